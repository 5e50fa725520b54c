# SPDX-License-Identifier: GPL-3.0-or-later
"""The files that a batch reads, and the copies that it writes."""

import glob
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

from ..base.errors import WrongUse
from .journal import UNFINISHED

STANDARD_INPUT = "-"


@dataclass(frozen=True)
class Job:
    """One file to read and the copy to write, both absolute."""

    source: Path
    target: Path


def plan_jobs(inputs: Iterable[str], out: Path, listed: Iterable[str] = ()) -> list[Job]:
    """Returns a job for each file of `inputs`: files, folders (all .blend files below them), patterns such as
    "characters/**/*.blend", and STANDARD_INPUT, which stands for the paths `listed`, one per line.

    A single file's copy is written directly to `out`. For a folder, a pattern or listed files, the tree is
    kept: below the folder, below the pattern's fixed part, or below the listed files' common folder.

    Raises WrongUse, before any work starts, where an input matches no file, a copy would overwrite an input,
    or two copies would have the same name. A file that cannot be read is reported by its own job.
    """
    out = Path(os.path.abspath(out))
    jobs: dict[Path, Job] = {}
    for given in inputs:
        root, paths = files_of(given, out, listed)
        for path in paths:
            target = (out / path.relative_to(root)).with_suffix(".blend")
            jobs.setdefault(path, Job(path, target))
    _check(list(jobs.values()))
    return list(jobs.values())


def files_of(given: str, out: Path, listed: Iterable[str]) -> tuple[Path, list[Path]]:
    """Returns the absolute paths of one input, and the folder below which the tree is kept. Raises
    WrongUse."""
    # Made absolute without following links, so that a linked folder keeps its name.
    path = Path(os.path.abspath(given))
    if given == STANDARD_INPUT:
        lines = [line for line in (line.strip("\r\n") for line in listed) if line]
        if any("\0" in line for line in lines):
            raise WrongUse("standard input: expected one path a line, not separated by zeros")
        paths = [Path(os.path.abspath(line)) for line in lines]
        if not paths:
            raise WrongUse("standard input: no paths, expected one a line")
        return Path(os.path.commonpath([p.parent for p in paths])), paths
    if path.is_dir():
        root, found = path, blend_files_below(path)
    elif glob.has_magic(given) and not path.exists():
        root = _fixed_part(path)
        found = _matching(root, path.relative_to(root))
    else:
        return path.parent, [path]
    # Copies of an earlier run are no inputs, nor are unfinished files of a killed run.
    resolved, resolve = out.resolve(), _resolver()
    may_be_below = resolved != root.resolve()
    files = [
        p
        for p in sorted(found)
        if p.is_file()
        and not (may_be_below and resolved in resolve(p).parents)
        and not p.name.endswith(UNFINISHED)
    ]
    if not files:
        raise WrongUse(f"{given}: no {'.blend files in this folder' if path.is_dir() else 'file matches'}")
    return root, files


def blend_files_below(folder: Path) -> Iterator[Path]:
    return (path for path in _files_below(folder) if path.suffix.lower() == ".blend")


def _files_below(folder: Path) -> Iterator[Path]:
    """Yields all files below, also in linked folders, but not in links to a parent folder, which would never
    end."""
    for path, folders, names in os.walk(folder, followlinks=True):
        above = {os.path.realpath(part) for part in (Path(path), *Path(path).parents)}
        folders[:] = [name for name in folders if os.path.realpath(os.path.join(path, name)) not in above]
        yield from (Path(path, name) for name in names)


def _matching(root: Path, pattern: Path) -> Iterator[Path]:
    """Returns the files below `root` that match a glob pattern: ** stands for any folders, and * does not
    match hidden names. glob itself does not end if links lead to a parent folder."""
    parts = pattern.parts
    if "**" not in parts:
        found = glob.iglob(os.path.join(glob.escape(str(root)), pattern))
        return (Path(path) for path in found)
    return (path for path in _files_below(root) if _fits(path.relative_to(root).parts, parts))


def _fits(names: tuple[str, ...], parts: tuple[str, ...]) -> bool:
    """Whether a path's names match a pattern's parts."""
    if not names:
        # At the end of a pattern, ** also stands for any file.
        return all(part == "**" for part in parts)
    if not parts:
        return False
    is_shown = not names[0].startswith(".")
    if parts[0] == "**":
        return _fits(names, parts[1:]) or (is_shown and _fits(names[1:], parts))
    fits = fnmatchcase(names[0], parts[0]) and (is_shown or parts[0].startswith("."))
    return fits and _fits(names[1:], parts[1:])


def _fixed_part(pattern: Path) -> Path:
    """Returns the folder above all files of a pattern. A part that exists with exactly that name is not a
    pattern."""
    fixed = Path(pattern.anchor)
    for part in pattern.parts[1:-1]:
        if glob.has_magic(part) and not (fixed / part).exists():
            break
        fixed /= part
    return fixed


def _check(jobs: list[Job]) -> None:
    resolve = _resolver()
    sources = {resolve(job.source) for job in jobs}
    targets: dict[Path, Path] = {}
    for job in jobs:
        target = resolve(job.target)
        if target in sources:
            raise WrongUse(f"{job.target}: the copy would replace an input; choose another --out")
        other = targets.setdefault(target, job.source)
        if other != job.source:
            raise WrongUse(f"{other} and {job.source} would both be written to {job.target}")


def _resolver() -> Callable[[Path], Path]:
    """Returns Path.resolve() for many files in few folders: each folder is resolved once."""
    folder = cache(Path.resolve)
    return lambda path: path.resolve() if path.is_symlink() else folder(path.parent) / path.name
