# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls of all that the library exports, with arguments that they accept: test_errors.py and
test_fuzz_bindings.py spoil these."""

import inspect

import numpy as np
import sinew
from rigs import LINEAR, about
from sinew import interpolate, spline


def bones(count=2):
    return np.tile(np.eye(4, dtype=np.float32), (count, 1, 1))


# Two vertices on two bones.
SKIN = {
    "rest_points": np.float32([[0, 0, 0], [1, 1, 1]]),
    "influence_offsets": np.int32([0, 1, 3]),
    "influence_bones": np.int32([0, 0, 1]),
    "influence_weights": np.float32([1, 0.5, 0.5]),
}
BINDING = sinew.Binding(**SKIN, vertex_data=LINEAR)
POINTS = SKIN["rest_points"]
HALF = np.float32([0.5, 0.5])
ENDS = np.zeros((2, 3)), np.ones((2, 3))
TWISTS = [[0, 0, 1, 0], [1, 0, 1, 1]]
POSED = np.array([np.eye(4), about((1, 2, 3), 40)], np.float32)
POSE = {"points": POINTS, "bone_transforms": POSED}
# Two triangles.
SHEET = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]])
FACES = {
    "face_offsets": [0, 3, 6],
    "corner_vertices": [0, 1, 2, 0, 2, 3],
    "edges": [[0, 1], [1, 2], [2, 0], [2, 3], [3, 0]],
}
KEYS = sinew.dual_quat.from_screw_about([1, 2, 3], [0, 0, 1], np.arange(5) / 4, np.arange(5) / 2)
SPLINE = {"keys": KEYS, "times": np.arange(5.0), "at": 0.5}


def skinned(binding, method="dq"):
    return sinew.Deformer(binding, method).deform(np.tile(POSED[1], (binding.bone_count, 1, 1)))


def kept(make, method, probe):
    """Calls a method of an object that, where it is refused, afterwards gives what it gave before."""

    def call(**given):
        one = make()
        before = probe(one)
        try:
            getattr(one, method)(**given)
        except Exception:
            np.testing.assert_array_equal(probe(one), before)
            raise
        return probe(one)

    return call


# Call, and arguments that it needs.
CALLS = {
    "Binding": (lambda **given: skinned(sinew.Binding(**given)), SKIN),
    "Deformer": (sinew.Deformer, {**SKIN, "method": "dq", "rest_bones": bones()}),
    "mix": (lambda mix: sinew.Deformer(BINDING, "lbs", mix=mix), {"mix": None}),
    "set_rest_points": (
        kept(lambda: sinew.Deformer(BINDING), "set_rest_points", lambda it: it.deform(POSED)),
        {"rest_points": POINTS},
    ),
    "deform": (lambda **given: sinew.Deformer(BINDING, "sdef").deform(**given), {"bone_transforms": POSED}),
    "BulgeLimit": (
        lambda **given: sinew.BulgeLimit(BINDING, **given).apply(POINTS, POSED),
        {"heads": ENDS[0], "tails": ENDS[1]},
    ),
    "limit": (lambda **given: sinew.BulgeLimit(BINDING, *ENDS).apply(**given), POSE),
    "set limited": (
        kept(lambda: sinew.BulgeLimit(BINDING, *ENDS), "set_rest_points", lambda it: it.apply(**POSE)),
        {"rest_points": POINTS},
    ),
    "TwistSpread": (
        lambda **given: sinew.TwistSpread(BINDING, **given).apply(POINTS, POSED),
        {"twists": TWISTS, "heads": ENDS[0], "tails": ENDS[1], "rest_bones": bones()},
    ),
    "spread": (lambda **given: sinew.TwistSpread(BINDING, TWISTS, *ENDS, bones()).apply(**given), POSE),
    "angles": (
        lambda **given: sinew.TwistSpread(BINDING, TWISTS, *ENDS, bones()).angles(**given),
        {"bone_transforms": POSED},
    ),
    "DeltaMush": (
        lambda **given: (lambda mush: mush.apply(np.zeros((mush.vertex_count, 3))))(sinew.DeltaMush(**given)),
        {"rest_points": SHEET, **FACES},
    ),
    "bind": (
        kept(lambda: sinew.DeltaMush(SHEET, **FACES), "bind", lambda it: it.apply(SHEET[::-1])),
        {"rest_points": SHEET},
    ),
    "mush": (lambda **given: sinew.DeltaMush(SHEET, **FACES).apply(**given), {"points": SHEET}),
    "crossing_triangles": (
        sinew.crossing_triangles,
        {"points": SHEET.astype(np.float64), "triangles": np.int32([[0, 1, 2], [0, 2, 3]])},
    ),
    "Normals": (
        lambda vertex_count, **given: sinew.Normals(vertex_count, **given).compute(SHEET[:vertex_count]),
        {"vertex_count": 4, **FACES},
    ),
    "compute": (lambda **given: sinew.Normals(4, **FACES).compute(**given), {"points": SHEET}),
    "SkinnedNormals": (
        lambda **given: sinew.SkinnedNormals(BINDING, **given).deform(POSED),
        {"normals": POINTS},
    ),
    "deform_skinned": (
        lambda **given: sinew.SkinnedNormals(BINDING, POINTS).deform(**given)[1],
        {"bone_transforms": POSED},
    ),
    "deform_normals": (lambda **given: sinew.SkinnedNormals(BINDING, POINTS).deform_normals(**given), POSE),
    "centres": (
        lambda **given: sinew.centres_of_rotation(**given).result(),
        {**SKIN, "triangles": [[0, 1, 0]]},
    ),
    "moments": (
        lambda **given: sinew.direct_delta_mush(**SKIN, triangles=[[0, 1, 0]], **given).result(),
        {"radius": 1.0},
    ),
    "vertex data": (lambda **given: sinew.Deformer(**SKIN, **given), {"vertex_data": {"cor": POINTS}}),
    "catmull_rom": (spline.catmull_rom, SPLINE),
    "catmull_rom_vector": (spline.catmull_rom_vector, SPLINE),
    "between": (interpolate.between, {"a": KEYS, "b": KEYS[::-1], "t": 0.5}),
    "blend": (interpolate.blend, {"transforms": KEYS, "weights": np.ones(5)}),
}
OPTIONS = {"out": np.zeros((2, 3), np.float32), "threads": 2, "bones_from_model": POSED[1]}
OF_POSE = {
    **{"threads": 2, "bones_from_model": POSED[1], "rest_inverses": bones().astype(np.float64)},
    **{"parameters": {"dq.signs": "hierarchy"}, "parents": [-1, 0], "turns": KEYS[:2, :4]},
}
BOUND = {"iterations": 3, "radius": 0.5, "factor": 0.5, "smooth_type": "length_weighted"}
BOUND |= {"pin_boundary": True, "weights": np.linspace(0, 1, 4)}
# Arguments that it may have.
MORE = {
    "Binding": {"rest_bones": bones(), "vertex_data": LINEAR},
    "Deformer": {"vertex_data": LINEAR},
    "deform": OPTIONS | OF_POSE,
    "BulgeLimit": {"bones_from_model": POSED[1], "weights": HALF},
    "limit": {"out": OPTIONS["out"], "threads": 2, "strength": 0.5, "form": "kim_han"},
    "set limited": {"bones_from_model": POSED[1]},
    "TwistSpread": {"parents": [-1, 0], "bones_from_model": POSED[1], "weights": HALF, "mix": HALF},
    "spread": {
        **{"out": OPTIONS["out"], "threads": 2, "amount": 0.5, "amounts": HALF, "curves": HALF},
        **{
            "channels": np.column_stack([KEYS[:2, :4], KEYS[:2, 5:]]),
            "blend": "rotations",
            "mix_blend": "linear",
        },
    },
    "angles": {"channels": np.column_stack([KEYS[:2, :4], KEYS[:2, 5:]])},
    "DeltaMush": BOUND,
    "bind": BOUND,
    "mush": {"out": np.zeros((4, 3), np.float32), "scale": 0.5, "threads": 2},
    "Normals": {
        "sharp_edges": [0, 1, 0, 0, 1],
        "sharp_faces": [1, 0],
        "custom_normals": np.ones((6, 2), np.int16),
    },
    "crossing_triangles": {"groups": [0, -1], "threads": 2},
    "compute": {"domain": "vertex", "out": np.zeros((4, 3), np.float32), "threads": 2},
    "SkinnedNormals": {"tangents": POINTS, "vertices": [1, 0], "method": "dq", "mix": ("lbs", HALF)},
    "deform_skinned": OF_POSE,
    "deform_normals": OPTIONS | OF_POSE,
    "centres": {"exact": True, "threads": 2, "gives_way": False},
    "moments": {"exact": True, "threads": 2, "gives_way": False},
    "catmull_rom": {"method": "sclerp"},
    "between": {"method": "dlb"},
    "blend": {"method": "sclerp", "signs": "as_given"},
}

LAYOUTS = {"affine": POSED[1], "quat_vec": sinew.dual_quat.to_quat_vec(KEYS[1]), "dual_quat": KEYS[1]}
# Of a module, or of an argument.
SAMPLES = {
    **LAYOUTS,
    **{
        "quat": KEYS[1, :4],
        "dual": np.array([1.0, 2.0]),
        "rotation": POSED[1, :3, :3],
        "twist": KEYS[1, 1:7],
    },
    **dict.fromkeys(("posed_from_rest", "rest_bone"), POSED[1]),
    **dict.fromkeys(("angle", "exponent", "t"), 0.5),
    **dict.fromkeys(
        ("axis", "moment", "point", "points", "vectors", "normals", "translation", "vector", "numbers"),
        np.array([0.5, 0.25, -0.5]),
    ),
}


def arguments(function):
    """The names of those that a native function lists in its signature."""
    return [text.split(":")[0] for text in function.__doc__.split(")")[0].split("(")[1].split(", ")]


for _module in (*LAYOUTS, "quat", "dual"):
    for _name, _function in vars(getattr(sinew, _module)).items():
        if inspect.isroutine(_function) and not _name.startswith("_") and _name != "identity":
            _needed = {each: SAMPLES.get(each, SAMPLES[_module]) for each in arguments(_function)}
            _needed |= {"translation": 0.5} if "screw" in _name and "translation" in _needed else {}
            CALLS[f"{_module}.{_name}"] = _function, _needed
