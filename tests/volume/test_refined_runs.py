"""fTetWild at twice the edge length asked for, and its mesh refined: what ``refinement="auto"`` does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from analytic_walls import cut_ellipsoid_volume, ellipsoid_wall
from slow_params import slow_but

from femprep.mesh.elements import boundary_faces
from femprep.model import FACET_TAGS, VolumeMesh
from femprep.volume import check, tetrahedralize
from femprep.wall import fill_cavities

ENDO, EPI, HEIGHT = (22.0, 22.0, 42.0), (31.0, 31.0, 51.0), 10.0


@pytest.fixture(scope="module")
def wall():
    return ellipsoid_wall(ENDO, EPI, HEIGHT, rings=10, layers=2)


@pytest.fixture(scope="module", params=slow_but(["wall"], ["wall", "wall and blood"]))
def mesh(wall, request) -> VolumeMesh:
    blood = fill_cavities(wall) if request.param == "wall and blood" else None
    return tetrahedralize(wall, edge_length=3.2, refinement="auto", blood=blood)


def nodes_of(mesh: VolumeMesh, name: str) -> np.ndarray:
    return np.unique(mesh.facets["triangle"][mesh.facet_tag == FACET_TAGS[name]])


@pytest.mark.slow
def test_it_says_how_it_was_made(mesh):
    assert mesh.info["refinement"]["levels"] == 1
    assert mesh.info["refinement"]["surfaces"] == "of the wall"
    assert mesh.info["attempts"][-1]["refined_levels"] == 1
    assert mesh.info["attempts"][-1]["outcome"] == "reached"
    assert "parent" not in mesh.cell_data


def test_it_is_as_good_as_a_mesh_of_the_mesher_and_nearer_to_the_truth(mesh, wall):
    report = check(mesh).raise_if_failed()
    # A flat element on the endocardium cannot be taken away where blood lies on its other side.
    assert report.measures["minimum_dihedral"].min >= (15.0 if "cap_lv" in mesh.facet_names else 20.0)
    assert report.measures["mean_ratio"].mean >= 0.86
    exact = cut_ellipsoid_volume(EPI, HEIGHT) - cut_ellipsoid_volume(ENDO, HEIGHT)
    assert abs(mesh.info["volume_mm3"] / exact - 1.0) < 0.5 * abs(wall.volume / exact - 1.0)
    for name, axes in (("endo", ENDO), ("epi", EPI)):
        off = np.abs(np.linalg.norm(mesh.points[nodes_of(mesh, name)] / axes, axis=1) - 1.0) * max(axes[:2])
        assert off.mean() < 0.02
        assert off.max() < 0.25


def test_base_and_caps_are_flat_and_every_boundary_facet_is_tagged(mesh):
    names = [name for name in ("base", "cap_lv") if name in mesh.facet_names]
    for name in names:
        assert np.abs(mesh.points[nodes_of(mesh, name), 2] - HEIGHT).max() < 1e-12
        assert name in mesh.planes
    tagged = {tuple(row) for row in np.sort(mesh.facets["triangle"], axis=1).tolist()}
    boundary = np.sort(boundary_faces(mesh.cells)["triangle"].nodes, axis=1).tolist()
    assert {tuple(row) for row in boundary} <= tagged
    inside = len(tagged) - len(boundary)
    assert (inside > 0) == ("cap_lv" in names)


@pytest.mark.slow
def test_a_direct_run_when_asked(wall, monkeypatch):
    from femprep.volume import runs

    asked = []

    def stop(points, triangles, parameters, arrays, **_):
        asked.append(np.min(arrays.get("bg_values", parameters["edge_length_abs"])))
        raise runs.StageError("enough")

    monkeypatch.setattr(runs, "run_tetwild", stop)
    for refinement, expected in (("auto", [6.4, 6.4, 3.2, 3.2]), ("none", [3.2, 3.2, 3.2])):
        asked.clear()
        with pytest.raises(runs.StageError):
            tetrahedralize(wall, edge_length=3.2, refinement=refinement)
        assert asked == expected


@pytest.mark.slow
def test_edges_that_vary_are_asked_for_twice_as_long(wall, monkeypatch):
    from femprep.volume import runs

    asked = []

    def stop(points, triangles, parameters, arrays, **_):
        inside = np.abs(arrays["bg_vertices"] - wall.points[0]).max(axis=1) < 5.0
        asked.append(arrays["bg_values"][inside].min())
        raise runs.StageError("enough")

    monkeypatch.setattr(runs, "run_tetwild", stop)
    for options in ({"elements_through_wall": 4}, {"sizing": lambda x: np.where(x[:, 0] < 0.0, 1.0, 3.0)}):
        asked.clear()
        for refinement in ("auto", "none"):
            with pytest.raises(runs.StageError):
                tetrahedralize(wall, refinement=refinement, retries=0, **options)
        assert asked[0] == pytest.approx(2.0 * asked[-1])


@pytest.mark.slow
def test_a_step_that_spoils_the_mesh_is_undone(wall, monkeypatch):
    """What the mesher gave is sound: it is not thrown away because a step after it fails."""
    from femprep.volume import finish
    from femprep.volume.tetwild import ways

    asked = []

    def spoil(given, levels, **_):
        asked.append(given)
        cells = given.cells["tetra"].copy()
        cells[0] = cells[0][[1, 0, 2, 3]]
        return replace(given, cells={"tetra": cells}, info={**given.info, "refinement": {"levels": levels}})

    monkeypatch.setattr(finish, "refine", spoil)
    # The time a run is allowed is a few times what its own elements need, be they the coarse ones or all.
    monkeypatch.setattr(ways, "_LEAST_SECONDS", 5.0)
    monkeypatch.setattr(ways, "_SECONDS_PER_TRIANGLE", 0.0)
    found = tetrahedralize(wall, edge_length=3.2, retries=0, minimum_dihedral=0.0, mean_ratio=0.0)
    first, last = found.info["attempts"]
    assert (first["way"], first["status"]) == ("refined", "wrong mesh")
    assert first["undone"][0].startswith("refined: 1 elements are inverted")
    assert (last["way"], last["status"]) == ("direct", "reached")
    assert last["time_limit_s"] > 2.0 * first["time_limit_s"]
    assert "refinement" not in found.info
    assert len(asked) == 1
    assert check(found).passed
