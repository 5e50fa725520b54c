# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the golden set: its reader reproduces it, and so does the library."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import sinew
import skin as reader

FOLDER = Path(__file__).resolve().parents[2] / "golden"
CASES = sorted(FOLDER.glob("*.npz"))
ORACLES = [("lbs", "linear"), ("dq", "preserve_volume")]
TOLERANCE = 1e-5


def read(path):
    case = dict(np.load(path))
    return case, TOLERANCE * np.linalg.norm(np.ptp(case["points"], axis=0))


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_reader(path):
    _arrays, tolerance = read(path)
    case, about = reader.read(path)
    for result in about["results"]:
        points = reader.result_of(case, result)
        assert np.abs(points - case[result["array"]]).max() <= tolerance, result


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
    assert {"rotated", "scaled", "mirrored", "antipodal", "twisted", "bendy"} <= {path.stem for path in CASES}


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_every_method_and_stage_is_there(path):
    _case, about = reader.read(path)
    results = about["results"]
    found = {
        **{m: [r["parameters"] for r in results if r["method"] == m.name] for m in sinew.methods()},
        **{s: [r["stages"][s.name] for r in results if s.name in r["stages"]] for s in sinew.stages()},
    }
    for owner, values in found.items():
        assert values, owner.name
        for parameter in owner.parameters:
            if parameter.kind == "enum":
                assert {each.get(parameter.id, parameter.default) for each in values} == set(
                    parameter.choices
                )
    listed = {name: f"{array.dtype} {list(array.shape)}" for name, array in np.load(path).items()}
    assert about["arrays"] == listed


def test_no_two_results_of_a_case_are_the_same():
    """Detects readers that confuse methods."""
    case, about = reader.read(FOLDER / "weights.npz")
    # No two bones of this case are more than half a turn apart.
    names = [r["array"] for r in about["results"] if r["parameters"].get("signs") != "hierarchy"]
    for a, b in itertools.combinations(names, 2):
        assert np.abs(case[a] - case[b]).max() > 1e-3, (a, b)
