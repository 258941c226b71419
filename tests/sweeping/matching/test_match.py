"""Matching on exact ellipsoids: nothing folded, rims in their planes, surfaces kept, thickness as in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.errors import InputError, OptionError
from femprep.model import Plane, Surface
from femprep.sweeping import sweep
from femprep.sweeping.matching.axial import section
from femprep.sweeping.matching.match import match_surfaces
from femprep.sweeping.matching.minimum_thickness import push_outwards
from femprep.template import charge_template

BASE = Plane(np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, 1.0]))
APEX = Plane(np.array([0.0, 0.0, -25.0]), np.array([0.0, 0.1, -1.0]))
ENDO, EPI = np.array([23.0, 25.0, 45.0]), np.array([33.0, 35.0, 53.0])


def ellipsoid(axes, name, vertices=600, turn=None) -> Surface:
    template = charge_template(vertices)
    points = template.directions * axes
    return Surface(points if turn is None else points @ turn.T, template.cells, name=name)


def beyond(points: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Distance from an ellipsoid to first order."""
    scaled = points / axes
    return (np.einsum("ij,ij->i", scaled, scaled) - 1.0) / (2.0 * np.linalg.norm(scaled / axes, axis=1))


@pytest.fixture(scope="module")
def pair() -> tuple[Surface, Surface]:
    return ellipsoid(ENDO, "lv"), ellipsoid(EPI, "epi")


@pytest.mark.parametrize("apex", [None, APEX], ids=["closed", "clipped"])
@pytest.mark.parametrize("template", ["triangle", "quad"])
def test_lines_join_both_surfaces_without_folding(pair, apex, template):
    matched = match_surfaces(endo=pair[0], epi=pair[1], base=BASE, apex=apex, template=template, edge_length=5.0)
    # Of the tetrahedra themselves; those of an ideal wedge have 0.7 to 0.9.
    assert matched.info["least_mean_ratio"] > 0.5
    assert np.abs(beyond(matched.inner, ENDO)).max() < 0.05
    assert np.abs(beyond(matched.outer, EPI)).max() < 0.05
    for points in (matched.inner, matched.outer):
        assert np.abs(BASE.signed_distance(points[matched.cup.base])).max() < 1e-10
        assert np.all(BASE.signed_distance(np.delete(points, matched.cup.base, axis=0)) < 0.0)
        if apex is not None:
            assert np.abs(apex.signed_distance(points[matched.cup.apex])).max() < 1e-10


def test_thickness_of_concentric_spheres_is_the_difference_of_radii():
    endo, epi = ellipsoid(np.full(3, 30.0), "lv", 800), ellipsoid(np.full(3, 40.0), "epi", 800)
    plane = Plane(np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    matched = match_surfaces(endo=endo, epi=epi, base=plane, edge_length=5.0)
    # The line between is radial up to the tangential play of the vertices: its length errs in second order.
    assert matched.thickness.mean() == pytest.approx(10.0, abs=0.05)
    assert matched.thickness.min() > 9.99
    assert matched.thickness.max() < 10.6
    assert matched.epi.point_data["thickness"].tolist() == matched.thickness.tolist()


def test_thickness_and_transmural_coordinate_converge_to_their_closed_forms():
    plane = Plane(np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    thickness, transmural = [], []
    for vertices in (200, 800):
        endo, epi = (ellipsoid(np.full(3, r), name, vertices) for r, name in ((30.0, "lv"), (40.0, "epi")))
        matched = match_surfaces(endo=endo, epi=epi, base=plane, edge_length=6.0)
        thickness.append(np.sqrt(np.mean((matched.thickness - 10.0) ** 2)))
        mesh = sweep(matched)
        share = (np.linalg.norm(mesh.points, axis=1) - 30.0) / 10.0
        transmural.append(np.sqrt(np.mean((mesh.point_data["transmural"] - share) ** 2)))
    # Lines are radial, whatever the elements' size; what is left is the error of the smooth surfaces through the
    # templates' vertices, of fourth order in their edges: 16 for half the edges.
    for errors in (thickness, transmural):
        assert 8.0 < errors[0] / errors[1] < 40.0
    assert thickness[1] < 1e-3
    assert transmural[1] < 5e-4


def test_a_turned_heart_gives_the_same_map_turned():
    angle = 0.7
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    straight = match_surfaces(endo=ellipsoid(ENDO, "lv"), epi=ellipsoid(EPI, "epi"), base=BASE, edge_length=8.0)
    turned = match_surfaces(
        endo=ellipsoid(ENDO, "lv", turn=turn),
        epi=ellipsoid(EPI, "epi", turn=turn),
        base=Plane(turn @ BASE.point, turn @ BASE.normal),
        edge_length=8.0,
    )
    # Rounding is amplified by the sweeps, which stop short of convergence: a thousandth of an edge is left.
    assert np.abs(turned.outer - straight.outer @ turn.T).max() < 8e-3


def test_equal_input_gives_equal_bytes(pair):
    one, two = (match_surfaces(endo=pair[0], epi=pair[1], base=BASE, edge_length=6.0) for _ in range(2))
    assert one.inner.tobytes() == two.inner.tobytes()
    assert one.outer.tobytes() == two.outer.tobytes()


def test_given_numbers_give_that_cup(pair):
    matched = match_surfaces(endo=pair[0], epi=pair[1], base=BASE, columns=30, rows=9, layers=3, edge_length=6.0)
    assert (matched.cup.columns, matched.cup.rows, matched.layers) == (30, 9, 3)


def test_a_thin_wall_is_pushed_apart_and_reported(pair):
    dent = np.array(pair[1].points)
    near = np.linalg.norm(dent - dent[np.argmin(np.abs(dent[:, 2] + 15.0) - dent[:, 0])], axis=1) < 12.0
    dent[near] *= 0.74
    thin = Surface(dent, pair[1].cells, name="epi")
    points, info = push_outwards(pair[0], thin, BASE, 2.0, 8.0)
    assert 0 < info["vertices"] < 100
    assert beyond(points, ENDO)[near].min() > 1.8
    far = np.linalg.norm(dent - dent[near].mean(axis=0), axis=1) > 40.0
    assert np.array_equal(points[far], dent[far])
    with pytest.raises(InputError, match=r"pushed by more than 0\.5 mm"):
        push_outwards(pair[0], thin, BASE, 2.0, 0.5)


def test_a_section_is_the_ellipse_it_cuts(pair):
    centre, radius = section(pair[0], BASE)
    assert np.abs(centre - [0.0, 0.0, 10.0]).max() < 0.2
    share = np.sqrt(1.0 - (10.0 / 45.0) ** 2)
    assert radius == pytest.approx(24.0 * share, rel=0.02)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"base": Plane(np.array([0.0, 0.0, 90.0]), np.array([0.0, 0.0, 1.0]))}, InputError, "does not cut surface"),
        ({"element": "hexahedron", "template": "triangle"}, OptionError, "needs template 'quad'"),
        ({"columns": 31}, OptionError, "multiple of 5"),
        ({"edge_length": -1.0}, OptionError, "edge_length"),
    ],
)
def test_what_cannot_be_matched_is_refused_in_one_line(pair, changes, error, message):
    with pytest.raises(error, match=message) as caught:
        match_surfaces(**{"endo": pair[0], "epi": pair[1], "base": BASE, **changes})
    assert "\n" not in str(caught.value)
