# SPDX-License-Identifier: GPL-3.0-or-later
"""Exceptions whose message is one sentence for the user."""

from collections.abc import Iterator
from contextlib import contextmanager


class SinewError(Exception):
    """The message says what is wrong and what to do."""


class WrongUse(SinewError):  # noqa: N818
    """The arguments make no sense; nothing has been done."""


@contextmanager
def about(what: object) -> Iterator[None]:
    """Context whose SinewErrors begin with what they are about."""
    try:
        yield
    except SinewError as error:
        raise SinewError(f"{what}: {error}") from None
