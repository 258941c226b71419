import os
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest
from full_disks import small_disk, small_files
from slow_params import slow_but

from femprep.errors import DiskFullError, FileError, MissingDependencyError, ResourceError, StageError
from femprep.volume.tetwild import guard

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
TRIANGLES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])

linux = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes through /proc")


def run(**changes):
    settings = {"time_limit": 60.0, "memory_limit": 4.0, **changes}
    return guard.run_tetwild(POINTS, TRIANGLES, {"edge_length_abs": 0.5, "num_threads": 1}, **settings)


def fake_worker(monkeypatch, folder: Path, text: str) -> None:
    """Run another script in place of the one that calls fTetWild."""
    script = folder / "worker.py"
    script.write_text(textwrap.dedent(text), encoding="utf-8")
    monkeypatch.setattr(guard, "WORKER", script)


def alive(pid: int) -> bool:
    """Whether a process runs (one that has ended and waits to be collected does not)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def wait_for(condition, seconds: float = 20.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    raise AssertionError("condition did not come true")


def pid_written(path: Path):
    return lambda: int(path.read_text()) if path.exists() and path.read_text() else None


@pytest.fixture
def temporary(monkeypatch, tmp_path) -> Path:
    """A folder for temporary files that no other process uses."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def test_meshes_a_tetrahedron(temporary):
    before = Path.cwd()
    result = run()
    assert not list(temporary.iterdir())
    x = result.points[result.cells]
    volume = np.linalg.det(x[:, 1:] - x[:, :1]) / 6
    assert volume.min() > 0
    assert volume.sum() == pytest.approx(1 / 6, rel=0.02)
    assert result.seconds > 0
    if sys.platform == "linux":
        assert 20e6 < result.peak_bytes < 4e9
    assert Path.cwd() == before
    assert not Path("__tracked_surface.stl").exists()


def test_crash_becomes_one_line(monkeypatch, tmp_path, temporary):
    fake_worker(monkeypatch, tmp_path, "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    with pytest.raises(
        StageError, match=r"^the mesher was ended by SIGSEGV after .* choose another edge_length"
    ) as error:
        run()
    assert "\n" not in str(error.value)
    assert not list(temporary.iterdir())


@pytest.mark.slow
def test_result_that_finds_no_room_blames_the_folder_for_temporary_files(temporary):
    with small_files(4096), pytest.raises(DiskFullError, match=rf"'{temporary}', became full .* set TMPDIR") as error:
        guard.run_tetwild(
            POINTS, TRIANGLES, {"edge_length_abs": 0.05, "num_threads": 1}, time_limit=60.0, memory_limit=4.0
        )
    assert error.value.exit_status == 3
    assert "\n" not in str(error.value)
    assert not list(temporary.iterdir())


def test_crash_on_a_full_disk_blames_the_disk(monkeypatch, tmp_path):
    fake_worker(
        monkeypatch,
        tmp_path,
        """
        import os, signal
        try:
            with open("large", "wb") as file:
                while True:
                    file.write(bytes(4096))
                    file.flush()
        except OSError:
            os.kill(os.getpid(), signal.SIGABRT)
        """,
    )
    with small_disk(tmp_path / "disk", "200k") as disk:
        monkeypatch.setattr(tempfile, "tempdir", str(disk))
        with pytest.raises(DiskFullError, match="became full while the mesher ran"):
            run()
        assert not list(disk.iterdir())


def test_room_is_looked_for_before_the_run(monkeypatch, tmp_path, temporary):
    fake_worker(monkeypatch, tmp_path, "raise RuntimeError('was started')")
    with pytest.raises(DiskFullError, match=r"MB left, the mesher needs 1000000000000\.0 MB or more; .* TMPDIR"):
        run(least_room=1e18)
    assert not list(temporary.iterdir())


def test_missing_folder_for_temporary_files_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    with pytest.raises(FileError, match=r"a temporary folder cannot be written: .*; set TMPDIR"):
        run()


def test_exception_in_the_child_is_quoted(monkeypatch, tmp_path):
    fake_worker(monkeypatch, tmp_path, "raise RuntimeError('no simplex left')")
    with pytest.raises(StageError, match=r"failed with status 1 after .*RuntimeError: no simplex left"):
        run()


def test_missing_pytetwild_is_named(monkeypatch, tmp_path):
    fake_worker(monkeypatch, tmp_path, "raise ModuleNotFoundError(\"No module named 'pytetwild'\")")
    with pytest.raises(MissingDependencyError, match="pip install pytetwild"):
        run()


HANG = """
    import os, sys, time
    open({pid!r}, "w").write(str(os.getpid()))
    time.sleep(120)
"""


WORK = """
    import os
    open({pid!r}, "w").write(str(os.getpid()))
    while True:
        pass
"""


@linux
@pytest.mark.parametrize("worker", [pytest.param(HANG, marks=pytest.mark.slow), WORK], ids=["hang", "work"])
def test_time_limit_ends_the_child(monkeypatch, tmp_path, temporary, worker):
    fake_worker(monkeypatch, tmp_path, worker.format(pid=str(tmp_path / "pid")))
    with pytest.raises(guard.TooLongError, match="did not finish within 1 s; choose a larger edge_length") as error:
        run(time_limit=1.0)
    # What it took all the same is known: a run that gave nothing counts among the seconds.
    assert error.value.seconds >= 1.0
    least = 0.1 if worker == WORK else 0.0
    assert least <= error.value.processor_seconds < error.value.seconds + 1.0
    assert not alive(int((tmp_path / "pid").read_text()))
    assert not list(temporary.iterdir())


SLOW = """
    import os, time
    open({pid!r}, "w").write(str(os.getpid()))
    while True:
        end = time.process_time() + 0.02
        while time.process_time() < end:
            pass
        time.sleep(0.18)
"""


@pytest.mark.slow
@linux
def test_a_child_that_gets_little_of_a_busy_machine_may_use_all_of_its_time(monkeypatch, tmp_path, temporary):
    fake_worker(monkeypatch, tmp_path, SLOW.format(pid=str(tmp_path / "pid")))
    with pytest.raises(guard.TooLongError) as error:
        run(time_limit=0.4)
    assert error.value.processor_seconds > 0.4
    assert error.value.seconds > 5.0 * 0.4


@linux
def test_what_progress_raises_cancels_the_run(monkeypatch, tmp_path):
    fake_worker(monkeypatch, tmp_path, HANG.format(pid=str(tmp_path / "pid")))
    pulses = []

    def pulse(gone: float) -> None:
        pulses.append(gone)
        if (tmp_path / "pid").exists() and len(pulses) >= 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(pulse=pulse)
    assert pulses == sorted(pulses)
    assert 0.15 < np.diff(pulses).mean() < 2.0
    assert not alive(int((tmp_path / "pid").read_text()))


@linux
def test_memory_limit_ends_the_child(monkeypatch, tmp_path):
    fake_worker(
        monkeypatch,
        tmp_path,
        "block = bytearray(400_000_000)\nblock[::4096] = b'1' * len(block[::4096])\nimport time; time.sleep(60)",
    )
    with pytest.raises(ResourceError, match=r"took 0\.\d GB, more than 0\.2 GB \(option memory_limit\)"):
        run(memory_limit=0.2)


PARENT = """
    import signal, sys
    import numpy as np
    from pathlib import Path
    from femprep.volume.tetwild import guard
    signal.signal(signal.SIGINT, signal.default_int_handler)   # shells let what runs in the background ignore it
    wait = Path({folder!r}, "worker.py")
    wait.write_text(
        "import ctypes, os, runpy, sys, time\\n"
        "worker = runpy.run_path({worker!r}, run_name='worker')\\n"
        "worker['follow_parent'](int(sys.argv[2]))\\n"
        "open({pid!r}, 'w').write(str(os.getpid()))\\n"
        "libc = ctypes.PyDLL(None)\\n"   # keeps the interpreter's lock, as fTetWild does
        "libc.sleep(100)\\n"
    )
    guard.WORKER = wait
    guard.run_tetwild(np.zeros((4, 3)), np.zeros((4, 3), int), {{}}, time_limit=90.0, memory_limit=4.0)
"""


@linux
@pytest.mark.parametrize("name", slow_but(["SIGKILL"], ["SIGKILL", "SIGTERM", "SIGINT"]))
def test_neither_orphan_nor_folder_when_the_parent_is_ended(tmp_path, name):
    pid = tmp_path / "pid"
    script = PARENT.format(folder=str(tmp_path), worker=str(guard.WORKER), pid=str(pid))
    folder = tmp_path / "temporary"
    folder.mkdir()
    parent = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "TMPDIR": str(folder)},
    )
    try:
        child = wait_for(pid_written(pid))
        assert alive(child)
        assert [path.name.startswith("femprep-tetwild-") for path in folder.iterdir()] == [True]
        parent.send_signal(getattr(signal, name))
        parent.wait(timeout=20)
        wait_for(lambda: not alive(child), 10.0)
        wait_for(lambda: not list(folder.iterdir()))
    finally:
        parent.kill()
        parent.wait()


WATCHED = """
    import sys, time
    from femprep.volume.tetwild.guard import start_watchdog, watch
    watch(start_watchdog(sys.argv[2]), int(sys.argv[1]))
    print("ready", flush=True)
    time.sleep(100)
"""


@pytest.mark.slow
@linux
def test_watchdog_ends_a_process_and_removes_its_folder_when_this_one_is_killed(tmp_path):
    """What other systems than Linux rely on."""
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "file").touch()
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(100)"])
    parent = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(WATCHED), str(child.pid), str(folder)], stdout=subprocess.PIPE, text=True
    )
    try:
        assert parent.stdout is not None
        assert parent.stdout.readline() == "ready\n"
        assert child.poll() is None
        os.kill(parent.pid, signal.SIGKILL)
        assert child.wait(timeout=20) == -signal.SIGKILL
        wait_for(lambda: not folder.exists())
    finally:
        for process in (parent, child):
            process.kill()
            process.wait()
        parent.stdout.close()


def test_worker_timer_ends_it_whatever_its_parent_does(monkeypatch, tmp_path):
    """The native timer: the worker itself ends after the time limit although the interpreter's lock is held."""
    script = (
        "import runpy, sys, ctypes\n"
        f"worker = runpy.run_path({str(guard.WORKER)!r}, run_name='worker')\n"
        "worker['main'].__globals__['_GRACE'] = 0.5\n"
        "import types; fake = types.ModuleType('pytetwild')\n"
        "fake.tetrahedralize = lambda *a, **k: ctypes.PyDLL(None).sleep(100)\n"
        "sys.modules['pytetwild'] = fake\n"
        "import os; from pathlib import Path\n"
        f"worker['main'](Path({str(tmp_path)!r}), os.getppid(), 0.5)\n"
    )
    np.savez(tmp_path / "input.npz", points=POINTS, triangles=TRIANGLES, settings="{}")
    start = time.monotonic()
    child = subprocess.run([sys.executable, "-c", script], capture_output=True, timeout=60, check=False)
    assert child.returncode == 1
    assert b"Timeout" in child.stderr
    assert time.monotonic() - start < 30
    assert not (tmp_path / "output.npz").exists()
