# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew fit` on files, without Blender."""

import json

import numpy as np
import pytest
import sinew
from motions import layout, rigid
from sinew_addon import cli
from sinew_addon.commands import console


class Output(console.Console):
    """Collects the output."""

    def __init__(self):
        self.said, self.complaints = [], []

    def say(self, line):
        self.said.append(line)

    def complain(self, line):
        self.complaints.append(str(line))


def fit(*words):
    """(exit status, output, errors)."""
    parser, modules = cli.make_parser()
    args = parser.parse_args(["fit", *map(str, words)])
    output = Output()
    status = modules["fit"].run(args, output)
    return status, "\n".join(output.said), output.complaints


@pytest.fixture
def points(tmp_path):
    rng = np.random.default_rng(0)
    motion = rigid(rng)
    source = rng.normal(size=(6, 3))
    np.savetxt(tmp_path / "a.csv", source, delimiter=",")
    np.save(tmp_path / "b.npy", motion.apply(source))
    return tmp_path, motion


@pytest.mark.parametrize("method", sinew.fit.METHODS)
def test_points_of_text_and_of_numpy(points, method):
    folder, motion = points
    status, said, _ = fit("points", folder / "a.csv", folder / "b.npy", "--method", method, "--json")
    facts = json.loads(said)
    assert status == 0
    np.testing.assert_allclose(facts["matrix"], motion.as_matrix(), atol=1e-14)
    assert facts["error"] < 1e-14


def test_what_is_not_defined_has_exit_status_1(tmp_path):
    (tmp_path / "line.txt").write_text("0 0 0\n1 1 1\n2 2 2\n")
    status, said, complaints = fit("points", tmp_path / "line.txt", tmp_path / "line.txt")
    assert status == 1
    assert "not defined" in complaints[0]
    assert "distance  0" in said


@pytest.mark.parametrize("name", ["affine", "quat_vec", "dual_quat"])
def test_motions_in_every_layout(tmp_path, name):
    rng = np.random.default_rng(1)
    x = rigid(rng)
    hands = rigid(rng, 5)
    eyes = [x.inv() * hand * x for hand in hands]
    for file, motions in (("a.txt", hands), ("b.txt", eyes)):
        rows = np.array([layout(each, name).ravel() for each in motions])
        np.savetxt(tmp_path / file, rows)
    status, said, _ = fit("hand-eye", tmp_path / "a.txt", tmp_path / "b.txt", "--json")
    assert status == 0
    np.testing.assert_allclose(json.loads(said)["matrix"], x.as_matrix(), atol=1e-11)


def test_an_average_says_what_it_leaves_out(tmp_path):
    rows = np.tile([1.0, 0, 0, 0, 1, 2, 3], (5, 1))
    rows[2] = [0, 1, 0, 0, 9, 9, 9]
    np.savetxt(tmp_path / "poses.txt", rows)
    status, said, _ = fit("average", tmp_path / "poses.txt", "--robust")
    assert status == 0
    assert "rows left out: 3" in said
    assert "translation  1  2  3" in said


def test_wrong_files_are_named(points):
    folder, _ = points
    (folder / "words.csv").write_text("a,b,c\n")
    (folder / "short.csv").write_text("1,2,3\n")
    from sinew_addon.core.errors import SinewError, WrongUse

    for words, error, text in (
        (["points", "a.csv"], WrongUse, "2 files"),
        (["points", "a.csv", "b.npy", "--robust"], WrongUse, "--robust"),
        (["points", "a.csv", "no.csv"], SinewError, r"no\.csv: no such file"),
        (["points", "a.csv", "words.csv"], SinewError, r"words\.csv: expected rows of numbers"),
        (["points", "a.csv", "short.csv"], SinewError, "target: expected"),
        (["hand-eye", "a.csv", "b.npy"], SinewError, "7, 8, 12 or 16"),
    ):
        paths = [folder / word if "." in word else word for word in words]
        with pytest.raises(error, match=text):
            fit(*paths)
