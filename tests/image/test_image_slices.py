"""Slice tables: areas, centroids, zig-zag."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femprep.image import Grid, Segmentation, slice_table


def test_areas_and_centroids_on_an_oblique_grid():
    labels = np.zeros((12, 10, 7), dtype=np.uint8)
    labels[2:6, 3:9, 2] = 3
    labels[2:8, 3:5, 4] = 3
    grid = Grid(labels.shape, (1.5, 1.25, 8.0), (5.0, 6.0, 7.0), Rotation.random(random_state=1).as_matrix())
    table = Segmentation(labels, grid, {"lv": (3,)}).slices("lv")
    assert table.index.tolist() == [2, 4]
    np.testing.assert_allclose(table.area, np.array([24, 12]) * 1.5 * 1.25)
    np.testing.assert_allclose(table.centroid, grid.to_world([[3.5, 5.5, 2], [4.5, 3.5, 4]]), atol=1e-12)
    np.testing.assert_allclose(table.normal, grid.direction[:, 2])
    assert (table.spacing, table.axis, len(table)) == (8.0, 2, 2)
    assert table.zigzag.shape == (0,)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_any_stack_axis(axis):
    mask = np.zeros((6, 6, 6), dtype=bool)
    mask[1:3, 2:5, 3:5] = True
    spacing = np.ones(3)
    spacing[axis] = 5.0
    table = slice_table(mask, Grid(mask.shape, spacing, np.zeros(3), np.eye(3)))
    assert table.axis == axis
    assert table.area.tolist() == [[6.0, 4.0, 6.0][axis]] * len(table)
    np.testing.assert_allclose(table.centroid.mean(axis=0), np.array([1.5, 3.0, 3.5]) * spacing)


def test_zigzag_is_the_shift_of_a_slice_against_the_middle_of_its_neighbours():
    mask = np.zeros((30, 30, 5), dtype=bool)
    for k in range(5):
        mask[8 + 2 * k : 14 + 2 * k, 8:14, k] = True
    mask[:, :, 2] = np.roll(mask[:, :, 2], 3, axis=1)
    table = slice_table(mask, Grid(mask.shape, (2.0, 1.0, 8.0), np.zeros(3), np.eye(3)))
    np.testing.assert_allclose(table.zigzag, [1.5, 3.0, 1.5])
