"""Whatever a file is written by, a full disk ends in one line and leaves nothing behind."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from full_disks import small_disk
from meshes import truncated_ellipsoid, with_fibres
from slow_params import slow_but

import femprep as fp
from femprep.export import FORMATS, write_format, write_mesh

HERE = Path(__file__).parents[1]

# In a process of its own: native code that does not bear it ends the process.
WRITE = """
import sys
from contextlib import nullcontext
from pathlib import Path
from full_disks import small_files
import femprep as fp
mesh, folder, name, limit = fp.read_mesh(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], int(sys.argv[4])
with small_files(limit) if limit else nullcontext():
    try:
        if name == "facets":
            fp.export.write_facets(mesh, folder / "facets.vtp")
        else:
            fp.export.write_format(mesh, folder, name)
    except fp.DiskFullError as error:
        assert "\\n" not in str(error) and "no room is left" in str(error), error
        sys.exit(error.exit_status)
"""


@pytest.fixture(scope="module")
def mesh_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mesh") / "mesh.vtu"
    write_mesh(with_fibres(truncated_ellipsoid("tetra", heights=8, around=24, layers=3)), path)
    return path


def written(mesh_file: Path, folder: Path, name: str, limit: int = 0) -> int:
    """Exit status of a process that writes the mesh."""
    command = [sys.executable, "-c", WRITE, str(mesh_file), str(folder), name, str(limit)]
    paths = os.pathsep.join([str(HERE), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": paths})
    assert done.stderr == ""
    return done.returncode


@pytest.mark.parametrize("name", slow_but(["abaqus"], [*FORMATS, "facets"]))
def test_limit_of_file_size(mesh_file: Path, tmp_path: Path, name: str) -> None:
    assert written(mesh_file, tmp_path, name, 1000) == 3
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.parametrize("size", ["8k", "32k"])
@pytest.mark.parametrize("name", ["vtu", "dolfinx", "fenics", "svmultiphysics", "med", "abaqus"])
def test_small_disk(mesh_file: Path, tmp_path: Path, name: str, size: str) -> None:
    with small_disk(tmp_path / "disk", size) as disk:
        assert written(mesh_file, disk, name) == 3
        assert not list(disk.iterdir())


@pytest.mark.parametrize("name", FORMATS)
def test_each_format_writes_the_files_it_names(mesh_file: Path, tmp_path: Path, name: str) -> None:
    write_format(fp.read_mesh(mesh_file), tmp_path, name)
    files = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert set(FORMATS[name].files) <= files
    assert FORMATS[name].files


def test_folder_format_leaves_what_else_a_folder_holds(mesh_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "results"
    fp.write_mesh(truncated_ellipsoid("hexahedron"), out, format="svmultiphysics")
    (out / "thesis.tex").write_text("mine")
    (out / "mesh-surfaces" / "seen.txt").write_text("mine")
    fp.write_mesh(fp.read_mesh(mesh_file), out, format="svmultiphysics")
    assert (out / "thesis.tex").read_text() == "mine"
    assert (out / "mesh-surfaces" / "seen.txt").read_text() == "mine"
    assert fp.read_mesh(out).n_cells == fp.read_mesh(mesh_file).n_cells
    assert [path.name for path in tmp_path.iterdir()] == ["results"]


def test_file_where_a_folder_goes_is_refused_before_anything_is_replaced(mesh_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "results"
    fp.write_mesh(truncated_ellipsoid("hexahedron"), out, format="svmultiphysics")
    earlier = (out / "mesh-complete.mesh.vtu").read_bytes()
    shutil.rmtree(out / "mesh-surfaces")
    (out / "mesh-surfaces").write_text("mine")
    with pytest.raises(fp.FileError, match="is a file, not a folder"):
        fp.write_mesh(fp.read_mesh(mesh_file), out, format="svmultiphysics")
    assert (out / "mesh-complete.mesh.vtu").read_bytes() == earlier
