# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws what blends of motions do, for docs/motion.md; prints the numbers that it quotes.

    python tools/pictures/draw_motion.py [--out docs]

An arm between two poses, skinned by the library, and the walks of tests/support/walks.py. Without Blender.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib
import numpy as np
import sinew
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from sinew import affine, quat_vec
from sinew_addon.features.blend.clip import Clip, Rig
from sinew_addon.features.blend.motion import KEYED, Blend, Settings, blend
from sinew_addon.features.pages.plots import COLOURS
from sinew_addon.io.poses import Poses

matplotlib.use("agg")
import matplotlib.pyplot as plt

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.append(str(REPOSITORY / "tests" / "support"))
import walks  # noqa: E402 - it is found there

# Upper arm, forearm, hand.
LENGTHS = (1.0, 0.9, 0.45)
SIDES, RINGS = 20, 60
METHODS = ("matrix_linear", "qv_slerp", "dlb")


# --- An arm between two poses


def arm_rig() -> Rig:
    """A chain along Y."""
    rest = np.array([[1.0, 0, 0, 0, 0, length, 0] for length in (0.0, *LENGTHS[:-1])])
    names, parents = ("upper arm", "forearm", "hand"), np.array([-1, 0, 1])
    return Rig(names, parents, rest, np.array(LENGTHS))


def arm_poses(rig: Rig) -> tuple[Clip, Clip]:
    """An arm that hangs with its palm in, and one that is raised, bent, and turned palm out."""

    def pose(name: str, shoulder: float, elbow: float, twist: float) -> Clip:
        rigid = np.tile(quat_vec.identity(), (1, 3, 1))
        x, y = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
        rigid[0, 0] = quat_vec.from_axis_angle(x, np.radians(shoulder))
        rigid[0, 1] = quat_vec.compose(
            quat_vec.from_axis_angle(x, np.radians(elbow)),
            quat_vec.from_axis_angle(y, np.radians(0.3 * twist)),
        )
        rigid[0, 2] = quat_vec.from_axis_angle(y, np.radians(0.7 * twist))
        return Clip(name, rig, Poses(rigid, np.ones((1, 3, 3))), 0.0)

    return pose("hanging", -65.0, 10.0, 0.0), pose("raised", 45.0, 100.0, 190.0)


def matrices(rig: Rig, poses: Poses) -> np.ndarray:
    """[bones, 4, 4] of the first frame, a child with its parent's scale, as Blender has it."""
    posed = np.zeros((len(rig.names), 4, 4))
    for bone, parent in enumerate(rig.parents):
        own = quat_vec.to_affine(rig.rest[bone]) @ quat_vec.to_affine(poses.rigid[0, bone])
        own[:3, :3] *= poses.scale[0, bone]
        posed[bone] = own if parent < 0 else posed[parent] @ own
    return posed


def tube() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rest points [n, 3], quads [m, 4] and weights [n, 3] of an arm's skin, thinner towards the hand."""
    along = np.linspace(0.0, sum(LENGTHS), RINGS)
    angles = np.linspace(0.0, 2 * np.pi, SIDES, endpoint=False)
    ends = np.cumsum(LENGTHS)
    radius = np.interp(along, [0.0, ends[0], ends[1], ends[2] - 0.1, ends[2]], [0.2, 0.15, 0.1, 0.11, 0.04])
    # A hand is flat: so its twist is seen.
    flat = np.interp(along, [0.0, ends[1] - 0.1, ends[1] + 0.15], [1.0, 0.9, 0.45])
    points = np.stack(
        [
            radius[:, None] * np.cos(angles),
            np.broadcast_to(along[:, None], (RINGS, SIDES)),
            (radius * flat)[:, None] * np.sin(angles),
        ],
        axis=-1,
    ).reshape(-1, 3)
    first = np.arange(RINGS - 1)[:, None] * SIDES + np.arange(SIDES)
    beside = np.arange(RINGS - 1)[:, None] * SIDES + (np.arange(SIDES) + 1) % SIDES
    quads = np.stack([first, beside, beside + SIDES, first + SIDES], axis=-1).reshape(-1, 4)
    reach = np.clip((np.repeat(along, SIDES)[:, None] - ends[:2]) / 0.25 + 0.5, 0.0, 1.0)
    weights = np.stack(
        [1.0 - reach[:, 0], reach[:, 0] * (1.0 - reach[:, 1]), reach[:, 0] * reach[:, 1]], axis=1
    )
    return points, quads, weights


def skinned(rig: Rig, poses: Poses) -> np.ndarray:
    """The tube by linear blending of the posed bones: what an engine shows of them."""
    points, _quads, weights = tube()
    rest = affine.inverse(quat_vec.to_affine(rig.to_armature(np.tile(quat_vec.identity(), (3, 1)))))
    motion = matrices(rig, poses) @ rest
    count = len(points)
    deformer = sinew.Deformer(
        points.astype(np.float32),
        np.arange(0, 3 * count + 1, 3, dtype=np.int32),
        np.tile(np.arange(3, dtype=np.int32), count),
        weights.astype(np.float32).ravel(),
        method="lbs",
    )
    return deformer.deform(motion.astype(np.float32))


def draw_arms(path: Path) -> None:
    """Seen along -X, painted from far to near."""
    rig = arm_rig()
    clips = arm_poses(rig)
    quads, shares, apart = tube()[1], (0.0, 0.2, 0.35, 0.5, 0.65, 0.8, 1.0), 2.6
    towards_light = np.array([0.6, -0.4, 0.69])
    figure, grid = plt.subplots(len(METHODS), 1, figsize=(12.6, 8.4), layout="constrained")
    for axes, method in zip(grid, METHODS, strict=True):
        for number, share in enumerate(shares):
            made = blend(clips, (1.0 - share, share), Settings(method=method, align=False, root_motion=KEYED))
            corners = skinned(rig, made.poses).astype(np.float64)[quads] + (0.0, apart * number, 0.0)
            normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
            colour = np.array(to_rgb(COLOURS[1] if 0.0 < share < 1.0 else "#909090"))
            shade = 0.55 + 0.75 * np.abs(normals @ towards_light)
            order = np.argsort(corners[:, :, 0].mean(axis=1))
            colours = np.clip(colour * shade[:, None], 0.0, 1.0)[order]
            axes.add_collection(
                PolyCollection(
                    corners[order][:, :, 1:], facecolors=colours, edgecolors=colours, linewidths=0.4
                )
            )
            volume, bone, _frame = made.smallest()
            text = ("the first clip", "the second")[int(share)] if share in (0.0, 1.0) else f"{share:.0%}"
            if volume < 0.99:
                text += f"\nhand: {max(volume, 0.0):.0%}"
                print(f"{method} at {share:.0%}: {bone} has {volume:.1%} of its volume")
            axes.text(apart * number + 0.6, -2.35, text, ha="center", va="top", fontsize=9)
        axes.set(xlim=(-0.6, apart * len(shares)), ylim=(-2.75, 2.0), aspect="equal")
        axes.set_title(method, loc="left", fontsize=12, fontweight="bold")
        axes.axis("off")
    figure.savefig(path, dpi=100, facecolor="white")
    plt.close(figure)


# --- Two walks


def pair() -> tuple[Clip, Clip]:
    return walks.walk(), walks.walk("run", 30, 1.1, 0.22, start=0.65)


def draw_sliding(path: Path) -> None:
    walk, run = pair()
    made = {
        "aligned": blend([walk, run], (1, 1), Settings(cycles=2)),
        "not aligned": blend([walk, run], (1, 1), Settings(cycles=2, align=False)),
    }
    figure, (first, second, third) = plt.subplots(1, 3, figsize=(12.6, 3.5), layout="constrained")
    for number, (name, each) in enumerate(made.items()):
        clip = each.clip(name)
        height = clip.rig.points(clip.rig.to_armature(clip.poses.rigid))[:, clip.rig.index("foot.L"), 0, 2]
        steps, on_ground = walks.sliding(clip)
        frames = np.arange(len(height))
        first.plot(frames, height - walks.ANKLE, color=COLOURS[number], label=name)
        slide = np.where(on_ground[:, 0] > 0.05, steps[:, 0], np.nan)
        second.plot(frames[1:] - 0.5, slide, color=COLOURS[number], marker=".", label=name)
        print(f"{name:12} {walks.mean_sliding(clip):.4f}")
    for clip in (walk, run):
        print(f"{clip.name:12} {walks.mean_sliding(clip):.4f}")
    first.set(xlabel="frame", title="Height of the left ankle above its stand")
    second.set(xlabel="frame", title="How far that foot slides a frame, on the ground", ylim=(0.0, None))
    warp = made["aligned"].warps[1]
    even = np.linspace(0.0, 2.0, 257)
    third.plot(even, even, color="0.6", linestyle=":", label="the same phase")
    third.plot(even, warp.at(even), color=COLOURS[0], label="found")
    made_so = even - 0.65 + np.round(warp.own[0] + 0.65)
    third.plot(even, made_so, color=COLOURS[4], linestyle="--", label="as the walks were made")
    third.set(xlabel="phase of the walk", ylabel="phase of the run", title="The same moment of both")
    for axes in (first, second, third):
        axes.grid(alpha=0.3)
        axes.legend()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def draw_strips(path: Path) -> None:
    """Legs from the side: the clips, and their blend, aligned or not."""
    walk, run = pair()
    still = Settings(root_motion="in-place")
    rows = {
        "walk": blend([walk, run], (1, 0), still),
        "run": blend([run, walk], (1, 0), still),
        "blend, aligned": blend([walk, run], (1, 1), still),
        "blend, not aligned": blend([walk, run], (1, 1), Settings(root_motion="in-place", align=False)),
    }
    figure, grid = plt.subplots(len(rows), 1, figsize=(12.6, 7.2), layout="constrained")
    for axes, (title, made) in zip(grid, rows.items(), strict=True):
        for number in range(10):
            frame = round(number * (len(made.poses.rigid) - 1) / 10)
            _draw_legs(axes, made, frame, 1.2 * number)
        axes.set_aspect("equal")
        axes.set_title(title, loc="left", fontsize=10)
        axes.axhline(0.0, color="0.75", linewidth=0.8, zorder=0)
        axes.set(xlim=(-0.7, 11.5), ylim=(-0.06, 1.15))
        axes.axis("off")
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def _draw_legs(axes, made: Blend, frame: int, x: float) -> None:
    rig = made.rig
    ends = rig.points(rig.to_armature(made.poses.rigid[frame]))
    for side, colour in (("R", "0.65"), ("L", COLOURS[1])):
        for name in ("thigh", "shin", "foot"):
            head, tail = ends[rig.index(f"{name}.{side}")]
            axes.plot([x - head[1], x - tail[1]], [head[2], tail[2]], color=colour, linewidth=4,
                      solid_capstyle="round")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=REPOSITORY / "docs", help="folder for the pictures")
    arguments = parser.parse_args()
    plt.rcParams["svg.hashsalt"] = "sinew"
    draw_arms(arguments.out / "motion-arms.png")
    draw_sliding(arguments.out / "motion-sliding.svg")
    draw_strips(arguments.out / "motion-legs.svg")


if __name__ == "__main__":
    main()
