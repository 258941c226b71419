"""Swept meshes of exact ellipsoids: every facet, volume, plane, number and tag; order 2; the boundary wall; phases."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from meshes import truncated_ellipsoid

from femprep.errors import InputError, OptionError
from femprep.mesh.elements import FACET_CORNERS, element_faces
from femprep.mesh.measures.volume_elements import element_measures, element_volumes
from femprep.mesh.topology import is_closed, is_consistently_wound
from femprep.model import FACET_TAGS, Plane, Surface, VolumeMesh
from femprep.sweeping import boundary_wall, displacements, sweep
from femprep.sweeping.elements.build import least_corner
from femprep.sweeping.matching.match import match_surfaces
from femprep.template import charge_template

BASE = Plane(np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, 1.0]))
APEX = Plane(np.array([0.0, 0.0, -25.0]), np.array([0.0, 0.0, -1.0]))
ENDO, EPI = np.array([23.0, 25.0, 45.0]), np.array([33.0, 35.0, 53.0])
KINDS = [("tetra", "triangle"), ("tetra", "quad"), ("wedge", "triangle"), ("hexahedron", "quad")]


def surface(axes, name: str) -> Surface:
    template = charge_template(800)
    return Surface(template.directions * axes, template.cells, name=name)


def exact(low: float, high: float) -> float:
    def body(axes) -> float:
        a, b, c = axes
        bottom = max(low, -c)
        return np.pi * a * b * ((high - bottom) - (high**3 - bottom**3) / (3.0 * c * c))

    return body(EPI) - body(ENDO)


@pytest.fixture(scope="module")
def matched():
    endo, epi = surface(ENDO, "lv"), surface(EPI, "epi")
    return {
        (template, apex is not None): match_surfaces(
            endo=endo, epi=epi, base=BASE, apex=apex, template=template, edge_length=6.0
        )
        for template, apex in itertools.product(("triangle", "quad"), (None, APEX))
    }


def only(blocks):
    ((name, block),) = blocks.items()
    return name, block


def rings(nodes: np.ndarray) -> set[tuple[int, ...]]:
    return {tuple(np.roll(row, -int(np.argmin(row))).tolist()) for row in nodes}


def tagged(mesh: VolumeMesh, name: str) -> list[np.ndarray]:
    found, start = [], 0
    for nodes in mesh.facets.values():
        rows = mesh.facet_tag[start : start + len(nodes)] == FACET_TAGS[name]
        found.append(nodes[rows])
        start += len(nodes)
    return found


@pytest.mark.parametrize("clipped", [False, True], ids=["closed", "clipped"])
@pytest.mark.parametrize(("element", "template"), KINDS)
@pytest.mark.parametrize("order", [1, 2])
def test_mesh_is_whole(matched, element, template, clipped, order):
    mesh = sweep(matched[template, clipped], element=element, order=order)
    name, cells = only(mesh.cells)
    measures = element_measures(mesh.points, cells, name)
    assert measures["relative_jacobian"].min() > 0.3
    assert measures["volume"].min() > 0.0
    for kind, faces in element_faces(mesh.cells).items():
        corner = np.sort(faces.nodes[:, : FACET_CORNERS[kind]], axis=1)
        _, first, uses = np.unique(corner, axis=0, return_index=True, return_counts=True)
        assert uses.max() <= 2
        border = faces.nodes[first[uses == 1]][:, : FACET_CORNERS[kind]]
        # Exactly the boundary is tagged, each facet once, with its outward winding.
        assert rings(border) == rings(mesh.facets[kind][:, : FACET_CORNERS[kind]])
        assert len(border) == len(mesh.facets[kind])
    planes = {"base": BASE, "apex": APEX} if clipped else {"base": BASE}
    for tag, plane in planes.items():
        nodes = np.unique(np.concatenate([f.ravel() for f in tagged(mesh, tag)]))
        assert np.abs(plane.signed_distance(mesh.points[nodes])).max() < 1e-12
    assert set(mesh.facet_names) == {"endo", "epi", *planes}
    volume = element_volumes(mesh.points, cells, name).sum()
    # Edges of 6 mm: chords lose 1.2 % of the volume, curved edges next to nothing.
    assert volume == pytest.approx(exact(-25.0 if clipped else -99.0, 10.0), rel=0.02 if order == 1 else 2e-3)


@pytest.mark.parametrize(("element", "template"), KINDS)
def test_numbers_run_layer_by_layer_template_first(matched, element, template):
    pair = matched[template, False]
    mesh = sweep(pair, element=element, layers=3, grading=2.0)
    count = len(pair.inner)
    assert len(mesh.points) == 4 * count
    assert np.array_equal(mesh.points[:count], pair.inner)
    assert np.array_equal(mesh.points[-count:], pair.outer)
    assert np.array_equal(mesh.point_data["template"], np.tile(np.arange(count), 4))
    depth = mesh.point_data["transmural"].reshape(4, count)
    assert np.ptp(depth, axis=1).max() == 0.0
    heights = np.diff(depth[:, 0])
    assert heights[2] / heights[0] == pytest.approx(2.0)
    _, cells = only(mesh.cells)
    assert np.array_equal(cells.min(axis=1) // count, mesh.cell_data["layer"])
    per = {"tetra": 3 if template == "triangle" else 5}.get(element, 1)
    assert len(cells) == 3 * per * len(pair.cup.cells)


def test_volume_converges_in_second_order_and_curved_elements_faster():
    endo, epi = surface(ENDO, "lv"), surface(EPI, "epi")
    wanted, errors = exact(-99.0, 10.0), {1: [], 2: []}
    for edge in (10.0, 5.0):
        pair = match_surfaces(endo=endo, epi=epi, base=BASE, element="hexahedron", edge_length=edge)
        for order in (1, 2):
            name, cells = only((mesh := sweep(pair, element="hexahedron", order=order)).cells)
            errors[order].append(abs(element_volumes(mesh.points, cells, name).sum() / wanted - 1.0))
    assert 3.0 < errors[1][0] / errors[1][1] < 5.0
    assert errors[2][1] < 0.05 * errors[1][1]


@pytest.mark.parametrize(("element", "template"), KINDS)
def test_mid_side_nodes_lie_on_the_smooth_surfaces(matched, element, template):
    mesh = sweep(matched[template, False], element=element, order=2)
    assert mesh.info["straightened"] == 0
    for tag, axes in (("endo", ENDO), ("epi", EPI)):
        nodes = np.unique(np.concatenate([f.ravel() for f in tagged(mesh, tag)]))
        scaled = mesh.points[nodes] / axes
        height = (np.einsum("ij,ij->i", scaled, scaled) - 1.0) / (2.0 * np.linalg.norm(scaled / axes, axis=1))
        assert np.abs(height).max() < 0.03
    assert np.all(mesh.point_data["template"][len(matched[template, False].inner) * (mesh.info["layers"] + 1) :] == -1)


@pytest.mark.parametrize("clipped", [False, True], ids=["closed", "clipped"])
@pytest.mark.parametrize(("element", "template"), KINDS)
def test_boundary_is_a_closed_wall(matched, element, template, clipped):
    mesh = sweep(matched[template, clipped], element=element)
    wall = boundary_wall(mesh)
    name, cells = only(mesh.cells)
    assert is_closed(wall.triangles)
    assert is_consistently_wound(wall.triangles)
    assert wall.volume == pytest.approx(element_volumes(mesh.points, cells, name).sum(), rel=1e-3)
    count = len(matched[template, clipped].inner)
    assert np.bincount(wall.template[wall.template >= 0]).tolist() == [2] * count


def test_equal_input_gives_equal_bytes(matched):
    one, two = (sweep(matched["triangle", False], order=2) for _ in range(2))
    assert one.points.tobytes() == two.points.tobytes()
    assert one.cells["tetra10"].tobytes() == two.cells["tetra10"].tobytes()


def test_phases_have_equal_connectivity_and_displacements_from_the_first():
    numbers = {"columns": 20, "rows": 5, "layers": 2, "edge_length": 8.0}
    meshes = []
    for factor in (1.0, 0.9):
        endo, epi = surface(factor * ENDO, "lv"), surface(factor * EPI, "epi")
        plane = Plane(factor * BASE.point, BASE.normal)
        meshes.append(sweep(match_surfaces(endo=endo, epi=epi, base=plane, **numbers)))
    first, second = displacements(meshes)
    assert np.abs(first.point_data["displacement"]).max() == 0.0
    # A heart that shrinks as a whole moves every node towards the origin.
    assert np.abs(second.point_data["displacement"] + 0.1 * meshes[0].points).max() < 0.4
    with pytest.raises(InputError, match="differs in connectivity"):
        displacements([meshes[0], sweep(match_surfaces(endo=endo, epi=epi, base=plane, **{**numbers, "rows": 6}))])
    with pytest.raises(InputError, match="2 phases"):
        displacements(meshes, 2)


def test_elements_that_do_not_go_with_the_cup_are_refused(matched):
    with pytest.raises(OptionError, match="choose tetra or wedge"):
        sweep(matched["triangle", False], element="hexahedron")


@pytest.mark.parametrize(("element", "template"), KINDS)
def test_an_inverted_element_is_found_at_any_corner(matched, element, template):
    mesh = sweep(matched[template, False], element=element)
    name, cells = only(mesh.cells)
    assert least_corner(mesh.points, cells, name).min() > 0.0
    for corner in range(cells.shape[1]):
        # A corner pushed through the element's middle and out on the other side turns its own frame over.
        points = np.array(mesh.points)
        points[cells[0, corner]] += 3.0 * (points[cells[0]].mean(axis=0) - points[cells[0, corner]])
        assert least_corner(points, cells[:1], name)[0] < 0.0


def test_what_was_not_swept_has_no_wall_of_columns():
    with pytest.raises(InputError, match="the mesh was not swept: it has no point data template, transmural"):
        boundary_wall(truncated_ellipsoid("hexahedron"))
