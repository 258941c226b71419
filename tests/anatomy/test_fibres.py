"""Fibres: exact on a slab, near the analytic field of the ellipsoid, nearer with refinement; signs, mirror images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from anatomy_meshes import clipped_ellipsoid, ellipsoid, grown, slab
from ellipsoid_wall import EllipsoidWall
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.anatomy.axes.mirror import flip
from femprep.anatomy.axes.ventricular_axes import VentricularAxes
from femprep.anatomy.fibres import add_fibres, default_points, helix_angle, quadrature_fibres
from femprep.anatomy.laplace.fields import WallFields
from femprep.anatomy.laplace.shapes import shape_functions
from femprep.anatomy.rules import node_fields
from femprep.errors import InputError, OptionError
from femprep.options import FibreOptions

KINDS = ["tetra", "wedge", "hexahedron", "mixed"]
SLAB_AXES = VentricularAxes([-20.0, 10, 0], [-20.0, 10, 30], [0.0, -1, 0])
WALL = EllipsoidWall((25.0, 55.0), (35.0, 65.0))


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle between two fields of lines, degrees."""
    return np.degrees(np.arccos(np.clip(np.abs(np.sum(a * b, axis=-1)), 0, 1)))


def _centres(mesh) -> np.ndarray:
    corners = {"tetra": 4, "wedge": 6, "hexahedron": 8}
    return np.concatenate([mesh.points[b[:, : corners[k.rstrip("0125")]]].mean(axis=1) for k, b in mesh.cells.items()])


def _triad(table) -> np.ndarray:
    return np.stack([table["fiber"], table["sheet"], table["normal"]], axis=2)


def _off(triads: np.ndarray) -> float:
    return float(np.abs(np.einsum("...ij,...ik->...jk", triads, triads) - np.eye(3)).max())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("endo", "epi"), [(60.0, -60.0), (0.0, 0.0), (-60.0, 60.0), (90.0, 0.0), (0.0, -37.5)])
def test_slab_is_exact(kind, endo, epi):
    mesh = add_fibres(slab(kind).mesh, endo_angle=endo, epi_angle=epi, axes=SLAB_AXES, nodes=True)
    for x, table in ((_centres(mesh)[:, 0], mesh.cell_data), (mesh.points[:, 0], mesh.point_data)):
        a = np.radians(endo + (epi - endo) * x / 10)
        # l = z, t = x, c = z x x = y
        exact = np.column_stack([np.zeros(len(a)), np.cos(a), np.sin(a)])
        assert np.abs(table["fiber"] - exact).max() < 1e-7
        assert np.abs(table["sheet"] - [1.0, 0, 0]).max() < 1e-7
        assert _off(_triad(table)) < 1e-10


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_quadratic_slab_is_exact_at_all_nodes(kind):
    mesh = add_fibres(grown(slab(kind, cells=(2, 2, 2)).mesh), axes=SLAB_AXES, nodes=True)
    a = np.radians(60 - 12 * mesh.points[:, 0])
    assert np.abs(mesh.point_data["fiber"] - np.column_stack([0 * a, np.cos(a), np.sin(a)])).max() < 1e-7
    assert len(mesh.cell_data["fiber"]) == mesh.n_cells


@pytest.mark.parametrize("kind", KINDS)
def test_slab_is_exact_at_quadrature_points(kind):
    mesh = slab(kind).mesh
    for name, triads in quadrature_fibres(mesh, axes=SLAB_AXES).items():
        points = default_points(name)
        x = np.einsum("qp,kpi->kqi", shape_functions(name, points)[0], mesh.points[mesh.cells[name]])[..., 0]
        a = np.radians(60 - 12 * x)
        assert triads.shape == (*x.shape, 3, 3)
        assert np.abs(triads[..., 0] - np.stack([0 * a, np.cos(a), np.sin(a)], axis=-1)).max() < 1e-7
        assert _off(triads) < 1e-10


def test_sheet_angle_turns_the_sheet_about_the_fibre():
    mesh = add_fibres(slab("tetra").mesh, axes=SLAB_AXES, endo_sheet_angle=30.0, epi_sheet_angle=90.0)
    x = _centres(mesh)[:, 0]
    b = np.radians(30 + 6 * x)
    assert mesh.cell_data["sheet"][:, 0] == pytest.approx(np.cos(b), abs=1e-7)
    assert np.sum(np.cross(mesh.cell_data["fiber"], mesh.cell_data["sheet"]) * mesh.cell_data["normal"], axis=1) == (
        pytest.approx(1.0)
    )


@pytest.mark.slow
def test_error_on_the_ellipsoid_is_below_three_degrees_and_falls():
    means = []
    for size, layers in ((4, 3), (8, 6), (16, 12)):
        mesh = add_fibres(ellipsoid("tetra", size=size, layers=layers).mesh)
        space_volume = _volumes(mesh)
        error = _angle(mesh.cell_data["fiber"], WALL.triads(_centres(mesh))[:, :, 0])
        means.append(np.average(error, weights=space_volume))
    assert means[1] < 3.0
    assert means[2] < 1.0
    assert np.log2(means[0] / means[1]) > 1.2
    assert np.log2(means[1] / means[2]) > 1.2


def _volumes(mesh) -> np.ndarray:
    x = mesh.points[mesh.cells["tetra"]]
    return np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / 6


@pytest.mark.parametrize("kind", KINDS)
def test_ellipsoid_of_any_element_at_cells_nodes_and_quadrature_points(kind):
    wall = ellipsoid(kind, size=8, layers=6)
    fields = WallFields(wall.mesh)
    mesh = add_fibres(wall.mesh, fields=fields, nodes=True)
    assert _angle(mesh.cell_data["fiber"], WALL.triads(_centres(mesh))[:, :, 0]).mean() < 3.0
    assert _angle(mesh.point_data["fiber"], WALL.triads(mesh.points)[:, :, 0]).mean() < 2.0
    for table in (mesh.cell_data, mesh.point_data):
        assert _off(_triad(table)) < 1e-10
    for name, triads in quadrature_fibres(wall.mesh, fields=fields).items():
        at = np.einsum("qp,kpi->kqi", shape_functions(name, default_points(name))[0], mesh.points[mesh.cells[name]])
        exact = WALL.triads(at.reshape(-1, 3))[:, :, 0].reshape(at.shape)
        assert _angle(triads[..., 0], exact).mean() < 3.0
        assert _off(triads) < 1e-10


def test_fibres_are_tangential_and_right_handed_helices_at_the_endocardium():
    wall = ellipsoid("hexahedron", size=6, layers=3)
    mesh = add_fibres(wall.mesh, nodes=True)
    inner = np.flatnonzero((wall.depth == 0) & (wall.polar > 0.8))
    fibre, x = mesh.point_data["fiber"][inner], mesh.points[inner]
    # A right-handed helix about the long axis climbs as it turns counter-clockwise seen from above.
    turn = np.cross([0.0, 0, 1], x)
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    assert (np.sum(fibre * turn, axis=1) * fibre[:, 2] > 0).all()
    outward = x / np.array([25.0, 25, 55]) ** 2
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    assert np.degrees(np.arcsin(np.abs(np.sum(fibre * outward, axis=1)))).max() < 6.0
    outer = np.flatnonzero((wall.depth == 1) & (wall.polar > 0.8))
    fibre, x = mesh.point_data["fiber"][outer], mesh.points[outer]
    assert (np.sum(fibre * np.cross([0.0, 0, 1], x), axis=1) * fibre[:, 2] < 0).all()


def test_angle_zero_runs_round_the_wall():
    mesh = add_fibres(ellipsoid("tetra", size=8, layers=4).mesh, endo_angle=0.0, epi_angle=0.0)
    centre = _centres(mesh)
    around = np.cross([0.0, 0, 1], centre)
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    far = np.hypot(centre[:, 0], centre[:, 1]) > 8
    assert _angle(mesh.cell_data["fiber"], around)[far].mean() < 1.5
    assert mesh.info["fibres"]["depth_angle_correlation"] == {"lv": None}


def test_reversed_signs_reverse_the_helix_and_nothing_else():
    wall = ellipsoid("tetra", size=4, layers=3)
    fields = WallFields(wall.mesh)
    one = add_fibres(wall.mesh, fields=fields)
    two = add_fibres(wall.mesh, fields=fields, endo_angle=-60.0, epi_angle=60.0)
    sites = node_fields(fields).each(fields.space.to_cells)
    angles = [helix_angle(m.cell_data["fiber"], sites.to_base, -sites.to_across) for m in (one, two)]
    assert angles[0] == pytest.approx(-angles[1], abs=1e-9)
    assert one.cell_data["sheet"] == pytest.approx(two.cell_data["sheet"], abs=1e-12)


@pytest.mark.parametrize("rule", ["linear", "bayer"])
def test_mirrored_twin_has_mirrored_fibres(rule, caplog):
    axes = VentricularAxes([0.0, 0, -65], [0.0, 0, 15], [-1.0, 0, 0], mirrored=False)
    mesh = add_fibres(ellipsoid("tetra", size=4, layers=2).mesh, axes=axes, rule=rule, endo_sheet_angle=20.0)
    assert mesh.info["fibres"]["mirrored"] is False
    twin = flip(mesh)
    again = add_fibres(twin, rule=rule, endo_sheet_angle=20.0)
    assert again.info["fibres"]["mirrored"] is True
    assert again.info["fibres"]["depth_angle_correlation"]["lv"] < -0.9  # of the anatomical angle
    assert "mirror image" in caplog.text
    for name in ("fiber", "sheet", "normal"):
        assert _angle(again.cell_data[name], twin.cell_data[name]).max() < 1e-3


def test_a_wrong_hand_is_never_silent(caplog):
    mesh = ellipsoid("tetra", size=3, layers=2).mesh
    mirrored = VentricularAxes([0.0, 0, -65], [0.0, 0, 15], [-1.0, 0, 0], mirrored=True)
    as_found = add_fibres(mesh, axes=mirrored)
    assert "mirror image" in caplog.text
    caplog.clear()
    as_it_lies = add_fibres(mesh, axes=mirrored, mirrored="no")
    assert not caplog.text
    assert _angle(as_found.cell_data["fiber"], as_it_lies.cell_data["fiber"]).mean() > 20
    unknown = add_fibres(mesh, axes=replace(mirrored, mirrored=None, info={"assumed": ["hand"]}))
    assert "assumed" in unknown.info["fibres"]
    assert np.array_equal(unknown.cell_data["fiber"], as_it_lies.cell_data["fiber"])


def test_correlation_of_depth_and_angle_is_measured():
    mesh = add_fibres(ellipsoid("tetra", size=4, layers=3).mesh)
    assert mesh.info["fibres"]["depth_angle_correlation"]["lv"] == pytest.approx(-1.0, abs=1e-3)
    bent = add_fibres(mesh, rule="bayer", depth="laplace", endo_angle=40, epi_angle=-40)
    assert -1.0 < bent.info["fibres"]["depth_angle_correlation"]["lv"] < -0.9


def test_bayer_rule_squares_the_depth():
    mesh = add_fibres(slab("tetra").mesh, axes=SLAB_AXES, rule="bayer", endo_angle=40.0, epi_angle=-50.0)
    depth = _centres(mesh)[:, 0] / 10
    up, out = np.tile([0, 0, 1.0], (len(depth), 1)), np.tile([1.0, 0, 0], (len(depth), 1))
    a = helix_angle(mesh.cell_data["fiber"], up, out)
    assert a == pytest.approx(40 - 90 * depth**2, abs=1e-6)


def test_clipped_apex_takes_its_plane():
    fields = WallFields(clipped_ellipsoid().mesh)
    assert len(fields.apex_nodes) == 200
    result = add_fibres(fields.mesh, fields=fields)
    assert _angle(result.cell_data["fiber"], WALL.triads(_centres(result))[:, :, 0]).mean() < 3.0
    assert result.info["fibres"]["degenerate_elements"] == 0


@settings(deadline=None, max_examples=15)
@given(st.floats(-90, 90), st.floats(-90, 90), st.floats(-180, 180), st.sampled_from(["linear", "bayer"]))
def test_always_orthonormal(endo, epi, sheet, rule):
    fields = _fields()
    mesh = add_fibres(fields.mesh, fields=fields, endo_angle=endo, epi_angle=epi, endo_sheet_angle=sheet, rule=rule)
    assert _off(_triad(mesh.cell_data)) < 1e-10


_cache: list[WallFields] = []


def _fields() -> WallFields:
    if not _cache:
        _cache.append(WallFields(ellipsoid("tetra", size=3, layers=2).mesh))
    return _cache[0]


def test_analytic_depth_inverts_the_blend():
    rng = np.random.default_rng(3)
    t, u, v = rng.uniform(0, 1, 200), rng.uniform(0.05, 2.0, 200), rng.uniform(0, 6.28, 200)
    a, b = 25 + 10 * t, 55 + 10 * t
    points = np.column_stack([a * np.sin(u) * np.cos(v), a * np.sin(u) * np.sin(v), -b * np.cos(u)])
    assert WALL.depth(points) == pytest.approx(t, abs=1e-12)
    meridian = np.column_stack([a * np.cos(u) * np.cos(v), a * np.cos(u) * np.sin(v), b * np.sin(u)])
    meridian /= np.linalg.norm(meridian, axis=1, keepdims=True)
    assert WALL.frames(points)[:, :, 1] == pytest.approx(meridian, abs=1e-12)


def test_bad_options_are_one_line():
    mesh = slab("tetra", cells=(1, 1, 1)).mesh
    with pytest.raises(OptionError, match="'endo_angle' is 120"):
        add_fibres(mesh, endo_angle=120.0)
    with pytest.raises(OptionError, match="unknown option 'angle'"):
        add_fibres(mesh, angle=1.0)
    with pytest.raises(InputError, match="expected 0 < endo < epi"):
        EllipsoidWall((35.0, 55.0), (25.0, 65.0))
    with pytest.raises(InputError, match=r"shape \(3,\), expected \(q, 3\)"):
        quadrature_fibres(mesh, axes=SLAB_AXES, points={"tetra": np.zeros(3)})


def test_options_group_and_keywords_agree():
    mesh = slab("tetra", cells=(2, 2, 2)).mesh
    one = add_fibres(mesh, FibreOptions(endo_angle=0.0, epi_angle=30.0), axes=SLAB_AXES)
    two = add_fibres(mesh, endo_angle=0.0, epi_angle=30.0, axes=SLAB_AXES)
    assert np.array_equal(one.cell_data["fiber"], two.cell_data["fiber"])
    assert replace(mesh).cell_data == {}
