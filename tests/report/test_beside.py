"""Volumes of a mesh beside those of its labels: what lies beyond the labels' last slice is told apart."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.image import Grid, Segmentation
from femprep.model import FACET_TAGS, REGION_TAGS, Plane, VolumeMesh
from femprep.report.beside import volumes_beside_labels, wall_difference
from femprep.report.manifest import VolumeRecord


def box_mesh(low: float, high: float, layers: int) -> VolumeMesh:
    """A wall between x = 2 and x = 4 beside a cavity from 0 to 2, y 0 to 4, z from low to high, of bricks."""
    z = np.linspace(low, high, layers + 1)
    points = np.array([[x, y, h] for h in z for x, y in ((2, 0), (4, 0), (4, 4), (2, 4))], dtype=float)
    cells = np.array([[4 * k + i for i in range(8)] for k in range(layers)])
    inner = np.array([[4 * k, 4 * k + 3, 4 * k + 7, 4 * k + 4] for k in range(layers)])
    tags = np.full(layers, FACET_TAGS["endo"])
    return VolumeMesh(points, {"hexahedron": cells}, np.full(layers, REGION_TAGS["lv"]), {"quad": inner}, tags)


def labelled(grid: Grid) -> Segmentation:
    """Labels of that cavity and wall, from z = 0 to 12."""
    labels = np.zeros(grid.shape, dtype=np.uint8)
    labels[:4, :4, :3] = 2
    labels[:2, :4, :3] = 3
    return Segmentation(labels, grid, {"lv": (3,), "myo": (2,)})


@pytest.mark.parametrize("layers", [3, 16])
def test_what_lies_beyond_the_last_slice_is_no_difference(layers: int) -> None:
    grid = Grid((8, 8, 4), np.array([1.0, 1.0, 4.0]), np.array([0.5, 0.5, 2.0]), np.eye(3))
    seg = labelled(grid)
    objects = {"lv": seg.object("lv"), "epi": seg.object("lv", "myo")}
    # Labels from z = 0 to 12, the base at 10; the mesh reaches 5 mm beyond them.
    base = Plane(np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, 1.0]))
    _, wall = volumes_beside_labels(box_mesh(-5.0, 10.0, layers), seg, objects, {"base": base})
    assert wall.segmentation_ml == pytest.approx(0.08)
    assert wall.mesh_ml == pytest.approx(0.12)
    assert (wall.part, wall.whole_ml) == ("below the base", pytest.approx(0.096))
    assert wall.extrapolated_ml == pytest.approx(0.04)
    assert wall.difference_percent == pytest.approx(50.0)
    assert wall_difference([wall]) == pytest.approx(0.0, abs=1e-9)
    _, wall = volumes_beside_labels(box_mesh(-5.0, 10.0, layers), seg, objects, {})
    assert wall.extrapolated_ml == 0.0


def test_cavity_that_was_left_out_is_no_wall() -> None:
    grid = Grid((12, 8, 4), np.array([1.0, 1.0, 4.0]), np.array([0.5, 0.5, 2.0]), np.eye(3))
    labels = np.array(labelled(grid).labels)
    labels[4:8, :4, :3] = 2
    labels[6, 1, :1] = 3
    seg = Segmentation(labels, grid, {"lv": (3,), "myo": (2,)})
    objects = {"lv": seg.object("lv"), "epi": seg.object("lv", "myo")}
    assert objects["lv"].report["removed_voxels"] == 1
    cavity, wall = volumes_beside_labels(box_mesh(0.0, 12.0, 3), seg, objects, {})
    assert cavity.segmentation_ml == pytest.approx(0.1)
    assert wall.segmentation_ml == pytest.approx(0.284)


def test_a_wall_without_labels_is_not_judged() -> None:
    assert wall_difference([VolumeRecord(name="wall", mesh_ml=5.0, segmentation_ml=0.0)]) is None
    assert wall_difference([VolumeRecord(name="rv wall", mesh_ml=5.0, segmentation_ml=1.0)]) is None
    assert wall_difference([VolumeRecord(name="lv wall and septum", mesh_ml=5.0, segmentation_ml=4.0)]) == 25.0
