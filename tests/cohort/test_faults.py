"""Whatever is killed or full, whole folders stay, nothing half-made is left, and run again the cohort ends the same.

The same means byte for byte: the tables, and every file of the swept folders but what tells seconds and dates
(``cohorts.comparable``).
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import cohorts
import psutil
import pytest
from cohorts import Quiet
from full_disks import small_disk

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc"),
]


#: How many cohorts have their workers killed at random times; 20 before a release.
SEEDS = int(os.environ.get("FEMPREP_FAULT_SEEDS", "2"))


@contextmanager
def started(*arguments: object, **keywords: object) -> Iterator[subprocess.Popen[str]]:
    """A cohort at work; ended with the block, if need be."""
    made = cohorts.command(*arguments, **keywords)  # type: ignore[arg-type]
    process = subprocess.Popen(made, env=cohorts.environment(), stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def workers(pid: int) -> list[psutil.Process]:
    """Worker processes of a cohort: spawned children that are no tracker of resources."""
    with suppress(psutil.Error):
        return [child for child in psutil.Process(pid).children() if "spawn_main" in " ".join(child.cmdline())]
    return []


def begun(out: Path) -> bool:
    """Whether a worker is at work on a subject."""
    return any(out.glob(".cohort/*.json"))


def ends_the_same(undisturbed: Quiet, out: Path) -> None:
    done = cohorts.run(undisturbed.source, out)
    assert done.returncode == 1, done.stderr
    assert cohorts.left_behind(out) == []
    assert cohorts.comparable(out) == cohorts.comparable(undisturbed.out)


@pytest.mark.parametrize("seed", range(SEEDS))
def test_workers_killed_at_random_times(undisturbed: Quiet, tmp_path: Path, seed: int) -> None:
    draw, out = random.Random(seed), tmp_path / "out"
    with started(undisturbed.source, out) as process:
        cohorts.wait_for(lambda: begun(out) or process.poll() is not None)
        for _ in range(3):
            time.sleep(draw.uniform(0.1, 6.0))
            if found := workers(process.pid):
                with suppress(psutil.Error):
                    draw.choice(found).kill()
        _, said = process.communicate(timeout=600)
    assert process.returncode == 1, said
    assert cohorts.left_behind(out) == []
    rows = cohorts.rows(out)
    assert len(rows) == 4
    assert {row["reason"] for row in rows.values()} <= {"done", "image-unreadable", "worker-lost"}
    ends_the_same(undisturbed, out)


@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_it_ends_within_seconds_and_leaves_whole_folders(
    undisturbed: Quiet, tmp_path: Path, sign: signal.Signals
) -> None:
    out = tmp_path / "out"
    with started(undisturbed.source, out) as process:
        cohorts.wait_for(lambda: any(out.glob("heart*/run.json")))
        family = psutil.Process(process.pid).children(recursive=True)
        start = time.monotonic()
        process.send_signal(sign)
        _, said = process.communicate(timeout=60)
        assert time.monotonic() - start < 20.0
    assert process.returncode == 130
    assert "interrupted" in said
    assert "the same command goes on" in said
    assert cohorts.left_behind(out) == []
    _, alive = psutil.wait_procs(family, timeout=10)
    assert alive == []
    ends_the_same(undisturbed, out)


def test_client_killed(undisturbed: Quiet, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with started(undisturbed.source, out) as process:
        cohorts.wait_for(lambda: any(out.glob("heart*/run.json")))
        family = psutil.Process(process.pid).children(recursive=True)
        process.kill()
        process.wait()
    _, alive = psutil.wait_procs(family, timeout=60)
    assert alive == []
    ends_the_same(undisturbed, out)


def test_subject_that_crashes_its_worker_is_set_aside_and_the_others_are_made(
    undisturbed: Quiet, tmp_path: Path
) -> None:
    source, out = shutil.copytree(undisturbed.source, tmp_path / "in"), tmp_path / "out"
    shutil.copy(source / "heart0.nii.gz", source / "crash.nii.gz")
    done = cohorts.run(source, out, env=cohorts.trap(tmp_path / "trap"))
    assert done.returncode == 1, done.stderr
    rows = cohorts.rows(out)
    assert (rows["crash"]["status"], rows["crash"]["reason"]) == ("set aside", "worker-lost")
    assert "ended 2 times" in rows["crash"]["message"]
    assert [rows[f"heart{number}"]["reason"] for number in range(3)] == ["done"] * 3
    assert cohorts.left_behind(out) == []
    # Once it crashes no more, it is made as any other.
    assert cohorts.run(source, out).returncode == 1
    assert cohorts.rows(out)["crash"]["reason"] == "done"


@pytest.mark.parametrize(("name", "more", "code"), [
    ("slow", ("--subject-time-limit", "10"), "time-limit"),
    ("hog", ("--memory-limit", "2"), "memory-limit"),
])  # fmt: skip
def test_subject_that_takes_too_much_is_set_aside_at_once(
    undisturbed: Quiet, tmp_path: Path, name: str, more: tuple[str, str], code: str
) -> None:
    # The others are done already, so that the limit can be short on a slow machine too.
    source, out = (shutil.copytree(here, tmp_path / here.name) for here in (undisturbed.source, undisturbed.out))
    shutil.copy(source / "heart0.nii.gz", source / f"{name}.nii.gz")
    done = cohorts.run(source, out, *more, env=cohorts.trap(tmp_path / "trap"))
    assert done.returncode == 1, done.stderr
    rows = cohorts.rows(out)
    assert (rows[name]["status"], rows[name]["reason"]) == ("set aside", code)
    assert more[0] in rows[name]["message"]
    assert rows["heart0"]["reason"] == "done"
    assert rows["none"]["reason"] == "image-unreadable"
    assert cohorts.left_behind(out) == []


def test_full_disk(undisturbed: Quiet, tmp_path: Path) -> None:
    size = sum(path.stat().st_size for path in undisturbed.out.rglob("*") if path.is_file())
    with small_disk(tmp_path / "disk", f"{int(0.6 * size / 1024)}k") as disk:
        out = disk / "out"
        done = cohorts.run(undisturbed.source, out, workers=1)
        assert done.returncode == 3, done.stderr
        assert "no room is left" in done.stderr
        assert done.stderr.count("\n") == 1
        assert cohorts.left_behind(out) == []
        assert len(list(out.glob("heart*/run.json"))) < 3
        subprocess.run(["mount", "-o", "remount,size=100m", str(disk)], check=True)
        ends_the_same(undisturbed, out)


def test_two_cohorts_into_one_folder(undisturbed: Quiet, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with started(undisturbed.source, out) as process:
        cohorts.wait_for(lambda: begun(out))
        second = cohorts.run(undisturbed.source, out)
        assert second.returncode == 2
        assert "another femprep cohort is at work" in second.stderr
        process.communicate(timeout=600)
    assert process.returncode == 1
    assert cohorts.comparable(out) == cohorts.comparable(undisturbed.out)


@contextmanager
def dask(*prefixes: list[str], host: str = "127.0.0.1") -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and a worker for each prefix of a command, the first of which is the scheduler's too."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp://{host}:{probe.getsockname()[1]}"
    port = address.rpartition(":")[2]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": cohorts.environment()}
    begin = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", host, "--port", port, "--no-dashboard"]
    processes = [subprocess.Popen([*prefixes[0], *begin], **quiet)]  # type: ignore[call-overload]
    for prefix in prefixes:
        work = ["distributed.cli.dask_worker", address, "--nthreads", "1", "--memory-limit", "0", "--no-dashboard"]
        processes.append(subprocess.Popen([*prefix, sys.executable, "-m", *work], **quiet))  # type: ignore[call-overload]
    try:
        yield address, processes
    finally:
        for process in processes:
            family = []
            with suppress(psutil.Error):
                family = psutil.Process(process.pid).children(recursive=True)
            process.kill()
            process.wait()
            for child in family:
                with suppress(psutil.Error):
                    child.kill()


def test_scheduler_killed(undisturbed: Quiet, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with dask([], []) as (address, processes):
        with started(undisturbed.source, out, "--scheduler", address, workers=None) as process:
            cohorts.wait_for(lambda: any(out.glob("heart*/run.json")))
            processes[0].kill()
            _, said = process.communicate(timeout=120)
        assert process.returncode == 3, said
        assert "the scheduler went away" in said
        assert said.count("\n") == 1
    ends_the_same(undisturbed, out)


def test_scheduler_that_is_not_there_is_told(undisturbed: Quiet, tmp_path: Path) -> None:
    done = cohorts.run(undisturbed.source, tmp_path / "out", "--scheduler", "tcp://127.0.0.1:1", workers=None)
    assert done.returncode == 2
    assert "does not answer" in done.stderr
    assert done.stderr.count("\n") == 1


@contextmanager
def two_hosts() -> Iterator[tuple[list[str], list[str], str]]:
    """Two network namespaces joined by a cable: prefixes of commands in each, and the address of the first."""
    if shutil.which("ip") is None or os.geteuid() != 0:
        pytest.skip("makes network namespaces, which takes ip and root")
    one, two = (f"femprep-{os.getpid()}-{number}" for number in (1, 2))
    ends = [f"fp{os.getpid() % 100000}a", f"fp{os.getpid() % 100000}b"]
    steps = [["netns", "add", one], ["netns", "add", two]]
    steps += [["link", "add", ends[0], "netns", one, "type", "veth", "peer", "name", ends[1], "netns", two]]
    for name, end, address in ((one, ends[0], "10.77.0.1/24"), (two, ends[1], "10.77.0.2/24")):
        steps += [["-n", name, "addr", "add", address, "dev", end], ["-n", name, "link", "set", end, "up"]]
        steps += [["-n", name, "link", "set", "lo", "up"]]
    try:
        for step in steps:
            done = subprocess.run(["ip", *step], capture_output=True, text=True)
            if done.returncode != 0:
                pytest.skip(f"cannot make network namespaces: {done.stderr.strip()}")
        yield ["ip", "netns", "exec", one], ["ip", "netns", "exec", two], "10.77.0.1"
    finally:
        for name in (one, two):
            subprocess.run(["ip", "netns", "delete", name], capture_output=True)


def test_two_hosts_over_tcp(undisturbed: Quiet, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with two_hosts() as (one, two, host), dask(one, two, host=host) as (address, processes):
        made = cohorts.command(undisturbed.source, out, "--scheduler", address, workers=None)
        done = subprocess.run([*one, *made], env=cohorts.environment(), capture_output=True, text=True, timeout=900)
        assert done.returncode == 1, done.stderr
        assert all(process.poll() is None for process in processes)
    assert cohorts.comparable(out) == cohorts.comparable(undisturbed.out)
