# SPDX-License-Identifier: GPL-3.0-or-later
"""Protects the memory of fits and of inverse kinematics, by the C++ tests."""

import os
import subprocess
from pathlib import Path


def test_the_tests_in_cpp_pass():
    program = Path(os.environ["SINEW_EXPERIMENTS"], "future_work_tests")
    subprocess.run([program, "--gtest_brief=1"], check=True)
