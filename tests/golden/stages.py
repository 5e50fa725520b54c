# SPDX-License-Identifier: GPL-3.0-or-later
"""What may follow a method: each takes a case, deformed points in the mesh object's space and its parameters,
whose vertex group is the name of an array, and gives the points back changed."""

import numpy as np
import skin

EPSILON = 10 * np.finfo(np.float32).eps


# --- The painted mix of two methods


def mix(case, points, method, group):
    share = case[group].clip(0, 1)[:, None]
    return (1 - share) * points + share * skin.skin(case, method, {})


# --- Twist Spread, along bones that follow each other; bendy ones spread their roll themselves


def fade(degrees):  # from 150 degrees to 180, where a matrix does not tell which way round a bone went
    t = np.clip((degrees - 150) / 30, 0, 1)
    return 1 - t * t * (3 - 2 * t)


def twist_of(motion, next_motion, next_rest, axis):
    relative = np.linalg.inv(motion) @ next_motion @ next_rest
    q = skin.quaternion(skin.axes(relative) @ skin.axes(next_rest).T)
    along = q[1:] @ axis
    angle, swing = 2 * np.arctan2(along, q[0]), 2 * np.arccos(min(1, np.hypot(along, q[0])))
    return angle * fade(abs(np.degrees(angle))) * fade(np.degrees(swing))


def turned(axis, angle, arm):
    across = np.cross(axis, arm)
    return arm + np.sin(angle) * across + (1 - np.cos(angle)) * np.cross(axis, across)


def twist_spread(case, points, amount, group, is_linear):  # is_linear: after linear blending
    to, motion = case["armature_from_mesh"], skin.bones(case).motion
    result, at_rest = skin.moved_by(to, points), skin.moved_by(to, case["points"])
    for bone in np.flatnonzero(case["segments"][:-1] == 1)[::-1]:  # those that others carry first
        rest, length, linear = case["rest"][bone], case["lengths"][bone], motion[bone][:3, :3]
        head, axis = rest[:3, 3], rest[:3, 1] / np.linalg.norm(rest[:3, 1])
        posed_head = skin.moved_by(motion[bone], head)
        posed_axis = unit(np.sign(np.linalg.det(linear)) * linear @ axis)
        twist = twist_of(motion[bone], motion[bone + 1], case["rest"][bone + 1], axis)
        for v, x in enumerate(at_rest):
            of, w = skin.influences(case, v, x)
            weight, arm = w[of == bone].sum(), x - head
            share = np.clip(arm @ axis / length, 0, 1) * amount * np.clip(case[group][v], 0, 1)
            alone = linear @ turned(axis, share * twist, arm)  # a vertex of this bone alone
            if is_linear:
                result[v] += weight * (alone - linear @ arm)
                continue
            scaled = alone - turned(posed_axis, share * twist, linear @ arm)  # 0 where the bone is not
            from_head = result[v] - posed_head
            result[v] = posed_head + turned(posed_axis, weight * share * twist, from_head) + weight * scaled
    return skin.moved_by(np.linalg.inv(to), result)


# --- Limit Bulge


def nearest(head, tail, point):  # of a segment
    along = tail - head
    share = np.clip((point - head) @ along / max(along @ along, 1e-300), 0, 1)
    return head + share * along


def segments(case):
    """Head and tail of each bone at rest; of a bendy bone's joint the ends of the two segments beside it."""
    heads = case["rest"][:, :3, 3].copy()
    tails = heads.copy()
    for bone, n in enumerate(case["segments"]):
        y = case["rest"][bone, :3, 1]
        tails[bone] += case["lengths"][bone] * y
        first = case["first_joint"][bone]
        if n > 1:
            own = case["rest"][first : first + n + 1, :3, 3]
            heads[first : first + n + 1] = own[[0, *range(n)]]
            tails[first : first + n + 1] = own[[*range(1, n + 1), n]]
    return heads, tails


def stretch(linear, axis):  # how much longer, at most, the motion makes what is across the bone and its image
    if not axis.any():
        return np.linalg.norm(linear) / np.sqrt(3)
    axis = axis / np.linalg.norm(axis)
    image = linear @ axis
    across = np.eye(3) - np.outer(image, image) / max(image @ image, 1e-300)
    return np.linalg.svd(across @ linear @ (np.eye(3) - np.outer(axis, axis)))[1][0]


def as_limits(heads, tails, motion):  # for all bones: the ends at rest, where they are posed, and the stretch
    posed = [
        np.array([skin.moved_by(m, end) for m, end in zip(motion, ends, strict=True)])
        for ends in (heads, tails)
    ]
    stretches = [stretch(m[:3, :3], t - h) for m, h, t in zip(motion, heads, tails, strict=True)]
    return heads, tails, *posed, np.array(stretches)


def limited(x, rest, of, w, bones, amount, form):
    """A point, its place at rest, its bones and their weights; bones: as_limits()"""
    if len(of) < 2:
        return x
    if form == "kim_han":  # the heaviest bone alone
        of, w = of[[w.argmax()]], np.ones(1)
    heads, tails, posed_heads, posed_tails, stretches = (each[of] for each in bones)
    at_rest = w @ [np.linalg.norm(rest - nearest(*ends, rest)) for ends in zip(heads, tails, strict=True)]
    allowed = at_rest * (w @ stretches)
    centre = w @ [nearest(*ends, x) for ends in zip(posed_heads, posed_tails, strict=True)]
    distance = np.linalg.norm(x - centre)
    return x + amount * (1 - allowed / distance) * (centre - x) if distance > allowed else x


def bulge_limit(case, points, strength, form, group):
    to, bones = case["armature_from_mesh"], as_limits(*segments(case), skin.bones(case).motion)
    at_rest, result = skin.moved_by(to, case["points"]), skin.moved_by(to, points)
    for v, rest in enumerate(at_rest):
        amount = strength * np.clip(case[group][v], 0, 1)
        result[v] = limited(result[v], rest, *skin.influences(case, v, rest), bones, amount, form)
    return skin.moved_by(np.linalg.inv(to), result)


# --- Delta Mush


def smoothed(points, edges, factors, iterations, smooth_type):
    points, (a, b) = points.copy(), edges.T
    valence = np.bincount(edges.ravel(), minlength=len(points))
    for _iteration in range(iterations):
        along = points[b] - points[a]
        lengths = np.linalg.norm(along, axis=1) if smooth_type == "length_weighted" else np.ones(len(along))
        total, weight = np.zeros_like(points), np.zeros(len(points))
        for ends, sign in ((a, 1.0), (b, -1.0)):
            np.add.at(total, ends, sign * lengths[:, None] * along)
            np.add.at(weight, ends, lengths)
        if smooth_type == "length_weighted":
            divisor, moves = weight * valence, weight * valence > EPSILON
            points[moves] += (2 * factors[moves] / divisor[moves])[:, None] * total[moves]
        else:
            points += (factors / np.maximum(valence, 1))[:, None] * total
    return points


def unit(vector):
    length = np.linalg.norm(vector)
    return vector / length if length > 0 else vector


def angle(cosine):  # by Blender's polynomial
    m = min(abs(cosine), 1.0)
    size = np.sqrt(1 - m) * (1.5707963267 + m * (-0.213300989 + m * (0.077980478 + m * -0.02164095)))
    return np.pi - size if cosine < 0 else size


def corner_axes(before, at, after):  # in columns, and how much the corner counts at its vertex
    a, b = unit(before - at), unit(at - after)
    if (np.abs(a - b) <= EPSILON).all():
        return np.eye(3), 0.0
    z, x = unit(np.cross(a, b)), unit(a + b)
    return np.column_stack([x, np.cross(z, x), z]), angle(a @ b)


def delta_mush(case, points, iterations, factor, smooth_type, scale, group):
    rest, edges = case["points"], case["edges"]
    factors = factor * case[group].clip(0, 1)
    rest_smoothed = smoothed(rest, edges, factors, iterations, smooth_type)
    result = smoothed(points, edges, factors, iterations, smooth_type)
    posed, details, sums = result.copy(), np.zeros_like(rest), np.zeros(len(rest))
    for start, end in zip(case["face_offsets"][:-1], case["face_offsets"][1:], strict=True):
        face = case["corner_vertices"][start:end]
        for before, at, after in zip(np.roll(face, 1), face, np.roll(face, -1), strict=True):
            rest_axes, _weight = corner_axes(*rest_smoothed[[before, at, after]])
            posed_axes, weight = corner_axes(*posed[[before, at, after]])
            details[at] += weight * posed_axes @ rest_axes.T @ (rest[at] - rest_smoothed[at])
            sums[at] += weight
    some = sums > 0
    result[some] += scale * details[some] / sums[some, None]
    return result
