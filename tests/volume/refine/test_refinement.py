"""Nested refinement: every element type, nothing inverted, all names kept, surfaces approached, fields carried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from analytic_walls import bowl, cut_ellipsoid_volume, disc_rings, ellipsoid_wall
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import mixed, truncated_ellipsoid, wedges_to_tets

import femprep as fp
from femprep.errors import InputError, OptionError
from femprep.mesh.elements import ELEMENTS, boundary_faces
from femprep.mesh.measures.volume_elements import element_measures, element_volumes
from femprep.model import FACET_TAGS, REGION_TAGS, Plane, VolumeMesh
from femprep.volume.refine import Refinement, refine

KINDS = ("tetra", "tetra10", "wedge", "wedge15", "hexahedron", "hexahedron20")
ENDO, EPI = (22.0, 22.0, 42.0), (31.0, 31.0, 51.0)
HEIGHT = 10.0


def coarse(kind: str) -> VolumeMesh:
    if kind == "mixed":
        return mixed()
    return truncated_ellipsoid(kind, curved=ELEMENTS[kind].quadratic)


def volumes(mesh: VolumeMesh) -> np.ndarray:
    return np.concatenate([element_volumes(mesh.points, block, name) for name, block in mesh.cells.items()])


def rows(nodes: np.ndarray) -> set[tuple[int, ...]]:
    return set(map(tuple, np.sort(nodes, axis=1).tolist()))


def layered(rings: int, layers: int, element: str) -> VolumeMesh:
    """A wall between two ellipsoids cut flat, of wedges or tetrahedra, its corners exactly on both."""
    inner, outer = bowl(ENDO, HEIGHT, rings), bowl(EPI, HEIGHT, rings)
    depth = np.linspace(0.0, 1.0, layers + 1)[:, None, None]
    points = (inner + depth * (outer - inner)).reshape(-1, 3)
    disc = disc_rings(rings)[:, [0, 2, 1]]
    cells = np.concatenate([np.hstack([disc + k * len(inner), disc + (k + 1) * len(inner)]) for k in range(layers)])
    if element == "tetra":
        cells = wedges_to_tets(cells)
    mesh = VolumeMesh(points, {element: cells}, np.full(len(cells), REGION_TAGS["lv"]))
    facets, tags = {}, []
    for kind, faces in boundary_faces(mesh.cells).items():
        facets[kind] = faces.nodes
        inside, outside = ((faces.nodes // len(inner) == k).all(axis=1) for k in (0, layers))
        tags.append(np.select([inside, outside], [FACET_TAGS["endo"], FACET_TAGS["epi"]], FACET_TAGS["base"]))
    plane = Plane([0.0, 0.0, HEIGHT], [0.0, 0.0, 1.0])
    return replace(mesh, facets=facets, facet_tag=np.concatenate(tags), planes={"base": plane})


@pytest.mark.parametrize("kind", [*KINDS, "mixed"])
def test_eight_sound_elements_for_each_and_every_name_kept(kind: str) -> None:
    mesh = coarse(kind)
    fine = refine(mesh, 1)
    assert fine.n_cells == 8 * mesh.n_cells
    assert list(fine.cells) == list(mesh.cells)
    assert all((element_measures(fine.points, b, n)["relative_jacobian"] > 0).all() for n, b in fine.cells.items())
    parent = fine.cell_data["parent"]
    np.testing.assert_array_equal(parent, np.repeat(np.arange(mesh.n_cells), 8))
    np.testing.assert_array_equal(fine.region, mesh.region[parent])
    np.testing.assert_array_equal(fine.facet_tag, np.repeat(mesh.facet_tag, 4))
    # The facets are the boundary, wound outward, and nothing else: the mesh is conforming.
    for name, faces in boundary_faces(fine.cells).items():
        assert rows(fine.facets[name]) == rows(faces.nodes)
    np.testing.assert_array_equal(
        np.unique(np.concatenate([b.ravel() for b in fine.cells.values()])), np.arange(len(fine.points))
    )
    tagged = Refinement.of(mesh, 1)
    np.testing.assert_array_equal(tagged.parent, parent)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_flat_facets_stay_flat_to_the_last_bit(kind: str) -> None:
    mesh = coarse(kind)
    fine = refine(mesh, 2)
    for name in ("base", "apex"):
        where = {}
        for at, one in (("coarse", mesh), ("fine", fine)):
            first, found = 0, []
            for block in one.facets.values():
                found.append(block[one.facet_tag[first : first + len(block)] == FACET_TAGS[name]].ravel())
                first += len(block)
            where[at] = np.unique(one.points[np.concatenate(found), 2])
        assert np.abs(where["fine"] - where["coarse"][0]).max() < 1e-13


def test_corners_stay_and_straight_children_fill_their_parent() -> None:
    mesh = replace(coarse("tetra"), facets={}, facet_tag=np.empty(0, dtype=np.int32))
    fine = refine(mesh, 2, optimised=False)
    np.testing.assert_array_equal(fine.points[: len(mesh.points)], mesh.points)
    np.testing.assert_allclose(np.bincount(fine.cell_data["parent"], weights=volumes(fine)), volumes(mesh), rtol=1e-12)


def test_boundary_without_tags_and_interfaces_between_regions_stay_while_elements_improve() -> None:
    mesh = replace(coarse("tetra"), facets={}, facet_tag=np.empty(0, dtype=np.int32))
    fine = refine(mesh, 1, poor=0.9)
    moved = (fine.points != refine(mesh, 1, optimised=False).points).any(axis=1)
    assert moved.any()
    for tag in np.unique(mesh.region):
        assert volumes(fine)[fine.region == tag].sum() == pytest.approx(
            volumes(mesh)[mesh.region == tag].sum(), rel=1e-12
        )


@pytest.mark.parametrize("element", ["tetra", pytest.param("wedge", marks=pytest.mark.slow)])
def test_error_of_volume_and_surface_falls_by_four_with_each_level(element: str) -> None:
    """Facets through nodes on an ellipsoid are off it by the square of their edge; refined flat, they would stay so."""
    mesh = layered(rings=8, layers=2, element=element)
    wall = ellipsoid_wall(ENDO, EPI, HEIGHT, rings=24)
    nested = Refinement.of(mesh, 3 if element == "wedge" else 2, wall=wall, optimised=False)
    exact = cut_ellipsoid_volume(EPI, HEIGHT) - cut_ellipsoid_volume(ENDO, HEIGHT)
    error, gap = [], []
    for each in (mesh, *(level.fine for level in nested.levels)):
        error.append(abs(volumes(each).sum() / exact - 1.0))
        first, worst = 0, 0.0
        for block in each.facets.values():
            tags = each.facet_tag[first : first + len(block)]
            first += len(block)
            for tag, axes in ((FACET_TAGS["endo"], ENDO), (FACET_TAGS["epi"], EPI)):
                centre = each.points[block[tags == tag]].mean(axis=1)
                if len(centre):
                    worst = max(worst, float(np.abs(np.linalg.norm(centre / axes, axis=1) - 1.0).max()))
        gap.append(worst)
    for figures in (error, gap):
        rates = np.array(figures[:-1]) / np.array(figures[1:])
        assert (rates > 3.3).all(), figures
        assert (rates < 4.8).all(), figures


@pytest.mark.slow
def test_without_the_wall_smooth_surfaces_go_through_the_facets() -> None:
    mesh = layered(rings=10, layers=2, element="tetra")
    exact = cut_ellipsoid_volume(EPI, HEIGHT) - cut_ellipsoid_volume(ENDO, HEIGHT)
    fine = refine(mesh, 1)
    assert abs(volumes(fine).sum() / exact - 1.0) < 0.35 * abs(volumes(mesh).sum() / exact - 1.0)
    assert any("smooth surfaces through the nodes" in note["what"] for note in fine.info["notices"])
    assert fine.info["refinement"]["levels"] == 1


@pytest.mark.slow
def test_rims_lie_on_the_surface_and_in_the_plane() -> None:
    mesh = layered(rings=8, layers=2, element="tetra")
    fine = refine(mesh, 2, wall=ellipsoid_wall(ENDO, EPI, HEIGHT, rings=24))
    block = fine.facets["triangle"]
    base, endo = (np.unique(block[fine.facet_tag == FACET_TAGS[name]]) for name in ("base", "endo"))
    rim = fine.points[np.intersect1d(base, endo)]
    assert len(rim) == 4 * 6 * 8
    assert np.abs(rim[:, 2] - HEIGHT).max() == 0.0
    assert np.abs(np.linalg.norm(rim / ENDO, axis=1) - 1.0).max() < 2e-4


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("levels", [1, 2])
def test_linear_fields_go_down_and_up_exactly(kind: str, levels: int) -> None:
    """Nodes lie on curved surfaces and have moved for better elements: their value is that of their place."""
    nested = Refinement.of(coarse(kind), levels)
    slope = np.array([[0.3, -1.2, 0.7], [2.0, 0.1, -0.4]]).T

    def field(mesh: VolumeMesh) -> np.ndarray:
        return mesh.points @ slope + 3.0

    np.testing.assert_allclose(nested.prolong(field(nested.coarse)), field(nested.fine), atol=1e-10)
    np.testing.assert_allclose(nested.restrict(field(nested.fine)), field(nested.coarse), atol=1e-10)
    ones = nested.to_parents(np.ones(nested.fine.n_cells))
    np.testing.assert_allclose(ones, 1.0, rtol=1e-12)
    values = np.arange(nested.coarse.n_cells, dtype=float)
    np.testing.assert_allclose(nested.to_parents(nested.to_children(values)), values, rtol=1e-12)


def test_quadratic_fields_are_exact_between_straight_quadratic_elements() -> None:
    mesh = replace(truncated_ellipsoid("tetra10"), facets={}, facet_tag=np.empty(0, dtype=np.int32))
    nested = Refinement.of(mesh, 1, optimised=False)

    def field(points: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        return x * y - 0.3 * z**2 + y

    np.testing.assert_allclose(nested.prolong(field(mesh.points)), field(nested.fine.points), atol=1e-9)


def test_point_data_go_along() -> None:
    mesh = truncated_ellipsoid("tetra", around=36, lean=0.0)
    turn = np.arctan2(mesh.points[:, 1], mesh.points[:, 0])
    radial = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(len(turn))])
    sign = np.where(np.arange(len(turn)) % 2, 1.0, -1.0)[:, None]
    data = {
        "height": mesh.points[:, 2],
        "fiber": sign * radial,
        "rotational": turn / (2 * np.pi) % 1.0,
        "rotational_cos": np.cos(turn),
        "rotational_sin": np.sin(turn),
    }
    fine = refine(mesh.with_data(point=data, cell={"number": np.arange(mesh.n_cells)}), 1)
    np.testing.assert_allclose(fine.point_data["height"], fine.points[:, 2], atol=1e-10)
    np.testing.assert_array_equal(fine.cell_data["number"], fine.cell_data["parent"])
    np.testing.assert_allclose(np.linalg.norm(fine.point_data["fiber"], axis=1), 1.0, rtol=1e-12)
    angle = np.arctan2(fine.points[:, 1], fine.points[:, 0])
    along = np.abs(np.cos(angle) * fine.point_data["fiber"][:, 0] + np.sin(angle) * fine.point_data["fiber"][:, 1])
    assert along.min() > 0.97
    jump = np.abs(np.exp(2j * np.pi * fine.point_data["rotational"]) - np.exp(1j * angle))
    assert jump.max() < 0.15


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(["tetra", "wedge", "hexahedron"]))
def test_numbers_of_nodes_and_the_order_of_elements_do_not_matter(seed: int, kind: str) -> None:
    """Refinement of the same mesh with its points and elements in another order has the same nodes and elements."""
    rng = np.random.default_rng(seed)
    mesh = truncated_ellipsoid(kind, heights=2, around=8, layers=1)
    order, node = rng.permutation(mesh.n_cells), rng.permutation(len(mesh.points))
    other = VolumeMesh(mesh.points[node], {kind: np.argsort(node)[mesh.cells[kind][order]]}, mesh.region[order])
    mesh = VolumeMesh(mesh.points, mesh.cells, mesh.region)
    one, two = (refine(m, 1, optimised=False) for m in (mesh, other))
    size = [volumes(m).reshape(-1, 8).sum(axis=1) for m in (one, two)]
    np.testing.assert_allclose(size[1], size[0][order], rtol=1e-9)
    places = [np.array(sorted(np.round(m.points, 7).tolist())) for m in (one, two)]
    np.testing.assert_allclose(places[0], places[1], atol=2e-7)


def test_the_same_bytes_every_time_and_inputs_are_left_alone() -> None:
    mesh = coarse("hexahedron")
    before = mesh.points.tobytes()
    one, two = refine(mesh, 1), refine(mesh, 1)
    assert one.points.tobytes() == two.points.tobytes()
    assert one.cells["hexahedron"].tobytes() == two.cells["hexahedron"].tobytes()
    assert mesh.points.tobytes() == before
    assert "parent" not in mesh.cell_data


def test_progress_ends_at_one() -> None:
    told = []
    refine(coarse("wedge"), 2, progress=lambda stage, fraction: told.append((stage, fraction)))
    assert [stage for stage, _ in told] == ["refine", "refine"]
    assert told[0][1] < 0.2
    assert told[1][1] == 1.0


@pytest.mark.parametrize("poor", [-0.1, 1.1, np.nan])
def test_a_quality_that_none_has_is_refused(poor: float) -> None:
    with pytest.raises(OptionError, match=f"poor is {poor}, expected a number from 0 to 1"):
        refine(truncated_ellipsoid("tetra"), 1, poor=poor)


@pytest.mark.parametrize("levels", [0, -1, 7, 1.5])
def test_levels_out_of_range_are_refused(levels: float) -> None:
    with pytest.raises(OptionError, match="levels is"):
        refine(coarse("tetra"), levels)  # type: ignore[arg-type]


def test_meshes_that_cannot_be_refined_are_refused() -> None:
    mesh = coarse("wedge")
    block = mesh.cells["wedge"].copy()
    block[3, 4] = block[3, 1]
    with pytest.raises(InputError, match="wedge 3 names a node twice"):
        refine(replace(mesh, cells={"wedge": block}), 1)
    tets = coarse("tetra")
    stray = {"triangle": np.array([[0, 1, len(tets.points) - 1]])}
    with pytest.raises(InputError, match="facets must be faces"):
        refine(replace(tets, facets=stray, facet_tag=np.array([101], dtype=np.int32)), 1)
    stray = {"quad": np.array([[0, 1, 2, 3]])}
    for mesh in (tets, coarse("tetra10")):
        with pytest.raises(InputError, match=r"a quad, of the points \[0, 1, 2, 3\], and no element has such a face"):
            refine(replace(mesh, facets=stray, facet_tag=np.array([101], dtype=np.int32)), 1)
    with pytest.raises(InputError, match="no elements"):
        refine(VolumeMesh(np.zeros((0, 3)), {}, np.empty(0)), 1)
    with pytest.raises(InputError, match="expected one for each"):
        Refinement.of(tets).prolong(np.ones(3))


def test_public_names() -> None:
    assert fp.refine is refine
    assert fp.Refinement is Refinement
