"""Intensities on a mesh: along the wall between slices, from the wall alone."""

from __future__ import annotations

import numpy as np
import pytest
from second_images import centres, depth, stack, ventricle

import femprep as fp
from femprep.errors import InputError


def image(grid: fp.Grid) -> fp.IntensityImage:
    """Depth of the wall in hundreds; bright blood and dark lung beside it, where the mesh, of flat faces, ends."""
    points = centres(grid)
    through = depth(points)
    values = np.where(through < -0.15, 5000.0, np.where(through > 1.0, -5000.0, 1000.0 + 100.0 * through))
    values[points[:, 2] > 15.0] = np.nan
    return fp.IntensityImage(values.reshape(grid.shape), grid)


def test_values_follow_the_wall_and_neither_blood_nor_lung_gets_in() -> None:
    mesh = ventricle(size=4)
    found = fp.sample_image(mesh, image(stack((1.6, 1.6, 8.0), 20.0)), "t1")
    value = found.cell_data["t1"]
    assert value.min() >= 1000.0
    assert value.max() <= 1100.0
    off = value - (1000.0 + 100.0 * mesh.cell_data["transmural"])
    assert np.abs(off).mean() < 6.0  # hundredths of the thickness; the mesh's flat faces cut off some
    at = found.point_data["t1"]
    assert np.abs(at - (1000.0 + 100.0 * mesh.point_data["transmural"])).mean() < 8.0
    assert found.info["sampled"]["t1"]["largest"] == value.max()


def test_names_and_images_that_do_not_meet_are_refused() -> None:
    mesh = ventricle(size=3, layers=2)
    grid = stack((4.0, 4.0, 8.0))
    whole = fp.IntensityImage(np.ones(grid.shape), grid)
    for name in ("fiber", "region"):
        with pytest.raises(InputError, match="has a field"):
            fp.sample_image(mesh, whole, name)
    with pytest.raises(InputError, match="no name for a field"):
        fp.sample_image(mesh, whole, "1 t")
    far = fp.IntensityImage(np.ones(grid.shape), fp.Grid(grid.shape, grid.spacing, grid.origin + 900.0, grid.direction))
    with pytest.raises(InputError, match="same world coordinates"):
        fp.sample_image(mesh, far, "t1")
    constant = fp.sample_image(mesh, whole, "t1")
    np.testing.assert_allclose(constant.cell_data["t1"], 1.0)
    np.testing.assert_allclose(fp.sample_image(constant, whole, "t1").point_data["t1"], 1.0)
