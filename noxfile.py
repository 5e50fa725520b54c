# SPDX-License-Identifier: GPL-3.0-or-later
"""Environments and jobs as sessions of nox, and the commands of ./dev: docs/dev.md."""

from __future__ import annotations

import argparse
import functools
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import nox
from filelock import FileLock

sys.path.append(str(Path(__file__).parent / "tools"))
from blenders import BLENDERS, NEWEST, NUMPY_1, OLDEST, SHORT_TERM
from lock import tell_uv_of_the_registry
from platforms import PLATFORMS, not_tested

ROOT = Path(__file__).resolve().parent
os.chdir(ROOT)
VERSION = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
PACKAGE = ROOT / f"dist/sinew-{VERSION}.zip"

WHEEL_PYTHONS = ("3.11", "3.13", "3.14")
WHEEL_SOURCES = ("CMakeLists.txt", "pyproject.toml", "requirements/build.txt", "native")
# Packages that Sinew is compared with, not locked; one that does not install is left out. Of libigl the last
# release with direct delta mush in Python.
BENCH_PACKAGES, BENCH_PEERS = ("numpy>=2", "matplotlib>=3.8"), ("libigl==2.5.1", "usd-core>=24")
# What `./dev test --all` runs of the other commands, in a folder: each must work in a fresh checkout.
SMALL = (
    "help; lint; site --out {0}/site; stub --out {0}/stub; package; wheel; "
    "lock --out {0}/requirements build; release --dry-run minor; demo; golden {0}/golden; "
    "pictures --only wrist --out {0}/pictures; report --quick --out {0}/report; "
    "bench --quick --kernels --name=small"
)
# Debian's packages, with the programs that tests of pages need; of each row any.
BROWSERS = {"chromium": "chromium chromium-browser google-chrome", "chromium-driver": "chromedriver"}
BROWSERS |= {"firefox-esr": "firefox-esr firefox", "xvfb": "Xvfb"}
PROCESSORS = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
LOGS = ROOT / "build/test-logs"
# A Blender that hangs must not prevent the others' results from being shown.
LIMIT = "timeout --foreground --kill-after=20 3600 " if sys.platform == "linux" else ""
# Set by ./dev test for its jobs.
IS_ALL, IS_QUICK = "SINEW_TEST_ALL" in os.environ, "SINEW_TEST_QUICK" in os.environ

nox.options.default_venv_backend = "uv"
nox.options.reuse_venv = "yes"
nox.options.envdir = ".venvs"
nox.options.allow_parallel = True
nox.options.error_on_missing_interpreters = True

# Debian's Python comes first, and pyenv's own: its programs on PATH fail for what is not switched on.
PYENV = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
SEARCHED = ["/usr/bin", *map(str, sorted(PYENV.glob("versions/3.1[1-9]*/bin"), reverse=True))]
SEARCHED += [folder for folder in os.environ["PATH"].split(":") if not folder.startswith(f"{PYENV}/")]
os.environ.setdefault("UV_PYTHON_SEARCH_PATH", ":".join(SEARCHED))
os.environ["PATH"] = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
# Pythons name the compiler differently; under a single name, ccache recognises what it has compiled.
os.environ.setdefault("CXX", "c++")
# The sloppiness has it also cache files that are compiled with a precompiled header.
os.environ |= {"CCACHE_DIR": str(ROOT / "build/ccache"), "CCACHE_BASEDIR": str(ROOT), "CCACHE_NOHASHDIR": "1"}
os.environ |= {"CCACHE_SLOPPINESS": "pch_defines,time_macros"}
os.environ |= {"CMAKE_CXX_COMPILER_LAUNCHER": "ccache"} if shutil.which("ccache") else {}
# Python stores compiled files of Blender and of packages: this halves start-up times.
os.environ["PYTHONDONTWRITEBYTECODE"] = ""


def say(text: str) -> None:
    print(f"dev: {text}", file=sys.stderr, flush=True)


def call(line: str, *others: object, must: bool = False) -> int:
    """Runs a program: a line, and further words."""
    status = subprocess.run([*line.split(), *map(str, others)], check=False).returncode
    return sys.exit(status) if must and status else status


def output_of(line: str, *others: object) -> str:
    done = subprocess.run([*line.split(), *map(str, others)], stdout=subprocess.PIPE, text=True, check=False)
    return done.stdout.strip() if not done.returncode else sys.exit(done.returncode)


@functools.cache
def python_of(version: str) -> str | None:
    """The Python of this machine that has this version."""
    if version == f"{sys.version_info.major}.{sys.version_info.minor}":
        return f"{sys.base_prefix}/bin/python{version}"
    words = ["uv", "python", "find", "--system", "--no-python-downloads", version]
    return subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip() or None


# .venv has the newest long-term release for the Python that runs this, whose headers the system has.
EVERYDAY_PYTHON = next((v for v in ("3.11", "3.13") if sys.version.startswith(v)), None)
EVERYDAY_PYTHON = EVERYDAY_PYTHON or ("3.11" if python_of("3.11") and not python_of("3.13") else "3.13")
EVERYDAY = {"3.11": "4.5", "3.13": "5.2"}[EVERYDAY_PYTHON]


# --- Environments


def environment_of(name: str) -> Path:
    """The folder that nox gives an environment."""
    return Path(".venvs", name.replace(".", "-"))


def python_in(name: str) -> str:
    return f"{environment_of(name)}/bin/python"


def wheel_of(version: str) -> Path | None:
    """The library's wheel that was built here for a Python."""
    tag, system = "cp" + version.replace(".", ""), {"darwin": "macosx"}.get(sys.platform, sys.platform)
    return next(Path("dist/wheels").glob(f"sinew_skinning-{VERSION}-{tag}-{tag}-{system}_*.whl"), None)


def is_current(wheel: Path | None) -> bool:
    found = [path for name in WHEEL_SOURCES for path in (Path(name), *Path(name).rglob("*"))]
    changed = max(path.stat().st_mtime for path in found if "__pycache__" not in path.parts)
    return wheel is not None and wheel.stat().st_mtime > changed


def sync(session: nox.Session, locks: str, *here: str) -> None:
    """Has an environment contain what locks have, and this of the checkout, and nothing else."""
    words = [f"requirements/{lock}.txt" for lock in locks.split()] + ["--require-hashes"] * (not here)
    if here:
        words.append(str(Path(session.virtualenv.location, "here.txt")))
        Path(words[-1]).write_text("\n".join(here) + "\n", encoding="utf-8")
    built = "--build-constraints", "requirements/wheels.txt"
    session.run_install("uv", "pip", "sync", "--quiet", *built, *words)


# The Pythons here that the extension's zip has wheels for.
FOUND = [version for version in WHEEL_PYTHONS if python_of(version)]
for _version in ("3.11", "3.12", "3.13", "3.14"):
    # After the first one, as the compiler's cache then has the library.
    _first = [f"wheel-{version}" for version in FOUND[:1] if version != _version]

    @nox.session(name=f"wheel-{_version}", python=python_of(_version) or _version, requires=_first)
    def make_wheel(session: nox.Session, version: str = _version) -> None:
        """The library's wheel for a Python, built where sources are newer."""
        sync(session, "build")
        if not is_current(wheel_of(version)):
            # CMake remembers the folder that a whole Blender's wheel takes the library from.
            env = {"SKBUILD_CMAKE_DEFINE": f"SINEW_BUILT={os.environ.get('SINEW_BUILT', '')}"}
            words, start = "uv build --wheel --no-build-isolation --out-dir dist/wheels", time.time()
            session.run_install(*words.split(), env=env, silent=True)
            # What changes meanwhile is newer.
            os.utime(wheel_of(version), (start, start))


# The newest bpy of the registry and its Python, for ./dev test --blender NEWEST: no lock need name it.
UNLOCKED, UNLOCKED_PYTHON = os.environ.get("SINEW_UNLOCKED", " ").split(" ")
if UNLOCKED:
    BLENDERS[UNLOCKED] = UNLOCKED_PYTHON
OTHERS = ("cross", "lint", "shaders")
# The locks of a Blender: its own wheel, and what that needs with the tests.
LOCKS = {bpy: f"{'tests-numpy-1' if bpy in NUMPY_1 else 'tests'} bpy-{bpy}" for bpy in BLENDERS}
LOCKS |= {UNLOCKED: "tests"} if UNLOCKED else {}
# Name, locks, Python, whether it has the library, whether the extension. bpy contains Blender's program for
# zips; what makes the site and the stub imports the library.
ENVIRONMENTS = [(f"bpy-{bpy}", LOCKS[bpy], python, True, True) for bpy, python in BLENDERS.items()]
ENVIRONMENTS += [("bundle", LOCKS[EVERYDAY], EVERYDAY_PYTHON, False, False)]
ENVIRONMENTS += [("site", "site", EVERYDAY_PYTHON, True, False)]
ENVIRONMENTS += [("browsers", "browsers three", EVERYDAY_PYTHON, False, False)]
ENVIRONMENTS += [("players", "players three babylon", EVERYDAY_PYTHON, False, False)]
ENVIRONMENTS += [(name, name, EVERYDAY_PYTHON, False, False) for name in OTHERS]
for _name, _locks, _version, _library, _addon in ENVIRONMENTS:
    _wheel = [f"wheel-{_version}"] * _library

    @nox.session(name=_name, python=python_of(_version) or _version, requires=_wheel)
    def environment(session: nox.Session, its: tuple = (_name, _locks, _version, _library, _addon)) -> None:
        """What locks have, and of the checkout what belongs to it."""
        name, locks, version, library, addon = its
        unlocked = [f"bpy=={UNLOCKED}", "bpy-vrm-format"] * (name == f"bpy-{UNLOCKED}")
        sync(session, locks, *[f"./{wheel_of(version)}"] * library, *["-e ./addon"] * addon, *unlocked)
        # So documents call them.
        for link in (Path(".venvs", name), *[Path(".venv")] * (name == f"bpy-{EVERYDAY}")):
            if link != environment_of(name) and not link.is_symlink():
                shutil.rmtree(link, ignore_errors=True)
                link.symlink_to(os.path.relpath(environment_of(name), link.parent))


@nox.session(name="bench", python=python_of(EVERYDAY_PYTHON), requires=[f"wheel-{EVERYDAY_PYTHON}"])
def bench_environment(session: nox.Session) -> None:
    """What Sinew is compared with."""
    install = "uv", "pip", "install", "--quiet"
    session.run_install(*install, *BENCH_PACKAGES, f"./{wheel_of(EVERYDAY_PYTHON)}")
    for peer in BENCH_PEERS:
        session.run_install(*install, peer, success_codes=range(3))


@nox.session(python=False)
def fetch(session: nox.Session) -> None:
    """Has uv keep what environments to make will have, while the first wheel is built."""
    for name, locks, version, library, _addon in ENVIRONMENTS:
        if library and name in session.posargs and not environment_of(name).exists():
            words = f"uv pip install --quiet --require-hashes --python {python_of(version)} --target".split()
            with tempfile.TemporaryDirectory(dir="build") as place:
                needed = [word for lock in locks.split() for word in ("-r", f"requirements/{lock}.txt")]
                session.run(*words, place, *needed)


@nox.session(python=False, requires=[f"wheel-{version}" for version in FOUND])
def package(session: nox.Session) -> None:
    """The extension's zip with a wheel for each Python, and its bill of materials."""
    versions = list(FOUND)
    if full := os.environ.get("SINEW_FULL_BLENDER"):
        # It has its own Python in its own system, so its wheel is built there, but for the library.
        words = "shell", "python3", "-c", "import sys; print('%d.%d' % sys.version_info[:2])"
        version = session.run(full, *words, silent=True, stderr=subprocess.DEVNULL).split()[-1]
        if version not in versions:
            built = ROOT.glob("build/wheel-*/native/sinew/libsinew.so")
            library = max(built, key=os.path.getmtime, default=None)
            # Without the folder of a build, it builds the library, too.
            words = "shell", "env", f"SINEW_BUILT={library.parents[2] if library else ''}"
            words += "./dev", "wheel", "python3"
            session.run(full, *words, silent=True)
            versions.append(version)
    wheels = [str(wheel_of(version)) for version in versions]
    session.run(sys.executable, "-I", "tools/package.py", *wheels)
    session.run(sys.executable, "-I", "tools/sbom.py", str(PACKAGE))


def build(session: nox.Session, preset: str, *targets: str) -> None:
    session.run("cmake", "--preset", preset, *MODULE.get(preset, ()), silent=True)
    chosen = ("--target", *targets) if targets else ()
    session.run("cmake", "--build", "--preset", preset, *chosen, silent=True)


# What a build of a Python module takes from the environment of the wheel.
_WHEEL, _SITE = environment_of(f"wheel-{EVERYDAY_PYTHON}"), f"lib/python{EVERYDAY_PYTHON}/site-packages"
MODULE = {
    "experiments": (
        f"-DPython_EXECUTABLE={ROOT / _WHEEL}/bin/python",
        f"-Dpybind11_ROOT={ROOT / _WHEEL / _SITE}/pybind11",
    )
}
for _preset in ("bench", "experiments"):

    @nox.session(name=f"{_preset}-programs", python=False, requires=[f"wheel-{EVERYDAY_PYTHON}"])
    def programs(session: nox.Session, preset: str = _preset) -> None:
        """What CMake builds for measurements, after a wheel, whose library the compiler's cache has."""
        build(session, preset)


# --- Jobs of ./dev test: nox runs two at a time, each in its own process


def job(name: str, *requires: str) -> Callable[[Callable[[nox.Session], None]], None]:
    """Has nox run a function, with its output in a file, too, while it runs."""

    def add(function: Callable[[nox.Session], None]) -> None:
        @nox.session(name=name, python=False, requires=requires)
        def run(session: nox.Session) -> None:
            LOGS.mkdir(parents=True, exist_ok=True)
            shown = os.dup(1), os.dup(2)
            try:
                with (LOGS / f"{name}.log").open("wb") as log:
                    os.dup2(log.fileno(), 1), os.dup2(log.fileno(), 2)
                function(session)
            finally:
                sys.stdout.flush()
                os.dup2(shown[0], 1), os.dup2(shown[1], 2)
                print((LOGS / f"{name}.log").read_text(encoding="utf-8", errors="replace"), flush=True)

    return add


# Of small matrices, which the oracles solve and decompose, threads make more work than they save.
ONE_BLAS_THREAD = {"OPENBLAS_NUM_THREADS": "1"}


def pytest(
    session: nox.Session, name: str, folder: str, marks: str = "", env: dict[str, str] | None = None
) -> None:
    marks = " and ".join(filter(None, [marks, "" if IS_ALL or session.posargs else "not slow"]))
    line = f"{LIMIT}{python_in(name)} -X faulthandler -m pytest -p no:cacheprovider --durations=25"
    words = [*line.split(), "--durations-min=4", "-m", marks, *folder.split(), *session.posargs]
    env = ONE_BLAS_THREAD | (env or {})
    # With options such as -k, a suite may have no test to run.
    session.run(*words, success_codes=[0, 5] if session.posargs else [0], env=env)


@job("native")
def native(session: nox.Session) -> None:
    """C++ tests, as shipped; all: also with sanitizers, and without vectors. Those leave out what takes long,
    what counts memory, which they replace, and what depends neither on vectors nor on threads."""
    if IS_ALL:
        programs = {"asan": "sinew_deform_tests sinew_tests", "tsan": "sinew_deform_tests"}
        for preset, targets in (programs | {"scalar": "sinew_deform_tests"}).items():
            build(session, preset, *targets.split())
            # Randomised addresses sometimes collide with the thread sanitizer's own memory.
            fixed = preset == "tsan" and sys.platform == "linux" and not call("setarch -R true")
            for target in targets.split():
                words = f"build/{preset}/tests/native/{target}", "--gtest_brief=1"
                session.run(*(("setarch", "-R") if fixed else ()), *words)
    build(session, "dev")
    words = f"ctest --preset dev -j {PROCESSORS} {'' if IS_ALL else '-LE slow'}".split()
    print(*session.run(*words, silent=True).splitlines()[-5:], sep="\n")


NEWEST_TESTED = os.environ.get("SINEW_TESTED", NEWEST).split()[-1]
job("window", "package")(
    functools.partial(pytest, name=f"bpy-{NEWEST_TESTED}", folder="tests/blender", marks="window")
)
job("python")(functools.partial(pytest, name=f"bpy-{EVERYDAY}", folder="tests/python tests/project"))
job("experiments")(functools.partial(pytest, name=f"bpy-{EVERYDAY}", folder="experiments/tests"))
job("shader")(functools.partial(pytest, name="shaders", folder="tests/shaders"))

for _bpy in BLENDERS:

    @job(f"blender-{_bpy}", "package")
    def blender(session: nox.Session, bpy: str = _bpy) -> None:
        """Unless options choose tests, those marked `once` run only in the newest; without --all, so do those
        of what does not depend on the version. Each keeps to a processor, but for .venv's, which test
        threads."""
        is_newest, is_chosen = bpy == NEWEST_TESTED, bool(session.posargs)
        left = [("SINEW_NOT_NEWEST", True), ("SINEW_BETWEEN", not IS_ALL or bpy not in (OLDEST, NEWEST))]
        left += [("SINEW_SHORT_TERM", not IS_ALL or bpy in SHORT_TERM)]
        env = {name: "1" for name, is_left in left if is_left and not (is_newest or is_chosen)}
        is_whole = not (is_chosen or IS_QUICK)
        if is_whole and (is_newest or bpy != EVERYDAY) and PROCESSORS > 1 and sys.platform == "linux":
            # Blender's threads wait for each other by giving up their processor: two suites on the same two
            # processors take twice the processor time.
            os.sched_setaffinity(0, {sorted(os.sched_getaffinity(0))[0 if is_newest else 1]})
        pytest(session, f"bpy-{bpy}", "tests/blender", "not window" * (is_whole and is_newest), env=env)


@job("browser")
def browser(session: nox.Session) -> None:
    """All: the page that turns and three.js, in browsers that the system brings where it can; Godot."""
    missing = [name for name, programs in BROWSERS.items() if not any(map(shutil.which, programs.split()))]
    if missing and shutil.which("apt-get") and (os.geteuid() == 0 or shutil.which("sudo")):
        start = ["sudo"] * (os.geteuid() != 0)
        start += ["env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq", "-o", "DPkg::Lock::Timeout=900"]
        for words in ("update", *(f"install -y --no-install-recommends {name}" for name in missing)):
            # Where that fails, the tests say what is missing.
            session.run(*start, *words.split(), silent=True, success_codes=range(256))
    pytest(session, "browsers", "tests/browsers")


@job("installed")
def installed(session: nox.Session) -> None:
    """Both wheels in an environment of their own, away from the checkout, and what README says of them."""
    line = f"{sys.executable} tests/installed/make.py {environment_of('installed')}"
    words = python_of(EVERYDAY_PYTHON), wheel_of(EVERYDAY_PYTHON), f"bpy=={EVERYDAY}.*"
    session.run(*line.split(), *map(str, words), *LIMIT.split())


@job("commands")
def commands(session: nox.Session) -> None:
    """All: each command of ./dev, small."""
    with tempfile.TemporaryDirectory() as place:
        for line in SMALL.split("; ") if IS_ALL else ["lint --fast"]:
            session.run("./dev", *line.format(place).split(), silent=True)


# --- The commands of ./dev


def set_up(*sessions: str, options: str = "") -> None:
    """Has nox make environments and the like; ends this if one fails."""
    tell_uv_of_the_registry()
    Path("build").mkdir(exist_ok=True)
    words = f"-m nox {'--parallel 4' if len(sessions) > 1 else ''} {options} --session".split()
    # One ./dev at a time, but for the one in a whole Blender. Standard output is for results.
    with nullcontext() if "SINEW_BUILT" in os.environ else FileLock("build/set-up.lock"):
        done = subprocess.run([sys.executable, *words, *sessions], stdout=sys.stderr, check=False)
    if done.returncode:
        sys.exit(done.returncode)


def in_blender(words: list[str], program: str) -> int:
    """Runs a program in the bpy of .venv, or in that of --blender VERSION."""
    parser = argparse.ArgumentParser(prog="./dev", add_help=False, allow_abbrev=False)
    parser.add_argument("--blender", choices=BLENDERS, default=EVERYDAY)
    chosen, others = parser.parse_known_args(words)
    set_up(f"bpy-{chosen.blender}")
    os.environ |= ONE_BLAS_THREAD
    return call(python_in(f"bpy-{chosen.blender}"), program, *others)


def demo(_words: list[str]) -> int:
    set_up(f"bpy-{EVERYDAY}")
    say("re-skinning blend_files/ with quaternion-vector skinning")
    call(".venv/bin/sinew reskin blend_files --method qv --out build/demo --overwrite", must=True)
    say("drawing a wrist under three methods, turned by half a turn, where they differ most")
    page = ROOT / "build/demo/wrist.html"
    output_of(".venv/bin/sinew compare blend_files/wrist.blend --frames 24 --out", page.parent)
    print(f"Re-skinned files: {page.parent}/*.blend\nComparison: {page}")
    return 0


def bring(version: str) -> str | None:
    """A Python that uv brings, where it can."""
    env = os.environ | {"UV_HTTP_TIMEOUT": "20", "UV_HTTP_RETRIES": "0"}
    subprocess.run(["uv", "python", "install", "--quiet", version], env=env, check=False)
    python_of.cache_clear()
    if not python_of(version):
        say(f"no Python {version} here: not testing in its Blenders")
    return python_of(version)


def newest_bpy() -> tuple[str, str]:
    """The newest bpy that the registry has for a Python that is here, and that Python."""
    found = []
    for python in filter(python_of, WHEEL_PYTHONS):
        words = f"uv pip compile - --quiet --no-deps --no-header --no-annotate --python-version {python}"
        done = subprocess.run(words.split(), input="bpy", capture_output=True, text=True, check=False)
        found += [(version, python) for version in re.findall(r"^bpy==([\d.]+)", done.stdout, re.MULTILINE)]
    return max(found, key=lambda each: [*map(int, each[0].split("."))], default=None) or sys.exit(
        "dev: the registry has no bpy for the Pythons here."
    )


def test(words: list[str]) -> int:
    if words and words[0].startswith("--platform"):
        set_up("cross")
        words = words[0].split("=")[1:] + words[1:]
        return call(f"{python_in('cross')} tools/platform_tests.py", *words)
    parser = argparse.ArgumentParser(prog="./dev test", add_help=False, allow_abbrev=False)
    parser.add_argument("--blender", choices=(*BLENDERS, "NEWEST"))
    own, words = parser.parse_known_args(words)
    if own.blender == "NEWEST" and not UNLOCKED:
        tell_uv_of_the_registry()
        version, python = newest_bpy()
        say(f"the newest Blender that the registry has is {version}")
        os.environ["SINEW_UNLOCKED"] = f"{version} {python}"
        os.execv(sys.executable, [sys.executable, *sys.argv])
    is_all, is_quick = "--all" in words, "--quick" in words
    options = [word for word in words if word not in ("--all", "--quick")]
    is_whole = not (is_quick or options or own.blender)
    wanted = [*BLENDERS] if is_all else [EVERYDAY] if is_quick else [OLDEST, EVERYDAY, NEWEST]
    wanted = [UNLOCKED or own.blender] if own.blender else wanted
    pythons = {version for version in {BLENDERS[b] for b in wanted} if python_of(version) or bring(version)}
    tested = [bpy for bpy, python in BLENDERS.items() if bpy in wanted and python in pythons]
    others = ["experiments-programs", "browsers"] * is_all + ["lint"] * is_whole
    environments = [f"bpy-{bpy}" for bpy in tested]
    set_up("fetch", *environments, "site", "shaders", *others, "--", *environments)
    os.environ |= {"SINEW_PACKAGE": str(PACKAGE), "SINEW_TESTED": " ".join(tested)}
    os.environ |= {"SINEW_TEST_QUICK": "1"} if is_quick else {}
    if is_all:
        for name in not_tested():
            say(f"the tests of {name} have not passed here as the files are: ./dev test --platform {name}")
        os.environ |= {"SINEW_TEST_ALL": "1", "SINEW_EXPERIMENTS": f"{ROOT}/build/experiments/experiments"}
    # The longest first.
    jobs = ["native"] * (not options and not own.blender) + ["window"] * is_whole
    jobs += [*(f"blender-{bpy}" for bpy in reversed(tested)), *["python", "shader"] * (not own.blender)]
    jobs += ["experiments", "browser"] * (is_all and not own.blender) + ["installed", "commands"] * is_whole
    for name in {"SINEW_RIGS", "SINEW_FULL_BLENDER"} - {*os.environ}:
        say(f"{name} is not set: tests that need it are skipped")
    shutil.rmtree(LOGS, ignore_errors=True)
    # nox ends its jobs when it is interrupted: so it is by what ends programs, too.
    start = "import signal, nox.__main__ as n; signal.signal(15, signal.default_int_handler); n.main()"
    words = ["--parallel", str(min(PROCESSORS, 2)), "--session", *jobs, "--", *options]
    os.execv(sys.executable, [sys.executable, "-c", start, *words])


def bench(words: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="./dev bench", allow_abbrev=False)
    parts = ["kernels", "peers", "frames", "counts", "plots"]
    for flag in [*parts, "quick", "million", "accept", "simd", "name"]:
        takes = {} if flag in ("simd", "name") else {"action": "store_const", "const": f"--{flag}"}
        parser.add_argument(f"--{flag}", default="", **takes)
    its = parser.parse_args(words)
    kernels, prefix = "build/bench/bench/sinew_kernels_bench", f"{its.name}-" if its.name else ""
    simd = f"--simd={its.simd}" if its.simd else ""
    own, everyday, peers = python_of(EVERYDAY_PYTHON), python_in(f"bpy-{EVERYDAY}"), python_in("bench")
    lines = {
        "kernels": f"{own} bench/kernels.py {kernels} --name {prefix}kernels {its.quick} {simd}",
        "peers": f"{peers} bench/peers.py --name {prefix}peers {its.quick}",
        "frames": f"{everyday} bench/frames.py --name {prefix}frames {its.quick} {its.million}",
        "counts": f"{own} bench/counts.py build/bench/bench/sinew_counts {its.accept}",
        "plots": f"{peers} bench/plots.py {kernels} --name {prefix}costs",
    }
    chosen = [part for part in parts if getattr(its, part)] or parts[:-1]
    needed = {"frames": [f"bpy-{EVERYDAY}"], "peers": ["bench"], "plots": ["bench", "bench-programs"]}
    set_up(*{name for part in chosen for name in needed.get(part, ["bench-programs"])})
    # A part that fails does not prevent the others from running.
    return int(any([call(lines[part]) for part in chosen]))


def report(words: list[str]) -> int:
    set_up(f"bpy-{EVERYDAY}", "experiments-programs")
    os.environ["PYTHONPATH"] = "experiments"
    line = ".venv/bin/python -m smith_2013 --out build/report --blend-files blend_files"
    return call(f"{line} --programs build/experiments/experiments", *words)


def site(words: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="./dev site")
    parser.add_argument("--out", type=Path, default="build/site")
    out = parser.parse_args(words).out.resolve()
    # The command of the latter makes pages that turn.
    set_up("site", f"bpy-{EVERYDAY}")
    # Leaves out an announcement. Not --quiet: mkdocs then counts no warnings, and strict has no effect.
    os.environ["NO_MKDOCS_2_WARNING"] = "1"
    call(f"{python_in('site')} -m mkdocs build --site-dir", out, must=True)
    print(out / "index.html")
    return 0


def findings(words: list[str]) -> int:
    """Runs scripts of findings/, each to its end, and says at last which saw something else."""
    known = {path.stem: path for path in sorted(Path("findings").glob("*.sh"))}
    if unknown := [word for word in words if word not in known]:
        sys.exit(f"dev: no finding {unknown[0]}: {', '.join(known)}")
    pythons = [Path(python).parent for python in map(python_of, WHEEL_PYTHONS) if python]
    os.environ["PATH"] = ":".join(map(str, (*pythons, os.environ["PATH"])))
    changed = []
    for name in words or known:
        say(f"finding {name}")
        if call("bash", known[name]):
            changed.append(name)
    if changed:
        say(f"changed: {', '.join(changed)}")
    return 1 if changed else 0


def players(words: list[str]) -> int:
    own = [bpy for bpy in (EVERYDAY, NEWEST) if python_of(BLENDERS[bpy])]
    set_up(*[f"bpy-{bpy}" for bpy in own], "players")
    known = [f"--bpy={bpy}={python_in(f'bpy-{bpy}')}" for bpy in own]
    return call(f"{python_in('players')} tools/players/measure.py", *known, *words)


def stub(words: list[str]) -> int:
    set_up("site")
    return call(f"{python_in('site')} tools/make_stub.py", *words)


def lint(words: list[str]) -> int:
    set_up("lint")
    return call(f"{sys.executable} tools/lint.py {environment_of('lint')}/bin", *words)


def package_command(words: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="./dev package")
    parser.add_argument("--bundle", action="store_true")
    parser.add_argument("--platform", choices=(*PLATFORMS, "all"))
    parser.add_argument("--python", choices=WHEEL_PYTHONS, action="append")
    options = parser.parse_args(words)
    if not options.bundle and not options.platform:
        set_up("package")
        print(PACKAGE.relative_to(ROOT))
        return 0
    # Blender's own program splits and checks zips.
    set_up("bundle", *["cross"] * bool(options.platform))
    if options.platform:
        pythons = [python_of(version) for version in options.python or WHEEL_PYTHONS if python_of(version)]
        line = f"{python_in('cross')} tools/cross_build.py {options.platform} --validator"
        return call(f"{line} {python_in('bundle')}", *(f"--python={python}" for python in pythons))
    shutil.rmtree("dist/zips", ignore_errors=True)
    made = output_of(f"{sys.executable} -I tools/package.py")
    call(f"{python_in('bundle')} tools/split_package.py {made} --out dist/zips", must=True)
    return call(f"{sys.executable} -I tools/sbom.py", *Path("dist/zips").glob("*.zip"))


def wheel(words: list[str]) -> int:
    version = EVERYDAY_PYTHON
    if words:
        program = shutil.which(words[0]) or sys.exit(f"dev: there is no {words[0]}.")
        version = output_of(program, "-c", "import sys; print('%d.%d' % sys.version_info[:2])")
        os.environ["UV_PYTHON_SEARCH_PATH"] = f"{Path(program).parent}:{os.environ['UV_PYTHON_SEARCH_PATH']}"
    # Without those before it: a whole Blender has no other Pythons.
    set_up(f"wheel-{version}", options="--no-dependencies")
    print(wheel_of(version))
    return 0


PROGRAMS = {
    "fuzz": "tests/blender/programs/fuzz_parity.py",
    "walk": "tests/blender/walk/walk.py",
    "soak": "tests/blender/programs/soak.py",
    "corpus": "tests/blender/programs/corpus.py",
    "pictures": "tools/pictures/draw_methods.py",
    "benchmark": "tools/pictures/draw_benchmark.py",
    "golden": "tests/golden/make_golden.py",
}
COMMANDS: dict[str, Callable[[list[str]], int]] = {
    **{name: functools.partial(in_blender, program=program) for name, program in PROGRAMS.items()},
    **{"demo": demo, "test": test, "bench": bench, "report": report, "site": site, "stub": stub},
    **{"findings": findings, "players": players, "lint": lint, "package": package_command, "wheel": wheel},
    "release": lambda words: call(f"{sys.executable} -I tools/release.py", *words),
    "lock": lambda words: call(f"{sys.executable} tools/lock.py", *words),
}

if __name__ == "__main__":
    command, *given = sys.argv[1:]
    sys.exit(COMMANDS[command](given) if command in COMMANDS else f"dev: no {command}: see ./dev help")
