# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects optimised centres of rotation: compared with the definition in float64, and their effect on a
tube."""

import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from pathlib import Path
from threading import Barrier

import numpy as np
import pytest
import rigs
import sinew
from rigs import lets_others_run
from tube import TABLE, Tube, numbers, three_bones

SIGMA = 0.1


@pytest.mark.parametrize("method", TABLE)
def test_the_table_of_the_tube(method):
    tube = Tube()
    found = numbers(tube, partial(tube.deformed, method))
    np.testing.assert_allclose(found, TABLE[method], atol=0.01)


def leaves(points, weights):
    """Triangles split until weights change by less than 0.1 along each edge: area, centroid, mean weights."""
    todo, done = [(points, weights)], []
    while todo:
        p, w = todo.pop()
        changes = [np.linalg.norm(w[k] - w[(k + 1) % 3]) for k in range(3)]
        k = int(np.argmax(changes))
        if changes[k] < 0.1:
            area = np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0])) / 2.0
            done.append((area, p.mean(axis=0), w.mean(axis=0)))
            continue
        for replaced in (k, (k + 1) % 3):
            p_half, w_half = p.copy(), w.copy()
            p_half[replaced] = p[[k, (k + 1) % 3]].mean(axis=0)
            w_half[replaced] = w[[k, (k + 1) % 3]].mean(axis=0)
            todo.append((p_half, w_half))
    return done


def defined_centres(points, weights, triangles):
    """Le and Hodgins' formula as printed; NaN if no triangle counts.

    weights  [vertices, bones], with sum 1
    """
    parts = [leaf for t in triangles for leaf in leaves(points[t], weights[t])]
    areas, centroids, means = (np.array(each) for each in zip(*parts, strict=True))
    centres = np.full_like(points, np.nan)
    for vertex, a in enumerate(weights):
        product = a[None, :] * means  # a_j b_j
        crossed = a[None, :, None] * means[:, None, :]  # a_j b_k
        near = np.exp(-(((crossed - crossed.transpose(0, 2, 1)) / SIGMA) ** 2))
        both = product[:, :, None] * product[:, None, :] * near
        similarity = both.sum(axis=(1, 2)) - np.trace(both, axis1=1, axis2=2)
        if (similarity > 0.0).any():
            share = similarity * areas
            centres[vertex] = share @ centroids / share.sum()
    return centres


@pytest.mark.parametrize("tube", [Tube(41, 16), three_bones()], ids=["two bones", "three bones"])
def test_centres_are_those_of_the_definition(tube):
    weights = tube.weights.astype(np.float32).astype(np.float64)
    weights /= weights.sum(axis=1, keepdims=True)
    expected = defined_centres(tube.points.astype(np.float32).astype(np.float64), weights, tube.triangles)
    rigid = np.isnan(expected[:, 0])
    expected[rigid] = tube.points[rigid]
    assert (~rigid).sum() > 100
    # Relative to the diameter, which is 1.
    assert np.linalg.norm(tube.centres(exact=True) - expected, axis=1).max() < 1e-5
    assert np.linalg.norm(tube.centres() - expected, axis=1).max() < 0.005


def test_bones_of_a_vertex_may_repeat_in_any_order():
    tube = three_bones()
    points, offsets, bones, weights = tube.mesh
    expected = tube.centres()
    order = np.concatenate([np.arange(e - 1, b - 1, -1) for b, e in pairwise(offsets)])
    swapped = sinew.centres_of_rotation(points, offsets, bones[order], weights[order], tube.triangles)
    np.testing.assert_allclose(swapped.result(), expected, atol=1e-5)
    twice = sinew.centres_of_rotation(
        points, 2 * offsets, np.repeat(bones, 2), np.repeat(weights, 2), tube.triangles
    )
    np.testing.assert_allclose(twice.result(), expected, atol=1e-5)


def test_triangles_without_area_count_for_nothing():
    tube = three_bones()
    flat = np.concatenate([tube.triangles, tube.triangles[:, [0, 1, 1]]])
    for exact in (False, True):
        found = sinew.centres_of_rotation(*tube.mesh, flat, exact=exact).result()
        np.testing.assert_array_equal(found, tube.centres(exact=exact))


# --- What both precomputations share


START = {"cor": lambda tube, **options: sinew.centres_of_rotation(*tube.mesh, tube.triangles, **options)}
if "ddm" in {method.name for method in sinew.methods()}:
    START["ddm"] = lambda tube, **options: sinew.direct_delta_mush(*tube.mesh, tube.triangles, 0.3, **options)
every_precomputation = pytest.mark.parametrize("start", START.values(), ids=START)
# Takes so long that it is always cancelled first.
LONG = """
import sys
import sinew
from tube import Tube
tube = Tube(2001, 256)
run = sinew.centres_of_rotation(*tube.mesh, tube.triangles, exact=True)
print("started", flush=True)
"""


def started(code: str) -> subprocess.Popen:
    """A Python that runs LONG and then this, once it has started."""
    process = subprocess.Popen(
        [sys.executable, "-c", LONG + code],
        cwd=Path(rigs.__file__).parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "started\n"
    return process


def long_one() -> sinew.Precomputation:
    tube = Tube(2001, 256)
    return sinew.centres_of_rotation(*tube.mesh, tube.triangles, exact=True)


@every_precomputation
def test_threads_change_no_bit(start):
    for tube in (Tube(), three_bones()):
        expected = start(tube, threads=1).result()
        for threads in (None, 0, np.int64(4), 10**30):
            np.testing.assert_array_equal(start(tube, threads=threads).result(), expected)


@every_precomputation
def test_progress_ends_at_one(start):
    run = start(Tube(401, 64))
    shares = [run.progress]
    while not run.wait(0.001):
        shares.append(run.progress)
    shares.append(run.progress)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert run.has_ended
    assert run.result() is run.result()


@every_precomputation
def test_threads_get_the_same_result(start):
    """Blender evaluates meshes that share a computation on several threads."""
    tube, count = Tube(81, 64), 4
    expected, together = start(tube).result().copy(), Barrier(count)

    def result_of(run):
        together.wait()
        return run.result()

    with ThreadPoolExecutor(count) as threads:
        for _again in range(100):
            run = start(tube)
            assert run.wait()
            found = list(threads.map(result_of, [run] * count))
            assert all(each is found[0] for each in found)
            np.testing.assert_array_equal(found[0], expected)


def test_it_works_on_copies():
    tube = Tube()
    mesh, triangles = [array.copy() for array in tube.mesh], tube.triangles.copy()
    run = sinew.centres_of_rotation(*mesh, triangles)
    for array in (*mesh, triangles):
        array[:] = 0
    np.testing.assert_array_equal(run.result(), tube.centres())


def test_cancelled_it_has_no_result():
    run = long_one()
    assert not run.has_ended
    assert not run.wait(0.0)
    run.cancel()
    assert run.has_ended
    assert run.wait()
    assert run.result() is None
    done = START["cor"](Tube())
    expected = done.result()
    done.cancel()
    assert done.result() is expected


def test_errors_are_those_of_its_result():
    tube = Tube()
    run = sinew.centres_of_rotation(*tube.mesh, tube.triangles + len(tube.points))
    assert run.wait(60)
    for _ in range(2):
        with pytest.raises(ValueError, match="triangles: expected numbers of vertices"):
            run.result()


@pytest.mark.skipif(sys.platform == "win32", reason="no such signal")
def test_ctrl_c_interrupts_who_waits():
    process = started("run.result()")
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    _out, errors = process.communicate(timeout=60)
    assert "KeyboardInterrupt" in errors
    assert time.monotonic() - began < 10


ENDS = {
    "module": "",
    "no references": "del run",
    "exit": "sys.exit(0)",
    "error": "import ctypes; ctypes.CDLL(None).exit(0)",
    "at once": "import os; os._exit(0)",
    "in a thread": "import threading; threading.Thread(target=run.result, daemon=True).start()",
}


@pytest.mark.parametrize("code", ENDS.values(), ids=ENDS)
def test_a_process_ends_meanwhile(code):
    if sys.platform == "win32" and "CDLL" in code:
        pytest.skip("not on this system")
    process = started(code)
    _out, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, "")


def test_other_threads_run_meanwhile():
    tube = Tube(161, 64)
    assert lets_others_run(lambda: tube.centres(threads=1), 20)
