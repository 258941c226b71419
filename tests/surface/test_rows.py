"""Surfaces in text: as many vertices and faces as they say, or refused."""

from __future__ import annotations

from pathlib import Path

import pytest

import femprep as fp
from femprep.errors import FileError

POINTS = "0 0 0\n10 0 0\n0 10 0\n0 0 10\n"
FACES = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
OFF = "OFF\n{} {} 0\n" + POINTS + FACES
PLY = (
    "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
    "element face {}\nproperty list uchar int vertex_indices\nend_header\n" + POINTS + FACES
)


@pytest.mark.parametrize(("ending", "text"), [(".off", OFF), (".ply", PLY)])
def test_counts_are_those_of_the_rows(ending: str, text: str, tmp_path: Path) -> None:
    """A face more than there are vertices was one, and a face less was lost."""
    path = tmp_path / f"a{ending}"
    path.write_text(text.format(4, 4) + "\n\n")
    assert len(fp.read_surface(path).cells) == 4
    for counts in ((5, 4), (3, 4), (4, 5), (4, 3)):
        path.write_text(text.format(*counts))
        with pytest.raises(FileError, match=f"says it has {sum(counts)} rows of vertices and faces, and has 8"):
            fp.read_surface(path)
    path.write_text(text.format(4, 4).rstrip()[:-2])
    with pytest.raises(FileError, match="has a face '3 1 2', expected 3 corners"):
        fp.read_surface(path)


def test_corners_of_obj_begin_with_1(tmp_path: Path) -> None:
    points = "".join(f"v {line}\n" for line in POINTS.splitlines())
    path = tmp_path / "a.obj"
    path.write_text(points + "f 1 3 2\nf 1 2 4\nf 1/1 4/2 3//3\nf 2 3 4\n")
    assert len(fp.read_surface(path).cells) == 4
    path.write_text(points + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 0/4\n")
    with pytest.raises(FileError, match="has a face 'f 2 3 0'; corners begin with 1"):
        fp.read_surface(path)


@pytest.mark.parametrize("face", ["f 2 3", "f 2//1 3//2  ", "f # lost", "f 2 3\r"])
def test_faces_of_obj_have_three_corners(face: str, tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    points = "".join(f"v {line}\n" for line in POINTS.splitlines())
    path.write_text(f"{points}f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 \\\n3 4\n")
    assert len(fp.read_surface(path).cells) == 4
    path.write_bytes(f"{points}f 1 3 2\nf 1 2 4\nf 1 4 3\n{face}\n".encode())
    with pytest.raises(FileError, match="expected three corners"):
        fp.read_surface(path)
