"""Images of intensities: read with their place, refused where they are none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

import femprep as fp
from femprep.errors import FileError, InputError
from femprep.image import Grid

GRID = Grid((4, 5, 3), (1.5, 1.5, 8.0), (10.0, -20.0, 30.0), np.eye(3))


def test_an_image_keeps_its_values_and_place(tmp_path: Path) -> None:
    values = np.random.default_rng(0).normal(1000.0, 50.0, GRID.shape).astype(np.float32)
    image = sitk.GetImageFromArray(values.T)
    image.SetSpacing([1.5, 1.5, 8.0])
    image.SetOrigin([10.0, -20.0, 30.0])
    sitk.WriteImage(image, str(tmp_path / "t1.nrrd"))
    found = fp.read_image(tmp_path / "t1.nrrd")
    np.testing.assert_array_equal(found.values, values)
    np.testing.assert_allclose(found.grid.origin, GRID.origin)
    np.testing.assert_allclose(found.grid.spacing, GRID.spacing)
    assert "1.5 x 1.5 x 8 mm" in repr(found)


def test_what_is_no_image_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such file"):
        fp.read_image(tmp_path / "t1.nii.gz")
    with pytest.raises(InputError, match="shape"):
        fp.IntensityImage(np.zeros((2, 2, 2)), GRID)
    with pytest.raises(InputError, match="no finite number"):
        fp.IntensityImage(np.full(GRID.shape, np.nan), GRID)
    with pytest.raises(InputError, match="expected numbers"):
        fp.IntensityImage(np.full(GRID.shape, "a"), GRID)


@pytest.mark.parametrize("frame", [-1, 0, 3])
def test_a_frame_that_is_not_there_is_refused(tmp_path: Path, frame: int) -> None:
    """Frames before the first were taken for it, or for the last."""
    image = sitk.JoinSeries([sitk.GetImageFromArray(np.full(GRID.shape, k, dtype=np.float32).T) for k in (1, 2)])
    for name, shown in (("t1.nii.gz", image), ("one.nii.gz", image[..., 0])):
        sitk.WriteImage(shown, str(tmp_path / name))
        with pytest.raises(InputError, match=f"has no frame {frame}, it holds . .*, counted from 1"):
            fp.read_image(tmp_path / name, frame=frame)
    assert np.all(fp.read_image(tmp_path / "t1.nii.gz", frame=2).values == 2)
