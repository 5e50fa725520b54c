# SPDX-License-Identifier: GPL-3.0-or-later
"""Which files a batch reads and which it writes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .errors import SinewError


@dataclass(frozen=True)
class Job:
    """One file to read and the copy to write."""

    source: Path
    target: Path


def plan_jobs(inputs: list[Path], out: Path) -> list[Job]:
    """A job for each file, and for each .blend file below each folder; a folder's tree is kept below `out`.

    Raises SinewError, before anything is done, where a folder has no .blend file, a copy would be written
    over an input, or two would have one name. A file that can not be read is left for its own job to report.
    """
    jobs = []
    for given in inputs:
        if given.is_dir():
            # What an earlier run wrote below the folder is not input.
            found = [
                p for p in sorted(given.rglob("*.blend")) if p.is_file() and not _is_below(p, out, given)
            ]
            if not found:
                raise SinewError(f"{given}: no .blend files in this folder")
            jobs += [Job(path, out / path.relative_to(given)) for path in found]
        else:
            jobs.append(Job(given, out / given.with_suffix(".blend").name))
    sources = {job.source.resolve() for job in jobs}
    targets: dict[Path, Path] = {}
    for job in jobs:
        target = job.target.resolve()
        if target in sources:
            raise SinewError(f"{job.target}: the copy would replace an input; choose another --out")
        other = targets.setdefault(target, job.source)
        if other != job.source:
            raise SinewError(f"{other} and {job.source} would both be written to {job.target}")
    return jobs


def _is_below(path: Path, out: Path, given: Path) -> bool:
    out = out.resolve()
    return out != given.resolve() and out in path.resolve().parents
