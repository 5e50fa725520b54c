# SPDX-License-Identifier: GPL-3.0-or-later
"""The golden set's reader, and what makes the shaders' buffer of bones, are imported by their names."""

import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path += [str(REPOSITORY / "tests" / "golden"), str(REPOSITORY / "shaders")]
