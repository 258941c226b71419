"""Whenever a run is killed its output folder is the earlier one or the new one, and nothing of the user's is lost."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from output_folders import FIRST, MINE, SECOND, held, make, write

from femprep.report.folder import swap
from femprep.report.folder.output_folder import require_writable, whole_folder

posix = pytest.mark.skipif(not hasattr(os, "fork"), reason="kills a process made by fork")
#: Exit status of a process that ended itself as if killed.
KILLED = 9
#: At each of these a process may be killed, just before it happens.
INSTANTS = ("os.rename", "os.link", "os.remove", "os.rmdir", "os.mkdir", "os.chmod", "ctypes.dlsym", "os.scandir")


def killed_at(number: int, run: Callable[[], None]) -> bool:
    """Run something in a process that is gone at its so many-th change of the disk; whether it came so far."""
    pid = os.fork()
    if pid == 0:
        left = number

        def hook(event: str, _: object) -> None:
            nonlocal left
            if event in INSTANTS:
                left -= 1
                if left < 0:
                    os._exit(KILLED)

        sys.addaudithook(hook)
        try:
            run()
        except BaseException:
            os._exit(1)
        os._exit(0)
    status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    assert status in (0, KILLED)
    return status == KILLED


def prepared(folder: Path) -> Path:
    out = folder / "out"
    make(out, FIRST)
    write(out, MINE)
    return out


@pytest.mark.slow
@posix
@pytest.mark.parametrize("exchange", [True, False], ids=["names exchanged", "renamed twice"])
@pytest.mark.parametrize("link", [True, False], ids=["links", "no links"])
def test_killed_at_any_instant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exchange: bool, link: bool) -> None:
    if not exchange:
        monkeypatch.setattr(swap, "_exchange", lambda one, two: False)
    elif sys.platform != "linux":
        pytest.skip("only Linux exchanges names")
    if not link:
        monkeypatch.setattr(os, "link", lambda *names, **options: (_ for _ in ()).throw(PermissionError(1, "no")))
    number, ends = 0, set()
    while True:
        out = prepared(tmp_path / str(number))
        killed = killed_at(number, lambda out=out: make(out, SECOND))
        assert out.exists() or not exchange, number
        if out.exists():
            found = held(out)
            ours = {name: text for name, text in found.items() if name not in MINE}
            assert ours in (FIRST, SECOND), number
            ends.add("mesh.inp" in ours)
            if link:  # a file of the user's is in its place at every instant
                files = [name for name in MINE if not name.startswith("sim")]
                assert {name: found.get(name) for name in files} == {name: MINE[name] for name in files}, number
        require_writable(out)  # as the next run does
        found = held(out)
        assert found in ({**FIRST, **MINE}, {**SECOND, **MINE}), number
        assert [path.name for path in out.parent.iterdir()] == ["out"], number
        make(out, SECOND)
        assert held(out) == {**SECOND, **MINE}, number
        if not killed:
            break
        number += 1
    assert number > 15
    assert ends == {True, False}


@posix
def test_folder_of_a_run_at_work_is_left_alone(tmp_path: Path) -> None:
    """Another run into the same folder sweeps away what killed ones left, not what is being made."""
    out = prepared(tmp_path)
    dead = tmp_path / ".out.partial-abcdefgh"
    write(dead, {"half": "half"})
    with whole_folder(out) as folder:
        write(folder, {"half": "half"})
        require_writable(out)
        assert held(folder) == {"half": "half"}
        assert not dead.exists()
        make(out, SECOND)
        (folder / "run.json").write_text('{"files": ["half", "run.json"]}')
    assert held(out) == {"half": "half", **MINE}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_neighbours_of_similar_names_are_left_alone(tmp_path: Path) -> None:
    out = prepared(tmp_path)
    names = [".out.partial-mine", ".out.old-2024", ".out2.partial-abcdefgh", "out.old-abcdefgh"]
    for name in names:
        write(tmp_path / name, {"file": "mine"})
    (tmp_path / ".out.old-abcdefgh").symlink_to(tmp_path / "out.old-abcdefgh")
    make(out, SECOND)
    assert all(held(tmp_path / name) == {"file": "mine"} for name in names)


def test_file_written_into_the_earlier_folder_at_the_last_moment_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = prepared(tmp_path)
    exchange = swap._exchange

    def late(one: Path, two: Path) -> bool:
        write(out, {"late.txt": "late", "sim/late.txt": "late"})
        return exchange(one, two)

    monkeypatch.setattr(swap, "_exchange", late)
    make(out, SECOND)
    assert held(out) == {**SECOND, **MINE, "late.txt": "late", "sim/late.txt": "late"}
