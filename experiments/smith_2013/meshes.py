# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 3.6 to 3.11: deformed chains of links, what is measured of them, and what the report says."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
import sinew
from sinew_addon.features.measure.metrics import Shape
from sinew_addon.skinning.surface import Surface

from .joints import root_relative
from .model import Fact, Figure, Picture

TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)
# By method of interpolation: figure and title.
HIERARCHIES = {
    "matrix_linear": ("3.6", "Matrix hierarchical interpolation"),
    "qv_nlerp": ("3.7", "Quaternion-vector hierarchical interpolation"),
    "dlb": ("3.8", "Dual quaternion hierarchical interpolation"),
}
# The methods of the report's pictures (a) to (c), then those of its future work.
SKINS = ("lbs", "qv", "dq", "log", "sbs")
# The length of a link of the tube, in metres.
LINK = 0.25
TITLES = {
    "3.9": "Mesh used for skinning, with linear weighting",
    "3.10": "Comparison of blending methods A: a bent joint",
    "3.11": "Comparison of blending methods B: a joint rotated about the axis of the cylinder",
}
_POSES = "The report does not print its poses; these are those of Sinew's own file."


def joint_degrees(parents: np.ndarray, rest: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """[bones]: how far each joint rotates between two poses; for a bone without parent, the rotation of its
    whole motion.

    parents              int32 [bones], parents before children
    rest, first, second  [bones, 4, 4] of the bones in one space
    """
    motions = []
    for pose in (first, second):
        moved = sinew.affine.normalized(sinew.affine.compose(pose, sinew.affine.inverse(rest)))
        relative = moved.copy()
        child = parents >= 0
        relative[child] = sinew.affine.compose(sinew.affine.inverse(moved[parents[child]]), moved[child])
        motions.append(sinew.affine.normalized(relative))
    return np.degrees(sinew.affine.rigid_distance(*motions).angle)


def said_of_joints(degrees: np.ndarray, between: str) -> str:
    """Returns a sentence such as: 5 joints rotate by 90 degrees between the keys. degrees: from
    joint_degrees()."""
    moving = degrees[degrees > 0.5]
    count = {1: "One joint rotates"}.get(len(moving), f"{len(moving)} joints rotate")
    low, high = (f"{angle:.0f}" for angle in (moving.min(), moving.max()))
    return f" {count} by {low if low == high else f'{low} to {high}'} degrees {between}."


@dataclass(frozen=True)
class Chain:
    """Links that do not blend, between two keyframes.

    points               [vertices, 3] at rest
    triangles            [triangles, 3]
    bones                int [vertices], the bone that moves each
    parents              int32 [bones], parents before children
    rest, first, second  [bones, 4, 4] of the bones, in the space of the points
    """

    points: np.ndarray
    triangles: np.ndarray
    bones: np.ndarray
    parents: np.ndarray
    rest: np.ndarray
    first: np.ndarray
    second: np.ndarray

    def between(self, t: float, method: sinew.interpolate.Method) -> np.ndarray:
        """[vertices, 3]: each bone interpolated relative to its parent, then chained (Smith 2013, algorithms
        2 and 1)."""
        module = {"matrix": sinew.affine, "qv": sinew.quat_vec}.get(method.split("_")[0], sinew.dual_quat)
        keys = []
        for pose in (self.first, self.second):
            relative = pose.copy()
            child = self.parents >= 0
            relative[child] = sinew.affine.compose(
                sinew.affine.inverse(pose[self.parents[child]]), pose[child]
            )
            relative = sinew.affine.normalized(relative)
            if module is not sinew.affine:
                name = "quat_vec" if module is sinew.quat_vec else "dual_quat"
                relative = getattr(sinew.affine, f"to_{name}")(relative)
            keys.append(relative)
        first, second = keys
        relative = sinew.interpolate.between(first, second, t, method).transforms
        pose = root_relative(module, self.parents, relative)
        if module is not sinew.affine:
            pose = module.to_affine(pose)
        moved = sinew.affine.compose(pose, sinew.affine.inverse(self.rest))
        return sinew.affine.transform_point(moved[self.bones], self.points)

    def link_volumes(self, points: np.ndarray) -> np.ndarray:
        """[bones]: the volume of each link."""
        of_triangle = self.bones[self.triangles[:, 0]]
        volumes = []
        for bone in range(len(self.parents)):
            corners = self.triangles[of_triangle == bone]
            used, corners = np.unique(corners, return_inverse=True)
            volumes.append(volume(points[used], corners.reshape(-1, 3)))
        return np.array(volumes)


def volume(points: np.ndarray, triangles: np.ndarray) -> float:
    """Inside a triangle mesh, [vertices, 3] and int [triangles, 3]."""
    return Shape(Surface(len(points), triangles, np.empty((0, 2), np.int32)), points).volume


def hierarchy_figures(
    chain: Chain, shapes: dict[str, list[np.ndarray]], pictures: dict[str, list[Picture]]
) -> tuple[Figure, ...]:
    """shapes: [vertices, 3] by method and time of TIMES, pictures likewise."""
    rest = chain.link_volumes(chain.points)
    length = float(np.ptp(chain.points, axis=0).max())
    kept = {
        method: np.array([chain.link_volumes(shape) / rest for shape in row])
        for method, row in shapes.items()
    }
    apart = max(
        float(np.linalg.norm(a - b, axis=1).max())
        for a, b in zip(shapes["qv_nlerp"], shapes["dlb"], strict=True)
    )
    degrees = joint_degrees(chain.parents, chain.rest, chain.first, chain.second)
    joints = said_of_joints(degrees, "between the keys")
    result = []
    for method, (number, title) in HIERARCHIES.items():
        middle = kept[method][TIMES.index(0.5)]
        values = {f"link {i + 1} at t = 0.5": float(share) for i, share in enumerate(middle)}
        if method == "matrix_linear":
            fact = Fact(
                "Matrices no longer transform the vertices rigidly, and scale them down.",
                f"Half way the second link has {middle[1]:.0%} of its volume and the last {middle[-1]:.1%}: "
                "what a joint loses, all links behind it lose again.",
                bool(middle[-1] < 0.99 and np.all(np.diff(middle) < 1e-9)),
                values,
            )
        else:
            rigid = float(np.abs(kept[method] - 1.0).max())
            fact = Fact(
                "Pairs and dual quaternions are near identical, and rigid.",
                f"Link volumes change by at most {rigid:.0e} of themselves; the two are at most "
                f"{apart / length:.0e} of the chain's length apart, as joints that only rotate have one "
                "centre for both.",
                rigid < 1e-5 and apart < 1e-5 * length,
                {**values, "largest change of volume": rigid, "apart": apart / length},
            )
        notes = (_POSES + joints + " Each vertex follows one bone.",)
        result.append(Figure(number, title, tuple(pictures[method]), (fact,), notes))
    return tuple(result)


@dataclass(frozen=True)
class Skin:
    """A tube of links along x that blends.

    rest                     [vertices, 3], of volume rest_volume
    triangles                [triangles, 3]
    counts, groups, weights  int [vertices]; then the link's number and its weight, for all entries
    """

    rest: np.ndarray
    rest_volume: float
    triangles: np.ndarray
    counts: np.ndarray
    groups: np.ndarray
    weights: np.ndarray

    def volume_kept(self, points: np.ndarray) -> float:
        return volume(points, self.triangles) / self.rest_volume


def figure_3_9(skin: Skin, picture: Picture) -> Figure:
    links = int(skin.groups.max()) + 1
    # The domes at both ends extend beyond the links, by the same length.
    middle = (skin.rest[:, 0].min() + skin.rest[:, 0].max()) / 2
    middles = middle + (np.arange(links) + 0.5 - links / 2) * LINK
    vertex = np.repeat(np.arange(len(skin.counts)), skin.counts)
    linear = np.array([np.interp(skin.rest[:, 0], middles, hat) for hat in np.eye(links)])
    error = float(np.abs(skin.weights - linear[skin.groups, vertex]).max())
    most = int(skin.counts.max())
    fact = Fact(
        "A number of links with bones, and linear weighting.",
        f"{links} links, {len(skin.rest):,} vertices, at most {most} bones each; weights are linear along "
        f"the tube, {'exactly' if error == 0 else f'to {error:.0e}'}.",
        most == 2 and error < 2e-3,
        {"links": links, "most bones": most, "off linear": error},
    )
    return Figure("3.9", TITLES["3.9"], (picture,), (fact,))


def figure_3_10(
    skin: Skin, shapes: dict[str, np.ndarray], pictures: list[Picture], degrees: np.ndarray
) -> Figure:
    """degrees: from joint_degrees(), relative to rest."""
    kept = {method: skin.volume_kept(points) for method, points in shapes.items()}
    drift = float(np.linalg.norm(shapes["qv"] - shapes["dq"], axis=1).max())
    width = float(np.ptp(skin.rest[:, 1]))
    facts = (
        Fact(
            "(a) The scaling of linear matrix blending affects the joints.",
            f"The tube keeps {kept['lbs']:.1%} of its volume, with dual quaternions {kept['dq']:.1%}.",
            kept["lbs"] < kept["dq"] - 0.01,
            {f"volume, {method}": share for method, share in kept.items()},
        ),
        Fact(
            "(b) Turning about the origin affects the blending; (c) DLB blends naturally.",
            "With pairs the joint, three links away from the origin, swings out by up to "
            f"{drift / width:.1f} widths of the tube from where dual quaternions have it.",
            drift > 0.25 * width,
            {"drift, in widths": drift / width},
        ),
    )
    notes = (_POSES + said_of_joints(degrees, "from rest"),)
    return Figure("3.10", TITLES["3.10"], tuple(pictures), facts, notes)


def figure_3_11(
    skin: Skin, shapes: dict[str, np.ndarray], pictures: list[Picture], degrees: np.ndarray
) -> Figure:
    """degrees: from joint_degrees(), relative to rest."""
    # The tube's own surface, without the domes; its middle is on the axis at rest.
    radius = np.hypot(skin.rest[:, 1], skin.rest[:, 2])
    wall = radius > 0.999 * radius.max()
    kept = {
        method: float((np.hypot(points[wall, 1], points[wall, 2]) / radius[wall]).min())
        for method, points in shapes.items()
    }
    fact = Fact(
        "(a) Matrices have the candy-wrapper effect, which dual quaternions avoid (chapter 4).",
        f"Where it is thinnest, the tube has {kept['lbs']:.1%} of its radius with matrices, {kept['qv']:.1%} "
        f"with pairs and {kept['dq']:.1%} with dual quaternions.",
        kept["lbs"] < 0.5 and min(kept["qv"], kept["dq"]) > 0.99,
        {f"radius, {method}": share for method, share in kept.items()},
    )
    notes = (
        _POSES + said_of_joints(degrees, "from rest"),
        f"Of its future work, log-matrix blending leaves {kept['log']:.1%} of the radius, spherical blend "
        f"skinning {kept['sbs']:.1%}.",
    )
    return Figure("3.11", TITLES["3.11"], tuple(pictures), (fact,), notes)


def trimmed(pictures: list[Picture]) -> list[Picture]:
    """Returns the PNGs without the transparent margin that all of them have. Requires Pillow."""
    from PIL import Image

    contents = [picture.content for picture in pictures if isinstance(picture.content, bytes)]
    images = [Image.open(io.BytesIO(content)) for content in contents]
    boxes = np.array([image.getchannel("A").getbbox() or (0, 0, *image.size) for image in images])
    margin = images[0].width // 50
    low, high = boxes[:, :2].min(axis=0) - margin, boxes[:, 2:].max(axis=0) + margin
    box = (*np.maximum(low, 0).tolist(), *np.minimum(high, images[0].size).tolist())
    result = []
    for picture, image in zip(pictures, images, strict=True):
        file = io.BytesIO()
        image.crop(box).save(file, format="PNG", optimize=True)
        result.append(Picture(picture.caption, file.getvalue()))
    return result


def missing(reason: str) -> tuple[Figure, ...]:
    """Returns all six figures, with the reason why they are missing."""
    titles = {**{number: title for number, title in HIERARCHIES.values()}, **TITLES}
    return tuple(Figure(number, title, missing=reason) for number, title in titles.items())
