# SPDX-License-Identifier: GPL-3.0-or-later
"""The golden set's reader reproduces it, and so does the library."""

import runpy
from pathlib import Path

import numpy as np
import pytest
import sinew

FOLDER = Path(__file__).resolve().parents[1] / "golden"
CASES = sorted(FOLDER.glob("*.npz"))
ORACLES = [("lbs", "linear"), ("dq", "preserve_volume")]
TOLERANCE = 1e-5


def read(path):
    case = dict(np.load(path))
    return case, TOLERANCE * np.linalg.norm(np.ptp(case["points"], axis=0))


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_reader(path):
    skin = runpy.run_path(str(FOLDER / "skin.py"))["skin"]
    case, tolerance = read(path)
    for preserve_volume, name in ((False, "linear"), (True, "preserve_volume")):
        assert np.abs(skin(case, preserve_volume) - case[name]).max() <= tolerance


@pytest.mark.parametrize("path", [p for p in CASES if p.stem != "bendy"], ids=lambda path: path.stem)
@pytest.mark.parametrize(("method", "name"), ORACLES)
def test_library(path, method, name):
    case, tolerance = read(path)
    sums = np.add.reduceat(np.append(case["weights"], 0.0), case["offsets"][:-1])
    deforms = (np.diff(case["offsets"]) > 0) & (sums > 1e-4)
    weights = case["weights"] * np.repeat(deforms, np.diff(case["offsets"]))
    deformer = sinew.Deformer(
        case["points"], case["offsets"], case["bones"], weights, method, rest_bones=case["rest"]
    )
    motions = case["posed"].astype(np.float64) @ np.linalg.inv(case["rest"].astype(np.float64))
    got = deformer.deform(motions.astype(np.float32), bones_from_model=case["armature_from_mesh"])
    assert np.abs(got - case[name]).max() <= tolerance


def test_there_are_cases():
    assert {"rotated", "scaled", "mirrored", "antipodal", "bendy"} <= {path.stem for path in CASES}
