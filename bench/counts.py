# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the instructions of each kernel, counted by callgrind, with those in bench/counts.json.

They do not depend on the machine or on its load, only on the compiler. The kernels are those for AVX2, as
callgrind does not support AVX-512. Exits with 1 if a kernel takes 5 % more.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

BASELINE = Path(__file__).parent / "counts.json"
ALLOWED = 0.05


def compiler_of(program: Path) -> str:
    """Name and version of the compiler that CMake found for this build."""
    cache = (program.parents[1] / "CMakeCache.txt").read_text()
    compiler = re.search(r"^CMAKE_CXX_COMPILER:\w+=(.*)$", cache, re.MULTILINE).group(1)
    first = subprocess.run([compiler, "--version"], check=True, capture_output=True, text=True).stdout
    # The first word is the program's name on this machine, c++ or g++.
    return first.splitlines()[0].split(maxsplit=1)[1]


def count(program: Path) -> dict[str, int]:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "callgrind.out"
        options = ["--tool=callgrind", "--collect-atstart=no", f"--callgrind-out-file={out}"]
        done = subprocess.run(["valgrind", *options, program], capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"callgrind failed:\n{done.stderr}")
        counts = {}
        for path in Path(folder).glob("callgrind.out.*"):
            text = path.read_text()
            name = re.search(r"^desc: Trigger: Client Request: (.*)$", text, re.MULTILINE)
            if name:
                total = re.search(r"^(?:summary|totals): (\d+)", text, re.MULTILINE)
                counts[name.group(1)] = int(total.group(1))
        return dict(sorted(counts.items()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--accept", action="store_true", help="make these the counts to compare with")
    arguments = parser.parse_args()
    compiler = compiler_of(arguments.program)
    print(f"== instructions (callgrind, AVX2 kernels) ==\ncompiler: {compiler}\n")
    counts = count(arguments.program)
    if arguments.accept:
        BASELINE.write_text(json.dumps({"compiler": compiler, "instructions": counts}, indent=1) + "\n")
        print(f"{BASELINE}: written")
        return
    baseline = json.loads(BASELINE.read_text())
    known = baseline["instructions"] if baseline["compiler"] == compiler else {}
    if not known:
        print(f"No counts to compare with for this compiler; there are some for {baseline['compiler']}.\n")
    heavier = []
    for name, instructions in counts.items():
        text = f"{name:27}{instructions:>14,}"
        if name in known:
            change = instructions / known[name] - 1
            text += f"{change:+9.1%}"
            if change > ALLOWED:
                heavier.append(f"{name} by {change:.1%}")
        elif known:
            text += "      new"
        print(text)
    if heavier:
        sys.exit(f"\nHeavier than bench/counts.json by more than {ALLOWED:.0%}: {', '.join(heavier)}.")


if __name__ == "__main__":
    main()
