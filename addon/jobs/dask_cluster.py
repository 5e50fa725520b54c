# SPDX-License-Identifier: GPL-3.0-or-later
"""The workers of a batch: Blenders of a dask cluster. The Python package has this, the extension does not."""

import ipaddress
import logging
from collections.abc import Callable, Generator, Sequence

import distributed
import sinew

from ..base.errors import SinewError
from ..blender_process import Limits
from .workers import do_task, end_blenders, failure, sentence, versions

CONNECT_LIMIT = 30.0


def run_in_dask(
    tasks: Sequence[dict], limits: Limits, scheduler: str, warn: Callable[[str], None]
) -> Generator[tuple[dict, dict], None, None]:
    """Yields each task and its outcome, in the order in which the dask cluster at `scheduler` finishes them,
    with as many Blenders on each worker as it has threads.

    warn  called with one sentence where others can reach the cluster

    Raises SinewError where the cluster cannot be used.
    """
    # dask warns of load and lost connections; what matters is an error of a task, too.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = distributed.Client(scheduler, timeout=CONNECT_LIMIT)
    except TypeError as error:
        # For tls:// without a complete configuration.
        raise SinewError(f"{scheduler}: {sentence(error)}; docs/batch.md has how to set up TLS") from None
    except (OSError, ValueError, RuntimeError) as error:
        raise SinewError(f"{scheduler}: no dask scheduler answers at this address: {error}") from None
    with client:
        _warn_where_open(client.scheduler_info()["address"], warn)
        _check_workers(client, scheduler)
        futures = client.map(do_task, tasks, limits=limits, pure=False)
        task_of = {future.key: task for future, task in zip(futures, tasks, strict=True)}
        try:
            # dask gives the task of a lost worker to another one, but not a task that has lost several
            # workers.
            for future in distributed.as_completed(futures):
                task = task_of[future.key]
                try:
                    outcome = future.result()
                except distributed.KilledWorker:
                    outcome = {"error": f"{task['source']}: lost with each worker that took it on"}
                except Exception as error:
                    outcome = failure(task, error)
                yield task, outcome
                future.release()
        finally:
            client.cancel(futures)
            client.run(end_blenders)


def _warn_where_open(address: str, warn: Callable[[str], None]) -> None:
    """address: as the scheduler reports it; one of its machine's addresses if it listens on all."""
    scheme, _separator, host_and_port = address.rpartition("://")
    host = host_and_port.rpartition(":")[0].strip("[]")
    if scheme != "tls" and not _is_this_machine(host):
        warn(
            f"{address}: whoever reaches this scheduler can run programs as you, on its workers and here; "
            "use TLS, or have it listen on 127.0.0.1 alone (docs/batch.md)"
        )


def _is_this_machine(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _check_workers(client: distributed.Client, scheduler: str) -> None:
    """Raises SinewError where a worker cannot run Blender or has another Sinew than this process."""
    try:
        client.wait_for_workers(1, timeout=CONNECT_LIMIT)
    except TimeoutError:
        raise SinewError(f"{scheduler}: has no workers; start some with `dask worker {scheduler}`") from None
    try:
        found = client.run(versions)
    except Exception as error:
        raise SinewError(
            f"{scheduler}: a worker can not run Sinew: {sentence(error)}; install sinew-blender for it"
        ) from None
    blenders = {versions["blender"] for versions in found.values()}
    if len(blenders) > 1:
        raise SinewError(f"{scheduler}: its workers have different Blenders: {', '.join(sorted(blenders))}")
    for address, worker_versions in found.items():
        if worker_versions["sinew"] != sinew.__version__:
            raise SinewError(
                f"{scheduler}: worker {address} has Sinew {worker_versions['sinew']}, here is "
                f"{sinew.__version__}; install the same"
            )
