"""An output folder is there whole or not at all, and a later run takes nothing of the user's away."""

from __future__ import annotations

import errno
import json
import os
import signal
import tempfile
from pathlib import Path
from typing import Any

import pytest
from output_folders import FIRST, MINE, SECOND, held, make, write

from femprep.errors import DiskFullError, FileError, StageError
from femprep.report.folder import output_folder as folder_module
from femprep.report.folder.output_folder import MARKER, require_writable, whole_folder

MKDTEMP = tempfile.mkdtemp


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """A folder of a run, to which the user has added files and folders."""
    out = tmp_path / "out"
    make(out, FIRST)
    write(out, MINE)
    (out / "empty").mkdir()
    return out


def test_folder_appears_whole(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    make(out, FIRST)
    assert held(out) == FIRST
    assert [p.name for p in out.parent.iterdir()] == ["out"]


def test_second_run_replaces_the_files_of_the_first_and_no_others(out: Path) -> None:
    inode = (out / "sim").stat().st_ino
    (out / "to_data").symlink_to("/nowhere/data")
    make(out, SECOND)
    assert held(out) == {**SECOND, **MINE}
    assert (out / "empty").is_dir()
    assert (out / "to_data").readlink() == Path("/nowhere/data")
    assert (out / "sim").stat().st_ino == inode, "a program at work in a folder loses its place"
    assert [p.name for p in out.parent.iterdir()] == ["out"]


def test_third_run_finds_what_the_first_user_added(out: Path) -> None:
    make(out, SECOND)
    write(out, {"later.txt": "later"})
    make(out, FIRST)
    assert held(out) == {**FIRST, **MINE, "later.txt": "later"}


def test_user_folder_of_the_name_of_a_new_one_is_shared(out: Path) -> None:
    write(out, {"dolfinx/solution.xdmf": "mine"})
    make(out, {**SECOND, "dolfinx/mesh.xdmf": "two"})
    assert held(out / "dolfinx") == {"solution.xdmf": "mine", "mesh.xdmf": "two"}


@pytest.mark.parametrize("error", [StageError("no"), KeyboardInterrupt()])
def test_failure_leaves_the_earlier_folder_and_nothing_else(out: Path, error: BaseException) -> None:
    with pytest.raises(type(error)), whole_folder(out) as folder:
        (folder / "half").write_text("half")
        raise error
    assert held(out) == {**FIRST, **MINE}
    assert [p.name for p in out.parent.iterdir()] == ["out"]


@pytest.mark.parametrize("name", ["mesh.inp", "dolfinx", "surfaces/epi.vtp", "wall.vtp/inside.txt"])
def test_what_is_in_the_way_is_refused_before_and_after_the_work(out: Path, name: str) -> None:
    write(out, {name: "mine"})
    names = ["mesh.inp", "dolfinx/mesh.xdmf", "surfaces/epi.vtp", "wall.vtp"]
    first = name.split("/inside")[0]
    with pytest.raises(FileError, match=f"holds '{first}', which femprep did not write") as error:
        require_writable(out, names)
    assert error.value.exit_status == 2
    assert "\n" not in str(error.value)
    with pytest.raises(FileError, match=f"holds '{first}'"):
        make(out, dict.fromkeys(names, "new"))
    assert held(out) == {**FIRST, **MINE, name: "mine"}
    assert [p.name for p in out.parent.iterdir()] == ["out"]


def test_changed_file_of_an_earlier_run_is_refused(out: Path) -> None:
    (out / "mesh.vtu").write_text("edited")
    with pytest.raises(FileError, match=r"holds 'mesh\.vtu', changed since"):
        require_writable(out)
    with pytest.raises(FileError, match="changed since"):
        make(out, SECOND)
    assert held(out) == {**FIRST, **MINE, "mesh.vtu": "edited"}
    (out / "mesh.vtu").unlink()
    make(out, SECOND)
    assert held(out) == {**SECOND, **MINE}


def test_file_changed_or_added_while_the_run_is_at_work_is_not_lost(out: Path) -> None:
    with pytest.raises(FileError, match=r"'mesh\.inp', which femprep did not write"), whole_folder(out) as folder:
        write(folder, SECOND)
        (folder / MARKER).write_text(json.dumps({"files": [*SECOND]}))
        write(out, {"mesh.inp": "mine"})
    assert held(out) == {**FIRST, **MINE, "mesh.inp": "mine"}


def test_many_names_are_told_in_one_line(out: Path) -> None:
    names = [f"{number}.txt" for number in range(9)]
    write(out, dict.fromkeys(names, "mine"))
    with pytest.raises(FileError, match=r"'0.txt', '1.txt', '2.txt', '3.txt', '4.txt' and 4 more"):
        require_writable(out, names)


@pytest.mark.parametrize("name", ["../victim", "/etc/victim", "surfaces/../../victim", "", "."])
def test_record_that_names_files_elsewhere_is_refused(out: Path, name: str) -> None:
    victim = out.parent / "victim"
    victim.write_text("precious")
    (out / MARKER).write_text(json.dumps({"files": [name, "mesh.vtu"]}))
    with pytest.raises(FileError, match="outside its folder"):
        make(out, SECOND)
    assert victim.read_text() == "precious"
    assert held(out) == {**FIRST, **MINE}


def test_listed_file_behind_a_link_is_not_deleted(out: Path, tmp_path: Path) -> None:
    (out / "cavities").rename(tmp_path / "elsewhere")
    (out / "cavities").symlink_to(tmp_path / "elsewhere")
    make(out, SECOND)
    assert held(tmp_path / "elsewhere") == {"lv.vtp": "cavity one", "seen.txt": "seen"}
    assert (out / "cavities").is_symlink()


@pytest.mark.parametrize(
    "text", ["{", "[]", "{}", '{"files": 3}', '{"files": [3]}', '{"files": [], "sha256": {"a": 1}}', "\xff", "[" * 9999]
)
def test_record_that_is_none_is_refused(out: Path, text: str) -> None:
    (out / MARKER).write_bytes(text.encode("latin-1"))
    with pytest.raises(FileError, match="no record of a run") as error:
        require_writable(out)
    assert "\n" not in str(error.value)
    assert held(out) == {**FIRST, **MINE}


def test_record_without_hashes_tells_names_alone(out: Path) -> None:
    (out / MARKER).write_text(json.dumps({"files": [*FIRST]}))
    make(out, SECOND)
    assert held(out) == {**SECOND, **MINE}


def test_folder_of_someone_else_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "thesis"
    write(out, {"chapter1.tex": "text"})
    with pytest.raises(FileError, match="did not write"):
        require_writable(out)
    with pytest.raises(FileError, match="did not write"), whole_folder(out):
        pass
    assert held(out) == {"chapter1.tex": "text"}


def test_output_that_is_a_file_or_a_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(FileError, match="not a folder"):
        require_writable(tmp_path / "file")
    with pytest.raises(FileError, match="is a file"):
        require_writable(tmp_path / "file" / "out")
    make(tmp_path / "real", FIRST)
    (tmp_path / "link").symlink_to(tmp_path / "real")
    with pytest.raises(FileError, match=r"symbolic link to '.*real', not a folder"):
        require_writable(tmp_path / "link")


def test_unwritable_parent_is_refused() -> None:
    with pytest.raises(FileError, match="cannot be written"):
        require_writable(Path("/proc/out"))


def test_read_only_folder_is_refused_before_any_work(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # For root every folder is writable, so that the system's answer is put in its mouth.
    monkeypatch.setattr(os, "access", lambda path, mode: not (mode & os.W_OK and Path(path) == out))
    with pytest.raises(FileError, match="read-only"):
        require_writable(out)


def test_disk_of_its_own_is_refused_before_any_work(out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os.path, "ismount", lambda path: Path(path) == out)
    with pytest.raises(FileError, match="a disk of its own"):
        require_writable(out)


def test_folder_keeps_its_permissions(out: Path) -> None:
    out.chmod(0o770)
    make(out, SECOND)
    assert out.stat().st_mode & 0o777 == 0o770


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EFBIG])
def test_disk_that_becomes_full_leaves_the_earlier_folder(out: Path, number: int) -> None:
    with pytest.raises(DiskFullError, match=r"out' cannot be written whole") as error, whole_folder(out) as folder:
        write(folder, SECOND)
        raise OSError(number, os.strerror(number), str(folder / "mesh.inp"))
    assert error.value.exit_status == 3
    assert "partial" not in str(error.value)
    assert held(out) == {**FIRST, **MINE}
    assert [p.name for p in out.parent.iterdir()] == ["out"]


def test_disk_without_room_is_refused_before_any_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = folder_module.shutil.disk_usage(tmp_path)
    monkeypatch.setattr(folder_module.shutil, "disk_usage", lambda path: usage._replace(free=5000))
    with pytest.raises(DiskFullError, match="5 kB of room are left") as error:
        require_writable(tmp_path / "out")
    assert error.value.exit_status == 3


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("when", ["asked", "begun"])
def test_signal_while_a_folder_is_made_leaves_none(
    number: int, when: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def made_and_ended(*args: Any, **keywords: Any) -> str:
        made.append(MKDTEMP(*args, **keywords))
        if when == "asked" or len(made) == 2:
            signal.raise_signal(number)
        return made[-1]

    def end(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(number, end)
    monkeypatch.setattr(tempfile, "mkdtemp", made_and_ended)
    try:
        with pytest.raises(KeyboardInterrupt), whole_folder(tmp_path / "out"):
            pass
        assert signal.getsignal(number) is end
    finally:
        signal.signal(number, before)
    assert made
    assert list(tmp_path.iterdir()) == []
