"""Mid-side nodes at other edges than their own: a file's order that is not the one it is read in."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

import femprep as fp
from femprep.errors import FileError, InputError
from femprep.export.midside import require_own_edges


def tet10(count: int = 3) -> fp.VolumeMesh:
    """Tetrahedra of ten nodes apart from each other, each side somewhat bent."""
    corners = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9)], dtype=float)
    edges = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    one = np.vstack([corners, *[(corners[a] + corners[b]) / 2 + 0.5 for a, b in edges]])
    points = np.vstack([one + 20.0 * i for i in range(count)])
    return fp.VolumeMesh(
        points=points, cells={"tetra10": np.arange(10 * count).reshape(count, 10)}, region=np.ones(count)
    )


def test_most_elements_of_a_type_decide() -> None:
    mesh = tet10()
    require_own_edges(mesh)
    rows = mesh.cells["tetra10"].copy()
    rows[0, [4, 5]] = rows[0, [5, 4]]
    require_own_edges(fp.VolumeMesh(points=mesh.points, cells={"tetra10": rows}, region=np.ones(3)))
    rows[1, [8, 9]] = rows[1, [9, 8]]
    with pytest.raises(InputError, match="most tetra10 have mid-side nodes that lie at other edges"):
        require_own_edges(fp.VolumeMesh(points=mesh.points, cells={"tetra10": rows}, region=np.ones(3)))


def test_what_meshio_does_not_order_is_refused(tmp_path: Path) -> None:
    """PERMAS lists corners and mid-side nodes in turn; meshio writes them so, and reads them as they stand."""
    mesh = tet10()
    meshio.Mesh(mesh.points, [("tetra10", mesh.cells["tetra10"])]).write(tmp_path / "a.post")
    with pytest.raises(FileError, match="the file has another order of nodes than it is read in"):
        fp.read_mesh(tmp_path / "a.post")
