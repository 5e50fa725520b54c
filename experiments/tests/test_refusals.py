# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects callers of fits and of solvers, whom an error tells what is wrong."""

import numpy as np
import pytest
import sinew
from future_work import curves, fit, ik

KEYS = sinew.dual_quat.from_screw_about([1, 2, 3], [0, 0, 1], np.arange(5) / 4, np.arange(5) / 2)
POINTS = np.float32([[0, 0, 0], [1, 1, 1]])
CHAIN = {"rest": [[1, 0, 0, 0, 0, 0, 0]], "tips": [[0, 1, 0]], "goals": [[1, 0, 0, 0, 0, 1, 0]]}


def solver(**more):
    return ik.Solver(**{"parents": [-1], "effectors": [ik.Effector(0)]} | more)


def solve(**given):
    return solver(effectors=[ik.Effector(0, has_pole="poles" in given)]).solve(**given)


CALLS = {
    "Solver": (solver, {}),
    "solve": (solve, CHAIN),
    "hermite": (
        curves.hermite,
        {"keys": KEYS[:, :3], "tangents": KEYS[:, 1:4], "times": np.arange(5.0), "at": 0.5},
    ),
    "rigid": (fit.rigid, {"source": POINTS, "target": POINTS}),
    "hand_eye": (fit.hand_eye, {"a": KEYS, "b": KEYS}),
    "average": (fit.average, {"poses": KEYS}),
}
ROWS = [
    ("Solver", "effectors", []),
    ("Solver", "effectors", [ik.Effector(1)]),
    ("Solver", "effectors", [ik.Effector(0, has_pole=np.zeros(2))]),
    ("Solver", "effectors", np.array({}, dtype=object)),
    ("Solver", "parents", [0]),
    ("Solver", "limits", np.zeros((2, 3))),
    ("Solver", "limits", np.full((1, 3, 2), np.nan)),
    ("Solver", "stiffness", [[1, 0, 0]]),
    ("solve", "rest", np.tile(CHAIN["rest"], (2, 1))),
    ("solve", "goals", CHAIN["goals"][0]),
    ("solve", "tips", [[0, np.inf, 0]]),
    ("solve", "iterations", -1),
    ("solve", "poles", None),
    ("hermite", "tangents", KEYS[:2, :3]),
    ("hermite", "times", [0, 1]),
    ("hermite", "keys", KEYS[:, :7]),
    ("rigid", "target", np.zeros((4, 3), np.float32)),
    ("rigid", "source", POINTS * np.float32(np.nan)),
    ("rigid", "weights", np.ones(3)),
    ("rigid", "weights", -np.ones(2)),
    ("hand_eye", "b", KEYS[:3]),
    ("hand_eye", "a", KEYS[:, :3]),
    ("average", "poses", KEYS[:0]),
    ("average", "weights", np.ones(3)),
]


@pytest.mark.parametrize(("name", "argument", "value"), ROWS)
def test_an_error_says_what_is_wrong(name, argument, value):
    call, good = CALLS[name]
    with pytest.raises(ValueError, match=f"^{argument}: expected .*, got "):
        call(**good | {argument: value})
