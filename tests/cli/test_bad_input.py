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


def refused(outcome: tuple[int, str], *words: str) -> None:
    status, error = outcome
    lines = [line for line in error.splitlines() if line.strip()]
    assert status == 2, error
    assert len(lines) == 1, error
    assert lines[0].startswith("femprep: error: ")
    for word in words:
        assert word in lines[0]


def test_missing_file(run: Run, tmp_path: Path) -> None:
    refused(run(tmp_path / "none.nii.gz"), "none.nii.gz")


def test_damaged_file(run: Run, tmp_path: Path) -> None:
    whole = write(tmp_path / "whole.nii.gz", heart())
    cut = tmp_path / "cut.nii.gz"
    cut.write_bytes(whole.read_bytes()[:200])
    refused(run(cut), "cut.nii.gz")
    text = tmp_path / "text.nii"
    text.write_text("this is no image")
    refused(run(text), "text.nii")
    short = tmp_path / "short.nii"
    short.write_bytes(gzip.decompress(whole.read_bytes())[:5000])
    refused(run(short), "short.nii")


def test_unknown_format_of_image(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "a.docx"
    path.write_bytes(b"PK")
    refused(run(path), "a.docx")


def test_two_and_four_dimensions(run: Run, tmp_path: Path) -> None:
    refused(run(write(tmp_path / "flat.mha", heart()[3])), "flat.mha", "2")
    refused(run(write(tmp_path / "series.nii", np.stack([heart(), heart()]), (1.5, 1.5, 8.0, 1.0))), "series.nii", "4")


def test_labels_that_are_no_integers(run: Run, tmp_path: Path) -> None:
    refused(run(write(tmp_path / "soft.nii", heart().astype(np.float32) * 0.5)), "integer")


def test_absent_label(run: Run, tmp_path: Path) -> None:
    labels = heart()
    labels[labels == 3] = 2
    refused(run(write(tmp_path / "a.nii", labels)), "lv", "3")
    refused(run(write(tmp_path / "b.nii", heart()), "--structure", "lv=9", "--structure", "myo=2", preset=False), "9")


def test_structure_that_is_not_named(run: Run, tmp_path: Path) -> None:
    refused(run(write(tmp_path / "a.nii", heart()), "--structure", "lv=3", preset=False), "myo")
    refused(run(write(tmp_path / "a.nii", heart()), preset=False), "preset")


def test_object_of_a_few_voxels_or_one_slice(run: Run, tmp_path: Path) -> None:
    labels = heart()
    labels[labels == 3] = 2
    labels[3, 24, 24] = 3
    refused(run(write(tmp_path / "speck.nii", labels)), "voxel")
    labels = heart()
    labels[:3] = labels[4:] = 0
    refused(run(write(tmp_path / "slice.nii", labels)), "slice")


def test_endocardium_not_inside_epicardium(run: Run, tmp_path: Path) -> None:
    labels = heart()
    beside = np.zeros_like(labels)
    k, j, i = np.mgrid[:8, :48, :48]
    beside[(np.hypot(j - 14, i - 14) < 8) & (k > 0) & (k < 7)] = 3
    beside[(np.hypot(j - 34, i - 34) < 8) & (k > 0) & (k < 7)] = 2
    refused(run(write(tmp_path / "beside.nii", beside)))


@pytest.mark.parametrize("edge", ["-1", "0", "nan", "0.001", "60"])
def test_edge_length(run: Run, tmp_path: Path, edge: str) -> None:
    refused(run(write(tmp_path / "a.nii", heart()), "--edge-length", edge), "edge")


def test_unknown_format_and_option(run: Run, tmp_path: Path) -> None:
    path = write(tmp_path / "a.nii", heart())
    refused(run(path, "--format", "ansys"), "ansys", "abaqus")
    config = tmp_path / "a.toml"
    config.write_text("[volume]\nedge_lenght = 2.0\n")
    refused(run(path, "--config", str(config)), "edge_lenght")
    refused(run(path, "--apex", "open"), "apex", "open")


def test_output_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path / "a.nii", heart())
    status = main(["mesh", str(path), "-o", "/proc/out", "--preset", "acdc"])
    refused((status, capsys.readouterr().err), "/proc/out")
