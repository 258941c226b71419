import json
from dataclasses import replace

import numba
import numpy as np
import pytest
from analytic_walls import cut_ellipsoid_volume, ellipsoid_wall
from meshes import truncated_ellipsoid
from scipy.spatial import cKDTree

from femprep.errors import StageError
from femprep.mesh.elements import boundary_faces
from femprep.mesh.measures.volume_elements import element_measures
from femprep.mesh.topology import euler_characteristic, is_manifold
from femprep.model import FACET_TAGS, REGION_TAGS, Plane, Wall
from femprep.options import CheckOptions, VolumeOptions
from femprep.volume import check, finish, runs, sound, tetrahedralize
from femprep.volume.tetwild.guard import TetwildRun, TooLongError
from femprep.volume.tetwild.ways import planned_runs


def holds(mesh, wall, volume: float = 0.01) -> None:
    """What is promised of every mesh; chords of coarse elements cost some volume."""
    report = check(mesh)
    assert report.passed, report.failures
    assert report.validity.inverted_elements == 0
    assert report.validity.untagged_boundary_facets == 0
    assert report.measures["minimum_dihedral"].min >= 10.0
    assert report.measures["mean_ratio"].mean >= 0.82
    for name, plane in wall.planes.items():
        nodes = np.unique(mesh.facets["triangle"][mesh.facet_tag == FACET_TAGS[name]])
        assert len(nodes) > 10
        assert np.abs(plane.signed_distance(mesh.points[nodes])).max() <= 1e-9
    boundary = boundary_faces(mesh.cells)["triangle"].nodes
    assert is_manifold(boundary)
    assert euler_characteristic(boundary) == euler_characteristic(wall.triangles)
    assert mesh.info["volume_mm3"] == pytest.approx(report.volume, rel=1e-12)
    assert abs(mesh.info["volume_difference_to_wall"]) < volume
    json.dumps(dict(mesh.info))


def test_mesh_of_a_wall(coarse_wall, fresh_mesh):
    holds(fresh_mesh, coarse_wall)
    assert set(fresh_mesh.cells) == {"tetra"}
    assert (fresh_mesh.region == REGION_TAGS["lv"]).all()
    assert set(fresh_mesh.facet_names) == {"endo", "epi", "base"}
    assert element_measures(fresh_mesh.points, fresh_mesh.cells["tetra"], "tetra")["volume"].min() > 0
    assert fresh_mesh.info["quality_reached"] is True
    assert fresh_mesh.info["deterministic"] is False
    exact = cut_ellipsoid_volume((22, 22, 42), 10)
    nodes = fresh_mesh.facets["triangle"][fresh_mesh.facet_tag == FACET_TAGS["endo"]]
    a, b, c = (fresh_mesh.points[nodes[:, i]] - [0, 0, 10] for i in range(3))
    cavity = -np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    # Chords of 6 mm in a surface whose curvature radius is 11.5 to 80 mm cut off less than l^2 / (8 r) of depth.
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0
    assert 0.0 < exact - cavity < area * 6.0**2 / (8 * 11.5)


@pytest.mark.slow
def test_wall_cut_at_base_and_apex():
    """A tube: two planes, oblique in space, four rims."""
    wall = tube()
    mesh = tetrahedralize(wall, edge_length=4.0)
    holds(mesh, wall)
    assert set(mesh.facet_names) == {"endo", "epi", "base", "apex"}


def tube(rings: int = 12, around: int = 40) -> Wall:
    """A tube of radii 10 and 16 mm, 30 mm long, turned in space."""
    angle = 2 * np.pi * np.arange(around) / around
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    inner = [(10.0, z) for z in np.linspace(0, 30, rings)]
    outer = [(16.0, z) for z in np.linspace(30, 0, rings)]
    middle = [[(12.0, 30.0), (14.0, 30.0)], [(14.0, 0.0), (12.0, 0.0)]]
    profile = [*inner, *middle[0], *outer, *middle[1]]
    names = ["endo"] * (rings - 1) + ["base"] * 3 + ["epi"] * (rings - 1) + ["apex"] * 3
    points = np.concatenate([np.column_stack([r * circle, np.full(around, z)]) for r, z in profile])
    triangles, tags = [], []
    for k, name in enumerate(names):
        a = k * around + np.arange(around)
        b = ((k + 1) % len(profile)) * around + np.arange(around)
        a_next, b_next = np.roll(a, -1), np.roll(b, -1)
        triangles += [np.column_stack([a, b, b_next]), np.column_stack([a, b_next, a_next])]
        tags += [FACET_TAGS[name]] * (2 * around)
    turn, _ = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [0.3, 1.0, 2.0], [2.0, 0.1, 1.0]]))
    turn *= np.sign(np.linalg.det(turn))
    move = lambda p: np.asarray(p) @ turn.T + [150.0, -80.0, 40.0]  # noqa: E731
    up = turn @ [0, 0, 1.0]
    planes = {"base": Plane(move([0, 0, 30.0]), up), "apex": Plane(move([0, 0, 0.0]), -up)}
    flat = move(points)
    for name, plane in planes.items():
        nodes = np.unique(np.concatenate(triangles)[np.array(tags) == FACET_TAGS[name]])
        flat[nodes] -= plane.signed_distance(flat[nodes])[:, None] * plane.normal
    return Wall(flat, np.concatenate(triangles), np.array(tags), np.full(len(points), -1), planes)


@pytest.mark.slow
def test_closed_cavity_stays_a_cavity():
    from test_validate import shells

    wall = shells()
    mesh = tetrahedralize(wall, edge_length=5.0)
    # 5 mm chords on spheres of 20 and 12 mm: l^2 / (8 r) of depth on the outer one, by the wall's thickness.
    holds(mesh, wall, volume=5.0**2 / (8 * 20.0) / 8.0)
    assert check(mesh).validity.boundary_shells == 2


def test_progress_rises_and_ends_at_one(coarse_wall, monkeypatch, coarse_mesh):
    seen: list[tuple[str, float]] = []

    def fake(points, triangles, settings, *, pulse, **_):
        for gone in np.arange(0.2, 20.0, 0.2):
            pulse(float(gone))
        return result(coarse_mesh)

    monkeypatch.setattr(runs, "run_tetwild", fake)
    tetrahedralize(
        coarse_wall, edge_length=6.0, retries=0, progress=lambda stage, fraction: seen.append((stage, fraction))
    )
    stages, fractions = zip(*seen)
    assert set(stages) == {"volume"}
    assert list(fractions) == sorted(fractions)
    assert fractions[-1] == 1.0
    assert max(fractions[:-1]) < 0.9


def result(mesh) -> TetwildRun:
    return TetwildRun(mesh.points.copy(), mesh.cells["tetra"].copy(), 1.0, 10**8, 1.0)


class Mesher:
    """In place of fTetWild: gives prepared answers in turn and keeps what it was asked."""

    def __init__(self, *answers):
        self.answers = list(answers)
        self.asked: list[dict] = []

    def __call__(self, points, triangles, settings, **limits):
        self.asked.append({**settings, **limits})
        answer = self.answers[min(len(self.asked), len(self.answers)) - 1]
        if isinstance(answer, Exception):
            raise answer
        return answer


@pytest.fixture
def mesher(monkeypatch):
    def install(*answers) -> Mesher:
        found = Mesher(*answers)
        monkeypatch.setattr(runs, "run_tetwild", found)
        return found

    return install


def filled(wall: Wall) -> TetwildRun:
    """A mesh of the convex body: what fTetWild gives when both shells have one orientation."""
    from scipy.spatial import Delaunay

    cells = Delaunay(wall.points).simplices.astype(np.int64)
    x = wall.points[cells]
    volume = np.linalg.det(x[:, 1:] - x[:, :1])
    cells[volume < 0] = cells[volume < 0][:, [1, 0, 2, 3]]
    return TetwildRun(wall.points.copy(), cells[np.abs(volume) > 1e-9], 1.0, None, 1.0)


@pytest.mark.slow
def test_retries_tighter_after_a_crash_and_says_so(mesher, coarse_wall, coarse_mesh):
    used = mesher(StageError("the mesher was ended by SIGSEGV"), result(coarse_mesh))
    mesh = tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82)
    assert [item["outcome"] for item in mesh.info["attempts"]] == ["the mesher was ended by SIGSEGV", "reached"]
    assert used.asked[1]["epsilon"] == pytest.approx(used.asked[0]["epsilon"] / 1.5)
    assert used.asked[1]["stop_energy"] < used.asked[0]["stop_energy"]
    diagonal = np.linalg.norm(np.ptp(coarse_wall.points, axis=0))
    assert used.asked[0]["epsilon"] * diagonal == pytest.approx(0.3)
    assert used.asked[0]["arrays"]["bg_values"].min() == 6.0
    assert used.asked[0]["edge_length_abs"] == used.asked[0]["arrays"]["bg_values"].max() == 12.0


def test_attempts_follow_the_outcome():
    options = VolumeOptions(retries=3, envelope=0.1, stop_energy=7.0)
    assert [a.envelope for a in planned_runs(options, lambda: "too long")] == pytest.approx([0.1, 0.15, 0.225, 0.3375])
    assert [a.stop_energy for a in planned_runs(options, lambda: "too long")] == [7.0, 14.0, 28.0, 56.0]
    assert [a.patience for a in planned_runs(options, lambda: "too long")] == [4.0, 8.0, 16.0, 32.0]
    assert [a.stop_energy for a in planned_runs(options, lambda: "crashed")] == [7.0, 6.5, 6.5, 6.5]
    assert [a.follows for a in planned_runs(options, lambda: "wrong mesh")] == [False, True, True, True]
    assert [a.envelope for a in planned_runs(options, lambda: "missed")] == [0.1] * 2
    assert [a.stop_energy for a in planned_runs(VolumeOptions(), lambda: "missed")] == [10.0, 6.5]
    assert [a.passes for a in planned_runs(VolumeOptions(), lambda: "missed")] == [80, 8]
    # In a wider envelope the mesher lets go of the wall's small triangles; one that is given is kept, as above.
    assert [a.envelope for a in planned_runs(VolumeOptions(edge_length=2.0), lambda: "missed")] == pytest.approx(
        [0.1, 0.3]
    )
    # Where that comes to nothing the next run is in the one before.
    told = iter(["missed", "wrong mesh", "missed"])
    runs = list(planned_runs(VolumeOptions(edge_length=2.0), lambda: next(told)))
    assert [(a.envelope, a.stop_energy, a.passes) for a in runs] == [
        (pytest.approx(0.1), 10.0, 80),
        (pytest.approx(0.3), 6.5, 8),
        (pytest.approx(0.1), 6.5, 8),
    ]
    few = list(planned_runs(VolumeOptions(edge_length=2.0), lambda: "missed", few=True))
    assert [(a.envelope, a.stop_energy, a.passes) for a in few] == [
        (pytest.approx(0.3), 7.0, 80),
        (pytest.approx(0.3), 6.5, 8),
    ]
    few = list(planned_runs(VolumeOptions(edge_length=2.0), lambda: "wrong mesh", few=True))
    assert [(a.envelope, a.stop_energy) for a in few] == [
        (pytest.approx(0.3), 7.0),
        (pytest.approx(0.1), 6.5),
        (pytest.approx(0.1 / 1.5), 6.5),
    ]
    told = iter(["missed", "too long"])
    # What the lowest energy takes too long for is not tried with a higher one than missed.
    assert len(list(planned_runs(VolumeOptions(), lambda: next(told)))) == 2
    given = VolumeOptions(stop_energy=5.0)
    assert [a.stop_energy for a in planned_runs(given, lambda: "crashed")] == [5.0, 5.0, 5.0]


@pytest.mark.slow
def test_the_best_of_runs_is_the_one_nearest_to_what_was_asked(mesher):
    """Not the one whose smallest angle is larger, where that is enough and it is the mean ratio that both miss."""
    given = truncated_ellipsoid("tetra", heights=6, around=24, layers=3, lean=0.0)
    facets, cells = given.facets["triangle"], given.cells["tetra"]
    inner = np.setdiff1d(np.arange(len(given.points)), facets)
    wall = Wall(given.points, facets, given.facet_tag, np.full(len(given.points), -1), given.planes)

    def moved(points: np.ndarray) -> tuple[TetwildRun, float, float]:
        found = element_measures(points, cells, "tetra")
        return (
            TetwildRun(points, cells.copy(), 1.0, None, 1.0),
            found["minimum_dihedral"].min(),
            found["mean_ratio"].mean(),
        )

    one, all_of_them = given.points.copy(), given.points.copy()
    element = int(np.argmax(np.isin(cells, inner).sum(axis=1)))
    top = cells[element][np.isin(cells[element], inner)][0]
    one[top] += 0.25 * (one[np.setdiff1d(cells[element], top)].mean(axis=0) - one[top])
    all_of_them[inner] += np.random.default_rng(3).uniform(-0.4, 0.4, (len(inner), 3))
    (good, *sharp), (poor, *blunt) = moved(one), moved(all_of_them)
    assert sharp[0] < blunt[0]
    assert sharp[1] > blunt[1]
    for answers in ((good, poor), (poor, good)):
        mesher(*answers)
        options = {"optimise": False, "minimum_dihedral": 0.5 * sharp[0], "mean_ratio": 0.99, "retries": 1}
        mesh = tetrahedralize(wall, edge_length=3.0, refinement="none", **options)
        assert [item["status"] for item in mesh.info["attempts"]] == ["missed", "missed"]
        assert len({item["outcome"].count(";") for item in mesh.info["attempts"]}) == 1
        mean = element_measures(mesh.points, mesh.cells["tetra"], "tetra")["mean_ratio"].mean()
        assert mean == pytest.approx(sharp[1], abs=0.3 * (sharp[1] - blunt[1]))


def test_the_time_of_a_run_follows_from_its_estimate():
    attempt = next(planned_runs(VolumeOptions(), str))
    assert attempt.time_limit(30.0, 6000, longest=600.0) == 120.0
    assert attempt.time_limit(300.0, 6000, longest=600.0) == 600.0
    assert attempt.time_limit(1.0, 6000, longest=600.0) == 60.0
    assert attempt.time_limit(1.0, 600, longest=600.0) == 40.0
    assert attempt.time_limit(1.0, 6000, longest=5.0) == 5.0


@pytest.mark.slow
def test_a_run_that_takes_too_long_is_followed_by_another_one(mesher, coarse_wall, coarse_mesh):
    used = mesher(TooLongError("the mesher did not finish within 40 s").after(55.0, 40.1), result(coarse_mesh))
    mesh = tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82)
    assert [item["status"] for item in mesh.info["attempts"]] == ["too long", "reached"]
    assert [item["processor_seconds"] for item in mesh.info["attempts"]] == [40.1, 1.0]
    assert mesh.info["attempts"][0]["seconds"] == 55.0
    assert [asked["time_limit"] for asked in used.asked] == [40.0, 40.0]
    assert used.asked[1]["stop_energy"] > used.asked[0]["stop_energy"]
    assert used.asked[0]["arrays"]["bg_values"].min() == used.asked[1]["arrays"]["bg_values"].min() == 6.0


@pytest.mark.parametrize(
    ("options", "first"),
    [
        ({"edge_length": 6.0}, 10.0),
        ({"edge_length": 6.0, "stop_energy": 12.0}, 12.0),
        ({"edge_length": 6.0, "quality": "fast"}, 50.0),
    ],
)
def test_a_run_begins_with_the_energy_of_its_quality_or_the_users(options, first):
    assert next(planned_runs(VolumeOptions(**options), str)).stop_energy == first


@pytest.mark.parametrize(
    ("options", "energy", "envelope"),
    [
        ({}, 7.0, 0.3),
        ({"quality": "fast"}, 35.0, 0.3),
        ({"quality": "best"}, 6.0, 0.3),
        ({"stop_energy": 12.0}, 12.0, 0.3),
        ({"envelope": 0.05}, 7.0, 0.05),
    ],
)
def test_a_wall_of_few_elements_begins_with_less_energy_in_a_wide_envelope(options, energy, envelope):
    first = next(planned_runs(VolumeOptions(edge_length=2.0, **options), str, few=True))
    assert (first.stop_energy, first.envelope, first.passes) == (energy, pytest.approx(envelope), 80)
    refined = next(planned_runs(VolumeOptions(edge_length=2.0, **options), str, levels=1, few=True))
    assert refined == next(planned_runs(VolumeOptions(edge_length=2.0, **options), str, levels=1))


@pytest.mark.slow
def test_a_run_that_misses_a_limit_of_the_check_is_followed_by_another_one(mesher, coarse_wall, coarse_mesh):
    """What the mesh will be judged by is what its mesher aims at; with a mesh at hand it is not waited for long."""
    used = mesher(result(coarse_mesh))
    most = float(element_measures(coarse_mesh.points, coarse_mesh.cells["tetra"], "tetra")["scaled_jacobian"].min())
    asked = CheckOptions(minimum_scaled_jacobian=min(1.5 * most, 0.99))
    mesh = tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82, optimise=False, limits=asked)
    assert [item["status"] for item in mesh.info["attempts"]] == ["missed"] * 2
    assert [asked["time_limit"] for asked in used.asked] == [40.0, pytest.approx(1.6)]  # the first took 1 s
    assert "smallest scaled Jacobian is" in mesh.info["attempts"][0]["outcome"]
    assert mesh.info["quality_reached"] is False
    mesh = tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82, optimise=False)
    assert [item["status"] for item in mesh.info["attempts"]] == ["reached"]


@pytest.mark.slow
def test_filled_cavity_is_refused(mesher, coarse_wall):
    mesher(filled(coarse_wall))
    with pytest.raises(
        StageError, match=r"no mesh after 3 attempt\(s\).*made .* mm3 of a wall of .*; it filled a cavity"
    ):
        tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("empty", "gave no elements"),
        ("inverted", "gave 1 inverted elements"),
        ("nan", "not finite or not there"),
        ("hole", "Euler characteristic|no closed 2-manifold|in 2 pieces|it lost part"),
        ("lost", "it lost part of it"),
    ],
)
def test_wrong_meshes_are_refused(mesher, coarse_wall, coarse_mesh, fault, message):
    points, cells = coarse_mesh.points.copy(), coarse_mesh.cells["tetra"].copy()
    if fault == "empty":
        cells = cells[:0]
    if fault == "inverted":
        cells[9] = cells[9][[1, 0, 2, 3]]
    if fault == "nan":
        points[cells[0, 0]] = np.nan
    middle = points[cells].mean(axis=1)
    if fault == "hole":  # an element deep inside the wall: a second shell
        boundary = np.unique(coarse_mesh.facets["triangle"])
        inside = ~np.isin(cells, boundary).any(axis=1)
        cells = np.delete(cells, np.flatnonzero(inside)[:1] if inside.any() else [0], axis=0)
    if fault == "lost":
        cells = cells[middle[:, 2] > -40.0]
    mesher(TetwildRun(points, cells, 1.0, None, 1.0))
    with pytest.raises(StageError, match=message):
        tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82, retries=0)


def test_best_mesh_is_kept_where_the_quality_asked_for_is_out_of_reach(mesher, coarse_wall, coarse_mesh, caplog):
    mesher(result(coarse_mesh))
    mesh = tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.99, retries=2, stop_energy=10.0)
    assert mesh.info["quality_reached"] is False
    # The third run would ask for what the second one could not reach.
    assert len(mesh.info["attempts"]) == 2
    assert "below what was asked" in mesh.info["attempts"][0]["outcome"]
    assert "below what was asked" in caplog.text
    assert not check(mesh, mean_of_mean_ratio=0.99).passed


def test_a_mesh_that_misses_its_mean_ratio_is_improved_further(mesher, coarse_wall, coarse_mesh):
    points = coarse_mesh.points + np.random.default_rng(0).uniform(-0.3, 0.3, coarse_mesh.points.shape)
    mesher(replace(result(coarse_mesh), points=points))
    content, short = (
        tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=asked, retries=0, envelope=0.4) for asked in (0.5, 0.99)
    )
    before, after = (
        element_measures(mesh.points, mesh.cells["tetra"], "tetra")["mean_ratio"] for mesh in (content, short)
    )
    assert after.mean() > before.mean() + 2e-3
    assert after.min() > 0


@pytest.mark.slow
def test_points_that_left_the_wall_are_put_back(mesher, coarse_wall, coarse_mesh):
    rng = np.random.default_rng(0)
    boundary = np.unique(coarse_mesh.facets["triangle"])
    points = coarse_mesh.points.copy()
    points[boundary] += rng.uniform(-0.1, 0.1, (len(boundary), 3))
    mesher(replace(result(coarse_mesh), points=points))
    mesh = tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82)
    # Points, and with them facets, are numbered by where they lie: the facets are matched by their middles.
    middle, before = (m.points[m.facets["triangle"]].mean(axis=1) for m in (mesh, coarse_mesh))
    _, same = cKDTree(before).query(middle)
    assert len(np.unique(same)) == len(before) == len(middle)
    np.testing.assert_array_equal(mesh.facet_tag, coarse_mesh.facet_tag[same])
    assert mesh.info["greatest_distance_from_wall_mm"] < 1e-9
    base = np.unique(mesh.facets["triangle"][mesh.facet_tag == FACET_TAGS["base"]])
    assert (mesh.points[base, 2] == 10.0).all()
    plain = tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82, optimise=False)
    assert (plain.points[base, 2] == 10.0).all()


def test_inputs_are_left_alone(coarse_wall, mesher, coarse_mesh):
    before = coarse_wall.points.tobytes(), coarse_wall.triangles.tobytes()
    mesher(result(coarse_mesh))
    tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82)
    assert before == (coarse_wall.points.tobytes(), coarse_wall.triangles.tobytes())


@pytest.mark.slow
def test_one_thread_and_several_give_the_same_bytes(coarse_wall, mesher, coarse_mesh, monkeypatch):
    mesher(result(coarse_mesh))
    found = []
    for number in (4, 1):
        monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", number)
        mesh = tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82)
        report = check(mesh).model_dump_json()
        found.append((mesh.points.tobytes(), mesh.cells["tetra"].tobytes(), mesh.facet_tag.tobytes(), report))
    assert found[0] == found[1]


@pytest.mark.slow
def test_a_boundary_that_is_wrong_is_told_before_tags_that_cannot_be(coarse_wall, mesher, coarse_mesh, monkeypatch):
    def fail(*_):
        raise StageError("no tags")

    monkeypatch.setattr(finish, "tag_facets", fail)
    mesher(result(coarse_mesh))
    with pytest.raises(StageError, match="no tags"):
        tetrahedralize(coarse_wall, edge_length=6.0)
    monkeypatch.setattr(sound, "pinched_vertices", lambda facets, table: facets[0])
    with pytest.raises(StageError, match="no closed 2-manifold"):
        tetrahedralize(coarse_wall, edge_length=6.0)


@pytest.mark.slow
@pytest.mark.parametrize("edge_length", [2.5, 1.5])
def test_fine_mesh_of_an_ellipsoid_converges(edge_length):
    wall = ellipsoid_wall(rings=30, layers=6)
    mesh = tetrahedralize(wall, edge_length=edge_length)
    holds(mesh, wall)
    exact = cut_ellipsoid_volume((31, 31, 51), 10) - cut_ellipsoid_volume((22, 22, 42), 10)
    # The wall's own facets cost 0.1 % of its volume, those of the mesh up to as much again.
    assert mesh.info["volume_mm3"] == pytest.approx(exact, rel=3e-3)
    assert check(mesh).edge_length.mean == pytest.approx(edge_length, rel=0.2)
