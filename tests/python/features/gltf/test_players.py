# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects what is said of players: the measurements are complete, and each sentence follows from them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from sinew_addon.base.errors import WrongUse
from sinew_addon.features.gltf import players

FIGURES = json.loads(Path(players.__file__).with_name("players.json").read_text(encoding="utf-8"))
DOCUMENT = Path(__file__).resolve().parents[4] / "docs/players.md"
PLAIN_AND_MORE = {"plain", "six", "unequal", "mirrored", "scaled_above", "two_keys", "two_clips", "morph"}


@pytest.mark.parametrize("row", FIGURES, ids=[row["label"] for row in FIGURES])
def test_what_was_measured_is_whole(row):
    """A player that skins was given each file of its ending; others the first alone."""
    assert row["ending"] in players.PLAYERS[row["name"]].endings or row["name"] == "mujoco"
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", row["date"])
    assert row["version"]
    first, cells = row["cells"]["plain"], set(row["cells"])
    if "rest" in first or "said" in first:
        assert cells == {"plain"}
        return
    # What their files do not have, or adapters can not judge.
    without = {"assimp": {"morph"}, "viser": {"two_keys"}}.get(row["name"], set())
    without |= {"two_clips"} if row["ending"] == ".usdc" else set()
    assert cells >= PLAIN_AND_MORE - without
    assert row["ending"] != ".glb" or cells >= {"loose", "bytes", "shorts"}


def test_each_file_that_a_player_reads_was_measured():
    measured = {(row["name"], row["ending"]) for row in FIGURES}
    wanted = {(name, ending) for name, its in players.PLAYERS.items() for ending in its.endings}
    assert wanted - measured == {("godot", ".glb")}


def test_the_document_has_the_figures():
    text = DOCUMENT.read_text(encoding="utf-8")
    for row in FIGURES:
        assert f"| {row['label']} | {row['version']} | {row['date']} |" in text


@pytest.mark.parametrize(
    ("text", "name"), [("threejs", "three.js"), ("Three.js", "three.js"), ("VTK importer", "vtk-importer")]
)
def test_names_of_players(text, name):
    assert players.player(text) == name


def test_a_player_that_is_not_known():
    with pytest.raises(
        WrongUse, match=r"expected a player, one of assimp, babylon.js, blender, .*, got 'unity'"
    ):
        players.player("unity")


@pytest.mark.parametrize(
    ("name", "ending", "said"),
    [
        ("panda3d", ".fbx", "panda3d reads no .fbx; write a .glb for it"),
        ("usdskel", ".glb", "UsdSkel reads no .glb; write a .usdc for it"),
        ("assimp", ".usdc", "assimp reads no .usdc; write a .glb or .fbx for it"),
        ("mujoco", ".glb", "MuJoCo reads no .glb, and no other file with a skin"),
    ],
)
def test_files_that_a_player_does_not_read(name, ending, said):
    with pytest.raises(WrongUse) as caught:
        players.check_ending(name, ending)
    assert str(caught.value) == said


def sentences(name, ending=".glb", influences=4, clips="all"):
    return " / ".join(players.sentences(name, ending, influences, clips))


def test_what_is_said_of_players():
    said = sentences("panda3d")
    assert re.search(
        r"wrongly with any animation \([\d.]+ m off\), unequal scale of bones \([\d.]+ m off\)", said
    )
    assert "weights whose sum" not in said
    assert "shows the next key without interpolation" in said
    assert "plays what such a file has as Blender shows it" in sentences("three.js")
    assert "plays what such a file has as Blender shows it" in sentences("babylon.js", influences=8)
    assert "with more than four influences (" in sentences("three.js", influences=8)
    assert sentences("trimesh").startswith(
        "trimesh does not skin: it shows the rest pose / For a pose there,"
    )
    assert "several clips (" in sentences("viser")
    assert "plays what such a file has" in sentences("viser", clips="shown")
    assert "several clips" not in sentences("f3d")
    assert sentences("godot") == "Godot was not measured"
    assert "importer of USD" in sentences("blender", ".usdc")
    assert "importer of USD" not in sentences("blender")


def test_who_plays_more_than_four_influences():
    assert players.more_than_four().startswith(
        "assimp, Babylon.js, Blender, Godot play more than four influences; F3D, "
    )
    assert "trimesh" not in players.more_than_four()
