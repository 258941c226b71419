"""Ventricles whose base is rounded have no crease to be read by: what lies within their convex hull names them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from anatomy_meshes import ellipsoid
from biventricular import biventricular

import femprep as fp
from femprep.annotation.cups import by_hull
from femprep.annotation.reading import NoReading
from femprep.annotation.shell import shell_of
from femprep.model import FACET_TAGS, VolumeMesh

ROUND, LAYERS, ROWS, AROUND = 4.5, 10, 24, 48


def rounded_cup() -> VolumeMesh:
    """Half an ellipsoid of 30 x 30 x 70 mm, its wall 9 mm thick and ending in half a circle, bent up and down."""
    turn = np.pi * np.arange(LAYERS + 1) / LAYERS
    across, up = -ROUND * np.cos(turn), ROUND * np.sin(turn)
    slope = np.linspace(0.0, np.pi / 2.0, ROWS + 1)
    middle = np.column_stack([30.0 * np.sin(slope), -70.0 * np.cos(slope)])
    normal = np.column_stack([np.sin(slope) / 30.0, -np.cos(slope) / 70.0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    profile = middle[:, None] + across[:, None] * normal[:, None]
    profile[..., 1] += np.linspace(0.0, 1.0, ROWS + 1)[:, None] ** 4 * up
    angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
    radius, height = profile[1:, None, :, 0], profile[1:, None, :, 1]
    rings = np.stack(
        [radius * np.cos(angle)[:, None], radius * np.sin(angle)[:, None], height + 0.0 * angle[:, None]], -1
    )
    bent = 4.0 * np.cos(2.0 * angle)[:, None] * np.linspace(0.0, 1.0, ROWS + 1)[1:, None, None] ** 4
    rings[..., 2] += bent
    pole = np.column_stack([np.zeros((LAYERS + 1, 2)), profile[0, :, 1]])
    points = np.concatenate([pole, rings.reshape(-1, 3)])

    def node(row: int, j: np.ndarray, k: np.ndarray) -> np.ndarray:
        return (row * AROUND + j % AROUND) * (LAYERS + 1) + k + LAYERS + 1

    j, k = (grid.ravel() for grid in np.meshgrid(np.arange(AROUND), np.arange(LAYERS), indexing="ij"))
    wedges = np.column_stack([column for n in range(2) for column in (k + n, node(0, j + 1, k + n), node(0, j, k + n))])
    bricks = [
        np.column_stack(
            [
                column
                for n in range(2)
                for column in (
                    node(row, j, k + n),
                    node(row, j + 1, k + n),
                    node(row + 1, j + 1, k + n),
                    node(row + 1, j, k + n),
                )
            ]
        )
        for row in range(ROWS - 1)
    ]
    cells = {"wedge": wedges, "hexahedron": np.concatenate(bricks)}
    return VolumeMesh(points, cells, np.ones(sum(map(len, cells.values()))))


def test_a_rounded_base_is_found_and_parts_endocardium_from_epicardium() -> None:
    found = fp.annotate(rounded_cup(), fibres=None)
    assert [attempt.way for attempt in found.attempts if attempt.taken] == ["convex hull"]
    mesh = found.mesh
    assert set(mesh.facet_names) == {"endo", "epi", "base"}
    shell = shell_of(mesh)
    out = np.einsum("ij,ij->i", shell.normal[:, :2], shell.centre[:, :2]) > 0.0
    tag = tags(mesh)
    endo, epi, base = (tag == FACET_TAGS[name] for name in ("endo", "epi", "base"))
    low = shell.centre[:, 2] < -10.0
    np.testing.assert_array_equal(epi[low], (out | (shell.normal[:, 2] < -0.5))[low])
    np.testing.assert_array_equal(endo[low], ~epi[low])
    # What looks up within 45 degrees: of ten facets across the rim the four of 9 and 27 degrees.
    assert shell.normal[base, 2].min() > 0.7
    assert shell.area[base].sum() == pytest.approx(0.4 * np.pi * ROUND * 2.0 * np.pi * 30.0, rel=0.05)


def tags(mesh: VolumeMesh) -> np.ndarray:
    """Tags of the mesh's facets in the order of its shell's."""
    rows = [frozenset(row) for block in shell_of(mesh).facets.values() for row in block.tolist()]
    of = dict(zip((frozenset(row) for block in mesh.facets.values() for row in block.tolist()), mesh.facet_tag))
    return np.array([of[row] for row in rows])


@pytest.mark.parametrize(
    "made",
    [lambda: ellipsoid("tetra").mesh, pytest.param(biventricular, marks=pytest.mark.slow)],
    ids=["one", "two"],
)
def test_flat_bases_are_read_by_the_hull_too(made: Callable[[], VolumeMesh]) -> None:
    mesh = made()
    shell = shell_of(VolumeMesh(mesh.points, mesh.cells, mesh.region))
    right = by_hull(shell).tag == tags(mesh)
    assert shell.area[right].sum() > 0.99 * shell.area.sum()


def test_a_ball_has_no_cavity() -> None:
    corners = np.array([[0, 0, 0], [60, 0, 0], [0, 60, 0], [0, 0, 60]], dtype=float)
    with pytest.raises(NoReading, match="the convex hull holds 0 cavities"):
        by_hull(shell_of(VolumeMesh(corners, {"tetra": np.array([[0, 1, 2, 3]])}, np.ones(1))))
