"""Mid-side nodes at other edges than their own: a file's order that is not the one it is read in."""

from __future__ import annotations

import numpy as np
import pytest

import femprep as fp
from femprep.errors import InputError
from femprep.export.midside import _astray, require_own_edges
from femprep.mesh.elements import ELEMENTS


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


def test_thin_curved_elements_are_sound() -> None:
    """A shell between radii of .24 and .25 over 60 degrees, as in a mesh of libMesh's: edges lie nearer than nodes."""
    angle = np.array([0.0, np.pi / 3, np.pi / 6])
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    at = [(r, k, z) for k in (0, 1) for r, z in ((0.25, 0.0), (0.25, 0.2), (0.24, 0.2), (0.24, 0.0))]
    edges = ELEMENTS["hexahedron20"].edges
    middle = [
        (0.5 * (at[a][0] + at[b][0]), at[a][1] if at[a][1] == at[b][1] else 2, 0.5 * (at[a][2] + at[b][2]))
        for a, b in edges
    ]
    points = np.array([(r * ring[k, 0], r * ring[k, 1], z) for r, k, z in [*at, *middle]])
    assert not _astray(points[None], "hexahedron20").any()
    require_own_edges(fp.VolumeMesh(points=points, cells={"hexahedron20": np.arange(20)[None]}, region=np.ones(1)))
