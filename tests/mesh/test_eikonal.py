"""Times of fronts: plane ones exact, bent ones late by an error that falls with the edges, none where no way leads."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from anatomy_meshes import slab

from femprep.errors import InputError
from femprep.mesh.eikonal import first_times

SPEEDS = np.array([0.6, 0.3, 0.2])


def metric(axes: np.ndarray) -> np.ndarray:
    """Inverse of the squared speeds along orthonormal rows."""
    return np.einsum("ai,aj,a->ij", axes, axes, SPEEDS**-2.0)


def turned() -> np.ndarray:
    return np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


def test_a_plane_front_is_exact() -> None:
    mesh = slab("tetra", (4, 5, 6)).mesh
    tets, x = mesh.cells["tetra"], mesh.points
    across = np.tile(metric(np.eye(3)), (len(tets), 1, 1))
    for axis, speed in enumerate(SPEEDS):
        start = np.flatnonzero(x[:, axis] == 0)
        times = first_times(x, tets, across, start, np.full(len(start), 2.0))
        np.testing.assert_allclose(times, 2.0 + x[:, axis] / speed, rtol=1e-13)


def test_a_front_from_a_corner_converges_to_the_exact_one() -> None:
    errors = []
    tensor = metric(turned())
    for k in (1, 2, 4):
        mesh = slab("tetra", (3 * k, 6 * k, 9 * k)).mesh
        x, tets = mesh.points, mesh.cells["tetra"]
        times = first_times(x, tets, np.tile(tensor, (len(tets), 1, 1)), [0], [0.0])
        way = x - x[0]
        exact = np.sqrt(np.einsum("ni,ij,nj->n", way, tensor, way))
        # Times are those of ways through the mesh, so that none is before the exact one in a convex body.
        assert np.all(times > exact - 1e-9)
        errors.append(float(np.mean(times - exact) / exact.max()))
    # About a single node the error is that of h log(1 / h), h the edges' share of the slab: a third to begin with.
    for k, (coarse, fine) in zip((1, 2), pairwise(errors)):
        assert fine < 0.5 * np.log(6 * k) / np.log(3 * k) * coarse
    assert errors[2] < 0.01


def test_turning_the_mesh_and_its_metric_changes_nothing() -> None:
    mesh = slab("tetra", (3, 4, 5)).mesh
    tets, turn = mesh.cells["tetra"], turned()
    one = first_times(mesh.points, tets, np.tile(metric(np.eye(3)), (len(tets), 1, 1)), [7, 30], [1.0, 0.0])
    two = first_times(mesh.points @ turn, tets, np.tile(metric(turn), (len(tets), 1, 1)), [7, 30], [1.0, 0.0])
    np.testing.assert_allclose(one, two, rtol=1e-12)


def test_the_earlier_of_two_fronts_counts_also_at_its_stimuli() -> None:
    mesh = slab("tetra", (3, 4, 5)).mesh
    tets = mesh.cells["tetra"]
    tensor = np.tile(np.eye(3), (len(tets), 1, 1))
    far = len(mesh.points) - 1
    alone = first_times(mesh.points, tets, tensor, [0], [0.0])
    both = first_times(mesh.points, tets, tensor, [0, far], [0.0, 1000.0])
    np.testing.assert_array_equal(alone, both)


def test_what_no_way_leads_to_is_never_reached() -> None:
    mesh = slab("tetra", (2, 2, 2)).mesh
    n = len(mesh.points)
    points = np.vstack([mesh.points, mesh.points + 100.0])
    tets = np.vstack([mesh.cells["tetra"], mesh.cells["tetra"] + n])
    times = first_times(points, tets, np.tile(np.eye(3), (len(tets), 1, 1)), [0], [0.0])
    assert np.isfinite(times[:n]).all()
    assert np.isinf(times[n:]).all()


@pytest.mark.parametrize(
    ("nodes", "times", "words"),
    [([], [], "begins anywhere"), ([999], [0.0], "point 999"), ([0], [np.nan], "not finite")],
    ids=["none", "out of range", "not a number"],
)
def test_bad_beginnings(nodes: list[int], times: list[float], words: str) -> None:
    mesh = slab("tetra", (1, 1, 1)).mesh
    tets = mesh.cells["tetra"]
    with pytest.raises(InputError, match=words):
        first_times(mesh.points, tets, np.tile(np.eye(3), (len(tets), 1, 1)), nodes, times)


def test_another_solver_agrees() -> None:
    """fim-python (AGPL), where someone has it: the same first-order scheme by another program."""
    fimpy = pytest.importorskip("fimpy.solver")
    mesh = slab("tetra", (4, 5, 6)).mesh
    tets, tensor = mesh.cells["tetra"], metric(turned())
    ours = first_times(mesh.points, tets, np.tile(tensor, (len(tets), 1, 1)), [0, 50], [0.0, 3.0])
    speed = np.tile(np.linalg.inv(tensor), (len(tets), 1, 1))
    solver = fimpy.create_fim_solver(mesh.points, tets, speed, precision=np.float64, device="cpu")
    theirs = solver.comp_fim(np.array([0, 50]), np.array([0.0, 3.0]))
    np.testing.assert_allclose(ours, theirs, rtol=2e-2)
