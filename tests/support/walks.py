# SPDX-License-Identifier: GPL-3.0-or-later
"""A walking pair of legs in closed form: a foot on the ground does not move, to within rounding.

It faces -Y and Z is up, as for Blender's characters. Two links of each leg are solved for the ankle.
"""

from __future__ import annotations

import math

import numpy as np
from sinew import affine, quat_vec
from sinew_addon.features.blend.clip import Clip, Rig
from sinew_addon.io.poses import Poses

THIGH = SHIN = 0.45
ANKLE, WIDE = 0.08, 0.1
LEG = ANKLE + SHIN + THIGH
# The share of a cycle in which a foot is on the ground, and the height of the hips.
DUTY = 0.6
HIP = 0.88
UP = np.array([0.0, 0.0, 1.0])


def rig() -> Rig:
    """Hips, a spine, and thigh, shin and foot on each side."""
    heads = {
        "hips": ((0, 0, LEG), (0, 0, LEG + 0.2), None),
        "spine": ((0, 0, LEG + 0.2), (0, 0, 1.5), "hips"),
    }
    for side, x in (("L", WIDE), ("R", -WIDE)):
        knee, ankle = ANKLE + SHIN, ANKLE
        heads[f"thigh.{side}"] = ((x, 0, LEG), (x, 0, knee), "hips")
        heads[f"shin.{side}"] = ((x, 0, knee), (x, 0, ankle), f"thigh.{side}")
        heads[f"foot.{side}"] = ((x, 0, ankle), (x, -0.2, 0.0), f"shin.{side}")
    names = tuple(heads)
    armature, lengths = [], []
    for head, tail, _parent in heads.values():
        along = np.subtract(tail, head).astype(float)
        lengths.append(np.linalg.norm(along))
        y, x = along / lengths[-1], np.array([1.0, 0.0, 0.0])
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = np.column_stack([x, y, np.cross(x, y)]), head
        armature.append(affine.to_quat_vec(matrix))
    parents = np.array([names.index(p) if p is not None else -1 for *_ends, p in heads.values()])
    rest = np.array(armature)
    for bone, parent in enumerate(parents):
        if parent >= 0:
            rest[bone] = quat_vec.compose(quat_vec.inverse(armature[parent]), armature[bone])
    return Rig(names, parents, rest, np.array(lengths))


def is_connected(name: str) -> bool:
    """Whether Blender keeps the bone's head on its parent's tail."""
    return name.startswith(("spine", "shin", "foot"))


def sliding(clip: Clip) -> tuple[np.ndarray, np.ndarray]:
    """[samples - 1, 2]: how far each foot moves along the ground to the next sample, and how much it is on
    the ground then: 2 - 2^(h / H), where h is its height above its lowest position and H 1.5 % of the rig's
    size (Zhang, Starke, Komura, Saito 2018, section 8)."""
    own = clip.rig
    places = own.points(own.to_armature(clip.poses.rigid))[:, [own.index("foot.L"), own.index("foot.R")], 1]
    heights = places[..., 2] - places[..., 2].min(axis=0)
    height = 0.5 * (heights[1:] + heights[:-1])
    steps = np.linalg.norm(np.diff(places[..., :2], axis=0), axis=-1)
    return steps, np.clip(2.0 - 2.0 ** (height / (0.015 * own.size)), 0.0, 1.0)


def mean_sliding(clip: Clip) -> float:
    """A frame, of feet on the ground."""
    steps, on_ground = sliding(clip)
    return float((steps * on_ground).sum() / max(on_ground.sum(), 1e-9))


def foot(phase: np.ndarray, stride: float, lift: float) -> tuple[np.ndarray, np.ndarray]:
    """How far a foot is in front of the hips and above the ground. It is on the ground for DUTY of a
    cycle, which starts with the foot in front."""
    phase = np.mod(phase, 1.0)
    reach = 0.5 * DUTY * stride
    on_ground = reach - stride * phase
    u = np.clip((phase - DUTY) / (1.0 - DUTY), 0.0, 1.0)
    # Hermite: it leaves and meets the ground at the ground's speed.
    pace = -stride * (1.0 - DUTY)
    swing = (
        -reach * (2 * u**3 - 3 * u**2 + 1)
        + pace * (u**3 - 2 * u**2 + u)
        + reach * (3 * u**2 - 2 * u**3)
        + pace * (u**3 - u**2)
    )
    swings = phase > DUTY
    return np.where(swings, swing, on_ground), np.where(swings, lift * np.sin(np.pi * u) ** 2, 0.0)


def walk(
    name: str = "walk",
    period: int = 20,
    stride: float = 0.8,
    lift: float = 0.1,
    start: float = 0.0,
    sway: float = 0.3,
    turn: float = 0.0,
    phases: np.ndarray | None = None,
) -> Clip:
    """One cycle of `period` frames from phase `start`. Its root moves by `stride` along -Y, or along an
    arc of `turn` radians. phases [samples]: for an uneven pace."""
    own = rig()
    phases = start + np.arange(period + 1) / period if phases is None else phases
    rigid = np.broadcast_to(quat_vec.identity(), (len(phases), len(own.names), 7)).copy()

    def rotate(bone: str, angle: np.ndarray, axis: tuple[float, ...] = (1.0, 0.0, 0.0)) -> None:
        rigid[:, own.index(bone), :4] = quat_vec.from_axis_angle(np.array(axis), angle)[:, :4]

    rotate("spine", sway * np.sin(2 * np.pi * phases), (0.0, 1.0, 0.0))
    for side, ahead in (("L", 0.0), ("R", 0.5)):
        front, height = foot(phases + ahead, stride, lift)
        down = HIP - (ANKLE + height)
        reach = np.hypot(front, down)
        assert reach.max() < THIGH + SHIN, "the leg is too short for this stride"
        knee = math.pi - np.arccos((THIGH**2 + SHIN**2 - reach**2) / (2 * THIGH * SHIN))
        thigh = -(np.arctan2(front, down) + np.arccos((THIGH**2 + reach**2 - SHIN**2) / (2 * THIGH * reach)))
        rotate(f"thigh.{side}", thigh)
        rotate(f"shin.{side}", knee)
        rotate(f"foot.{side}", -(thigh + knee))
    # The hips are lower than with straight legs, and move ahead; on an arc, about a centre beside them.
    hips = own.rest[0]
    done = phases - phases[0]
    lower = quat_vec.from_translation(np.array([0.0, 0.0, HIP - LEG]))
    if turn:
        centre = np.array([-stride / turn, 0.0, 0.0])
        ground = quat_vec.from_screw_about(UP, centre, -turn * done, np.zeros(len(done)))
    else:
        ground = quat_vec.from_translation(np.column_stack([0 * done, -stride * done, 0 * done]))
    moved = quat_vec.compose(ground, quat_vec.compose(lower, hips))
    rigid[:, 0] = quat_vec.compose(quat_vec.inverse(hips), moved)
    return Clip(name, own, Poses(rigid, np.ones((*rigid.shape[:2], 3))), float(period))


def random_clip(rng: np.random.Generator, name: str) -> Clip:
    """Every bone rotated and moved smoothly; not cyclic."""
    own, frames = rig(), 12
    time = np.linspace(0.0, 1.0, frames + 1)[:, None, None]
    bones = len(own.names)
    twists = 0.48 * rng.normal(size=(bones, 6)) * np.sin(2 * time + rng.uniform(0, 6, (bones, 6)))
    rigid = np.concatenate(
        [
            quat_vec.from_twist(np.pad(twists[..., :3], ((0, 0), (0, 0), (0, 3))))[..., :4],
            0.2 * twists[..., 3:],
        ],
        axis=-1,
    )
    scale = 1.0 + 0.3 * rng.uniform(-1, 1, (frames + 1, bones, 3))
    return Clip(name, own, Poses(rigid, scale), float(frames))
