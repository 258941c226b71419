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


#: Nodes of a file of each version, the number of the first left open.
NODES = {
    "2.2": b"4\n%d 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1",
    "4.0": b"1 4\n1 3 0 4\n%d 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1",
    "4.1": b"1 4 1 4\n3 1 0 4\n%d\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1",
}


def written(folder: Path, version: str, nodes: bytes) -> Path:
    path = folder / "mesh.msh"
    head = b"$MeshFormat\n%s 0 8\n$EndMeshFormat\n" % version.encode()
    path.write_bytes(head + b"$Nodes\n" + nodes + b"\n$EndNodes\n")
    return path


@pytest.mark.parametrize("version", NODES)
@pytest.mark.parametrize(
    ("number", "words"),
    [
        (2_000_000_000, "it numbers a node 2000000000, in .* bytes"),
        (0, "it numbers a node 0, expected whole numbers from 1 on"),
        (-42, "it numbers a node -42, expected"),
        (4, "it has 2 nodes 4"),
    ],
)
def test_nodes_have_numbers_of_their_own(version: str, number: int, words: str, tmp_path: Path) -> None:
    """A file of 30 kB with a large number took 6 GB and 27 s; a node 0 stood for the last one."""
    with pytest.raises(FileError, match=words):
        fp.read_mesh(written(tmp_path, version, NODES[version] % number))


@pytest.mark.parametrize("version", NODES)
def test_nodes_that_are_missing_are_refused(version: str, tmp_path: Path) -> None:
    """Those of version 4 were what was in the memory."""
    head, rest = (NODES[version] % 1).split(b"\n", 1)
    nodes = head.replace(b"4", b"5", 1) + b"\n" + rest
    with pytest.raises(FileError, match="it says it has 5 nodes and lists 4"):
        fp.read_mesh(written(tmp_path, version, nodes))


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
    with pytest.raises(FileError, match=r"damaged|no mesh|version"):
        fp.read_mesh(path)


@pytest.mark.parametrize("version", ["4.04.1", "4.11", "3.0", "4"])
def test_versions_that_meshio_takes_for_others_are_refused(version: str, tmp_path: Path) -> None:
    """meshio takes 4.04.1 for 4.1, and nobody looked at its numbers: 16 GB."""
    path = written(tmp_path, version, NODES["4.1"] % 1)
    with pytest.raises(FileError, match="version"):
        fp.read_mesh(path)


def test_comments_may_come_first(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(heights=2, around=6, layers=1)
    path = tmp_path / "mesh.msh"
    fp.write_mesh(mesh, path)
    comment = b"$Comments\n" + b"$MeshFormat 9 9 9\n" * 500 + b"$EndComments\n"
    path.write_bytes(comment + path.read_bytes())
    assert fp.read_mesh(path).n_cells == mesh.n_cells
