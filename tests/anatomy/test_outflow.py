"""Fibres after Doste et al. 2019 on an ellipsoid with two openings: angles exact at valves, along the outflow tract."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from anatomy_meshes import ellipsoid, open_valves
from biventricular import biventricular

import femprep as fp
from femprep.anatomy import WallFields
from femprep.anatomy.fibres import helix_angle
from femprep.anatomy.laplace.valves import valve_fields
from femprep.anatomy.rules import node_fields
from femprep.model import FACET_TAGS
from femprep.model.blocks import chosen_rows


@cache
def opened(kind: str = "hexahedron", size: int = 6) -> fp.VolumeMesh:
    """The ellipsoid, its base the mitral ring on one side and the aortic one on the other, 35 degrees between them."""
    mesh = ellipsoid(kind, size=size, layers=3).mesh
    return open_valves(mesh, {("mitral", "aortic"): np.zeros(3)})


def angles(mesh: fp.VolumeMesh, **options) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Helix angle, depth and share of the outflow tract at the nodes, by the rule's own frames."""
    fields = WallFields(mesh)
    sites = node_fields(fields, "doste")
    found = fp.add_fibres(mesh, rule="doste", nodes=True, fields=fields, **options)
    fibre = np.asarray(found.point_data["fiber"])[fields.space.nodes]
    return helix_angle(fibre, sites.to_base, -sites.to_across), 1 - sites.across_distance, sites.outflow


@pytest.mark.parametrize("kind", ["tetra", "hexahedron"])
def test_angles_are_those_of_ventricle_and_outflow_tract(kind: str) -> None:
    found, depth, out = angles(opened(kind, 5), endo_angle=50.0, epi_angle=-40.0, outflow_endo_angle=80.0)
    wanted = (1 - depth) * ((1 - out) * 50.0 + out * 80.0) + depth * (1 - out) * -40.0
    np.testing.assert_allclose(found, wanted, atol=1e-6)
    assert out.min() == 0.0
    assert out.max() == 1.0


def test_at_the_aortic_ring_fibres_run_out_inside_and_round_outside() -> None:
    mesh = opened()
    found = fp.add_fibres(mesh, rule="doste", nodes=True)
    fibre = np.asarray(found.point_data["fiber"])
    nodes = np.unique(np.concatenate(list(mesh.facets.values()))[mesh.facet_tag == FACET_TAGS["aortic"]])
    at = mesh.points[nodes]
    radius = np.hypot(at[:, 0], at[:, 1])
    up = np.abs(fibre[nodes, 2])
    inner, outer = radius < radius.min() + 0.5, radius > radius.max() - 0.5
    # The ellipsoid leans inward at the base: its tangent is not quite upright.
    assert np.median(up[inner]) > 0.9
    assert np.median(up[outer]) < 0.2
    around = np.cross([0, 0, 1.0], at / np.linalg.norm(at, axis=1, keepdims=True))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    assert np.median(np.abs(np.einsum("ni,ni->n", fibre[nodes], around))[outer]) > 0.95


def test_both_shares_of_the_openings_make_up_the_whole_exactly() -> None:
    """The share of one opening and of the other, as harmonic fields, add up to the field from apex to both."""
    mesh = opened()
    keep = mesh.facet_tag != FACET_TAGS["base"]
    mesh = replace(mesh, facets=chosen_rows(mesh.facets, keep), facet_tag=mesh.facet_tag[keep])
    one, two = FACET_TAGS["mitral"], FACET_TAGS["aortic"]
    swapped = np.where(mesh.facet_tag == one, two, np.where(mesh.facet_tag == two, one, mesh.facet_tag))
    fields = WallFields(mesh)
    mine, other = valve_fields(fields, "lv")[2], valve_fields(WallFields(replace(mesh, facet_tag=swapped)), "lv")[2]
    np.testing.assert_allclose(mine + other, fields.upward, atol=1e-7)
    # Towards the apex the outflow tract has less and less of a say.
    on = np.abs(fields.space.points[:, 0]) < 6
    assert np.corrcoef(mine[on], fields.space.points[on, 2])[0, 1] > 0.9


def test_it_is_right_handed_and_orthonormal_and_repeats() -> None:
    one, two = (fp.add_fibres(opened(), rule="doste") for _ in range(2))
    triad = np.stack([np.asarray(one.cell_data[name]) for name in ("fiber", "sheet", "normal")], axis=2)
    np.testing.assert_allclose(
        np.einsum("nji,njk->nik", triad, triad), np.tile(np.eye(3), (len(triad), 1, 1)), atol=1e-12
    )
    assert np.all(np.linalg.det(triad) > 0.999)
    np.testing.assert_array_equal(one.cell_data["fiber"], two.cell_data["fiber"])


def test_closed_valves_are_refused() -> None:
    with pytest.raises(fp.InputError, match="tagged mitral"):
        fp.add_fibres(ellipsoid("hexahedron", size=3, layers=1).mesh, rule="doste")


@pytest.mark.slow
def test_a_ventricle_without_its_valves_has_no_outflow_tract_and_that_is_said() -> None:
    centres = {("mitral", "aortic"): np.zeros(3), ("tricuspid", "pulmonary"): np.array([-75.0, 0.0, 0.0])}
    both = open_valves(biventricular(6.0), centres, axis=1)
    shut = replace(
        both, facet_tag=np.where(both.facet_tag == FACET_TAGS["pulmonary"], FACET_TAGS["base"], both.facet_tag)
    )
    one, other = (fp.add_fibres(mesh, rule="doste") for mesh in (both, shut))
    said = [notice["what"] for notice in other.info["fibres"]["notices"]]
    assert "the rv has no outflow tract, as it has no open pulmonary valve" in said
    assert not any("outflow" in notice["what"] for notice in one.info["fibres"].get("notices", ()))
    sites = node_fields(WallFields(shut), "doste")
    right = (sites.side < 0) & (sites.across < -0.5)
    assert sites.outflow[right].max() < 0.26  # of the septum's right half the left ventricle has a share
    assert sites.outflow.max() > 0.99
    # The free wall of the left ventricle is as with both.
    fields = WallFields(both)
    left = node_fields(fields, "doste")
    free = (left.outside > 0.5) & (left.side > 0)
    np.testing.assert_allclose(left.outflow[free], sites.outflow[free], atol=1e-6)
