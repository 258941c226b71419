"""Bad input of the main job: one clear line, exit status 2, nothing written."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from femprep.cli import main

Run = Callable[..., tuple[int, str]]


def write(path: Path, array: np.ndarray, spacing: tuple[float, ...] = (1.5, 1.5, 8.0)) -> Path:
    """Write an array indexed [k, j, i] as an image."""
    image = sitk.GetImageFromArray(array)
    image.SetSpacing(spacing[: array.ndim])
    sitk.WriteImage(image, str(path))
    return path


def heart(cavity: float = 16.0, wall: float = 26.0) -> np.ndarray:
    """Concentric cylinders of 8 slices: 3 cavity, 2 myocardium; the two last slices are myocardium alone."""
    k, j, i = np.mgrid[:8, :48, :48]
    radius = np.hypot(j - 23.5, i - 23.5) * 1.5
    labels = np.zeros(k.shape, dtype=np.uint8)
    labels[(radius < wall) & (k > 0)] = 2
    labels[(radius < cavity) & (k > 0) & (k < 6)] = 3
    return labels


@pytest.fixture
def run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run ``femprep mesh`` on a file and check that a refusal is one line and leaves nothing behind."""

    def go(path: Path, *arguments: str, preset: bool = True) -> tuple[int, str]:
        out = tmp_path / "result" / "out"
        out.parent.mkdir(exist_ok=True)
        status = main(["mesh", str(path), "-o", str(out), *(["--preset", "acdc"] if preset else []), *arguments])
        error = capsys.readouterr().err
        assert not list(out.parent.iterdir()), "something was written"
        return status, error

    return go


def refusal(outcome: tuple[int, str]) -> str:
    """The one line a run was refused with."""
    status, error = outcome
    lines = [line for line in error.splitlines() if line.strip()]
    assert status == 2, error
    assert len(lines) == 1, error
    assert lines[0].startswith("femprep: error: ")
    return lines[0]


def test_missing_file(run: Run, tmp_path: Path) -> None:
    assert "none.nii.gz" in refusal(run(tmp_path / "none.nii.gz"))


def test_damaged_file(run: Run, tmp_path: Path) -> None:
    whole = write(tmp_path / "whole.nii.gz", heart())
    cut = tmp_path / "cut.nii.gz"
    cut.write_bytes(whole.read_bytes()[:200])
    assert "cut.nii.gz" in refusal(run(cut))
    text = tmp_path / "text.nii"
    text.write_text("this is no image")
    assert "text.nii" in refusal(run(text))
    short = tmp_path / "short.nii"
    short.write_bytes(gzip.decompress(whole.read_bytes())[:5000])
    assert "short.nii" in refusal(run(short))


def test_unknown_format_of_image(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "a.docx"
    path.write_bytes(b"PK")
    assert "a.docx" in refusal(run(path))


def test_two_and_four_dimensions(run: Run, tmp_path: Path) -> None:
    line = refusal(run(write(tmp_path / "flat.mha", heart()[3])))
    assert "flat.mha" in line
    assert "2" in line
    line = refusal(run(write(tmp_path / "series.nii", np.stack([heart(), heart()]), (1.5, 1.5, 8.0, 1.0))))
    assert "series.nii" in line
    assert "4" in line


def test_labels_that_are_no_integers(run: Run, tmp_path: Path) -> None:
    assert "integer" in refusal(run(write(tmp_path / "soft.nii", heart().astype(np.float32) * 0.5)))


def test_absent_label(run: Run, tmp_path: Path) -> None:
    labels = heart()
    labels[labels == 3] = 2
    line = refusal(run(write(tmp_path / "a.nii", labels)))
    assert "lv" in line
    assert "3" in line
    assert "9" in refusal(
        run(write(tmp_path / "b.nii", heart()), "--structure", "lv=9", "--structure", "myo=2", preset=False)
    )


def test_structure_that_is_not_named(run: Run, tmp_path: Path) -> None:
    assert "myo" in refusal(run(write(tmp_path / "a.nii", heart()), "--structure", "lv=3", preset=False))
    assert "preset" in refusal(run(write(tmp_path / "a.nii", heart()), preset=False))


def test_object_of_a_few_voxels_or_one_slice(run: Run, tmp_path: Path) -> None:
    labels = heart()
    labels[labels == 3] = 2
    labels[3, 24, 24] = 3
    assert "voxel" in refusal(run(write(tmp_path / "speck.nii", labels)))
    labels = heart()
    labels[:3] = labels[4:] = 0
    assert "slice" in refusal(run(write(tmp_path / "slice.nii", labels)))


def test_endocardium_not_inside_epicardium(run: Run, tmp_path: Path) -> None:
    labels = heart()
    beside = np.zeros_like(labels)
    k, j, i = np.mgrid[:8, :48, :48]
    beside[(np.hypot(j - 14, i - 14) < 8) & (k > 0) & (k < 7)] = 3
    beside[(beside == 0) & (np.hypot(j - 14, i - 28) < 8) & (k > 0) & (k < 7)] = 2
    path = write(tmp_path / "beside.nii", beside)
    assert "both ends" in refusal(run(path))
    assert "myocardium closes around the cavity in none" in refusal(run(path, "--basal-end", "last"))


@pytest.mark.parametrize("edge", ["-1", "0", "nan", "0.001", "60"])
def test_edge_length(run: Run, tmp_path: Path, edge: str) -> None:
    assert "edge" in refusal(run(write(tmp_path / "a.nii", heart()), "--edge-length", edge))


def test_unknown_format_and_option(run: Run, tmp_path: Path) -> None:
    path = write(tmp_path / "a.nii", heart())
    line = refusal(run(path, "--format", "ansys"))
    assert "ansys" in line
    assert "abaqus" in line
    config = tmp_path / "a.toml"
    config.write_text("[volume]\nedge_lenght = 2.0\n")
    assert "edge_lenght" in refusal(run(path, "--config", str(config)))
    line = refusal(run(path, "--apex", "open"))
    assert "apex" in line
    assert "open" in line


def test_output_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path / "a.nii", heart())
    status = main(["mesh", str(path), "-o", "/proc/out", "--preset", "acdc"])
    assert "/proc/out" in refusal((status, capsys.readouterr().err))
