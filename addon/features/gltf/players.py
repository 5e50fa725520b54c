# SPDX-License-Identifier: GPL-3.0-or-later
"""What programs and libraries play of exported files: docs/players.md has the measurements."""

from __future__ import annotations

from dataclasses import dataclass

from ...base.phrases import Phrase, phrase

# Influences of a vertex that every player of glTF reads.
FOUR = 4


@dataclass(frozen=True)
class Player:
    """
    name        as its makers write it
    influences  of a vertex in a .glb, at most; 0 for all
    """

    name: str
    influences: int = FOUR


PLAYERS: dict[str, Player] = {
    "assimp": Player("assimp", influences=0),
    "blender": Player("Blender", influences=0),
    "f3d": Player("F3D"),
    "godot": Player("Godot", influences=8),
    "panda3d": Player("panda3d"),
    "pygfx": Player("pygfx"),
    "three.js": Player("three.js"),
    "viser": Player("viser"),
    "vtk": Player("VTK"),
}


def more_than_four() -> Phrase:
    """Who plays more than four influences."""
    plays = {name: player.influences == 0 or player.influences > FOUR for name, player in PLAYERS.items()}
    return phrase(
        "{players} play more than four influences; {others} do not, and some play such a file wrongly",
        players=", ".join(PLAYERS[name].name for name, does in plays.items() if does),
        others=", ".join(PLAYERS[name].name for name, does in plays.items() if not does),
    )
