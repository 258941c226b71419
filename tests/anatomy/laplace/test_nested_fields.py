"""Coordinates and fibres of a refined mesh: from the coarser one's solution, the same as without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from meshes import truncated_ellipsoid

from femprep.anatomy import WallFields, add_fibres
from femprep.anatomy.laplace import multilevel
from femprep.anatomy.laplace.conjugate import conjugate_gradients
from femprep.model import VolumeMesh
from femprep.volume.refine import Refinement

FIELDS = ("across", "upward", "across_distance", "upward_distance", "turn")


@pytest.fixture(scope="module")
def fine() -> VolumeMesh:
    return Refinement.of(truncated_ellipsoid("tetra"), 2).fine


@pytest.fixture(scope="module")
def alone(fine: VolumeMesh) -> WallFields:
    return WallFields(replace(fine, nested=None))


@pytest.mark.slow
def test_fields_are_those_of_the_mesh_alone(fine: VolumeMesh, alone: WallFields) -> None:
    assert fine.nested is not None
    assert fine.nested.coarse.nested is not None
    nested = WallFields(fine, alone.axes)
    for name in FIELDS:
        found, wanted = getattr(nested, name), getattr(alone, name)
        assert np.abs(np.asarray(found) - np.asarray(wanted)).max() < 3e-4, name


def test_fibres_are_those_of_the_mesh_alone(fine: VolumeMesh, alone: WallFields) -> None:
    found = add_fibres(fine, axes=alone.axes).cell_data["fiber"]
    wanted = add_fibres(alone.mesh, fields=alone).cell_data["fiber"]
    angle = np.degrees(np.arccos(np.clip(np.abs(np.einsum("ij,ij->i", found, wanted)), 0.0, 1.0)))
    assert np.percentile(angle, 99.0) < 0.05
    assert angle.max() < 0.5


def test_few_steps_are_taken_and_the_bytes_are_the_same_each_time(fine: VolumeMesh, monkeypatch) -> None:
    taken: list[int] = []

    def counted(*args, **keywords):
        values, steps = conjugate_gradients(*args, **keywords)
        taken.append(steps)
        return values, steps

    monkeypatch.setattr(multilevel, "conjugate_gradients", counted)
    first, second = WallFields(fine), WallFields(fine)
    assert first.upward_distance.tobytes() == second.upward_distance.tobytes()
    assert 0 < max(taken) < 100


def test_a_refined_mesh_of_other_points_or_elements_is_not_nested(fine: VolumeMesh) -> None:
    assert fine.with_data(cell={"more": np.zeros(fine.n_cells)}).nested is fine.nested
    assert replace(fine, points=fine.points + 1.0).nested is None
    assert replace(fine, cells={"tetra": fine.cells["tetra"][:, [1, 2, 0, 3]]}).nested is None


def test_what_is_left_of_a_refined_mesh_stays_nested(fine: VolumeMesh) -> None:
    kept = np.arange(fine.n_cells)[:-5]
    nodes = np.unique(fine.cells["tetra"][kept])
    number = np.full(len(fine.points), -1)
    number[nodes] = np.arange(len(nodes))
    points, cells = fine.points[nodes], number[fine.cells["tetra"][kept]]
    for array in (points, cells):
        array.setflags(write=False)
    rest = VolumeMesh(points, {"tetra": cells}, fine.region[kept])
    assert fine.nested is not None
    rest = replace(rest, nested=fine.nested.part(rest, nodes, kept))
    assert rest.nested is not None
    assert np.abs(rest.nested.down @ rest.nested.coarse.points - rest.points).max() < 1e-9
    assert np.array_equal(rest.nested.parent, kept // 8)
