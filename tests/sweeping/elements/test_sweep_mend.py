"""Mending of layered meshes: tangled nodes are untangled, surfaces and planes kept, good meshes left alone."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.model import Plane, Surface
from femprep.sweeping import sweep
from femprep.sweeping.elements.build import least_corner
from femprep.sweeping.elements.mend import mend
from femprep.sweeping.elements.split import prisms
from femprep.sweeping.matching.match import match_surfaces
from femprep.template import charge_template

ENDO, EPI = np.array([23.0, 25.0, 45.0]), np.array([33.0, 35.0, 53.0])
BASE = Plane(np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, 1.0]))


@pytest.fixture(scope="module", params=["wedge", "hexahedron"])
def matched(request):
    template = charge_template(600)
    endo, epi = (Surface(template.directions * axes, template.cells) for axes in (ENDO, EPI))
    return match_surfaces(endo=endo, epi=epi, base=BASE, element=request.param, edge_length=6.0, layers=3)


def layered(matched) -> np.ndarray:
    depth = np.linspace(0.0, 1.0, matched.layers + 1)[:, None, None]
    return np.ascontiguousarray(matched.inner + depth * (matched.outer - matched.inner))


def elements(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    name = "wedge" if cells.shape[1] == 3 else "hexahedron"
    solid = prisms(cells, points.shape[1], len(points) - 1)
    return least_corner(np.ascontiguousarray(points.reshape(-1, 3)), solid, name)


@pytest.mark.slow
def test_tangled_nodes_are_untangled_on_their_surfaces_and_planes(matched):
    points = layered(matched)
    element = "wedge" if matched.cup.cells.shape[1] == 3 else "hexahedron"
    rng = np.random.default_rng(3)
    inside = np.flatnonzero(matched.cup.rim == 0)
    chosen = rng.choice(inside, 6, replace=False)
    points[1:-1, chosen] += rng.normal(0.0, 2.0, (matched.layers - 1, len(chosen), 3))
    # A vertex of the endocardium put beyond the next one, and one of the rim along its curve.
    for vertex, other in ((inside[40], inside[41]), (matched.cup.base[3], matched.cup.base[4])):
        beyond = points[0, vertex] + 1.3 * (points[0, other] - points[0, vertex])
        flat = matched.cup.rim[vertex : vertex + 1]
        planes = np.array([[*BASE.normal, BASE.offset]])
        points[0, vertex] = matched.inner_surface.settle(beyond[None], None, flat, planes)[0][0]
    assert elements(points, matched.cup.cells).min() < 0.0
    found = mend(points, matched, element)
    assert found["poor_before"] > found["poor"]
    assert elements(points, matched.cup.cells).min() > 0.0
    for layer, axes in ((0, ENDO), (-1, EPI)):
        scaled = points[layer] / axes
        beyond = (np.einsum("ij,ij->i", scaled, scaled) - 1.0) / (2.0 * np.linalg.norm(scaled / axes, axis=1))
        assert np.abs(beyond).max() < 0.05
    assert np.abs(BASE.signed_distance(points[:, matched.cup.base])).max() < 1e-9


def test_a_good_mesh_is_left_as_it_is(matched):
    points = layered(matched)
    before = points.copy()
    element = "wedge" if matched.cup.cells.shape[1] == 3 else "hexahedron"
    assert mend(points, matched, element)["moved"] == 0
    assert np.array_equal(points, before)


@pytest.mark.slow
def test_the_same_mesh_is_mended_to_the_same_bytes(matched):
    element = "wedge" if matched.cup.cells.shape[1] == 3 else "hexahedron"
    found = []
    for _ in range(2):
        points = layered(matched)
        points[1, 5:40:7] += 4.0
        mend(points, matched, element)
        found.append(points.tobytes())
    assert found[0] == found[1]


def test_the_sweep_tells_what_it_mended(matched):
    mesh = sweep(matched, element="wedge" if matched.cup.cells.shape[1] == 3 else "hexahedron")
    assert mesh.info["mended"] == {"poor_before": 0, "poor": 0, "moved": 0, "farthest_mm": 0.0}
