# SPDX-License-Identifier: GPL-3.0-or-later
"""What programs and libraries play of exported files, and what each plays best. players.json has what
`./dev players` measured, as docs/players.md shows it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ...base.errors import WrongUse
from ...base.phrases import Phrase, phrase

# Influences of a vertex that every player of glTF reads.
FOUR = 4
# Of a tube of 6 m, in metres: what is farther off is named. Outlines are measured by pixels of 0.0126.
_WRONG = 0.02
ALL_CLIPS, SHOWN = "all", "shown"


@dataclass(frozen=True)
class Player:
    """
    name        as its makers write it
    influences  of a vertex that it plays, at most; 0 for all
    clips       ALL_CLIPS, or SHOWN where it plays best a file with one
    endings     of files that it reads, the best first
    note        what one would not guess
    """

    name: str
    influences: int = FOUR
    clips: str = ALL_CLIPS
    endings: tuple[str, ...] = (".glb",)
    note: str = ""


_STILL = "For a pose there, export the mesh of that frame without its armature, such as a .obj"
_FIRST = "F3D plays the first clip of a file, unless --animation-indices names another"
_NEXT = (
    "panda3d shows the next key without interpolation: the more frames a second the scene has, the less it "
    "is ahead"
)
_AT_ONCE = "viser plays all clips of a file at once"
_TIMES = "Blender's importer of USD does not interpolate, where channels have keys at different times"
_DATA = "assimp skins nothing itself, and normalises no weights: whoever reads the file does"

PLAYERS: dict[str, Player] = {
    "assimp": Player("assimp", 0, endings=(".glb", ".fbx"), note=_DATA),
    "babylon.js": Player("Babylon.js", 8),
    "blender": Player("Blender", 0, endings=(".glb", ".usdc", ".fbx"), note=_TIMES),
    "f3d": Player("F3D", clips=SHOWN, note=_FIRST),
    "godot": Player("Godot", 8),
    "mujoco": Player("MuJoCo", endings=()),
    "open3d": Player("Open3D", note=_STILL),
    "panda3d": Player("panda3d", note=_NEXT),
    "pygfx": Player("pygfx"),
    "pyvista": Player("PyVista", note=_STILL),
    "three.js": Player("three.js"),
    "trimesh": Player("trimesh", note=_STILL),
    "ufbx": Player("ufbx", 0, endings=(".fbx",)),
    "usdskel": Player("UsdSkel", 0, endings=(".usdc",)),
    "viser": Player("viser", clips=SHOWN, note=_AT_ONCE),
    "vtk": Player("VTK"),
    "vtk-importer": Player("VTK's importer", note=_STILL),
}

# By the columns of the table, what a file may have.
PROPERTIES = {
    "plain": "any animation",
    "six": "more than four influences",
    "loose": "weights whose sum is not 1",
    "unequal": "unequal scale of bones",
    "mirrored": "mirrored bones",
    "scaled_above": "a scaled armature",
    "two_keys": "keys more than a frame apart",
    "two_clips": "several clips",
    "morph": "shape keys and bones",
}


_TAKES = {
    (FOUR, ALL_CLIPS): "Four influences a vertex, all clips",
    (FOUR, SHOWN): "Four influences a vertex, one clip",
    (8, ALL_CLIPS): "Eight influences a vertex, all clips",
    (0, ALL_CLIPS): "All influences, all clips",
}


def takes(name: str) -> str:
    """What a player plays best, in words."""
    its = PLAYERS[name]
    return _TAKES[its.influences, its.clips]


def player(text: str) -> str:
    """The name in PLAYERS of what a user calls a player, such as threejs. Raises WrongUse."""
    found = [name for name in PLAYERS if _letters(name) == _letters(text)]
    if not found:
        raise WrongUse(f"expected a player, one of {', '.join(PLAYERS)}, got {text!r}")
    return found[0]


def _letters(name: str) -> str:
    return "".join(each for each in name.lower() if each.isalnum())


@cache
def _figures() -> list[dict[str, Any]]:
    return json.loads(Path(__file__).with_name("players.json").read_text(encoding="utf-8"))


def _row(name: str, ending: str) -> dict[str, Any] | None:
    """The last one measured of a player."""
    rows = [row for row in _figures() if row["name"] == name and row["ending"] == ending]
    return rows[-1] if rows else None


def _skins(name: str, ending: str = ".glb") -> bool:
    """Whether it moves the mesh at all, as far as that was measured."""
    row = _row(name, ending)
    return row is None or ("distance" in (first := row["cells"]["plain"]) and "rest" not in first)


def best_options(name: str) -> dict[str, Any]:
    """What a player plays best, by the names of ExportOptions."""
    its = PLAYERS[name]
    return {"influences": its.influences, "clips": its.clips}


def check_ending(name: str, ending: str) -> None:
    """Raises WrongUse for a file that a player does not read."""
    its = PLAYERS[name]
    if ending not in its.endings:
        if not its.endings:
            raise WrongUse(f"{its.name} reads no {ending}, and no other file with a skin")
        raise WrongUse(f"{its.name} reads no {ending}; write a {' or '.join(its.endings)} for it")


def more_than_four() -> Phrase:
    """Who plays more than four influences."""
    of_gltf = [name for name, its in PLAYERS.items() if ".glb" in its.endings and _skins(name)]
    plays = {name: not PLAYERS[name].influences or PLAYERS[name].influences > FOUR for name in of_gltf}
    return phrase(
        "{players} play more than four influences; {others} do not, and some play such a file wrongly",
        players=", ".join(PLAYERS[name].name for name, does in plays.items() if does),
        others=", ".join(PLAYERS[name].name for name, does in plays.items() if not does),
    )


def warning(name: str, ending: str) -> Phrase | None:
    """Of a player that leaves the skin at rest."""
    if _skins(name, ending):
        return None
    return phrase("{player} does not skin: it shows the rest pose", player=PLAYERS[name].name)


def sentences(name: str, ending: str, influences: int, clips: str = ALL_CLIPS) -> list[Phrase]:
    """What the table says of a player.

    influences  of a vertex that the file has, at most; 0 for all
    clips       of ExportOptions
    """
    its, row = PLAYERS[name], _row(name, ending)
    said = [phrase(its.note)] if its.note and (its.note is not _TIMES or ending == ".usdc") else []
    if (at_rest := warning(name, ending)) is not None:
        return [at_rest, *said]
    if row is None:
        return [phrase("{player} was not measured", player=its.name), *said]
    # What is wrong with any file is said once.
    least = max(_WRONG, 1.5 * row["cells"]["plain"]["distance"])
    limits = {key: _WRONG if key == "plain" else least for key in PROPERTIES}
    if 0 < influences <= FOUR:
        del limits["six"]
    if clips == SHOWN:
        del limits["two_clips"]
    cells = {key: row["cells"].get(key) for key in limits}
    wrong = [
        _named(PROPERTIES[key], cell)
        for key, cell in cells.items()
        if cell is not None and cell.get("distance", float("inf")) > limits[key]
    ]
    version = row["version"]
    if not wrong:
        right = phrase(
            "{player} {version} plays what such a file has as Blender shows it",
            player=its.name,
            version=version,
        )
        return [right, *said]
    listed = wrong[0]
    for each in wrong[1:]:
        listed = phrase("{first}, {second}", first=listed, second=each)
    plays = phrase(
        "{player} {version} plays a tube of 6 m wrongly with {wrong}",
        player=its.name,
        version=version,
        wrong=listed,
    )
    return [plays, *said]


def _named(text: str, cell: dict[str, Any]) -> Phrase:
    if "distance" not in cell:
        return phrase(text)
    return phrase("{name} ({distance} m off)", name=phrase(text), distance=f"{cell['distance']:.2g}")
