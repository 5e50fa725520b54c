# SPDX-License-Identifier: GPL-3.0-or-later
"""Parses lists of frames."""

from .errors import WrongUse

# Blender's limits; it clamps frames beyond them without a message.
FIRST_FRAME, LAST_FRAME = -1_048_574, 1_048_574


def parse_frames(text: str) -> list[float]:
    """Returns the frames of a text such as "1,12,40-48": single frames, which may be fractions, and ranges,
    in the order given.

    Whole frames are returned as int. Raises WrongUse for anything else.
    """
    frames: list[float] = []
    for part in text.split(","):
        part = part.strip()
        try:
            # The first character can be a minus sign, so a range's dash is searched after it.
            dash = part.find("-", 1)
            if dash > 0:
                first: float = int(part[:dash])
                last: float = int(part[dash + 1 :])
            else:
                first = last = float(part)
        except ValueError:
            raise WrongUse(f"frames: expected frames such as 1,12,40-48, got {text!r}") from None
        if last < first:
            raise WrongUse(f"frames: {part!r} runs backwards; write {last}-{first}")
        if not FIRST_FRAME <= first <= last <= LAST_FRAME:
            raise WrongUse(f"frames: expected {FIRST_FRAME} to {LAST_FRAME}, got {part!r}")
        if isinstance(first, int):
            frames.extend(range(first, int(last) + 1))
        else:
            frames.append(int(first) if first.is_integer() else first)
    return frames
