# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the deformer: its methods compared with float64 reference code, its threads, forks."""

import os
import subprocess
import sys

import numpy as np
import psutil
import pytest
import reference
import sinew
from rigs import (
    LINEAR,
    NO_TIE,
    TOLERANCE,
    about,
    lets_others_run,
    random_motion,
    random_rig,
    transform,
    translation,
)

METHODS = [method.name for method in sinew.methods()]
# Methods that a build may lack.
WITHOUT = {"ddm"} - set(METHODS)

every_method = pytest.mark.parametrize("method", METHODS)


def assert_agrees(method, rig, extent, reference=None):
    expected, margins = reference or rig.reference(method)
    sure = margins > NO_TIE
    assert sure.mean() > 0.95
    errors = np.linalg.norm(rig.deform(method) - expected, axis=1)[sure] / extent
    assert errors.max() < TOLERANCE, f"worst error {errors.max():.2e} of the size of the scene"


def test_methods_say_what_they_are():
    assert sinew.Deformer(*random_rig(35).mesh).method == "lbs"
    rows = sinew.methods()
    numbers = {"lbs": 1, "qv": 2, "dq": 3, "log": 4, "cor": 5, "sbs": 6, "dib": 7, "sdef": 8, "ddm": 9}
    assert {row.name: row.number for row in rows} == {n: v for n, v in numbers.items() if n not in WITHOUT}
    for row in rows:
        assert row.label
        assert row.description
        assert row.source
        assert set(row.needs) <= {"rest_bones", "vertex_data", "topology", "precomputation"}
        assert (row.vertex_floats > 0) == ("vertex_data" in row.needs)
        assert row.name in repr(row)
        assert parameters_are_whole(row.parameters)


def parameters_are_whole(parameters):
    for row in parameters:
        assert row.id.isidentifier()
        assert row.label
        assert row.description
        assert row.unit in ("", "length", "angle", "factor")
        if row.kind in ("float", "int", "bool"):
            assert row.min <= row.default <= row.max
        elif row.kind == "enum":
            assert row.default in row.choices
        else:
            assert row.kind in ("vertex_group", "method")
            assert (row.default, row.min, row.max) == (None, None, None)
    return len({row.id for row in parameters}) == len(parameters)


@every_method
@pytest.mark.parametrize("scaled", [False, True], ids=["rigid", "scaled"])
@pytest.mark.parametrize(("extent", "seed"), [(0.01, 0), (1.0, 1), (100.0, 2)])
def test_agrees_with_the_reference(method, scaled, extent, seed):
    assert_agrees(method, random_rig(seed, extent=extent, scaled=scaled), extent)


@every_method
def test_agrees_with_the_reference_with_identity_rest_bones(method):
    rig = random_rig(22, scaled=True)
    expected, margins = reference.deform(method, *rig.mesh, rig.transforms)
    # Without vertex data cor rotates each vertex about itself.
    points = sinew.Deformer(*rig.mesh, method, vertex_data=LINEAR).deform(rig.transforms)
    np.testing.assert_allclose(points[margins > NO_TIE], expected[margins > NO_TIE], atol=TOLERANCE)


@every_method
def test_agrees_with_the_reference_far_from_the_origin(method):
    rig = random_rig(23, scaled=True)
    far = translation([1000.0, -500.0, 2000.0])
    rig = rig.with_motions(
        far @ rig.transforms @ np.linalg.inv(far),
        rest_points=transform(far, rig.rest_points).astype(np.float32),
        rest_bones=(far @ rig.rest_bones).astype(np.float32),
    )
    assert_agrees(method, rig, 2300.0)


@every_method
def test_few_weights_many_scales(method):
    rig = random_rig(24, scaled=True)
    expected = rig.reference(method)
    for factor in (1e-30, 1e-3, 7.0, 3.4e38):
        scaled = rig.with_(weights=(rig.weights * np.float32(factor)).astype(np.float32))
        assert_agrees(method, scaled, 1.0, expected)


@every_method
@pytest.mark.parametrize("scaled", [False, True], ids=["rigid", "scaled"])
def test_rigid_motion_after_the_pose_commutes(method, scaled):
    if method == "log":
        pytest.skip("the logarithm of a product is no sum of logarithms: rotations are measured from rest")
    rig = random_rig(26, scaled=scaled)
    motion = random_motion(np.random.default_rng(27), 2.0)
    _, margins = rig.reference(method)
    moved = rig.with_motions(motion @ rig.transforms.astype(np.float64)).deform(method)
    expected = transform(motion, rig.deform(method).astype(np.float64))
    np.testing.assert_allclose(moved[margins > NO_TIE], expected[margins > NO_TIE], atol=4 * TOLERANCE)


@every_method
@pytest.mark.parametrize("size", [1e-30, 1.0, 1e6, 1e12])
def test_finite_for_whatever_is_finite(method, size):
    """Rotations by 180 degrees about all axes, bones without width, and far bones, in every kernel that a
    mesh can use."""
    rng = np.random.default_rng(61)
    axes = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (-1, -2, 3)]
    motions = [np.eye(4), np.diag([0.0, 0.0, 0.0, 1.0]), np.diag([-1.0, -1.0, -1.0, 1.0])]
    motions += [about(axis, degrees) for axis in axes for degrees in (180.0, -180.0, 179.9999, 360.0)]
    motions = np.array(motions)
    motions[:, :3, 3] = rng.uniform(-size, size, (len(motions), 3))
    counts = np.repeat([1, 2, 3, 5, 9, 40], 50)
    bones = np.concatenate([rng.integers(0, len(motions), count) for count in counts]).astype(np.int32)
    weights = rng.choice([1e-30, 1e-3, 1.0], len(bones)).astype(np.float32)
    rest = rng.uniform(-size, size, (len(counts), 3)).astype(np.float32)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    data = {"cor": rng.uniform(-size, size, rest.shape), "sdef": rng.uniform(-size, size, (len(rest), 10))}
    data = LINEAR | data
    deformer = sinew.Deformer(rest, offsets, bones, weights, method, vertex_data=data)
    assert np.isfinite(deformer.deform(motions.astype(np.float32))).all()


@every_method
@pytest.mark.parametrize("scaled", [False, True], ids=["rigid", "scaled"])
def test_another_origin_changes_only_qv(method, scaled):
    rig, other_from_model = random_rig(30, scaled=scaled), translation([3.0, -2.0, 1.0])
    _, margins = rig.reference(method)
    back = np.linalg.inv(other_from_model)
    other = rig.with_motions(
        other_from_model @ rig.transforms.astype(np.float64) @ back,
        rest_points=transform(other_from_model, rig.rest_points.astype(np.float64)).astype(np.float32),
        rest_bones=(other_from_model @ rig.rest_bones.astype(np.float64)).astype(np.float32),
        centres=transform(other_from_model, rig.centres.astype(np.float64)).astype(np.float32),
    )
    points = transform(back, other.deform(method).astype(np.float64))
    change = np.linalg.norm(points - rig.deform(method), axis=1)[margins > NO_TIE].max()
    if method == "qv":
        assert change > 0.1
    else:
        assert change < 10 * TOLERANCE


@every_method
def test_bone_numbers_mean_nothing(method):
    if method == "ddm":
        pytest.skip("it adds bones by their numbers: of opposite rotations another decides; see test_ddm")
    rig = random_rig(31, scaled=True)
    number = np.random.default_rng(32).permutation(15)
    order = np.argsort(number)
    renumbered = rig.with_(
        bones=number[rig.bones].astype(np.int32),
        transforms=rig.transforms[order],
        rest_bones=rig.rest_bones[order],
    )
    np.testing.assert_array_equal(renumbered.deform(method), rig.deform(method))


@every_method
@pytest.mark.parametrize("degrees", [179.999, 180.0, 180.001, 360.0, 540.0])
@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 2, 3)])
def test_opposite_twists_give_finite_points(method, degrees, axis):
    weights = np.linspace(0.0, 1.0, 11, dtype=np.float32)
    rest = np.tile(np.float32([0.3, 0.4, 0.5]), (11, 1))
    mesh = (
        rest,
        np.arange(0, 24, 2, dtype=np.int32),
        np.tile(np.int32([0, 1]), 11),
        np.column_stack([1 - weights, weights]).ravel(),
    )
    twist = np.array([np.eye(4), about(axis, degrees)], np.float32)
    points = sinew.Deformer(*mesh, method, vertex_data=LINEAR).deform(twist)
    assert np.isfinite(points).all()
    assert (np.linalg.norm(points, axis=1) <= np.linalg.norm(rest, axis=1) + 1e-6).all()
    np.testing.assert_allclose(points[0], rest[0], atol=1e-6)
    np.testing.assert_allclose(points[-1], transform(twist[1], rest)[-1], atol=1e-6)


@every_method
@pytest.mark.parametrize("zeros", [(0,), (1,), (2,), (0, 1), (1, 2), (0, 2), (0, 1, 2)])
def test_bones_scaled_to_nothing_give_finite_points(method, zeros):
    rig = random_rig(34)
    motions = rig.transforms.astype(np.float64)
    for bone in range(0, 15, 2):
        factors = np.ones(4)
        factors[list(zeros)] = 0.0
        rest = rig.rest_bones[bone].astype(np.float64)
        motions[bone] = motions[bone] @ rest @ np.diag(factors) @ np.linalg.inv(rest)
    points = rig.with_motions(motions).deform(method)
    assert np.isfinite(points).all()
    assert np.abs(points).max() < 10.0
    if len(zeros) == 3:
        # Nothing is left of the bone but its head.
        binding = sinew.Binding([[0.3, -0.4, 0.5]], [0, 1], [2], [1], rig.rest_bones, LINEAR)
        head = rig.rest_bones[2, :3, 3]
        point = sinew.Deformer(binding, method).deform(motions)[0]
        np.testing.assert_allclose(point, (rig.transforms[2] @ [*head, 1.0])[:3], atol=2e-6)


@pytest.mark.parametrize("method", [m.name for m in sinew.methods() if "rest_bones" in m.needs])
def test_a_scaled_bone_whose_rest_axes_lean_takes_its_vertices_along_but_for_dq(method):
    """Rest axes of bones near -Y are not quite orthonormal. Blender's own method misses by as much."""
    rig = random_rig(39, scaled=True, most_influences=1)
    leaning = rig.rest_bones.copy()
    leaning[:, :3, 0] += 1e-3 * leaning[:, :3, 1]
    points = rig.with_(rest_bones=leaning).deform(method)
    rest = np.column_stack([rig.rest_points, np.ones(len(points))])
    whole = np.einsum("vij,vj->vi", rig.transforms[rig.bones], rest)[:, :3]
    assert (np.abs(points - whole).max() > 1e-4) == (method == "dq")


@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("degrees", [0.0, 35.0])
def test_the_centre_of_sbs_that_bones_leave_free_is_near_their_heads(count, degrees):
    """Bones that rotate about one axis, or all alike."""
    rig = random_rig(44, vertices=count, bones=count, most_influences=count)
    hinge = translation([1.0, 2.0, 0.0])
    turns = [hinge @ about((0, 0, 1), degrees * bone) @ np.linalg.inv(hinge) for bone in range(count)]
    if degrees == 0.0:
        turns = [about((1, 2, 3), 50.0)] * count
    assert_agrees("sbs", rig.with_motions(turns), 3.0)


@every_method
def test_vertices_without_weight_stay_to_the_bit(method):
    rest = np.float32([[0.1, 0.2, 0.3], [1e-20, -1e20, 7.0], [1.0, 2.0, 3.0]])
    deformer = sinew.Deformer(
        rest, [0, 0, 2, 3], [0, 1, 1], np.float32([0, 0, 1]), method, vertex_data=LINEAR
    )
    motions = np.array([random_motion(np.random.default_rng(i)) for i in range(2)], np.float32)
    for space in (None, about((1, 2, 3), 40).astype(np.float32)):
        points = deformer.deform(motions, bones_from_model=space)
        np.testing.assert_array_equal(points[:2], rest[:2])
        assert np.abs(points[2] - rest[2]).max() > 0.1


@pytest.mark.parametrize("method", LINEAR)
def test_missing_vertex_data_is_never_taken_for_linear_blending(method):
    rig = random_rig(34)
    wanted = f"that of {method}, or {method} by name without data, for linear blending, got none"
    for arguments in ((method,), ("lbs", (method, np.zeros(len(rig.rest_points))))):
        with pytest.raises(ValueError, match=f"^vertex_data: expected {wanted}$"):
            sinew.Deformer(sinew.Binding(*rig.mesh), *arguments)
    linear = sinew.Deformer(sinew.Binding(*rig.mesh, vertex_data={method: None}), method)
    np.testing.assert_allclose(linear.deform(rig.transforms), rig.deform("lbs"), atol=4 * TOLERANCE)


@every_method
def test_input_is_copied(method):
    rig = random_rig(37, scaled=True)
    arrays = [array.copy() for array in (*rig.mesh, rig.rest_bones)]
    data = rig.vertex_data
    deformer = sinew.Deformer(*arrays[:4], method, arrays[4], data)
    for values in data.values():
        values[...] = 0
    for array in arrays:
        array[...] = 0
    np.testing.assert_array_equal(deformer.deform(rig.transforms), rig.deform(method))


@every_method
def test_rest_inverses_equal_multiplying_by_hand(method):
    """Also for bones stored by columns, and far away, where the product of two float matrices would lose
    digits."""
    rig, rng = random_rig(42), np.random.default_rng(43)
    far = np.array([random_motion(rng, 1000.0) for _bone in rig.transforms])
    posed = (rig.transforms.astype(np.float64) @ far).astype(np.float32)
    by_columns = posed.transpose(0, 2, 1).copy().transpose(0, 2, 1)
    inverses = np.linalg.inv(far)
    expected = rig.with_motions(posed.astype(np.float64) @ inverses).deform(method)
    deformer = rig.deformer(method)
    whole = deformer.deform(posed, rest_inverses=inverses)
    np.testing.assert_allclose(whole, expected, atol=TOLERANCE)
    np.testing.assert_array_equal(deformer.deform(by_columns, rest_inverses=inverses), whole)
    np.testing.assert_array_equal(deformer.deform(posed[:, :3], rest_inverses=inverses[:, :3]), whole)


@every_method
def test_what_changes_no_bit(method):
    """Where points are written, rows and bones that are not read, and an identity."""
    rig = random_rig(41, scaled=True)
    deformer, expected, bones = rig.deformer(method), rig.deform(method), rig.transforms
    out = np.full_like(rig.rest_points, np.nan)
    assert deformer.deform(bones, out=out) is out
    np.testing.assert_array_equal(out, expected)
    spoilt = bones.copy()
    spoilt[:, 3] = np.nan
    more = np.concatenate([bones, np.full((3, 4, 4), 9.0, np.float32)])
    identity = np.eye(4, dtype=np.float32)
    for given, space in ((spoilt, None), (more, None), (bones, identity), (bones, identity[:3])):
        np.testing.assert_array_equal(deformer.deform(given, bones_from_model=space), expected)
    points = rig.rest_points.copy()
    deformer = sinew.Deformer(points, *rig.mesh[1:], method, rig.rest_bones, rig.vertex_data)
    for _ in range(2):
        np.testing.assert_array_equal(deformer.deform(bones, out=points), expected)


@every_method
def test_empty_mesh_works(method):
    deformer = sinew.Deformer(
        np.empty((0, 3), np.float32), [0], np.empty(0, np.int32), [], method, vertex_data=LINEAR
    )
    for motions in (np.empty((0, 4, 4), np.float32), np.eye(4, dtype=np.float32)[None]):
        points = deformer.deform(motions)
        assert points.shape == (0, 3)
        assert points.dtype == np.float32


@every_method
def test_gil_is_released(method):
    rig = random_rig(50, vertices=50000, most_influences=4)
    deformer = rig.deformer(method)
    out = np.empty_like(rig.rest_points)
    assert lets_others_run(lambda: deformer.deform(rig.transforms, out=out, threads=1), 1000)


@pytest.mark.skipif(sys.platform == "darwin", reason="the system does not say it there")
@every_method
def test_memory_is_reserved_for_one_thread(method):
    """Windows counts what is reserved, for 16 threads gigabytes. More is made when more deform at once."""
    count = 100_000
    rest = np.zeros((count, 3), np.float32)
    numbers = np.arange(count + 1)
    binding = sinew.Binding(rest, numbers, numbers[:-1], np.ones(count, np.float32), vertex_data=LINEAR)

    def reserved():
        # What can be written: the C library sets 64 MiB more aside when a thread first allocates. On Windows
        # what is reserved.
        memory = psutil.Process().memory_info()
        return memory.vms if sys.platform == "win32" else memory.data

    before = reserved()
    deformer = sinew.Deformer(binding, method)
    # 60 to 270 bytes for each bone.
    assert reserved() - before < 500 * count
    assert deformer.method == method


@every_method
def test_deformers_share_a_binding(method):
    rig = random_rig(71, scaled=True)
    binding = rig.binding()
    counts = (binding.vertex_count, binding.influence_count, binding.bone_count)
    deformer, other = (sinew.Deformer(binding, method) for _ in range(2))
    assert counts == (deformer.vertex_count, deformer.influence_count, deformer.bone_count)
    assert deformer.mixed_method is None
    del binding
    np.testing.assert_array_equal(deformer.deform(rig.transforms), rig.deform(method))
    moved = rig.rest_points + np.float32(1.0)
    deformer.set_rest_points(moved)
    np.testing.assert_array_equal(
        deformer.deform(rig.transforms), rig.with_(rest_points=moved).deform(method)
    )
    np.testing.assert_array_equal(other.deform(rig.transforms), rig.deform(method))


# What a child calls while the parent's threads are inside the same call, and what comes before it.
CALLS = {
    "Deformer": "lambda: (deformer.set_rest_points(rest), deformer.deform(bones, threads=3))[1]",
    "DeltaMush": "lambda: (mush.bind(rest, iterations=20), mush.apply(rest, threads=3))[1]",
    "Normals": "lambda: normals.compute(rest, threads=3)",
    "SkinnedNormals": "lambda: skinned.deform(bones, threads=3)[1]",
    "BulgeLimit": "lambda: (limit.set_rest_points(rest), limit.apply(rest, bones, threads=3))[1]",
    "TwistSpread": "lambda: (spread.set_rest_points(rest), spread.apply(rest, bones, threads=3))[1]",
}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.parametrize(
    "name", [name if name == "Deformer" else pytest.param(name, marks=pytest.mark.slow) for name in CALLS]
)
def test_a_child_forked_while_others_call_goes_on(tmp_path, name):
    """The child has none of the threads that are inside calls here, and must not wait for them."""
    program = tmp_path / "fork.py"
    program.write_text(FORKING.replace("CALL", CALLS[name]))
    done = subprocess.run([sys.executable, program], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout.strip()) == (0, "children: 20"), done.stderr


FORKING = """
import os, signal, threading
import numpy as np, sinew
side = 300
count = side * side
rest = np.array([(i % side, i // side, i % 3) for i in range(count)], np.float32)
corner = np.arange(count).reshape(side, side)
quads = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], -1).reshape(-1, 4)
edges = [np.stack(ends, -1).reshape(-1, 2) for ends in
         ((corner[:, :-1], corner[:, 1:]), (corner[:-1], corner[1:]))]
faces = np.arange(0, quads.size + 1, 4), quads.ravel(), np.concatenate(edges)
skin = rest, np.arange(count + 1), np.zeros(count, np.int32), np.ones(count, np.float32)
bones = np.eye(4, dtype=np.float32)[None]
deformer = sinew.Deformer(*skin, "dq")
mush = sinew.DeltaMush(rest, *faces, iterations=20)
normals = sinew.Normals(count, *faces)
skinned = sinew.SkinnedNormals(sinew.Binding(*skin), np.tile(np.float32([0, 0, 1]), (count, 1)))
limit = sinew.BulgeLimit(sinew.Binding(*skin), [[0, 0, 0]], [[0, 1, 0]])
spread = sinew.TwistSpread(sinew.Binding(*skin), [[0, 0, 0, 1]], [[0, 0, 0]], [[0, 1, 0]], bones)
call = CALL
expected = call()
done = threading.Event()
def work():
    while not done.is_set():
        call()
threads = [threading.Thread(target=work) for _ in range(3)]
for thread in threads: thread.start()
ended = 0
for _ in range(20):
    child = os.fork()
    if child == 0:
        signal.alarm(30)
        os._exit(0 if np.array_equal(call(), expected) else 1)
    ended += os.waitpid(child, 0)[1] == 0
done.set()
for thread in threads: thread.join()
print("children:", ended)
"""


# Before 3.14, threads that wait for the GIL when Python ends are unwound; this must not end the process.
ENDING = """
import threading, time
import numpy as np, sinew
count = 200_000
rest = np.zeros((count, 3), np.float32)
offsets = np.arange(count + 1, dtype=np.int32)
deformer = sinew.Deformer(rest, offsets, np.zeros(count, np.int32), np.ones(count, np.float32), "lbs")
bones = np.eye(4, dtype=np.float32)[None]
many = np.tile(np.eye(4), (200_000, 1, 1))
def deform():
    while True: deformer.deform(bones, threads=2)
def set_rest_points():
    while True: deformer.set_rest_points(rest)
def invert():
    while True: sinew.affine.inverse(many)
def blend():
    while True: sinew.interpolate.between(many[:20_000], many[:20_000], 0.5, "matrix_polar")
for work in (deform, deform, set_rest_points, invert, blend):
    threading.Thread(target=work, daemon=True).start()
time.sleep(0.2)
print("the end")
"""


def test_python_ends_while_daemon_threads_are_at_work(tmp_path):
    program = tmp_path / "ending.py"
    program.write_text(ENDING)
    for _ in range(10):
        done = subprocess.run([sys.executable, program], capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stdout.strip(), done.stderr) == (0, "the end", "")
