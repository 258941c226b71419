"""Interrupting or killing the main job leaves no half-made output and no orphan child."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import femprep as fp
from femprep.phantoms import lv_ellipsoid

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")


def descendants(pid: int) -> set[int]:
    """Process numbers of the children of a process, and of theirs."""
    parent = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if fields[0] != "Z":
                parent[int(entry.name)] = int(fields[1])
    found, front = set(), {pid}
    while front:
        front = {child for child, of in parent.items() if of in front}
        found |= front
    return found


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.fixture(scope="module")
def heart(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("heart") / "heart.nii.gz"
    fp.write_segmentation(lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0)), path)
    return path


# At once, while this process still loads what comes after the mesher, and when only the mesher is at work.
@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.1, 1.0])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_end_in_the_mesher(heart: Path, tmp_path: Path, number: signal.Signals, seconds: float) -> None:
    out = tmp_path / "result" / "out"
    out.parent.mkdir()
    # Shells let what runs in the background ignore interrupts.
    start = "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); from femprep.cli import main"
    command = [sys.executable, "-c", f"{start}; sys.exit(main())"]
    command += ["mesh", str(heart), "-o", str(out), "--preset", "acdc", "--edge-length", "1.2", "--quiet"]
    command += ["--refinement", "none"]  # which takes a minute
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, "TMPDIR": str(tmp_path)})
    try:
        deadline = time.monotonic() + 240.0
        while not (children := descendants(process.pid)):
            assert process.poll() is None, process.communicate()[1]
            assert time.monotonic() < deadline, "the mesher was not started"
            time.sleep(0.1)
        time.sleep(seconds)
        children |= descendants(process.pid)
        process.send_signal(number)
        _, error = process.communicate(timeout=120.0)
    finally:
        process.kill()
    deadline = time.monotonic() + 120.0  # a child that is still loading libraries sees it only then
    while any(alive(child) for child in children) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not [child for child in children if alive(child)], "a child lives on"
    assert not list(out.parent.iterdir()), "something was written"
    if number == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL
    else:
        assert process.returncode == 130
        assert "interrupted" in error
        assert "Traceback" not in error
