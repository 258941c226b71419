"""Asserting that two meshes are the same: points, cells, regions, tagged facets, data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from femprep.mesh.elements import FACET_CORNERS
from femprep.model import VolumeMesh


def assert_same(
    found: VolumeMesh,
    wanted: VolumeMesh,
    *,
    tolerance: float = 0.0,
    data: Iterable[str] = (),
    data_tolerance: float = 0.0,
    by_region: bool = False,
) -> None:
    """Compare element by element.

    ``tolerance`` is absolute, mm; ``data`` are the cell arrays that have to come back; ``by_region`` allows elements
    sorted by their region, block by block.
    """
    assert found.points.shape == wanted.points.shape
    assert np.abs(found.points - wanted.points).max() <= tolerance
    assert list(found.cells) == list(wanted.cells)
    rows = _rows(wanted) if by_region else np.arange(wanted.n_cells)
    assert np.array_equal(found.region, wanted.region[rows])
    first = 0
    for kind, block in wanted.cells.items():
        own = rows[first : first + len(block)] - first
        assert np.array_equal(found.cells[kind], block[own]), kind
        first += len(block)
    assert found.region_names == wanted.region_names
    assert found.facet_names == wanted.facet_names
    assert facet_set(found) == facet_set(wanted)
    for name in data:
        np.testing.assert_allclose(
            np.asarray(found.cell_data[name]), np.asarray(wanted.cell_data[name])[rows], rtol=0, atol=data_tolerance
        )


def _rows(mesh: VolumeMesh) -> np.ndarray:
    out, first = [], 0
    for block in mesh.cells.values():
        out.append(first + np.argsort(mesh.region[first : first + len(block)], kind="stable"))
        first += len(block)
    return np.concatenate(out)


def facet_set(mesh: VolumeMesh) -> set[tuple[int, ...]]:
    """Every facet as its tag and its nodes, turned to begin with the smallest corner, its winding kept."""
    found, first = set(), 0
    for kind, block in mesh.facets.items():
        corners = FACET_CORNERS[kind]
        for tag, nodes in zip(mesh.facet_tag[first : first + len(block)].tolist(), block.tolist()):
            start = int(np.argmin(nodes[:corners]))
            turned = nodes[start:corners] + nodes[:start]
            middle = nodes[corners:]
            found.add((tag, *turned, *(middle[start:] + middle[:start])))
        first += len(block)
    return found


def copies(mesh: VolumeMesh) -> Mapping[str, bytes]:
    """The bytes of every array of a mesh, to see later that none has changed."""
    arrays = {"points": mesh.points, "region": mesh.region, "facet_tag": mesh.facet_tag, **mesh.cells, **mesh.facets}
    return {name: np.asarray(values).tobytes() for name, values in {**arrays, **mesh.cell_data}.items()}
