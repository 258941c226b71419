"""How a file begins: packed, in UTF-16, or with a mark in front; a path that VTK cannot open, and a folder."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import meshio
import numpy as np
import pytest
from meshes import quadratic, truncated_ellipsoid

import femprep as fp
from femprep.errors import FileError


@pytest.fixture(params=["inp", "k", "msh", "mesh"])
def text(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return fp.write_mesh(truncated_ellipsoid("tetra"), tmp_path / f"a.{request.param}")[0]


def test_a_packed_text(text: Path) -> None:
    named = text.with_suffix(".gz")
    named.write_bytes(text.read_bytes())
    with pytest.raises(FileError, match="is not packed by gzip; give it the ending of its format"):
        fp.read_mesh(named)
    for path in (text, text.with_suffix(".vtk")):
        path.write_bytes(gzip.compress(named.read_bytes()))
        with pytest.raises(FileError, match="is packed by gzip; unpack it"):
            fp.read_mesh(path)


def test_a_text_in_two_bytes_a_letter(text: Path) -> None:
    for path in (text, text.with_suffix(".vtk")):
        path.write_text(text.read_text(), encoding="utf-16") if path == text else path.write_bytes(text.read_bytes())
        with pytest.raises(FileError, match="is text in UTF-16; save it in UTF-8"):
            fp.read_mesh(path)


def test_a_mark_in_front(text: Path) -> None:
    text.write_bytes(b"\xef\xbb\xbf" + text.read_bytes())
    if text.suffix in (".inp", ".k"):
        assert fp.read_mesh(text).n_cells
    else:
        with pytest.raises(FileError, match="begins with a byte order mark; save it in UTF-8 without one"):
            fp.read_mesh(text)


def test_a_path_that_is_no_text(tmp_path: Path) -> None:
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/\xff.vtu"))
    try:
        path.write_bytes(fp.write_mesh(truncated_ellipsoid("tetra"), tmp_path / "a.vtu")[0].read_bytes())
    except OSError:
        pytest.skip("the system holds no such names")
    with pytest.raises(FileError) as error:
        fp.read_mesh(path)
    assert str(error.value).endswith("has letters in its path that are no UTF-8, which VTK needs; rename it")
    assert str(error.value).count("udcff") == 1


@pytest.mark.parametrize("name", ["a.vtu", "a.inp", "a"])
def test_a_folder(name: str, tmp_path: Path) -> None:
    (tmp_path / name).mkdir()
    with pytest.raises(FileError, match=r"holds no mesh-complete\.mesh\.vtu; name the file of a mesh"):
        fp.read_mesh(tmp_path / name)


def test_quadratic_elements_among_others_in_xdmf(tmp_path: Path) -> None:
    mesh = quadratic(truncated_ellipsoid("tetra"))
    cells = [("tetra10", mesh.cells["tetra10"]), ("triangle6", np.array([[0, 1, 2, 3, 4, 5]]))]
    meshio.Mesh(mesh.points, cells).write(tmp_path / "a.xdmf")
    with pytest.raises(FileError, match=r"mixes elements of several types, some with mid-side nodes.*write VTU"):
        fp.read_mesh(tmp_path / "a.xdmf")
