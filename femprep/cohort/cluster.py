"""A number of workers, or the address of a scheduler, in; a client of dask.distributed out, ended within seconds."""

from __future__ import annotations

import logging
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

from femprep.errors import MissingDependencyError, OptionError

#: Seconds in which a scheduler has to answer, and to have its first worker.
PATIENCE: Final = 60.0
_CONNECT: Final = 10.0
#: What dask is told here; the rest is the user's own configuration.
_SETTINGS: Final = {
    # One subject at a time and none waiting at a worker: what is lost with it is that one alone.
    "distributed.scheduler.worker-saturation": 1.0,
    # How often a subject is tried is counted by ourselves, whatever a scheduler elsewhere has been told.
    "distributed.scheduler.allowed-failures": 3,
    # No profile of every call, no page of the scheduler's.
    "distributed.worker.profile.enabled": False,
    "distributed.comm.timeouts.connect": f"{_CONNECT:g}s",
}


def require_distributed() -> None:
    """Make sure that dask.distributed is there.

    Raises
    ------
    MissingDependencyError
    """
    try:
        import distributed  # noqa: F401
    except ImportError as error:
        raise MissingDependencyError(
            f"femprep cohort needs dask.distributed ({error}); install it with pip install 'femprep[cohort]'"
        ) from None


def default_workers() -> int:
    """A worker for each core."""
    from dask.system import CPU_COUNT

    return int(CPU_COUNT)


def default_memory(workers: int) -> float:
    """An even share of the machine's memory, GB."""
    from distributed.system import MEMORY_LIMIT

    return float(MEMORY_LIMIT) / workers / 1e9


@contextmanager
def connected(scheduler: str | None, workers: int) -> Iterator[Any]:
    """A client of a scheduler: of one elsewhere by its address, or one of this process with worker processes.

    Parameters
    ----------
    scheduler : str, optional
        ``tcp://host:port``.
    workers : int
        Processes of this machine where there is no scheduler.

    Raises
    ------
    OptionError
        The scheduler does not answer, or has no workers.
    """
    import dask

    with dask.config.set(_SETTINGS):
        if scheduler is not None:
            with _elsewhere(scheduler) as client:
                yield client
        else:
            with _here(workers) as client:
                yield client


@contextmanager
def _elsewhere(scheduler: str) -> Iterator[Any]:
    from distributed import Client

    _silence()
    try:
        client = Client(scheduler, timeout=_CONNECT, set_as_default=False, name="femprep-cohort")
    except (OSError, ValueError, TimeoutError, RuntimeError, ImportError) as error:
        raise OptionError(
            f"--scheduler {scheduler!r} does not answer ({error}); give its address as tcp://HOST:PORT"
        ) from None
    try:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise OptionError(
                f"the scheduler {scheduler!r} has no workers after {PATIENCE:g} s; start some, and run this again"
            ) from None
        yield client
    finally:
        with suppress(Exception):  # a scheduler that has gone
            client.close(timeout=2)


@contextmanager
def _here(workers: int) -> Iterator[Any]:
    import dask
    from distributed import Client, LocalCluster

    _silence()
    threads = max(1, default_workers() // workers)
    with (
        tempfile.TemporaryDirectory(prefix="femprep-cohort-", ignore_cleanup_errors=True) as folder,
        # The scheduler's own files, too, which it would leave in the system's temporary folder.
        dask.config.set({"temporary-directory": folder}),
    ):
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            # Memory is watched by ourselves, together with that of the mesher's process.
            memory_limit=0,
            dashboard_address=None,
            local_directory=folder,
            silence_logs=logging.CRITICAL,
            env={"NUMBA_NUM_THREADS": str(threads), "DASK_LOGGING__DISTRIBUTED": "critical"},
        )
        try:
            client = Client(cluster, set_as_default=False, name="femprep-cohort")
            try:
                yield client
            finally:
                _end(cluster)
                with suppress(Exception):
                    client.close(timeout=2)
        finally:
            with suppress(Exception):
                cluster.close(timeout=5)


def _silence() -> None:
    """Leave what is said to one line of ours. Dask gives its client a level of its own, below that of the others."""
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)


def _end(cluster: Any) -> None:
    """End all workers now: what they are at cannot be waited for, and leaves nothing half-made."""
    from femprep.cohort.watch import end_family

    nannies = list(cluster.workers.values())
    for nanny in nannies:
        nanny.auto_restart = False
    for nanny in nannies:
        pid = nanny.pid
        if pid is not None and pid != os.getpid():
            end_family(pid)
