import json
from dataclasses import replace

import numpy as np
import pytest
from analytic_walls import cut_ellipsoid_volume
from meshes import truncated_ellipsoid

from femprep.errors import InputError, OptionError, QualityError
from femprep.mesh.elements import ELEMENTS
from femprep.model import FACET_TAGS, REGION_TAGS, Plane, VolumeMesh
from femprep.options import PURPOSE_LIMITS
from femprep.volume import QualityReport, check
from femprep.volume.quality.check import statistics
from femprep.volume.quality.limits import judge_wall_volume
from femprep.volume.quality.transmural import elements_through_wall

#: Splits a cube into six tetrahedra around its diagonal.
KUHN = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]


def slab(nx: int, ny: int, nz: int, kind: str = "hexahedron") -> VolumeMesh:
    """A box nx x ny x nz of unit cubes: endo at z = 0, epi at z = nz, the sides base."""
    nodes = np.stack(np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), np.arange(nz + 1), indexing="ij"), -1)
    number = np.arange(nodes[..., 0].size).reshape(nodes.shape[:3])
    at = lambda i, j, k: number[i : i + nx, j : j + ny, k : k + nz].ravel()  # noqa: E731
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    hexes = np.stack([at(*c) for c in corners], axis=1)
    points = nodes.reshape(-1, 3).astype(float)
    cells = {
        "hexahedron": hexes,
        "wedge": np.concatenate([hexes[:, [0, 1, 2, 4, 5, 6]], hexes[:, [0, 2, 3, 4, 6, 7]]]),
        "tetra": np.concatenate([hexes[:, list(t)] for t in KUHN]),
    }[kind]
    return tagged(VolumeMesh(points, {kind: cells}, np.full(len(cells), REGION_TAGS["lv"])), nz)


def tagged(mesh: VolumeMesh, top: float) -> VolumeMesh:
    from femprep.mesh.elements import boundary_faces

    facets, tags = {}, []
    for kind, faces in boundary_faces(mesh.cells).items():
        facets[kind] = faces.nodes
        z = mesh.points[faces.nodes][:, :, 2]
        tag = np.where((z == 0).all(1), FACET_TAGS["endo"], FACET_TAGS["base"])
        tags.append(np.where((z == top).all(1), FACET_TAGS["epi"], tag))
    return replace(mesh, facets=facets, facet_tag=np.concatenate(tags))


LOOSE = {"minimum_dihedral": None, "mean_of_mean_ratio": None, "minimum_scaled_jacobian": None}


def test_volume_ratio_where_more_than_two_elements_share_a_face():
    """Three tetrahedra on one face, of heights 1, 2 and 8: each is compared with the next."""
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 2), (0, 0, 8)], dtype=float)
    cells = np.array([(0, 1, 2, 3), (0, 1, 2, 4), (0, 1, 2, 5)])
    report = check(VolumeMesh(points, {"tetra": cells}, np.full(3, REGION_TAGS["lv"])))
    assert report.validity.non_manifold_faces == 1
    assert report.volume_ratio == pytest.approx(4.0)


def test_facets_of_mixed_meshes_are_counted_by_their_corners():
    """A hexahedron with a wedge on its side: triangles and quadrilaterals side by side, one facet twice, one stray."""
    points = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1), (2, 0))], dtype=float)
    cells = {"hexahedron": np.array([(0, 1, 2, 3, 5, 6, 7, 8)]), "wedge": np.array([(1, 4, 2, 6, 9, 7)])}
    facets = {"triangle": np.array([(1, 2, 4), (0, 1, 2)]), "quad": np.array([(0, 3, 2, 1), (1, 2, 3, 0)])}
    found = check(VolumeMesh(points, cells, np.full(2, REGION_TAGS["lv"]), facets, np.full(4, 2))).validity
    assert found.boundary_facets == 5 + 4
    assert found.untagged_boundary_facets == 9 - 2
    assert found.stray_facets == 1
    assert found.inward_facets == 1
    assert found.pieces == 1


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "tetra"])
def test_box_is_judged_exactly(kind):
    mesh = slab(3, 4, 2, kind)
    report = check(mesh, **LOOSE)
    assert report.passed, report.failures
    assert report.raise_if_failed() is report
    assert report.volume == pytest.approx(24.0)
    assert report.cells == {kind: {"hexahedron": 24, "wedge": 48, "tetra": 144}[kind]}
    assert report.bounds == ((0, 0, 0), (3, 4, 2))
    assert report.regions["lv"].volume == pytest.approx(24.0)
    areas = {name: record.area for name, record in report.facet_tags.items()}
    assert areas == pytest.approx({"endo": 12.0, "epi": 12.0, "base": 28.0})
    assert {name: record.pieces for name, record in report.facet_tags.items()} == {"endo": 1, "epi": 1, "base": 1}
    assert report.validity.boundary_shells == 1
    assert report.validity.euler_characteristic == 2
    assert report.validity.pieces == 1
    assert report.validity.untagged_boundary_facets == 0
    assert report.elements_through_wall is not None
    assert (report.elements_through_wall.min, report.elements_through_wall.max) == (2.0, 2.0)
    assert report.measures["volume"].count == mesh.n_cells
    assert sum(report.measures["mean_ratio"].histogram.counts) == mesh.n_cells


def test_mixed_mesh_has_figures_for_each_type():
    lower, upper = slab(2, 2, 1, "hexahedron"), slab(2, 2, 1, "tetra")
    shifted = np.arange(len(upper.points)).reshape(3, 3, 2)
    number = shifted.copy()
    number[:, :, 1] = len(lower.points) + np.arange(9).reshape(3, 3)
    number[:, :, 0] = np.arange(len(lower.points)).reshape(3, 3, 2)[:, :, 1]
    top = upper.points.reshape(3, 3, 2, 3)[:, :, 1].reshape(-1, 3) + np.array([0.0, 0.0, 1.0])
    points = np.concatenate([lower.points, top])
    cells = {"hexahedron": lower.cells["hexahedron"], "tetra": number.ravel()[upper.cells["tetra"]]}
    report = check(VolumeMesh(points, cells, np.repeat([1, 2], [4, 24])), **LOOSE)
    assert set(report.measures_by_type) == {"hexahedron", "tetra"}
    assert "radius_ratio" not in report.measures_by_type["hexahedron"]
    assert report.measures["radius_ratio"].count == 24
    assert {name: record.volume for name, record in report.regions.items()} == pytest.approx({"lv": 4.0, "rv": 4.0})
    # A quadrilateral of a hexahedron against two triangles of tetrahedra does not fit: the check must say so.
    assert not report.passed
    assert report.validity.pieces == 2


def test_mesh_without_tags_is_judged():
    mesh = slab(2, 2, 2)
    report = check(VolumeMesh(mesh.points, mesh.cells, mesh.region), **LOOSE)
    assert report.passed
    assert report.notes == ("no facet tags: boundary conditions have nothing to name",)
    assert report.validity.untagged_boundary_facets is None
    assert report.elements_through_wall is None
    assert report.facet_tags == {}


def damaged(name: str) -> VolumeMesh:
    mesh = slab(2, 2, 2, "tetra")
    points, cells = mesh.points.copy(), mesh.cells["tetra"].copy()
    if name == "inverted":
        cells[5] = cells[5][[1, 0, 2, 3]]
    if name == "doubled element":
        return replace(mesh, cells={"tetra": np.concatenate([cells, cells[:1]])}, region=np.append(mesh.region, 1))
    if name == "orphan":
        points = np.concatenate([points, [[9.0, 9.0, 9.0]]])
    if name == "doubled point":
        points = np.concatenate([points, points[13:14]])
        cells[np.flatnonzero((cells == 13).any(1))[:1]] = np.where(
            cells[(cells == 13).any(1)][:1] == 13, len(points) - 1, cells[(cells == 13).any(1)][:1]
        )
    if name == "untagged":
        facets = {"triangle": mesh.facets["triangle"][1:]}
        return replace(mesh, facets=facets, facet_tag=mesh.facet_tag[1:])
    if name == "stray":
        facets = {"triangle": np.concatenate([mesh.facets["triangle"], [[0, 13, 26]]])}
        return replace(mesh, facets=facets, facet_tag=np.append(mesh.facet_tag, 101))
    if name == "inward":
        nodes = mesh.facets["triangle"].copy()
        nodes[2] = nodes[2][::-1]
        return replace(mesh, facets={"triangle": nodes})
    if name == "off plane":
        return replace(mesh, planes={"epi": Plane(np.array([0, 0, 2.001]), np.array([0, 0, 1.0]))})
    return replace(mesh, points=points, cells={"tetra": cells})


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("inverted", r"^1 inverted element"),
        ("doubled element", r"^1 element\(s\) doubled"),
        ("orphan", r"^1 point\(s\) that no element uses"),
        ("doubled point", r"^1 pair\(s\) of points in the same place"),
        ("untagged", r"^1 boundary facet\(s\) without a tag"),
        ("stray", r"^1 tagged facet\(s\) that are no face of any element"),
        ("inward", r"^1 tagged facet\(s\) wound into the mesh"),
        ("off plane", r"^greatest distance of epi points from their plane in mm is 0.001, asked for is at most 1e-09"),
    ],
)
def test_each_fault_is_found_and_named(name, message):
    import re

    report = check(damaged(name), **LOOSE)
    assert not report.passed
    assert any(re.search(message, failure) for failure in report.failures), report.failures
    with pytest.raises(QualityError, match=r"^the mesh fails its checks: "):
        report.raise_if_failed()


def test_boundary_that_touches_itself_along_an_edge_and_in_a_point():
    def two_cubes(shift: tuple[float, float, float]) -> VolumeMesh:
        one = slab(1, 1, 1)
        points = np.concatenate([one.points, one.points + shift])
        _, first, inverse = np.unique(points, axis=0, return_index=True, return_inverse=True)
        cells = np.concatenate([one.cells["hexahedron"], one.cells["hexahedron"] + 8])
        return VolumeMesh(points[first], {"hexahedron": inverse.ravel()[cells]}, np.ones(2))

    edge = check(two_cubes((1, 1, 0)), **LOOSE).validity
    assert (edge.non_manifold_boundary_edges, edge.pieces) == (1, 2)
    point = check(two_cubes((1, 1, 1)), **LOOSE).validity
    assert (point.non_manifold_boundary_edges, point.non_manifold_boundary_points) == (0, 1)
    face = check(two_cubes((1, 0, 0)), **LOOSE).validity
    assert (face.pieces, face.non_manifold_boundary_points, face.boundary_facets) == (1, 0, 10)


def test_closed_cavity_counts_as_a_second_shell():
    mesh = slab(3, 3, 3)
    keep = np.arange(27) != 13
    report = check(VolumeMesh(mesh.points, {"hexahedron": mesh.cells["hexahedron"][keep]}, np.ones(26)), **LOOSE)
    assert (report.validity.boundary_shells, report.validity.euler_characteristic) == (2, 4)
    assert report.volume == pytest.approx(26.0)


def test_limits_are_compared_with_the_worst_element():
    mesh = slab(2, 2, 2, "tetra")
    found = check(mesh, **LOOSE)
    worst = found.measures["minimum_dihedral"].min
    assert worst == pytest.approx(45.0)
    assert check(mesh, **{**LOOSE, "minimum_dihedral": worst - 0.01}).passed
    report = check(mesh, **{**LOOSE, "minimum_dihedral": worst + 0.01})
    x, y, z = next(item.centroid for item in report.worst if item.measure == "minimum_dihedral")
    place = f"({x:.1f}, {y:.1f}, {z:.1f})"
    assert report.failures == (f"smallest dihedral angle in degrees is 45 near {place}, asked for is at least 45.01",)
    unlisted = check(mesh, **{**LOOSE, "minimum_dihedral": worst + 0.01, "worst": 0})
    assert unlisted.failures == ("smallest dihedral angle in degrees is 45, asked for is at least 45.01",)
    (limit,) = (item for item in report.limits if item.name == "minimum_dihedral")
    assert (limit.kind, limit.passed) == ("at least", False)
    assert limit.value == pytest.approx(45.0)


def test_worst_elements_have_their_place():
    mesh = slab(4, 4, 4)
    points = mesh.points.copy()
    corner = int(np.argmax(points.sum(axis=1)))
    points[corner] += 0.4
    report = check(replace(mesh, points=points), worst=3, **LOOSE)
    worst = [item for item in report.worst if item.measure == "scaled_jacobian"]
    assert len(worst) == 3
    assert worst[0].element == 63
    assert worst[0].centroid == pytest.approx((3.55, 3.55, 3.55))
    assert worst[0].value == report.measures["scaled_jacobian"].min < worst[1].value == pytest.approx(1.0)


def test_report_is_json_and_comes_back():
    report = check(slab(2, 1, 1, "wedge"), **LOOSE)
    text = report.model_dump_json()
    record = json.loads(text)
    assert record["passed"] is True
    record.pop("passed")
    assert QualityReport.model_validate(record) == report
    assert QualityReport.model_json_schema()["properties"]["validity"]


def test_statistics_by_hand():
    values = np.array([0.0, 1.0, 2.0, 3.0, 14.0])
    found = statistics(values, "mm", (0.0, 10.0))
    assert (found.min, found.mean, found.median, found.max, found.count) == (0.0, 4.0, 2.0, 14.0, 5)
    assert found.standard_deviation == pytest.approx(np.sqrt((16 + 9 + 4 + 1 + 100) / 5))
    assert found.percentiles["25"] == 1.0
    assert found.histogram.counts[-1] == 1
    assert sum(found.histogram.counts) == 5


def test_statistics_of_a_range_that_no_bin_divides():
    assert sum(statistics(np.array([0.0, 5e-324]), "mm").histogram.counts) == 2


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "tetra"])
@pytest.mark.parametrize("layers", [1, 3, 5])
def test_layers_are_counted(kind, layers):
    counts = elements_through_wall(slab(2, 3, layers, kind))
    assert len(counts) == 12
    assert set(counts) == {layers}


def test_wrong_meshes_and_limits_are_refused():
    mesh = slab(1, 1, 1)
    with pytest.raises(InputError, match="no volume elements"):
        check(VolumeMesh(mesh.points, {}, np.empty(0)))
    with pytest.raises(InputError, match="'pyramid' is not known"):
        check(VolumeMesh(mesh.points, {"pyramid": np.arange(5)[None]}, np.ones(1)))
    points = mesh.points.copy()
    points[3, 0] = np.inf
    with pytest.raises(InputError, match=r"point 3 of the mesh is \[inf"):
        check(replace(mesh, points=points))
    with pytest.raises(OptionError, match="'minimum_dihedral' is 200"):
        check(mesh, minimum_dihedral=200)
    with pytest.raises(OptionError, match="unknown option 'dihedral'"):
        check(mesh, dihedral=5)


@pytest.mark.slow
def test_mesh_of_a_wall_is_judged(fresh_mesh):
    report = check(fresh_mesh)
    assert report.passed, report.failures
    exact = cut_ellipsoid_volume((31, 31, 51), 10) - cut_ellipsoid_volume((22, 22, 42), 10)
    assert report.volume == pytest.approx(exact, rel=0.02)
    assert report.elements_through_wall is not None
    assert report.elements_through_wall.min >= 1
    assert report.edge_length.mean == pytest.approx(6.0, rel=0.2)


def test_flat_elements_do_not_break_the_report():
    mesh = slab(2, 2, 2, "tetra")
    points = mesh.points.copy()
    points[:, 2] = 0.0
    report = check(replace(mesh, points=points))
    assert report.validity.inverted_elements == mesh.n_cells
    assert "aspect_ratio" not in report.measures
    assert json.loads(report.model_dump_json())["measures"]["volume"]["max"] == 0.0
    assert not report.passed


def test_a_ratio_near_the_largest_number_is_that_of_a_flat_element():
    """Found by fuzzing: an aspect ratio of 1.5e308, about which no histogram has bins."""
    points = np.array([[0, 0, 0], [28.2, 0, 0], [0, -4.7, 11.3], [3.75e-308, 7.5e-308, 3.75e-308]])
    report = check(VolumeMesh(points, {"tetra": np.array([[0, 1, 2, 3]])}, np.ones(1, dtype=np.int32)))
    assert "aspect_ratio" not in report.measures
    assert not report.passed
    json.loads(report.model_dump_json())


def test_time_step_is_the_least_height_by_the_speed_of_sound():
    """Unit cubes: volume by face is 1 mm; at 2000 m/s that is half a microsecond."""
    report = check(slab(2, 2, 2), wave_speed=2000.0)
    assert report.time_step == pytest.approx(0.5)
    assert check(slab(2, 2, 2), wave_speed=2000.0, minimum_time_step=0.499).passed
    failed = check(slab(2, 2, 2), wave_speed=2000.0, minimum_time_step=0.501)
    assert failed.failures == ("stable time step in microseconds is 0.5, asked for is at least 0.501",)


def test_volume_ratio_is_that_of_neighbours():
    """Layers of heights 1 and 4: the ratio across the face between them; elements apart do not count."""
    mesh = slab(2, 2, 3)
    points = np.array(mesh.points)
    points[points[:, 2] == 3, 2] = 6.0
    uneven = tagged(replace(mesh, points=points, facets={}, facet_tag=np.empty(0, dtype=np.int32)), 6.0)
    report = check(uneven)
    assert report.volume_ratio == pytest.approx(4.0)
    assert check(uneven, maximum_volume_ratio=4.1).passed
    assert "neighbouring" in check(uneven, maximum_volume_ratio=3.9).failures[0]
    assert check(slab(1, 1, 1)).volume_ratio == 1.0
    points[points[:, 2] == 6, 2] = 1.5
    assert check(replace(uneven, points=points)).volume_ratio is None


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "tetra"])
def test_purpose_sets_limits_that_options_override(kind):
    mesh = slab(3, 3, 3, kind)
    names = {purpose: {r.name for r in check(mesh, purpose=purpose).limits} for purpose in PURPOSE_LIMITS}
    assert {"minimum_size_ratio"} == names["explicit"] - names["general"]
    assert names["implicit"] >= {"minimum_relative_jacobian", "maximum_volume_ratio", "minimum_mean_ratio"}
    assert "maximum_edge_by_space_constant" in names["electrophysiology"]
    report = check(mesh, purpose="implicit", minimum_scaled_jacobian=0.35)
    assert report.options.minimum_scaled_jacobian == 0.35
    assert report.options.minimum_mean_ratio == PURPOSE_LIMITS["implicit"]["minimum_mean_ratio"]
    with pytest.raises(OptionError, match="'purpose' is 'fluid'"):
        check(mesh, purpose="fluid")


def test_electrophysiology_asks_for_edges_below_the_space_constant():
    mesh = slab(2, 2, 2)
    small = replace(mesh, points=0.3 * mesh.points)
    assert check(small, purpose="electrophysiology").passed
    (failure,) = check(mesh, purpose="electrophysiology").failures
    assert failure == "mean edge length by the space constant is 2.857, asked for is at most 1"
    assert check(mesh, purpose="electrophysiology", space_constant=1.5).passed


def test_explicit_fails_on_one_small_element_among_large_ones():
    mesh = slab(4, 4, 4)
    assert check(mesh, purpose="explicit").passed
    points = np.array(mesh.points)
    points[points[:, 2] == 4, 2] = 3.15
    thin = replace(mesh, points=points, facets={}, facet_tag=np.empty(0, dtype=np.int32))
    assert any("characteristic length" in line for line in check(thin, purpose="explicit").failures)
    assert check(thin, **LOOSE).passed


@pytest.mark.parametrize("kind", list(ELEMENTS))
def test_every_element_type_is_judged_and_its_worst_listed_with_place(kind):
    mesh = truncated_ellipsoid(kind)
    report = check(mesh, worst=4, **LOOSE)
    assert report.passed, report.failures
    for measure in ("scaled_jacobian", "mean_ratio", "minimum_dihedral", "characteristic_length"):
        listed = [item for item in report.worst if item.measure == measure]
        assert len(listed) == 4
        assert listed[0].value == report.measures[measure].min
        for item in listed:
            nodes = mesh.cells[kind][item.element, : ELEMENTS[kind].corners]
            np.testing.assert_allclose(item.centroid, mesh.points[nodes].mean(axis=0), rtol=1e-12)
            assert item.region in ("lv", "septum")
        assert sum(report.measures[measure].histogram.counts) == mesh.n_cells


@pytest.mark.parametrize(("difference", "passed"), [(9.9, True), (-9.9, True), (10.1, False), (-14.0, False)])
def test_a_wall_that_differs_from_its_labels_by_more_than_the_limit_fails(difference, passed):
    report = check(slab(2, 2, 2))
    judged = judge_wall_volume(report, difference)
    assert judged.passed is (report.passed and passed)
    verdict = judged.limits[-1]
    assert (verdict.name, verdict.value, verdict.limit) == ("wall_volume_difference", abs(difference), 10.0)
    more = "more" if difference > 0 else "less"
    line = f"the wall of the left ventricle has {abs(difference):.1f} % {more} volume than its labels"
    assert any(failure.startswith(line) for failure in judged.failures) is not passed
    assert judge_wall_volume(report, None) is report
    assert (
        judge_wall_volume(check(slab(2, 2, 2), maximum_wall_volume_difference=None), difference).limits == report.limits
    )
