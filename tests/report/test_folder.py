"""An output folder is there whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from femprep.errors import FileError, StageError
from femprep.report.folder import MARKER, require_writable, whole_folder


def make(out: Path, text: str) -> None:
    with whole_folder(out) as folder:
        (folder / MARKER).write_text(text)


def test_folder_appears_whole(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    make(out, "one")
    assert (out / MARKER).read_text() == "one"
    assert [p.name for p in out.parent.iterdir()] == ["out"]


def test_earlier_folder_is_replaced_with_all_its_files(tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(out, "one")
    (out / "old.vtu").write_text("old")
    make(out, "two")
    assert sorted(p.name for p in out.iterdir()) == [MARKER]
    assert (out / MARKER).read_text() == "two"
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("error", [StageError("no"), KeyboardInterrupt()])
def test_failure_leaves_the_earlier_folder_and_nothing_else(tmp_path: Path, error: BaseException) -> None:
    out = tmp_path / "out"
    make(out, "one")
    with pytest.raises(type(error)), whole_folder(out) as folder:
        (folder / "half").write_text("half")
        raise error
    assert (out / MARKER).read_text() == "one"
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_folder_of_someone_else_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "thesis"
    out.mkdir()
    (out / "chapter1.tex").write_text("text")
    with pytest.raises(FileError, match="did not write"):
        require_writable(out)
    with pytest.raises(FileError, match="did not write"), whole_folder(out):
        pass
    assert (out / "chapter1.tex").read_text() == "text"


def test_output_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(FileError, match="not a folder"):
        require_writable(tmp_path / "file")
    with pytest.raises(FileError, match="is a file"):
        require_writable(tmp_path / "file" / "out")


def test_unwritable_parent_is_refused() -> None:
    with pytest.raises(FileError, match="cannot be written"):
        require_writable(Path("/proc/out"))
