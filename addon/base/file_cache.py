# SPDX-License-Identifier: GPL-3.0-or-later
"""A folder of arrays, by the hash of what they were made from. Any number of processes may share it."""

import hashlib
import io
import os
import time
import uuid
from contextlib import suppress
from pathlib import Path

import numpy as np

MAGIC = b"SINEW 1\n"
SUFFIX = ".sinew"
_DIGEST_BYTES = 16
# A killed process leaves files that it had not renamed yet; older ones are removed.
_SECONDS_OF_UNFINISHED = 3600.0


class FileCache:
    """Entries that cannot be read or written count as missing: nothing here raises OSError.

    folder  made where it is missing
    limit   bytes; beyond it, the least recently used entries are removed
    """

    def __init__(self, folder: Path, limit: int) -> None:
        self.folder = folder
        self.limit = limit

    def load(self, key: str) -> np.ndarray | None:
        """Returns None where there is no entry; a damaged one is removed."""
        path = self._path(key)
        try:
            content = path.read_bytes()
        except OSError:
            return None
        array = _unpack(content)
        with suppress(OSError):
            if array is None:
                path.unlink(missing_ok=True)
            else:
                os.utime(path)
        return array

    def store(self, key: str, array: np.ndarray) -> None:
        content = _pack(array)
        if len(content) > self.limit:
            return
        # Written beside it and renamed, so that others find a whole file or none.
        unfinished = self.folder / f".{uuid.uuid4().hex}{SUFFIX}"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            unfinished.write_bytes(content)
            unfinished.replace(self._path(key))
        except OSError:
            with suppress(OSError):
                unfinished.unlink(missing_ok=True)
        self._keep_limit()

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}{SUFFIX}"

    def _keep_limit(self) -> None:
        files = []
        with suppress(OSError):
            for entry in os.scandir(self.folder):
                # Another process may remove it meanwhile.
                with suppress(OSError):
                    if entry.name.endswith(SUFFIX):
                        files.append((entry.stat().st_mtime, entry.stat().st_size, Path(entry.path)))
        total, now = sum(size for _time, size, _path in files), time.time()
        for changed, size, path in sorted(files):
            is_unfinished = path.name.startswith(".")
            if is_unfinished and now - changed < _SECONDS_OF_UNFINISHED:
                continue
            if is_unfinished or total > self.limit:
                with suppress(OSError):
                    path.unlink(missing_ok=True)
                total -= size


def _pack(array: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array(file, np.ascontiguousarray(array), allow_pickle=False)
    payload = file.getvalue()
    return MAGIC + _digest(payload) + payload


def _unpack(content: bytes) -> np.ndarray | None:
    """Returns None for anything that _pack() has not made."""
    start = len(MAGIC) + _DIGEST_BYTES
    payload = content[start:]
    if content[:start] != MAGIC + _digest(payload):
        return None
    try:
        return np.lib.format.read_array(io.BytesIO(payload), allow_pickle=False)
    except ValueError:
        return None


def _digest(payload: bytes) -> bytes:
    return hashlib.blake2b(payload, digest_size=_DIGEST_BYTES).digest()
