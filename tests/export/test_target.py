"""A mesh goes where its path says, or nowhere."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from meshes import truncated_ellipsoid

from femprep.errors import FileError, OptionError
from femprep.export import read_mesh, write_facets, write_mesh
from femprep.export.target import target_of

MESH = truncated_ellipsoid(heights=2, around=6, layers=1)


@pytest.mark.parametrize(
    ("name", "format", "told"),
    [
        ("data.vtu", "abaqus", "the ending '.vtu' of .* is not that of abaqus; name it 'data.inp'"),
        ("data.vtk", "vtu", "name it 'data.vtu'"),
        ("DATA.INP", None, "name it 'DATA.inp'"),
        ("data.msh", "dolfinx", "name it 'data.xdmf'"),
        ("data.vtu", "svmultiphysics", "name it 'data'"),
    ],
)
def test_the_ending_of_another_format_is_refused(name: str, format: str | None, told: str, tmp_path: Path) -> None:
    (tmp_path / "data.inp").write_text("earlier")
    with pytest.raises(OptionError, match=told):
        write_mesh(MESH, tmp_path / name, format=format)
    assert [path.name for path in tmp_path.iterdir()] == ["data.inp"]
    assert (tmp_path / "data.inp").read_text() == "earlier"


@pytest.mark.parametrize(
    ("name", "told"), [(".", "is a folder"), ("..", "is a folder"), ("sub", "is a folder"), ("-", "no regular file")]
)
def test_what_is_no_file_is_refused(name: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sub" / "sub").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "sub")
    for write in (lambda: write_mesh(MESH, name, format="vtu"), lambda: write_facets(MESH, name)):
        with pytest.raises(FileError, match=told):
            write()
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["sub", "sub"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("write", [lambda path: write_mesh(MESH, path, format="vtu"), lambda p: write_facets(MESH, p)])
def test_a_pipe_stays_one(write: Callable[[Path], object], tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileError, match="no regular file"):
        write(tmp_path / "pipe")
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


@pytest.mark.parametrize(
    ("format", "ending"),
    [("abaqus", ".inp"), ("opencarp", ".pts"), ("opencarp-binary", ".bpts"), ("dolfinx", ".xdmf"), ("medit", ".mesh")],
)
def test_a_dot_in_a_name_is_no_ending(format: str, ending: str, tmp_path: Path) -> None:
    written = write_mesh(MESH, tmp_path / "patient.007", format=format)
    file = tmp_path / f"patient.007{ending}"
    assert file in written
    assert read_mesh(file).facet_names == MESH.facet_names
    assert target_of(tmp_path / "patient.007", format).file == file


@pytest.mark.parametrize("name", [".", "..", "-"])
def test_a_format_that_is_a_folder_needs_a_name(name: str) -> None:
    with pytest.raises(FileError, match="names no folder"):
        target_of(name, "svmultiphysics")


def test_a_link_is_replaced_and_what_it_leads_to_stays(tmp_path: Path) -> None:
    (tmp_path / "own.inp").write_text("earlier")
    (tmp_path / "lv.inp").symlink_to("own.inp")
    write_mesh(MESH, tmp_path / "lv.inp")
    assert not (tmp_path / "lv.inp").is_symlink()
    assert (tmp_path / "own.inp").read_text() == "earlier"
