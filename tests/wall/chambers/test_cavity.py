"""The closed surface of a cavity: of nodes of the mesh, its volume that of endocardium and planes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from biventricular import LV_ENDO, biventricular
from meshes import truncated_ellipsoid

from femprep.errors import InputError
from femprep.mesh.topology import is_closed, is_consistently_wound
from femprep.model import REGION_TAGS
from femprep.model.facets import facet_triangles
from femprep.report.volumes import cavity_volume
from femprep.wall import cavity_surface


@pytest.fixture(scope="module")
def mesh():
    return biventricular(5.0)


@pytest.mark.parametrize("name", ["lv", "rv"])
def test_it_is_closed_and_has_the_volume_of_the_cavity(mesh, name):
    surface = cavity_surface(mesh, name)
    assert is_closed(surface.cells)
    assert is_consistently_wound(surface.cells)
    assert surface.volume == pytest.approx(cavity_volume(mesh, f"endo_{name}"), rel=1e-9)
    assert len(surface.cells) == len(facet_triangles(mesh, f"endo_{name}")) + surface.info["cap_triangles"]


def test_the_volume_is_the_ellipsoid_s_below_the_base(mesh):
    a, b, c = LV_ENDO[0]
    t = 10.0 / c
    exact = np.pi * a * b * c * (2 / 3 + t - t**3 / 3)
    assert cavity_surface(mesh, "lv").volume == pytest.approx(exact, rel=0.03)


def test_its_points_are_those_of_the_mesh_and_caps_lie_in_the_base(mesh):
    surface = cavity_surface(mesh, "rv")
    np.testing.assert_array_equal(surface.points, mesh.points[surface.point_data["GlobalNodeID"] - 1])
    cap = surface.cells[-surface.info["cap_triangles"] :]
    np.testing.assert_allclose(surface.points[cap][..., 2], 10.0, atol=1e-9)


def test_a_cavity_that_is_not_there_is_named(mesh):
    with pytest.raises(InputError, match="no facets tagged 'endo_la', so no cavity 'la'"):
        cavity_surface(mesh, "la")


def test_a_plain_endocardium_is_that_of_the_chamber_the_mesh_is_of():
    """Whatever was asked for, the left ventricle was given by that name."""
    left = truncated_ellipsoid("tetra")
    assert cavity_surface(left, "lv").name == "lv cavity"
    for name in ("rv", "la", "left"):
        with pytest.raises(
            InputError, match=f"no facets tagged 'endo_{name}', so no cavity '{name}'; its facets: endo"
        ):
            cavity_surface(left, name)
    atrium = replace(left, region=np.full(left.n_cells, REGION_TAGS["la"]))
    assert cavity_surface(atrium, "la").volume == cavity_surface(left, "lv").volume
    with pytest.raises(InputError, match="no cavity 'ra'"):
        cavity_surface(atrium, "ra")
