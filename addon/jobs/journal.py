# SPDX-License-Identifier: GPL-3.0-or-later
"""The record of a batch in its output folder, which is valid even if a run is killed at any moment.

One JSON object per line. A line is on disk before the copy that it describes gets its final name: if the run
is killed in between, the next run only has to rename the copy. A half-written last line is ignored.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path, PurePath

from ..base.errors import SinewError, WrongUse
from ..base.lock import try_lock
from ..base.output import writing

NAME = "sinew-journal.jsonl"
UNFINISHED = ".unfinished.blend"


class Journal:
    """The journal of the folder `out`, locked until it is closed or the process ends.

    latest  the last record of each copy, by its path below `out`

    Raises WrongUse where another batch is running in the folder.
    """

    def __init__(self, out: Path) -> None:
        self.out = out
        self.path = out / NAME
        self._start = len(os.path.join(out, ""))
        # _read() truncates a half-written last line, which it must not do through a link that somebody else
        # made.
        if self.path.is_symlink() or (self.path.exists() and not self.path.is_file()):
            raise SinewError(f"{self.path}: is no journal but a link or a folder; remove it")
        with writing(self.path):
            out.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("a+b", buffering=0)
        if not try_lock(self._file.fileno()):
            self._file.close()
            raise WrongUse(f"{out}: another batch is at work there; wait for it, or choose another --out")
        self.latest = self._read()

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_exception: object) -> None:
        self._file.close()

    def name_of(self, target: Path) -> str:
        """Returns the path of a copy below `out`."""
        return str(target)[self._start :].replace(os.sep, "/")

    def record(self, target: Path, record: dict) -> None:
        """Adds the record of a copy; it is on disk when this returns."""
        record = {"file": self.name_of(target), **record}
        line = json.dumps(record, ensure_ascii=True, separators=(",", ":")).encode() + b"\n"
        end = self._file.seek(0, os.SEEK_END)
        try:
            if self._file.write(line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fsync(self._file.fileno())
        except OSError as error:
            # Removes the part of the line that was written before the disk was full: only a last line may be
            # half-written.
            self._file.truncate(end)
            raise SinewError(
                f"{self.path}: can not be written: {error.strerror}; what was done is in it, --resume goes on"
            ) from None
        self.latest[record["file"]] = record

    def finish(self, target: Path, record: dict) -> None:
        """Renames a copy after its record was written. A file that has its final name is not touched."""
        unfinished = target.with_name(record.get("unfinished", target.name))
        if _stamp(unfinished) == record.get("written"):
            os.replace(unfinished, target)

    def matches(self, target: Path, record: dict | None) -> bool:
        """Whether `target` is still the file that its record describes."""
        return record is not None and record.get("written") == _stamp(target)

    def recover(self) -> None:
        """Renames the files that a killed run had recorded and not renamed yet."""
        for name, record in self.latest.items():
            if "unfinished" in record:
                self.finish(self.out / name, record)

    def remove_unfinished(self, targets: Iterable[Path]) -> None:
        """Removes unfinished copies of killed runs that no record describes."""
        for folder in {target.parent for target in targets}:
            # Blender's own temporary files end with @.
            for leftover in folder.glob(f".*{UNFINISHED}*"):
                leftover.unlink(missing_ok=True)

    def _is_behind_link(self, path: str) -> bool:
        """Whether a folder on the way from `out` to a record's file is a link, which can lead outside."""
        folders = (self.out / folder for folder in PurePath(path).parents)
        return any(folder != self.out and folder.is_symlink() for folder in folders)

    def _read(self) -> dict[str, dict]:
        self._file.seek(0)
        content = self._file.read()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            self._file.truncate(whole)
        latest = {}
        for line in content[:whole].splitlines():
            # After a loss of power, or in a folder made by somebody else, a line can be anything: it is
            # ignored, and its file is processed again.
            with suppress(ValueError):
                record = json.loads(line)
                if _is_sound(record) and not self._is_behind_link(record["file"]):
                    latest[record["file"]] = record
        return latest


def _is_sound(record: object) -> bool:
    """Whether a line has the form of a record, names no file outside of the journal's folder, and renames
    only what a batch has written."""
    if not isinstance(record, dict):
        return False
    unfinished = record.get("unfinished", f".{UNFINISHED}")
    if not isinstance(unfinished, str) or PurePath(unfinished).name != unfinished:
        return False
    # The name under which a batch writes before it renames.
    return _is_inside(record.get("file")) and unfinished.startswith(".") and UNFINISHED in unfinished


def is_complete(record: dict) -> bool:
    """Whether a record of a finished file has everything that the report shows."""
    kinds = {"hash": str, "versions": dict, "meshes": list, "left_out": list, "notes": list, "seconds": dict}
    if not all(isinstance(record.get(key), kind) for key, kind in kinds.items()):
        return False
    meshes_complete = all(
        isinstance(mesh, dict) and {"object", "method", "warnings"} <= mesh.keys()
        for mesh in record["meshes"]
    )
    return meshes_complete and {"sinew", "blender"} <= record["versions"].keys()


def _is_inside(path: object) -> bool:
    if not isinstance(path, str) or not path or "\0" in path:
        return False
    pure = PurePath(path)
    # On Windows a path without a drive, but with a root, leads outside, too, and does not count as absolute.
    return not pure.anchor and ".." not in pure.parts


def content_hash(path: Path) -> str | None:
    """Returns the hash of a file's content; None where it cannot be read, which opening the file will
    report."""
    try:
        if not path.is_file():
            return None
        with path.open("rb") as file:
            return hashlib.file_digest(file, "blake2b").hexdigest()[:32]
    except OSError:
        return None


def stamp(path: Path) -> list[int]:
    """Returns the size of a file and the time of its last change, which renaming keeps."""
    status = path.stat()
    return [status.st_size, status.st_mtime_ns]


def _stamp(path: Path) -> list[int] | None:
    try:
        return stamp(path)
    except OSError:
        return None
