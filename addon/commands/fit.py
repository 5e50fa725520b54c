# SPDX-License-Identifier: GPL-3.0-or-later
"""`sinew fit`: fits rigid transforms to numbers in files, without Blender."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import sinew

from ..core.errors import SinewError, WrongUse
from .console import Console

HELP = """\
Prints the rigid transform that fits what is measured, as a 4x4 matrix for column vectors and as (w, x, y, z),
(x, y, z), with what is left and whether it is the only one that is as good:

points SOURCE TARGET   that takes the points of one file nearest to those of the other, in the same order
hand-eye A B           x of a x = x b: of motions of two bodies that are fixed to each other
average POSES          the mean of poses; --robust: almost half of them may be wrong

Files are .npy, or text with a row of numbers for each point (3) or motion: 7 (w, x, y, z, tx, ty, tz), 8 (a
dual quaternion), 12 or 16 (a matrix, row by row), with commas or blanks between. Exit status 1: another
transform fits as well, as of points on one line."""

# The number of values in a row, and the shape that they have.
SHAPES = {7: (7,), 8: (8,), 12: (3, 4), 16: (4, 4)}
FILES = {"points": 2, "hand-eye": 2, "average": 1}


def add_parser(subparsers: argparse._SubParsersAction) -> argparse.ArgumentParser:
    parser = subparsers.add_parser(
        "fit",
        help="print the rigid transform that fits points, motions of two bodies, or many poses",
        description=HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", choices=tuple(FILES), help="what the files hold")
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help=".npy, .csv or .txt")
    parser.add_argument("--weights", type=Path, metavar="FILE", help="a number for each row, not below 0")
    parser.add_argument(
        "--method",
        choices=sinew.fit.METHODS,
        default="horn",
        help="of points; they differ by rounding (default: horn)",
    )
    parser.add_argument("--robust", action="store_true", help="of an average: leave out what is far off")
    parser.add_argument("--json", action="store_true", help="print JSON")
    return parser


def run(args: argparse.Namespace, console: Console) -> int:
    if len(args.files) != FILES[args.what]:
        raise WrongUse(f"sinew fit {args.what}: expected {FILES[args.what]} files, got {len(args.files)}")
    if args.robust and args.what != "average":
        raise WrongUse("--robust is of sinew fit average")
    weights = None if args.weights is None else _numbers(args.weights).ravel()
    read = _points if args.what == "points" else _motions
    rows = [read(path) for path in args.files]
    try:
        facts = _fitted(args, rows, weights)
    except ValueError as error:
        raise SinewError(f"{', '.join(map(str, args.files))}: {error}") from None
    if args.json:
        console.say(json.dumps(facts, indent=2))
    else:
        _say(facts, console)
    return 0 if facts["is_defined"] else 1


def _fitted(args: argparse.Namespace, rows: list[np.ndarray], weights: np.ndarray | None) -> dict[str, Any]:
    if args.what == "points":
        found = sinew.fit.rigid(rows[0], rows[1], weights, method=args.method)
        left = {"error": float(found.error), "is_mirrored": bool(found.is_mirrored)}
        return _facts(found.transforms, bool(found.is_defined), left)
    if args.what == "hand-eye":
        pair = sinew.fit.hand_eye(rows[0], rows[1], weights)
        left = {"angle_degrees": math.degrees(float(pair.angle)), "distance": float(pair.translation)}
        return _facts(pair.transforms, bool(pair.is_defined), left)
    mean = sinew.fit.average(rows[0], weights, robust=args.robust)
    return _facts(mean.transforms, bool(mean.is_defined), {"kept": mean.kept.tolist()})


def _facts(transform: np.ndarray, is_defined: bool, left: dict[str, Any]) -> dict[str, Any]:
    """`transform` can have any layout, recognised by its last axis."""
    matrix = transform
    if transform.shape[-1] != 4:
        layout = sinew.quat_vec if transform.shape[-1] == 7 else sinew.dual_quat
        matrix = layout.to_affine(transform)
    pair = sinew.affine.to_quat_vec(matrix)
    return {
        "matrix": matrix.tolist(),
        "rotation": pair[:4].tolist(),
        "translation": pair[4:].tolist(),
        "is_defined": is_defined,
        **left,
    }


def _say(facts: dict[str, Any], console: Console) -> None:
    for row in facts["matrix"]:
        console.say("  ".join(f"{number: .9f}" for number in row))
    console.say("rotation     " + "  ".join(f"{number:.9f}" for number in facts["rotation"]))
    console.say("translation  " + "  ".join(f"{number:.9g}" for number in facts["translation"]))
    if "error" in facts:
        console.say(f"root of the mean square distance  {facts['error']:.6g}")
    if "distance" in facts:
        console.say(f"left  {facts['angle_degrees']:.6g} degrees, {facts['distance']:.6g}")
    if "kept" in facts:
        left_out = [str(row + 1) for row, part in enumerate(facts["kept"]) if part == 0.0]
        console.say(f"rows left out: {', '.join(left_out) or 'none'}")
    if facts.get("is_mirrored"):
        console.complain("a mirror image would fit better")
    if not facts["is_defined"]:
        console.complain("not defined: another transform fits as well")


def _numbers(path: Path) -> np.ndarray:
    """Reads float64 [rows, ..]."""
    if not path.is_file():
        raise SinewError(f"{path}: no such file")
    try:
        if path.suffix.lower() == ".npy":
            return np.asarray(np.load(path, allow_pickle=False), np.float64)
        text = path.read_text(encoding="utf-8").replace(",", " ")
        return np.loadtxt(text.splitlines(), dtype=np.float64, ndmin=2)
    except (ValueError, TypeError, EOFError) as error:
        raise SinewError(f"{path}: expected rows of numbers ({error})") from None


def _points(path: Path) -> np.ndarray:
    points = _numbers(path)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0:
        raise SinewError(f"{path}: expected rows of 3 numbers, got an array {list(points.shape)}")
    return points


def _motions(path: Path) -> np.ndarray:
    motions = _numbers(path)
    if motions.ndim == 3 and motions.shape[1:] in ((3, 4), (4, 4)):
        return motions
    if motions.ndim != 2 or motions.shape[1] not in SHAPES or len(motions) == 0:
        raise SinewError(
            f"{path}: expected rows of 7, 8, 12 or 16 numbers, got an array {list(motions.shape)}"
        )
    return motions.reshape(-1, *SHAPES[motions.shape[1]])
