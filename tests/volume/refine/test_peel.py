"""Flat tetrahedra on a smooth surface are taken away, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femprep.mesh.elements import boundary_faces
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.topology import is_manifold
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh
from femprep.volume.optimise import POOR, tet_quality
from femprep.volume.refine.peel import without_flat

ENDO, EPI = FACET_TAGS["endo"], FACET_TAGS["epi"]


def capped(height: float) -> VolumeMesh:
    """A square pyramid of two tetrahedra below a square, and a flat one on top whose ridge is ``height`` above it."""
    points = np.array([[1, 0, 0], [0, 1, height], [-1, 0, 0], [0, -1, height], [0, 0, -1.5]], dtype=float)
    cells = np.array([[0, 1, 2, 4], [0, 2, 3, 4], [0, 1, 2, 3]])
    volumes = element_volumes(points, cells, "tetra")
    cells[volumes < 0] = cells[volumes < 0][:, [1, 0, 2, 3]]
    nodes = boundary_faces({"tetra": cells})["triangle"].nodes
    tag = np.where((nodes == 4).any(axis=1), EPI, ENDO)
    return VolumeMesh(points, {"tetra": cells}, np.full(3, REGION_TAGS["lv"]), {"triangle": nodes}, tag)


def test_a_flat_tetrahedron_on_one_surface_goes():
    mesh = capped(0.2)
    assert tet_quality(mesh.points, mesh.cells["tetra"])[2] < POOR
    found, count = without_flat(mesh, [ENDO, EPI], POOR)
    assert count == 1
    assert len(found.cells["tetra"]) == len(found.region) == 2
    nodes = found.facets["triangle"]
    assert is_manifold(nodes)
    expected = boundary_faces(found.cells)["triangle"].nodes
    assert {tuple(sorted(row)) for row in nodes.tolist()} == {tuple(sorted(row)) for row in expected.tolist()}
    # Wound outward: by the divergence theorem the facets enclose what the elements fill.
    a, b, c = (found.points[nodes[:, k]] for k in range(3))
    inside = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert inside == pytest.approx(element_volumes(found.points, found.cells["tetra"], "tetra").sum())
    assert sorted(found.facet_tag.tolist()) == [ENDO] * 2 + [EPI] * 4


def test_a_flat_pyramid_goes_with_its_top():
    """One element on another, three of its faces on the surface: the top is a node of nothing else."""
    points = np.array([[1, 0, 0], [-0.5, 0.9, 0], [-0.5, -0.9, 0], [0, 0, 0.1], [0, 0, -1.2]], dtype=float)
    cells = np.array([[0, 1, 2, 3], [0, 2, 1, 4]])
    nodes = boundary_faces({"tetra": cells})["triangle"].nodes
    tag = np.where((nodes == 4).any(axis=1), EPI, ENDO)
    mesh = VolumeMesh(points, {"tetra": cells}, np.full(2, REGION_TAGS["lv"]), {"triangle": nodes}, tag)
    found, count = without_flat(mesh, [ENDO, EPI], POOR)
    assert count == 1
    np.testing.assert_array_equal(found.points, points[[0, 1, 2, 4]])
    assert is_manifold(found.facets["triangle"])
    assert element_volumes(found.points, found.cells["tetra"], "tetra") == pytest.approx(
        element_volumes(points, cells[1:], "tetra")
    )
    assert sorted(found.facet_tag.tolist()) == [ENDO] + [EPI] * 3


def test_a_sound_one_goes_before_refinement():
    """Its children on the surface are half as thick with each level."""
    mesh = capped(0.6)
    quality = [tet_quality(mesh.points, mesh.cells["tetra"])[2]]
    for level in (1, 2):
        child = capped(0.6 / 2.0**level)
        quality.append(tet_quality(child.points, child.cells["tetra"])[2])
    assert quality[0] > POOR > quality[1] > quality[2]
    assert without_flat(mesh, [ENDO, EPI], POOR)[1] == 0
    found, count = without_flat(mesh, [ENDO])
    assert count == 1
    assert is_manifold(found.facets["triangle"])


@pytest.mark.parametrize("why", ["sound", "two tags", "not smooth"])
def test_others_stay(why):
    mesh = capped(1.0 if why == "sound" else 0.2)
    tags = [EPI] if why == "not smooth" else [ENDO, EPI]
    if why == "two tags":
        tag = mesh.facet_tag.copy()
        tag[np.flatnonzero(tag == ENDO)[0]] = EPI
        mesh = replace(mesh, facet_tag=tag)
    found, count = without_flat(mesh, tags, POOR)
    assert count == 0
    assert found is mesh
