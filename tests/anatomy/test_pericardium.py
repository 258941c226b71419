"""The pericardium: its stiffness is the published function of the coordinate, and it lies on the epicardium alone."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import APEX_HEIGHT, BASE_HEIGHT, truncated_ellipsoid

import femprep as fp
from femprep.export.deck.names import facet_nodes
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.measures.triangles import areas
from femprep.model import FACET_TAGS
from femprep.model.facets import facet_triangles


def with_heights(kind: str) -> fp.VolumeMesh:
    """An ellipsoid whose coordinate is known: linear in height."""
    mesh = truncated_ellipsoid(kind, lean=0.0)
    return mesh.with_data(point={"apicobasal": (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)})


def test_it_is_whole_at_the_apex_and_ends_before_the_base() -> None:
    # 1.5266 0.82^3 - 0.37 0.82^2 + 0.4964 0.82, by hand
    assert fp.pericardium_scale(0.0) == pytest.approx(0.9999783, abs=1e-6)
    assert fp.pericardium_scale([0.82, 0.9, 1.0]).tolist() == [0.0, 0.0, 0.0]
    values = fp.pericardium_scale(np.linspace(0, 0.82, 100))
    assert np.all(np.diff(values) < 0)
    assert fp.pericardium_scale(0.62) == pytest.approx(1.5266 * 0.008 - 0.37 * 0.04 + 0.4964 * 0.2, abs=1e-15)


@pytest.mark.parametrize("kind", list(ELEMENTS))
def test_stiffness_is_exact_on_an_ellipsoid(kind: str) -> None:
    mesh = fp.add_pericardium(with_heights(kind), stiffness=2.5)
    epi = facet_nodes(mesh, FACET_TAGS["epi"])
    stiffness = np.asarray(mesh.point_data["pericardium"])
    left = 0.82 - (mesh.points[epi, 2] + 42.0) / 54.0
    wanted = np.where(left > 0, 2.5 * (1.5266 * left**3 - 0.37 * left**2 + 0.4964 * left), 0.0)
    np.testing.assert_allclose(stiffness[epi], wanted, atol=1e-13)
    assert np.all(np.delete(stiffness, epi) == 0)
    normal = np.asarray(mesh.point_data["pericardium_normal"])
    np.testing.assert_allclose(np.linalg.norm(normal[epi], axis=1), 1.0, atol=1e-14)
    assert np.all(np.sum(normal[epi, :2] * mesh.points[epi, :2], axis=1) > 0)  # out of the wall
    ring = np.flatnonzero(np.asarray(mesh.point_data["basal_ring"]))
    assert len(ring) == (24 if ELEMENTS[kind].quadratic else 12)
    np.testing.assert_allclose(mesh.points[ring, 2], BASE_HEIGHT, atol=1e-12)
    assert set(ring) <= set(epi)


def test_areas_add_up_to_the_epicardium() -> None:
    mesh = fp.add_pericardium(with_heights("tetra"))
    wanted = areas(mesh.points, facet_triangles(mesh, "epi")).sum()
    assert np.sum(mesh.point_data["pericardium_area"]) == pytest.approx(wanted, rel=1e-12)


def test_what_it_lies_on_has_to_be_there() -> None:
    with pytest.raises(fp.InputError, match="apicobasal"):
        fp.add_pericardium(truncated_ellipsoid("tetra"))
    with pytest.raises(fp.InputError, match="tagged epi"):
        mesh = with_heights("tetra")
        fp.add_pericardium(fp.VolumeMesh(mesh.points, mesh.cells, mesh.region, point_data=mesh.point_data))
    with pytest.raises(fp.OptionError):
        fp.add_pericardium(with_heights("tetra"), stiffness=-1.0)


def facet_area(mesh: fp.VolumeMesh) -> float:
    corners = mesh.points[mesh.facets["triangle"][mesh.facet_tag == FACET_TAGS["epi"]]]
    return float(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    )


@pytest.mark.parametrize("levels", [1, 2])
def test_a_refined_mesh_has_the_springs_of_its_own_facets(levels: int) -> None:
    """Areas are no values in between: interpolated, springs came out six times too stiff with each level."""
    mesh = truncated_ellipsoid("tetra")
    height = (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)
    mesh = fp.add_pericardium(mesh.with_data(point={"apicobasal": height}), stiffness=0.5)
    fine = fp.refine(mesh, levels=levels)
    assert np.sum(fine.point_data["pericardium_area"]) == pytest.approx(facet_area(fine), rel=1e-12)
    off = np.setdiff1d(
        np.arange(len(fine.points)), fine.facets["triangle"][fine.facet_tag == FACET_TAGS["epi"]].ravel()
    )
    assert not np.any(fine.point_data["pericardium"][off])
    assert set(np.unique(np.linalg.norm(fine.point_data["pericardium_normal"], axis=1).round(12))) == {0.0, 1.0}
    np.testing.assert_allclose(fine.points[fine.point_data["basal_ring"] == 1, 2], BASE_HEIGHT, atol=1e-9)


def test_a_mirrored_mesh_has_mirrored_springs() -> None:
    mesh = truncated_ellipsoid("tetra")
    height = (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)
    mesh = mesh.with_data(point={"apicobasal": height})
    twin, wanted = fp.flip(fp.add_pericardium(mesh)), fp.add_pericardium(fp.flip(mesh))
    for name in ("pericardium", "pericardium_area", "pericardium_normal", "basal_ring"):
        np.testing.assert_allclose(twin.point_data[name], wanted.point_data[name], atol=1e-12)


@pytest.mark.parametrize("wrong", [-1.0, 1.1, np.nan, np.inf])
def test_a_coordinate_beyond_apex_and_base_has_no_stiffness(wrong: float) -> None:
    with pytest.raises(fp.InputError, match=f"an apicobasal coordinate is {wrong:g}, but it is 0 at the apex"):
        fp.pericardium_scale([0.5, wrong])
    assert fp.pericardium_scale(-1e-9) == fp.pericardium_scale(0.0)
    mesh = with_heights("tetra")
    off = np.delete(np.arange(len(mesh.points)), facet_nodes(mesh, FACET_TAGS["epi"]))
    heights = np.array(mesh.point_data["apicobasal"])
    heights[off] = wrong
    kept = fp.add_pericardium(mesh.with_data(point={"apicobasal": heights}))  # off the epicardium none is asked for
    np.testing.assert_array_equal(kept.point_data["pericardium"], fp.add_pericardium(mesh).point_data["pericardium"])
