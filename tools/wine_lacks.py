# SPDX-License-Identifier: GPL-3.0-or-later
"""A pytest plugin: skips a test that calls what wine 8 lacks, which would end the process."""

from __future__ import annotations

import pytest
import scipy.linalg


def _logarithm(*_arguments: object, **_options: object) -> None:
    pytest.skip("wine 8 has no logarithms and powers of complex numbers (ucrtbase.dll: carg, cpow)")


# The logarithm of a matrix, by complex numbers. A plugin loads before the tests that import it.
scipy.linalg.logm = _logarithm
