# SPDX-License-Identifier: GPL-3.0-or-later
"""Random walks of operations, in a Blender with Sinew and in one without, which does the same.

    python tests/blender/walk/walk.py --steps 10000 [--seed 0] [--route both|evaluation|update] [--keep DIR]

A walk is a list of operations (operations/), each with its own random numbers, so that any of them can
be left out. Two processes execute them: one with Sinew, one with the Armature modifiers, with Preserve
Volume where Sinew's method is dq. For methods and stages that Blender lacks, the library computes the shape
from the data of the Blender without Sinew (walk_shapes). After most steps the final points of all meshes,
the data given to renders and the content of the file must be the same; steps without a comparison leave more
to the next one.

A failing walk is reduced to the operations that it needs, and saved as DIR/walk-SEED-ROUTE.py, which repeats
them.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import pickle
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import operations

HERE = Path(__file__).resolve().parent
TOLERANCE = 1e-5
ROUTES = {"evaluation": "fast", "update": "safe"}
# Steps in one file: as many as a failing walk can reasonably be reduced from.
EPISODE = 120
# Time limits in seconds: for steps that hang, and for Blender to start, which a busy machine delays.
LIMIT = 60.0
START_LIMIT = 600.0
# After these, a comparison's copies still show what their originals show: they do not follow changes of an
# original's modifiers and stages.
FOLLOWED = {
    *("frame", "subframe", "play", "pose", "key_pose", "rest_position", "move_vertices", "weights", "update"),
    *(
        "method",
        "parameters",
        "enabled",
        "rebind",
        "heat",
        "leave_small",
        "move_object",
        "compare",
        "arrange_comparison",
    ),
    *("render", "touch", "shape_key_value", "shape_key_points", "save_and_load"),
}
# A setting, the artist's change, and what makes Blender evaluate.
RUNS = (
    (
        "method",
        "stages",
        "enabled",
        "heat",
        "leave_small",
        "rebind",
        "add",
        "scale_rule",
        "undo",
        "save",
        "compare",
    ),
    (
        "weights",
        "move_vertices",
        "edit_mesh",
        "paint_weights",
        "groups",
        "shape_key_points",
        "armature_options",
    ),
    ("frame", "subframe", "render", "update", "play"),
)
RUN_SHARE = 0.06
LOOKS = 0.7
# Files that they leave to be opened without Sinew.
SAVED = {"save": "walk.blend", "save_copy": "copy.blend"}
# After these, Sinew itself chooses how it handles an object, which is known once it has seen it.
LOOKED_AT = {*SAVED, "delete_sinew_modifier", "delete_modifier", "copy_modifiers"}
# What Sinew may report about an object that it switches off.
SENTENCES = (
    "Armature modifier was deleted",
    "removes Sinew's node group again and again",
    "Sinew modifier was deleted",
    "its armature was deleted",
    "was deleted, or is in no collection",
    "is linked from another file",
    "is a simulation",
    "its parent deforms it as well",
)


@dataclass(frozen=True)
class Step:
    """check  whether the sides are compared afterwards
    push   whether an undo step follows, which makes Blender check everything, too
    words  what it chooses, where a script says it (walk_script)
    """

    operation: str
    seed: int
    check: bool
    push: bool = False
    words: tuple[str | int | float, ...] = ()


@dataclass
class Fault:
    """The fault of a walk: a kind, which stays the same while the walk is reduced, and a description."""

    kind: str
    text: str
    step: int


@dataclass
class Outcome:
    seed: int
    route: str
    steps: list[Step]
    fault: Fault | None = None
    said: list[str] = field(default_factory=list)
    idle: set[Step] = field(default_factory=set)
    ran: Counter = field(default_factory=Counter)
    refused: Counter = field(default_factory=Counter)
    compared: int = 0
    by_library: int = 0
    worst: float = 0.0
    copies_follow: bool = False
    unanswered: int = 0
    script: Path | None = None


class EndedError(Exception):
    """A process that crashed or hangs."""


class Side:
    """A Blender in its own process."""

    def __init__(self, role: str, route: str) -> None:
        self.role = role
        self.folder = Path(tempfile.mkdtemp(prefix=f"walk-{role}-"))
        environment = dict(os.environ)
        environment.pop("SINEW_SAFE", None)
        if route == "safe":
            environment["SINEW_SAFE"] = "1"
        self.process = subprocess.Popen(
            [
                sys.executable,
                "-X",
                "faulthandler",
                str(HERE / "walk_child.py"),
                role,
                route,
                str(self.folder),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
        )
        self.hello = None

    def send(self, **request: object) -> None:
        try:
            pickle.dump(request, self.process.stdin, protocol=pickle.HIGHEST_PROTOCOL)
            self.process.stdin.flush()
        except BrokenPipeError:
            raise EndedError(self.last_words()) from None

    def receive(self, limit: float = LIMIT) -> dict:
        import select

        ready, _w, _x = select.select([self.process.stdout], [], [], limit)
        if not ready:
            raise EndedError(f"{self.role}: no answer in {limit:.0f} s")
        try:
            return pickle.load(self.process.stdout)
        except (EOFError, pickle.UnpicklingError):
            raise EndedError(self.last_words()) from None

    def last_words(self) -> str:
        self.process.wait(20)
        path = self.folder / "errors.txt"
        text = path.read_text(errors="replace") if path.exists() else ""
        return f"{self.role}: ended with {self.process.returncode}\n{text[-3000:]}"

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()
        shutil.rmtree(self.folder, ignore_errors=True)


class Pair:
    """Sinew and Blender without it, restarted if one of them ended."""

    def __init__(self, route: str) -> None:
        self.route = route
        self.sides: tuple[Side, Side] | None = None
        self.reader: Side | None = None
        self.blender = ""

    def __enter__(self) -> Pair:
        return self

    def __exit__(self, *_args: object) -> None:
        self.close()

    def close(self) -> None:
        for side in (*(self.sides or ()), *((self.reader,) if self.reader is not None else ())):
            side.close()
        self.sides = self.reader = None

    def read(self, path: Path) -> dict:
        """What a Blender without Sinew shows of a file."""
        if self.reader is None:
            self.reader = Side("blender", ROUTES[self.route])
            self.reader.receive(START_LIMIT)
        self.reader.send(what="open", path=str(path))
        return self.reader.receive()

    def ready(self) -> tuple[Side, Side]:
        if self.sides is None:
            # Without buffering in Python: select does not see what is in a buffer.
            self.sides = (Side("sinew", ROUTES[self.route]), Side("blender", ROUTES[self.route]))
            for side in self.sides:
                self.blender = side.receive(START_LIMIT)["blender"]
        return self.sides


def make_steps(seed: int, count: int, weights: dict[str, float], looks: float = LOOKS) -> list[Step]:
    """Random operations, with runs of operations on one object without a comparison in between.

    looks  after which share of the steps the sides are compared; 1 also leaves out the runs
    """
    numbers = random.Random(seed)
    names: list[tuple[str, bool, bool]] = []
    runs = [[name for name in names if name in weights] for names in RUNS]
    while len(names) < count:
        if all(runs) and looks < 1.0 and numbers.random() < RUN_SHARE:
            names += [(numbers.choice(run), run is runs[-1], False) for run in runs]
        else:
            name = numbers.choices(list(weights), list(weights.values()))[0]
            names.append((name, numbers.random() < looks, numbers.random() < 0.6))
    return [
        Step(name, numbers.randrange(1 << 30), check or name in LOOKED_AT, push)
        for name, check, push in names[:count]
    ]


def request_of(step: Step) -> dict:
    return {"what": "step", **dataclasses.asdict(step)}


def walk(pair: Pair, seed: int, steps: Sequence[Step]) -> Outcome:
    outcome = Outcome(seed, pair.route, list(steps))
    at = -1
    try:
        sinew, blender = pair.ready()
        sinew.send(what="start")
        blender.send(what="start")
        outcome.fault = compare(outcome, -1, sinew.receive(), blender.receive(), blender)
        claims = {}
        is_ahead = False
        for at, step in enumerate(steps):
            if outcome.fault is not None:
                break
            if not is_ahead:
                sinew.send(**request_of(step))
            ours = sinew.receive()
            # Both sides work at the same time.
            is_ahead = at + 1 < len(steps) and step.operation not in SAVED
            if is_ahead:
                sinew.send(**request_of(steps[at + 1]))
            blender.send(**request_of(step), claims_before=claims, claims_after=ours["claims"])
            theirs = blender.receive()
            claims = ours["claims"]
            outcome.said.append(ours["said"])
            outcome.idle |= {step} if ours["outcome"] == "nothing" else set()
            outcome.copies_follow &= step.operation in FOLLOWED
            outcome.copies_follow |= step.operation == "compare" and ours["outcome"] == "done"
            outcome.ran[step.operation] += ours["outcome"] == "done"
            outcome.refused[step.operation] += ours["outcome"] in ("refused", "failed")
            outcome.fault = compare(outcome, at, ours, theirs, blender)
            if outcome.fault is None and step.operation in SAVED and ours["outcome"] == "done":
                name = SAVED[step.operation]
                saved = pair.read(sinew.folder / name)
                outcome.fault = compare_saved(outcome, at, saved, ours, theirs)
                if outcome.fault is not None:
                    # What Blender itself loads differently from what it saved: a driver's value whose target
                    # is missing, and bones in edit mode.
                    loaded = {**theirs, "shapes": pair.read(blender.folder / name)["shapes"]}
                    outcome.fault = compare_saved(outcome, at, saved, ours, loaded)
            if outcome.fault is not None and is_ahead:
                with suppress(EndedError):
                    sinew.receive()
    except EndedError as ended:
        who, _colon, _rest = str(ended).partition(":")
        outcome.fault = Fault(f"crash of {who}", str(ended), at)
        pair.close()
    return outcome


def compare(outcome: Outcome, at: int, ours: dict, theirs: dict, blender: Side) -> Fault | None:
    """The differences between the two sides after a step."""
    fault = compare_words(at, ours, theirs)
    if fault is not None or "shapes" not in ours:
        return fault
    fault = compare_files(at, ours, theirs)
    if fault is not None:
        return fault
    outcome.unanswered += ours["unanswered"]
    skipped = {*ours["skipped"], *theirs["skipped"]}
    return (
        compare_shapes(outcome, at, ours, theirs, skipped)
        or compare_renders(outcome, at, ours, theirs, skipped)
        or compare_copies(outcome, at, ours, theirs, skipped, blender)
    )


def exception_of(problems: list[str], at: int) -> Fault:
    """The name of the last exception, without parts that differ between runs."""
    text = "\n".join(problems)
    raised = re.findall(r"^(\w+(?:Error|Exception|Warning)\b.*)$", text, re.MULTILINE) or [
        text.splitlines()[-1]
    ]
    kind = re.sub(r"[\"'].*|\d+", "…", raised[-1])[:60]
    where = re.findall(r'File "[^"]*/(\w+\.py)", line (\d+)', text)
    place = f" at {where[-1][0]}:{where[-1][1]}" if where else ""
    return Fault(f"exception: {kind}", f"{raised[-1]}{place}\n{text}", at)


def compare_words(at: int, ours: dict, theirs: dict) -> Fault | None:
    """What the step raised, returned, reported and left behind."""
    if ours["problems"]:
        return exception_of(ours["problems"], at)
    if ours.get("outcome") != theirs.get("outcome"):
        return Fault(
            "operation",
            f"with Sinew {ours['outcome']} ({ours['said']}), without {theirs['outcome']} ({theirs['said']})",
            at,
        )
    for name, claim in ours.get("claims", {}).items():
        error = claim["error"]
        if error and not any(sentence in error for sentence in SENTENCES):
            return Fault("error", f"{name}: {error}", at)
    if ours.get("left over"):
        return Fault("left over", ", ".join(ours["left over"]), at)
    return None


def compare_files(at: int, ours: dict, theirs: dict) -> Fault | None:
    """Compares the content of the open files."""
    if theirs["wrong"]:
        return Fault("settings", "; ".join(theirs["wrong"]), at)
    different = differing(ours["state"], theirs["state"])
    if different:
        return Fault("state", "; ".join(different), at)
    if ours["shapes"].keys() != theirs["shapes"].keys():
        only = ours["shapes"].keys() ^ theirs["shapes"].keys()
        return Fault("visibility", f"shown on one side only: {', '.join(sorted(only))}", at)
    return None


def compare_shapes(outcome: Outcome, at: int, ours: dict, theirs: dict, skipped: set[str]) -> Fault | None:
    for name, (points, matrix) in ours["shapes"].items():
        other_points, other_matrix = theirs["shapes"][name]
        if not np.allclose(matrix, other_matrix, atol=1e-5):
            return Fault("place", f"{name} is elsewhere", at)
        if name not in skipped:
            fault = differ(outcome, at, name, points, other_points)
            if fault is not None:
                return fault
        elif not np.isfinite(points).all():
            return Fault("shape", f"{name} has points that are not finite", at)
        elif name in theirs.get("expected", {}) and name not in ours["skipped"]:
            outcome.by_library += 1
            fault = differ(outcome, at, name, points, theirs["expected"][name])
            if fault is not None:
                return fault
    return None


def compare_renders(outcome: Outcome, at: int, ours: dict, theirs: dict, skipped: set[str]) -> Fault | None:
    for name, points in ours.get("rendered", {}).items():
        other = theirs["rendered"].get(name)
        if name.partition(" in the render")[0] in skipped:
            other = theirs["rendered by library"].get(name)
            if other is None:
                continue
            outcome.by_library += 1
        if other is None:
            return Fault("render", f"{name} only with Sinew", at)
        fault = differ(outcome, at, name, points, other)
        if fault is not None:
            return Fault("render", fault.text, at)
    return None


def compare_copies(
    outcome: Outcome, at: int, ours: dict, theirs: dict, skipped: set[str], blender: Side
) -> Fault | None:
    """Copies of the comparison in the viewport, each compared with the Armature modifier's shape for its
    method."""
    if not ours.get("copies") or not outcome.copies_follow:
        return None
    wanted = [key for key in ours["copies"] if key[0] not in skipped or key[0] in theirs["shapes"]]
    blender.send(what="shapes by", copies=wanted)
    for key, other in blender.receive().items():
        points, other = ours["copies"][key].astype(np.float64), other.astype(np.float64)
        if key[0] in skipped and key[0] in ours["skipped"]:
            continue
        if points.shape == other.shape and len(points):
            # Shown next to the original.
            points = points - (points - other).mean(axis=0)
        fault = differ(outcome, at, f"the copy of {key[0]} by {key[1]}", points, other)
        if fault is not None:
            return Fault("comparison", fault.text, at)
    return None


def compare_saved(outcome: Outcome, at: int, saved: dict, ours: dict, theirs: dict) -> Fault | None:
    """The differences between a file that Sinew's side saved, opened without Sinew, and the other side."""
    if "shapes" not in ours:
        return None
    skipped = {*ours["skipped"], *theirs["skipped"]}
    for name, (other, _matrix) in theirs["shapes"].items():
        if name in skipped:
            continue
        if name not in saved["shapes"]:
            return Fault("saved file", f"{name} is not shown", at)
        fault = differ(outcome, at, name, saved["shapes"][name][0], other)
        if fault is not None:
            return Fault("saved file", f"without Sinew, {fault.text}", at)
    return None


def differ(outcome: Outcome, at: int, name: str, points: np.ndarray, other: np.ndarray) -> Fault | None:
    if points.shape != other.shape:
        return Fault("shape", f"{name} has {len(points)} vertices, without Sinew {len(other)}", at)
    if not len(points):
        return None
    diagonal = float(np.linalg.norm(np.ptp(other, axis=0))) or 1.0
    difference = np.abs(points - other).max(axis=1)
    error = float(difference.max())
    outcome.compared += 1
    if not error <= TOLERANCE * diagonal:
        many = int((~(difference <= TOLERANCE * diagonal)).sum())
        return Fault("shape", f"{name}: {many} of {len(points)} vertices differ by up to {error:.3g}", at)
    outcome.worst = max(outcome.worst, error / diagonal)
    return None


def differing(ours: dict, theirs: dict) -> list[str]:
    found = []
    for key in [*theirs, *(key for key in ours if key not in theirs)]:
        a, b = ours.get(key), theirs.get(key)
        if isinstance(a, dict) and isinstance(b, dict):
            found += [f"{key}, {line}" for line in differing(a, b)]
        elif a != b:
            found.append(f"{key}: with Sinew {a}, without {b}")
    return found


# --- Reducing a failing walk


def shrink(pair: Pair, outcome: Outcome, seconds: float = 120.0) -> Outcome:
    """The same fault with the fewest operations: leaves out parts, larger ones first (ddmin)."""
    until = time.monotonic() + seconds
    best = outcome
    steps = list(outcome.steps[: outcome.fault.step + 1])

    def fails(some: list[Step]) -> Outcome | None:
        if time.monotonic() > until:
            return None
        tried = walk(pair, outcome.seed, some)
        return tried if tried.fault is not None and tried.fault.kind == outcome.fault.kind else None

    done = [step for step in steps if step not in outcome.idle]
    again = fails(done)
    if again is not None:
        best, steps = again, done[: again.fault.step + 1]
    size = max(1, len(steps) // 2)
    while size >= 1:
        start, removed = 0, False
        while start < len(steps):
            fewer = steps[:start] + steps[start + size :]
            again = fails(fewer) if fewer else None
            if again is not None:
                best, removed = again, True
                steps = fewer[: again.fault.step + 1]
            else:
                start += size
        if size == 1 and not removed:
            break
        size = size // 2 if size > 1 else 1
    # A comparison is only needed at the end, and undo needs few steps.
    for index in range(len(steps) - 1):
        for unneeded in ("check", "push"):
            if index < len(steps) - 1 and getattr(steps[index], unneeded):
                silent = [*steps]
                silent[index] = dataclasses.replace(steps[index], **{unneeded: False})
                again = fails(silent)
                if again is not None:
                    best, steps = again, silent[: again.fault.step + 1]
    return best


SCRIPT = '''"""{title}

{words}

Blender {blender}. Does the walk again: python THIS_FILE
"""

import sys

sys.path.insert(0, {here!r})
import walk

STEPS = [
{steps}
]

if __name__ == "__main__":
    sys.exit(walk.replay(STEPS, {route!r}))
'''


def save(pair: Pair, outcome: Outcome, keep: Path) -> Path:
    keep.mkdir(parents=True, exist_ok=True)
    path = keep / f"walk-{outcome.seed}-{outcome.route}.py"
    said = [*outcome.said, *([""] * (len(outcome.steps) - len(outcome.said)))]
    lines = [
        f"    walk.Step{dataclasses.astuple(step)},  # {text}"
        for step, text in zip(outcome.steps, said, strict=True)
    ]
    path.write_text(
        SCRIPT.format(
            title=f"{outcome.fault.kind}, by route {outcome.route}.",
            words=outcome.fault.text.replace("\\", "/").replace('"""', "'''"),
            blender=pair.blender,
            here=str(HERE),
            steps="\n".join(lines),
            route=outcome.route,
        )
    )
    return path


def replay(steps: Sequence[Step], route: str) -> int:
    """Executes the steps, and prints each of them and its faults."""
    with Pair(route) as pair:
        outcome = walk(pair, 0, steps)
    for number, text in enumerate(outcome.said):
        print(f"{number + 1:4}  {text}")
    if outcome.fault is None:
        print("nothing goes wrong")
        return 0
    print(f"{outcome.fault.kind}: {outcome.fault.text}")
    return 1


# --- Many walks


def operation_weights() -> dict[str, float]:
    """The relative frequency of each operation, by name."""
    text = "".join((HERE / "operations" / f"{part}.py").read_text() for part in operations.PARTS)
    found = re.findall(r"^@operation\(([\d.]+)\)\ndef (\w+)\(", text, re.MULTILINE)
    return {name: float(weight) for weight, name in found}


def run(
    first: int,
    steps: int,
    keep: Path,
    routes: Sequence[str] = tuple(ROUTES),
    without: Sequence[str] = (),
    episode: int = EPISODE,
    seconds: float = 120.0,
    looks: float = LOOKS,
    say: Callable[[str], None] = print,
) -> list[Outcome]:
    """Walks of `steps` operations in total by each route; failing ones are reduced and saved in `keep`.

    without  operations that are left out
    seconds  for reducing a walk
    looks    after which share of the steps the sides are compared
    """
    weights = {name: weight for name, weight in operation_weights().items() if name not in without}
    outcomes = []
    with ExitStack() as stack:
        pairs = {route: stack.enter_context(Pair(route)) for route in routes}
        for seed in range(first, first + -(-steps // episode)):
            count = min(episode, steps - (seed - first) * episode)
            for route, pair in pairs.items():
                outcome = walk(pair, seed, make_steps(seed, count, weights, looks))
                outcomes.append(outcome)
                if outcome.fault is not None:
                    words = f"{outcome.fault.kind}: {outcome.fault.text[:600]}"
                    say(f"walk {seed} by route {route} fails: {words}")
                    small = shrink(pair, outcome, seconds)
                    outcome.script = save(pair, small, keep)
                    for text in small.said:
                        say(f"    {text}")
                    say(f"  {small.fault.kind}: {small.fault.text[:600]}")
                    say(f"  {len(small.said)} operations, saved as {outcome.script}")
                    # Discards whatever the fault left behind in the process.
                    pair.close()
    return outcomes


def summarise(outcomes: Sequence[Outcome], seconds: float) -> str:
    ran: Counter = Counter()
    for outcome in outcomes:
        ran += outcome.ran
    done = sum(len(o.said) for o in outcomes)
    lines = []
    for route in dict.fromkeys(o.route for o in outcomes):
        own = [o for o in outcomes if o.route == route]
        worst, by_library = max((o.worst for o in own), default=0.0), sum(o.by_library for o in own)
        lines.append(
            f"{route}: {sum(len(o.said) for o in own)} steps in {len(own)} walks, "
            f"{sum(o.fault is not None for o in own)} failed; {sum(o.compared for o in own)} shapes "
            f"compared, {by_library} of them with the library's, worst {worst:.1e} of the diagonal; "
            f"{sum(o.unanswered for o in own)} requests within Blender's evaluation not answered"
        )
    kinds = Counter(o.fault.kind for o in outcomes if o.fault is not None)
    lines += [f"{count} x {kind}" for kind, count in kinds.most_common()]
    lines.append(f"{done} steps in {seconds:.0f} s, {done / max(seconds, 1e-9):.0f} a second")
    lines.append("how often each operation ran: " + ", ".join(f"{n} {c}" for n, c in ran.most_common()))
    refused = sum((o.refused for o in outcomes), Counter())
    if refused:
        lines.append("refused on both sides: " + ", ".join(f"{n} {c}" for n, c in refused.most_common()))
    never = [name for name, weight in operation_weights().items() if weight and not ran[name]]
    if never:
        lines.append(f"never: {', '.join(never)}")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=2000, help="operations by each route")
    parser.add_argument("--seed", type=int, default=0, help="of the first walk")
    parser.add_argument("--route", choices=("both", *ROUTES), default="both")
    parser.add_argument("--episode", type=int, default=EPISODE, help="operations in one file")
    parser.add_argument("--without", default="", help="operations to leave out, separated by commas")
    parser.add_argument("--shrink", type=float, default=120.0, help="seconds for making a failing walk small")
    parser.add_argument(
        "--looks", type=float, default=LOOKS, help="after which share of the steps to compare"
    )
    parser.add_argument("--keep", type=Path, default=Path("build/walk"), help="folder for walks that fail")
    args = parser.parse_args()
    started = time.monotonic()
    routes = tuple(ROUTES) if args.route == "both" else (args.route,)
    without = tuple(name for name in args.without.split(",") if name)
    unknown = sorted(set(without) - set(operation_weights()))
    if unknown:
        parser.error(f"no operation is called {', '.join(unknown)}")
    outcomes = run(
        args.seed,
        args.steps,
        args.keep,
        routes,
        without,
        args.episode,
        args.shrink,
        args.looks,
        lambda text: print(text, flush=True),
    )
    print(summarise(outcomes, time.monotonic() - started))
    return int(any(o.fault is not None for o in outcomes))


if __name__ == "__main__":
    sys.exit(main())
