"""Counts of Gmsh's files: more nodes than bytes are refused, sound files read."""

from __future__ import annotations

import struct
from pathlib import Path

import meshio
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.errors import FileError

MANY = 671_088_640


def binary(width: int) -> bytes:
    counts = struct.pack("=4I" if width == 4 else "=4Q", 0, MANY, 1, MANY)
    return b"$MeshFormat\n4.1 1 %d\n" % width + struct.pack("i", 1) + b"\n$EndMeshFormat\n$Nodes\n" + counts


@pytest.mark.parametrize(
    "content", [b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n0 %d 1 %d\n" % (MANY, MANY), binary(4), binary(8)]
)
def test_more_nodes_than_bytes_are_refused(content: bytes, tmp_path: Path) -> None:
    """meshio sorted as many numbers as there should be nodes: 5 GB and 16 s for a file of 137 bytes."""
    path = tmp_path / "mesh.msh"
    path.write_bytes(content)
    with pytest.raises(FileError, match=f"it says it has {MANY} nodes, in {len(content)} bytes"):
        fp.read_mesh(path)


@pytest.mark.parametrize("made", [("gmsh", True), ("gmsh", False), ("gmsh22", True), ("gmsh22", False)])
def test_sound_files_are_read(made: tuple[str, bool], tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(heights=2, around=6, layers=1)
    cells = [(kind, nodes) for kind, nodes in mesh.cells.items()]
    path = tmp_path / "mesh.msh"
    meshio.write(path, meshio.Mesh(mesh.points, cells), file_format=made[0], binary=made[1])
    assert fp.read_mesh(path).n_cells == mesh.n_cells


@pytest.mark.parametrize("content", [b"", b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", b"$Nodes\n"])
def test_without_counts_it_is_the_readers_to_say(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "mesh.msh"
    path.write_bytes(content)
    with pytest.raises(FileError, match=r"damaged|no mesh|unknown format"):
        fp.read_mesh(path)
