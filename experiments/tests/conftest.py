# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of experiments/, beside the product's own, some of whose modules they share. SINEW_EXPERIMENTS is the
folder of the built programs; without it these tests are skipped."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = os.environ.get("SINEW_EXPERIMENTS")
if PROGRAMS is None:
    collect_ignore_glob = ["test_*.py"]
sys.path += [PROGRAMS or "", str(ROOT / "tests" / "support")]
