# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects memory, handlers, data and thread states from growing with frames; `./dev soak` runs more."""

from __future__ import annotations

import soak


def test_nothing_grows():
    assert soak.run(frames=300, threads=60) == []
