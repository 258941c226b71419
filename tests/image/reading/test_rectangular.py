"""Volumes whose axes are not at right angles: refused unless asked for, and then where the heart really lies."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.image.reading.rectangular import is_sheared, rectangular_labels, rectangular_values, sharpest_angle

CENTRE, INNER, OUTER = np.array([3.0, -12.0, 31.0]), 24.0, 36.0
#: Steps along the axes as columns, mm: slices that slide aside, pixels that are no rectangles, both and turned.
STEPS = {
    "slices": np.array([[1.5, 0.0, 0.0], [0.0, 1.5, 2.9], [0.0, 0.0, 8.0]]),
    "pixels": np.array([[1.5, 0.5, 0.0], [0.0, 1.6, 0.0], [0.0, 0.0, 6.0]]),
    "first axis across": np.array([[6.0, 0.0, 0.0], [1.3, 1.5, 0.0], [0.0, 0.4, 1.4]]),
    "left-handed": np.array([[1.5, 0.0, 1.0], [0.0, 1.5, 2.9], [0.0, 0.0, -8.0]]),
}
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
STEPS["both, turned"] = TURN @ np.array([[1.4, 0.3, 1.7], [0.0, 1.5, -2.2], [0.0, 0.0, 8.0]])


def sampled(step: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A ball in a shell on a sheared grid around them, its labels, their distances from the centre; the origin."""
    shape = np.ceil(2.4 * OUTER / np.abs(np.linalg.inv(step)).max(axis=1) ** -1).astype(int) + 1
    origin = CENTRE - step @ (0.5 * (shape - 1))
    index = np.moveaxis(np.indices(shape), 0, -1)
    distance = np.linalg.norm(index @ step.T + origin - CENTRE, axis=-1)
    labels = np.where(distance < INNER, 3, np.where(distance < OUTER, 2, 0)).astype(np.uint8)
    return labels, distance, origin


@pytest.mark.parametrize("name", STEPS)
def test_labels_lie_where_they_do_in_the_world(name: str) -> None:
    step = STEPS[name]
    labels, _, origin = sampled(step)
    drawn, grid, said = rectangular_labels(labels, step, origin, Path("map.nii"))
    places = grid.to_world(np.moveaxis(np.indices(grid.shape), 0, -1).reshape(-1, 3))
    distance = np.linalg.norm(places - CENTRE, axis=1).reshape(grid.shape)
    true = np.where(distance < INNER, 3, np.where(distance < OUTER, 2, 0))
    for label in (2, 3):
        mask = drawn == label
        assert np.count_nonzero(mask) * grid.voxel_volume == pytest.approx(
            np.count_nonzero(labels == label) * abs(np.linalg.det(step)), rel=0.01
        )
        centre = places[mask.ravel()].mean(axis=0)
        np.testing.assert_allclose(centre, CENTRE, atol=0.3)  # a fifth of a pixel; half of one by nearest neighbours
        both = 2 * np.count_nonzero(mask & (true == label)) / (np.count_nonzero(mask) + np.count_nonzero(true == label))
        assert both > (0.98 if label == 3 else 0.965)
    # Wrong voxels are at the boundaries alone: within a pixel of them.
    off = np.minimum(np.abs(distance - INNER), np.abs(distance - OUTER))[drawn != true]
    assert off.max() < 1.5
    assert np.sign(np.linalg.det(grid.direction)) == np.sign(np.linalg.det(step))
    assert f"{sharpest_angle(step):.1f} degrees" in said


@pytest.mark.parametrize("name", STEPS)
def test_intensities_that_are_linear_stay_what_they_are(name: str) -> None:
    step = STEPS[name]
    _, distance, origin = sampled(step)
    index = np.moveaxis(np.indices(distance.shape), 0, -1)
    slope = np.array([0.3, -0.7, 0.2])
    drawn, grid = rectangular_values((index @ step.T + origin) @ slope, step, origin, Path("t1.nii"))
    known = np.isfinite(drawn)
    places = grid.to_world(np.argwhere(known))
    np.testing.assert_allclose(drawn[known], places @ slope, atol=1e-4)
    assert known.mean() > 0.4


def test_a_grid_at_right_angles_is_drawn_as_it_is() -> None:
    step = TURN @ np.diag([1.5, 1.25, 8.0])
    assert not is_sheared(step)
    labels, _, origin = sampled(step)
    drawn, grid, _ = rectangular_labels(labels, step, origin, Path("map.nii"))
    np.testing.assert_array_equal(drawn, labels)
    np.testing.assert_allclose(grid.direction * grid.spacing, step, atol=1e-12)


def sheared_nifti(path: Path, *, qform: bool) -> np.ndarray:
    """A label map whose sform, and that alone, is sheared; its steps."""
    step = STEPS["slices"]
    labels, _, origin = sampled(step)
    spacing = np.diag(step)
    fp.write_segmentation(
        fp.Segmentation(labels, fp.Grid(labels.shape, spacing, origin, np.eye(3)), {"lv": (3,)}), path
    )
    header = bytearray(path.read_bytes())
    matrix = np.column_stack([step, origin]) * np.array([[-1.0], [-1.0], [1.0]])
    struct.pack_into("<2h", header, 252, int(qform), 1)
    struct.pack_into("<12f", header, 280, *matrix.ravel())
    path.write_bytes(header)
    return labels


def test_a_sheared_file_is_resampled_on_request(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "sheared.nii"
    labels = sheared_nifti(path, qform=False)
    with pytest.raises(fp.InputError, match=r"not at right angles.*--resample"):
        fp.read_segmentation(path, {"lv": 3, "myo": 2})
    assert main(["mesh", str(path), "--structure", "lv=3", "--structure", "myo=2", "-o", str(tmp_path / "out")]) == 2
    assert "--resample" in " ".join(capsys.readouterr().err.split())
    found = fp.read_segmentation(path, {"lv": 3, "myo": 2}, resample=True)
    centre = found.grid.to_world(np.argwhere(found.mask("lv"))).mean(axis=0)
    np.testing.assert_allclose(centre, CENTRE, atol=0.3)
    assert np.count_nonzero(found.mask("myo")) == pytest.approx(np.count_nonzero(labels == 2), rel=0.01)
    assert any("70.1 degrees" in notice["what"] for notice in found.info["notices"])
    image = fp.read_image(path, resample=True)
    assert image.grid.shape == found.grid.shape
    with pytest.raises(fp.InputError, match="not at right angles"):
        fp.read_image(path)


def test_a_sheared_sform_beside_a_qform_is_told(tmp_path: Path) -> None:
    path = tmp_path / "both.nii"
    sheared_nifti(path, qform=True)
    plain = fp.read_segmentation(path, {"lv": 3, "myo": 2})
    assert any("--resample takes the sform" in notice["what"] for notice in plain.info["notices"])
    taken = fp.read_segmentation(path, {"lv": 3, "myo": 2}, resample=True)
    assert taken.grid.shape != plain.grid.shape


def test_a_broken_affine_is_refused_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "broken.nii"
    sheared_nifti(path, qform=False)
    header = bytearray(path.read_bytes())
    struct.pack_into("<f", header, 284, float("nan"))
    path.write_bytes(header)
    with pytest.raises(fp.FileError, match="holds numbers that are not finite"):
        fp.read_segmentation(path, {"lv": 3, "myo": 2}, resample=True)
