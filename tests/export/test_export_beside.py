"""What stands beside a mesh is its own: what an earlier one of its path has left goes, what is others' stays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid

from femprep.errors import FileError
from femprep.export import read_mesh, write_mesh
from femprep.model import VolumeMesh

BARE = truncated_ellipsoid(heights=2, around=6, layers=1)


def full() -> VolumeMesh:
    """A mesh with all that stands in files beside it."""
    count, ones = BARE.n_cells, np.ones(len(BARE.points))
    axes = {name: np.tile(row, (count, 1)) for name, row in zip(("fiber", "sheet", "normal"), np.eye(3))}
    places = dict.fromkeys(("apicobasal", "transmural", "rotational"), 0.5 * ones)
    return BARE.with_data(cell={**axes, "aha": np.ones(count, np.int32)}, point=places)


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


PATHS = {
    "opencarp": "x.pts",
    "opencarp-binary": "x.bpts",
    "medit": "x.mesh",
    "dolfinx": "mesh.xdmf",
    "fenics": "mesh.xdmf",
    "svmultiphysics": "x",
}


@pytest.mark.parametrize("format", PATHS)
def test_another_mesh_of_the_same_path_leaves_nothing_of_the_earlier_one(format: str, tmp_path: Path) -> None:
    once, twice = tmp_path / "once", tmp_path / "twice"
    for folder, meshes in ((once, [BARE]), (twice, [full(), BARE])):
        folder.mkdir()
        (folder / "notes.txt").write_text("mine")
        for mesh in meshes:
            write_mesh(mesh, folder / PATHS[format], format=format)
    assert files(twice) == files(once)
    assert {path.name for path in twice.rglob("*") if path.is_dir()} <= {"x", "mesh-surfaces", "caps"}


def test_meshes_for_dolfinx_share_a_folder_unless_they_are_called_mesh(tmp_path: Path) -> None:
    """Files without the mesh's name, which readers of a whole folder look for, belong to mesh.xdmf alone."""
    others = {"info.json": b"{}", "markers.json": b"[]", "microstructure.bp/note.txt": b"mine"}
    (tmp_path / "microstructure.bp").mkdir()
    for name, content in others.items():
        (tmp_path / name).write_bytes(content)
    write_mesh(full(), tmp_path / "a.xdmf", format="dolfinx", length_unit="m")
    first = files(tmp_path)
    write_mesh(BARE, tmp_path / "b", format="dolfinx")
    assert files(tmp_path).items() >= {**first, **others}.items()
    for name in ("a.xdmf", "b.xdmf"):
        back = read_mesh(tmp_path / name)
        assert back.facet_names == BARE.facet_names
        np.testing.assert_allclose(back.points, BARE.points)
    before = files(tmp_path)
    with pytest.raises(FileError, match=r"holds 'info.json', 'markers.json', not from an earlier mesh.xdmf"):
        write_mesh(BARE, tmp_path / "mesh.xdmf", format="dolfinx")
    assert files(tmp_path) == before


@pytest.mark.parametrize(
    ("format", "path", "other"),
    [
        ("opencarp", "x.pts", "x.aha.dat"),
        ("opencarp", "x.pts", "x.elem"),
        ("opencarp", "x.pts", "x.bpts"),
        ("medit", "x.mesh", "x.fiber.sol"),
        ("dolfinx", "x.xdmf", "x.h5"),
        ("svmultiphysics", "x", "x/mesh-surfaces/epi.vtp"),
        ("svmultiphysics", "x", "x/mesh-complete.mesh.vtu"),
    ],
)
@pytest.mark.parametrize("with_mesh", [False, True])
def test_files_of_others_are_not_touched(format: str, path: str, other: str, with_mesh: bool, tmp_path: Path) -> None:
    (tmp_path / other).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / other).write_text("theirs")
    if with_mesh and format != "svmultiphysics":
        (tmp_path / path).write_text("theirs, too")
    before = files(tmp_path)
    with pytest.raises(FileError, match=f"{Path(other).name}', not from an earlier"):
        write_mesh(full(), tmp_path / path, format=format)
    assert files(tmp_path) == before


def test_a_surface_that_would_be_read_as_the_mesh_s_own_is_in_the_way(tmp_path: Path) -> None:
    write_mesh(BARE, tmp_path / "x.pts")
    (tmp_path / "x.pacing.vtx").write_text("0\nextra\n")
    write_mesh(BARE, tmp_path / "x.pts")
    assert (tmp_path / "x.pacing.vtx").exists()
    (tmp_path / "x.pacing.surf").write_text("0\n")
    with pytest.raises(FileError, match=r"holds 'x.pacing.surf', not from an earlier"):
        write_mesh(BARE, tmp_path / "x.pts")
