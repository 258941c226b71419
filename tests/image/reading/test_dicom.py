"""DICOM segmentations, made with highdicom as its users make them, read into label maps that lie where they did."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.errors import MissingDependencyError
from femprep.image.reading import dicom
from femprep.phantoms import lv_ellipsoid

hd = pytest.importorskip("highdicom")
pydicom = pytest.importorskip("pydicom")
NAMES = ("LV blood pool", "Myocardium")
#: A turn about no axis of the patient, as short axis stacks have.
TURNED = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]).T


def phantom(direction: np.ndarray | None = None) -> fp.Segmentation:
    seg = lv_ellipsoid().segmentation(spacing=(2.0, 2.5, 8.0), apex="uncapped")
    if direction is None:
        return seg
    grid = fp.Grid(seg.grid.shape, seg.grid.spacing, (12.0, -40.0, 7.0), direction)
    return fp.Segmentation(seg.labels, grid, seg.structures)


def source_images(grid: fp.Grid, moved: np.ndarray | None = None) -> list[Any]:
    """The MR images that were segmented, without pixels; each slice moved as given, mm."""
    study, series, frame = (pydicom.uid.generate_uid() for _ in range(3))
    images = []
    for k in range(grid.shape[2]):
        image = pydicom.Dataset()
        image.file_meta = pydicom.dataset.FileMetaDataset()
        image.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        image.SOPClassUID, image.SOPInstanceUID = pydicom.uid.MRImageStorage, pydicom.uid.generate_uid()
        image.StudyInstanceUID, image.SeriesInstanceUID, image.FrameOfReferenceUID = study, series, frame
        image.Modality, image.Manufacturer, image.PatientID = "MR", "phantom", "1"
        for name in ("PatientName", "PatientBirthDate", "PatientSex", "StudyDate", "StudyTime", "StudyID"):
            setattr(image, name, "")
        image.AccessionNumber = image.ReferringPhysicianName = image.PositionReferenceIndicator = ""
        image.SeriesNumber, image.InstanceNumber = 1, k + 1
        image.Columns, image.Rows = grid.shape[:2]
        image.PixelSpacing = [float(grid.spacing[1]), float(grid.spacing[0])]
        image.SliceThickness = image.SpacingBetweenSlices = float(grid.spacing[2])
        image.ImageOrientationPatient = [float(x) for x in grid.direction[:, :2].T.ravel()]
        place = grid.to_world([[0, 0, k]])[0] + (0.0 if moved is None else moved[k])
        image.ImagePositionPatient = [float(f"{x:.9g}") for x in place]
        images.append(image)
    return images


def write_seg(
    path: Path, seg: fp.Segmentation, masks: list[np.ndarray], kind: str = "BINARY", moved: np.ndarray | None = None
) -> Path:
    """A DICOM SEG of masks (i, j, k), without its empty frames."""
    pixels = np.stack([mask.transpose(2, 1, 0) for mask in masks], axis=-1).astype(np.uint8)
    if kind == "LABELMAP":
        pixels = (pixels * np.arange(1, len(masks) + 1)).sum(axis=-1).astype(np.uint8)
    codes = pydicom.sr.codedict.codes.SCT
    described = [
        hd.seg.SegmentDescription(number, name, codes.Organ, codes.Heart, hd.seg.SegmentAlgorithmTypeValues.MANUAL)
        for number, name in enumerate((*NAMES, "Scar")[: len(masks)], 1)
    ]
    made = hd.seg.Segmentation(
        source_images(seg.grid, moved),
        pixels.astype(float) if kind == "FRACTIONAL" else pixels,
        kind,
        described,
        *(pydicom.uid.generate_uid(), 2, pydicom.uid.generate_uid(), 1),
        *("maker", "model", "1", "serial"),
    )
    made.save_as(path)
    return path


def masks_of(seg: fp.Segmentation) -> list[np.ndarray]:
    return [seg.mask("lv"), seg.mask("myo")]


def assert_same_place(found: fp.Segmentation, seg: fp.Segmentation, name: str) -> None:
    """Every voxel of a structure in one place of the world in both."""
    own, other = (one.grid.to_world(np.argwhere(one.mask(name))) for one in (found, seg))
    assert len(own) == len(other)
    order = [np.lexsort(np.round(points, 3).T) for points in (own, other)]
    np.testing.assert_allclose(own[order[0]], other[order[1]], atol=1e-4)


@pytest.mark.parametrize("kind", ["BINARY", "LABELMAP", "FRACTIONAL"])
def test_segments_lie_where_they_did(kind: str, tmp_path: Path) -> None:
    seg = phantom(TURNED)
    path = write_seg(tmp_path / "heart.dcm", seg, masks_of(seg), kind)
    for found in (fp.read_segmentation(path), fp.read_segmentation(path, {"lv": NAMES[0], "myo": 2})):
        for name in ("lv", "myo"):
            assert_same_place(found, seg, name)
        np.testing.assert_allclose(found.grid.spacing, seg.grid.spacing)
        assert found.grid.right_handed
        assert found.info["format"] == "DICOM SEG"
        halved = [notice["what"] for notice in found.info["notices"]]
        assert halved == (
            ["segments are fractional (probability): taken from one half on"] if kind == "FRACTIONAL" else []
        )


def test_slices_without_a_frame_are_filled_in(tmp_path: Path) -> None:
    seg = phantom()
    masks = masks_of(seg)
    empty = int(np.flatnonzero(masks[0].any(axis=(0, 1)))[3])
    for mask in masks:
        mask[:, :, empty] = False
    path = write_seg(tmp_path / "heart.dcm", seg, masks)
    found = fp.read_segmentation(path)
    assert found.grid.spacing[2] == pytest.approx(8.0)
    for name, mask in zip(("lv", "myo"), masks):
        assert np.count_nonzero(found.mask(name)) == np.count_nonzero(mask)
    filled = np.flatnonzero(~found.mask("myo").any(axis=(0, 1)))
    np.testing.assert_allclose(found.grid.to_world([[0, 0, filled[0]]]), seg.grid.to_world([[0, 0, empty]]), atol=1e-4)


def test_overlapping_segments_are_told_and_those_not_asked_for_take_nothing(tmp_path: Path) -> None:
    seg = phantom()
    lv, myo = masks_of(seg)
    scar = myo & (np.arange(myo.shape[0]) < 15)[:, None, None]
    path = write_seg(tmp_path / "heart.dcm", seg, [lv, lv | myo, scar])
    found = fp.read_segmentation(path)
    assert_same_place(found, seg, "myo")
    assert_same_place(found, seg, "lv")
    assert any(f"{np.count_nonzero(lv)} voxels are both" in notice["what"] for notice in found.info["notices"])
    wanted = {"lv": NAMES[0], "myo": NAMES[1], "scar": "Scar"}
    asked = fp.read_segmentation(path, wanted)
    assert np.count_nonzero(asked.mask("scar")) == np.count_nonzero(scar)


def test_where_slices_lie_counts_more_than_their_stated_distance(tmp_path: Path) -> None:
    seg = phantom()
    path = write_seg(tmp_path / "heart.dcm", seg, masks_of(seg))
    data = pydicom.dcmread(path)
    data.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0].SpacingBetweenSlices = 4.0
    data.save_as(path)
    found = fp.read_segmentation(path)
    assert_same_place(found, seg, "lv")
    assert any("said to be 4 mm apart and lie 8 mm apart" in notice["what"] for notice in found.info["notices"])


def test_a_file_without_ending_is_known_by_its_first_bytes(tmp_path: Path) -> None:
    seg = phantom()
    made = write_seg(tmp_path / "heart.dcm", seg, masks_of(seg))
    for name in ("IM000001", "1.2.840.99"):
        path = Path(shutil.copy(made, tmp_path / name))
        assert_same_place(fp.read_segmentation(path), seg, "myo")


def uneven(path: Path, seg: fp.Segmentation) -> None:
    moved = np.zeros((seg.grid.shape[2], 3))
    moved[7:, 2] = 3.0
    write_seg(path, seg, masks_of(seg), moved=moved)


def one_slice(path: Path, seg: fp.Segmentation) -> None:
    masks = masks_of(seg)
    for mask in masks:
        mask[:, :, :7] = mask[:, :, 8:] = False
    write_seg(path, seg, masks)


def mr_image(path: Path, seg: fp.Segmentation) -> None:
    source_images(seg.grid)[0].save_as(path, enforce_file_format=True)


def cut(size: int) -> Any:
    def make(path: Path, seg: fp.Segmentation) -> None:
        write_seg(path, seg, masks_of(seg))
        path.write_bytes(path.read_bytes()[:size])

    return make


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (uneven, "its slices are no even stack: 8 to 11 mm apart"),
        (one_slice, "labels a single slice"),
        (mr_image, "is DICOM of the kind 'MR Image', expected a segmentation"),
        (cut(0), "file is empty"),
        (cut(100), "is no DICOM file"),
        (cut(300), "damaged or cut short"),
        (cut(9000), "damaged"),
        (cut(-200), "cut short, .* bytes"),
        (lambda path, seg: path.write_bytes(b"no heart" * 100), "is no DICOM file"),
        (lambda path, seg: None, "no such file"),
    ],
)
def test_what_is_no_segmentation_is_refused_in_one_line(
    make: Any, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "heart.dcm"
    make(path, phantom())
    assert main(["mesh", str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err.strip()
    assert "\n" not in said.replace("\n  ", " ")
    with pytest.raises(fp.FemprepError, match=words):
        fp.read_segmentation(path)
    assert not (tmp_path / "out").exists()


def test_what_does_not_fit_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seg = phantom()
    path = write_seg(tmp_path / "heart.dcm", seg, masks_of(seg))
    with pytest.raises(
        fp.OptionError, match=r"no segment 'Blod' in the file; .*it holds 1 'LV blood pool' .*mL.*, 2 'Myocardium'"
    ):
        fp.read_segmentation(path, {"lv": "Blod"})
    with pytest.raises(fp.InputError, match="a DICOM SEG holds one"):
        fp.read_segmentation(path, frame=2)
    monkeypatch.setattr(dicom, "find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'femprep\[dicom\]'"):
        fp.read_segmentation(path)


@pytest.mark.slow
def test_the_command_meshes_a_dicom_segmentation(tmp_path: Path) -> None:
    seg = phantom(TURNED)
    path = write_seg(tmp_path / "heart.dcm", seg, masks_of(seg))
    small = ["--mesher", "sweep", "--vertices", "300", "--edge-length", "6", "--quiet"]
    assert main(["mesh", str(path), "-o", str(tmp_path / "out"), *small]) == 0
