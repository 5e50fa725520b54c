# SPDX-License-Identifier: GPL-3.0-or-later
"""A dask cluster as docs/batch.md starts it: where it listens, TLS, and what `sinew` reports about
others."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import bpy
import psutil
import pytest
import scenes
from conftest import REPOSITORY
from distributed.utils import get_ip
from program import run_program
from sinew_addon.attach import properties

pytestmark = [
    pytest.mark.skipif(bpy.app.version < (5, 2), reason="not of Blender: runs with the newest one alone"),
    pytest.mark.outer_versions,
]
BATCH = (REPOSITORY / "docs" / "batch.md").read_text(encoding="utf-8")


def documented(program: str, address: str) -> list[str]:
    """The words of the line for that program and that address, such as "dask worker"."""
    lines = re.findall(rf"^    dask ({program} .*)$", BATCH, re.MULTILINE)
    # The farm's lines contain this machine's address, too, for their pages.
    (line,) = [line for line in lines if ("10.0.0.5" in line) == (address == "10.0.0.5")]
    return shlex.split(line)


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@contextmanager
def running(folder: Path, *arguments: str, environment: dict[str, str] | None = None):
    with (folder / f"{arguments[0]}.log").open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", *arguments],
            stdout=log,
            stderr=log,
            cwd=folder,
            env={**os.environ, **(environment or {})},
        )
        try:
            yield process
        finally:
            process.terminate()
            process.wait(timeout=30)


@contextmanager
def cluster(folder: Path, address: str, environment: dict[str, str] | None = None):
    """Starts the documented lines for an address, with free ports and 127.0.0.1 instead of the farm's
    addresses. Yields the scheduler's address and the processes."""
    port = str(free_port())
    with ExitStack() as stack:
        processes = []
        for program, more in (("scheduler", ("--port", port)), ("worker", ())):
            line = " ".join(documented(program, address))
            line = line.replace("10.0.0.5", "127.0.0.1").replace("10.0.0.6", "127.0.0.1")
            words = shlex.split(line.replace("8786", port).replace("8787", "0"))
            processes.append(stack.enter_context(running(folder, *words, *more, environment=environment)))
        scheme = "tls" if address.startswith("10.") else "tcp"
        yield f"{scheme}://127.0.0.1:{port}", processes


def addresses(processes: list[subprocess.Popen]) -> set[str]:
    found = set()
    for process in processes:
        with suppress(psutil.Error):
            for each in (psutil.Process(process.pid), *psutil.Process(process.pid).children(recursive=True)):
                found |= {c.laddr.ip for c in each.net_connections("inet") if c.status == psutil.CONN_LISTEN}
    return found


@pytest.fixture
def rig(tmp_path):
    scenes.make_arm()
    return scenes.save(tmp_path / "arm.blend")


def arguments(rig: Path, out: Path, scheduler: str) -> tuple:
    return (
        *("reskin", rig, "--method", "dq", "--frames", "none", "--no-pictures"),
        *("--out", out, "--scheduler", scheduler),
    )


def assert_done(out: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(out / "arm.blend"))
    assert properties.of(bpy.data.objects["Arm"]).method == "dq"


@pytest.mark.slow
def test_as_documented_it_listens_on_this_machine_alone(rig, tmp_path):
    with cluster(tmp_path, "127.0.0.1") as (address, processes):
        done = run_program(*arguments(rig, tmp_path / "out", address))
        assert "can run programs" not in done.stderr
        # Scheduler, worker, its nanny, and the pages of both.
        assert addresses(processes) <= {"127.0.0.1", "::1"}
        assert len(addresses(processes)) >= 1
    assert_done(tmp_path / "out")


@pytest.mark.slow
def test_one_that_is_open_to_others_is_named(rig, tmp_path):
    port = str(free_port())
    pages = ("--dashboard-address", "127.0.0.1:0")
    with (
        running(tmp_path, "scheduler", "--host", "0.0.0.0", "--port", port, *pages),
        running(tmp_path, "worker", f"tcp://127.0.0.1:{port}", "--host", "127.0.0.1", *pages),
    ):
        done = run_program(*arguments(rig, tmp_path / "out", f"tcp://127.0.0.1:{port}"))
    if get_ip().startswith("127."):
        pytest.skip("this machine has no address that others reach")
    assert "whoever reaches this scheduler can run programs as you" in done.stderr
    assert_done(tmp_path / "out")


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    """A certificate authority, and a certificate that it signed; the documented configuration with both."""
    if shutil.which("openssl") is None:
        pytest.skip("there is no openssl to make certificates")
    folder = tmp_path_factory.mktemp("tls")

    def openssl(*words: str) -> None:
        subprocess.run(["openssl", *words], cwd=folder, check=True, capture_output=True)

    new = ("req", "-newkey", "rsa:2048", "-nodes", "-days", "2")
    openssl(*new, "-x509", "-keyout", "ca-key.pem", "-out", "ca.pem", "-subj", "/CN=farm")
    openssl(*new, "-keyout", "machine-key.pem", "-out", "machine.csr", "-subj", "/CN=machine")
    openssl("x509", "-req", "-in", "machine.csr", "-CA", "ca.pem", "-CAkey", "ca-key.pem", "-CAcreateserial",
            "-days", "2", "-out", "machine.pem")  # fmt: skip
    text = re.search(r"```yaml\n(.*?)```", BATCH, re.DOTALL)[1].replace("/farm/tls", str(folder))
    config = folder / "config"
    config.mkdir()
    (config / "tls.yaml").write_text(text)
    return config


@pytest.mark.slow
def test_tls_as_documented(rig, tmp_path, certificates):
    with_config = {"DASK_CONFIG": str(certificates)}
    with cluster(tmp_path, "10.0.0.5", with_config) as (address, processes):
        done = run_program(*arguments(rig, tmp_path / "out", address), env_more=with_config)
        assert "can run programs" not in done.stderr
        assert addresses(processes) <= {"127.0.0.1", "::1"}
        # A client without a key is refused with one sentence.
        without = run_program(*arguments(rig, tmp_path / "out 2", address), status=1)
        assert "how to set up TLS" in without.stderr
        plain = run_program(*arguments(rig, tmp_path / "out 3", address.replace("tls", "tcp")), status=1)
        assert "no dask scheduler answers at this address" in plain.stderr
    assert_done(tmp_path / "out")


@pytest.mark.slow
@pytest.mark.parametrize("address", ["tls://127.0.0.1:1", "http://127.0.0.1:1", "nonsense", "tcp://[::1"])
def test_what_is_no_scheduler(address, rig, tmp_path):
    failed = run_program(*arguments(rig, tmp_path / "out", address), status=1)
    assert [line for line in failed.stderr.splitlines() if line.startswith(f"sinew: {address}: ")]
