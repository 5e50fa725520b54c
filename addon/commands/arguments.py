# SPDX-License-Identifier: GPL-3.0-or-later
"""Types of arguments that several commands have."""

from __future__ import annotations

import argparse


def count(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"expected at least 1, got {number}")
    return number


def seconds(text: str) -> float:
    number = float(text)
    if not 0 <= number < float("inf"):
        raise argparse.ArgumentTypeError(f"expected 0 or more, got {text}")
    return number
