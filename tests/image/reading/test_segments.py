"""Segmentations as other programs leave them: 3D Slicer's segments, a mask per structure, maps with several frames."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.image.reading.segments import merged_masks
from femprep.model import TISSUES
from femprep.options import PRESETS
from femprep.phantoms import lv_ellipsoid

SimpleITK = pytest.importorskip("SimpleITK")


def phantom() -> fp.Segmentation:
    return lv_ellipsoid().segmentation(spacing=(2.0, 2.0, 8.0), apex="uncapped")


def write_slicer(path: Path, layers: list[np.ndarray], segments: Sequence[tuple[str, object, object]]) -> None:
    """A .seg.nrrd as 3D Slicer writes it, by pynrrd: layers are the first axis where there are several."""
    nrrd = pytest.importorskip("nrrd")
    seg = phantom()
    several = len(layers) > 1
    header = {
        "space": "left-posterior-superior",
        "space directions": np.vstack(
            [*([[np.nan] * 3] if several else []), (seg.grid.direction * np.asarray(seg.grid.spacing)).T]
        ),
        "space origin": np.asarray(seg.grid.origin),
        "kinds": [*(["list"] if several else []), "domain", "domain", "domain"],
        "encoding": "gzip",
    }
    for k, (name, label, layer) in enumerate(segments):
        header |= {
            f"Segment{k}_ID": f"Segment_{k + 1}",
            f"Segment{k}_Name": name,
            f"Segment{k}_LabelValue": str(label),
            f"Segment{k}_Layer": str(layer),
        }
    nrrd.write(str(path), np.stack(layers) if several else layers[0], header)


def masks_of(seg: fp.Segmentation) -> dict[str, np.ndarray]:
    return {name: np.isin(seg.labels, numbers) for name, numbers in seg.structures.items()}


def test_segments_are_taken_by_their_usual_names_and_lie_where_they_did(tmp_path: Path) -> None:
    seg, path = phantom(), tmp_path / "heart.seg.nrrd"
    mask = masks_of(seg)
    labels = (7 * mask["lv"] + 3 * mask["myo"]).astype(np.uint8)
    write_slicer(path, [labels], [("LV blood pool", 7, 0), ("Myocardium", 3, 0)])
    for found in (fp.read_segmentation(path), fp.read_segmentation(path, preset="slicer")):
        for name in ("lv", "myo"):
            np.testing.assert_array_equal(found.mask(name), mask[name])
        np.testing.assert_allclose(found.grid.to_world([[1, 2, 3]]), seg.grid.to_world([[1, 2, 3]]), atol=1e-4)


def test_overlapping_layers_are_merged_and_said(tmp_path: Path) -> None:
    seg, path = phantom(), tmp_path / "heart.seg.nrrd"
    mask = masks_of(seg)
    whole = mask["lv"] | mask["myo"]
    segments = [("cavity", 1, 0), ("whole heart", 1, 1)]
    write_slicer(path, [mask["lv"].astype(np.uint8), whole.astype(np.uint8)], segments)
    found = fp.read_segmentation(path, {"lv": "Cavity", "myo": "whole heart"})
    np.testing.assert_array_equal(found.mask("lv"), mask["lv"])
    np.testing.assert_array_equal(found.mask("myo"), mask["myo"])
    shared = np.count_nonzero(mask["lv"])
    assert any(f"{shared} voxels are both" in notice["what"] for notice in found.info["notices"])


def test_a_segment_that_is_not_there_is_named_with_those_that_are(tmp_path: Path) -> None:
    path = tmp_path / "heart.seg.nrrd"
    write_slicer(path, [masks_of(phantom())["lv"].astype(np.uint8)], [("Blood", 1, 0)])
    with pytest.raises(
        fp.OptionError, match=r"no segment 'Blod' in the file; did you mean 'Blood'\?; it holds 1 'Blood'"
    ):
        fp.read_segmentation(path, {"lv": "Blod"})


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("LabelValue", "two", "Segment1_LabelValue 'two', expected a whole number"),
        ("LabelValue", "1e300", "'1e300', expected"),
        ("LabelValue", "9" * 5000, "'9{40}...', expected"),
        ("Layer", "-1", "Segment1_Layer '-1', expected"),
        ("Layer", "300", "segment 'wall' is in layer 300 by its header, and the layers are 0 to [01];"),
    ],
)
@pytest.mark.parametrize("several", [False, True])
def test_labels_and_layers_that_are_no_numbers_are_refused(
    field: str, value: str, words: str, several: bool, tmp_path: Path
) -> None:
    path, mask = tmp_path / "heart.seg.nrrd", masks_of(phantom())["lv"].astype(np.uint8)
    row = {"LabelValue": "1", "Layer": "0", field: value}
    segments = [("lv", 1, 0), ("wall", row["LabelValue"], row["Layer"])]
    write_slicer(path, [mask, mask] if several else [mask], segments)
    with pytest.raises(fp.InputError, match=words):
        fp.read_segmentation(path)


def write_mask(mask: np.ndarray, seg: fp.Segmentation, path: Path) -> Path:
    fp.write_segmentation(fp.Segmentation(mask.astype(np.uint8), seg.grid, {"mask": (1,)}), path)
    return path


def test_a_mask_for_each_structure(tmp_path: Path) -> None:
    seg = phantom()
    files = {name: write_mask(mask, seg, tmp_path / f"{name}.nii.gz") for name, mask in masks_of(seg).items()}
    found = fp.read_masks(files)
    for name in files:
        np.testing.assert_array_equal(found.mask(name), seg.mask(name))


def test_masks_on_another_grid_are_refused(tmp_path: Path) -> None:
    seg = phantom()
    mask = masks_of(seg)
    first = write_mask(mask["lv"], seg, tmp_path / "lv.nii.gz")
    moved = fp.Grid(seg.grid.shape, seg.grid.spacing, np.add(seg.grid.origin, [0.0, 5.0, 0.0]), seg.grid.direction)
    other = fp.Segmentation(mask["myo"].astype(np.uint8), moved, {"mask": (1,)})
    fp.write_segmentation(other, tmp_path / "myo.nii.gz")
    with pytest.raises(fp.InputError, match=r"mask 'myo', myo\.nii\.gz, lies on another grid .* origin"):
        fp.read_masks({"lv": first, "myo": tmp_path / "myo.nii.gz"})


def test_an_empty_mask_and_one_within_another_are_refused(tmp_path: Path) -> None:
    seg = phantom()
    first = write_mask(masks_of(seg)["lv"], seg, tmp_path / "lv.nii.gz")
    empty = write_mask(np.zeros(seg.grid.shape, dtype=bool), seg, tmp_path / "myo.nii.gz")
    with pytest.raises(fp.InputError, match=r"mask 'myo', myo\.nii\.gz, is empty"):
        fp.read_masks({"lv": first, "myo": empty})
    box = np.zeros((4, 4, 4), dtype=bool)
    box[1:3] = True
    with pytest.raises(fp.InputError, match="lies within the others"):
        merged_masks({"one": box, "same": box})


def test_the_smaller_of_two_masks_has_the_voxels_of_both() -> None:
    inner, outer = np.zeros((6, 6, 6), dtype=bool), np.zeros((6, 6, 6), dtype=bool)
    inner[2:4, 2:4, 2:4], outer[1:5, 1:5, 1:5] = True, True
    for order in ({"lv": inner, "myo": outer}, {"myo": outer, "lv": inner}):
        labels, names, said = merged_masks(order)
        np.testing.assert_array_equal(labels == names["lv"][0], inner)
        np.testing.assert_array_equal(labels == names["myo"][0], outer & ~inner)
        assert said == ["8 voxels are both myo and lv: taken as lv, which is the smaller one"]


def test_a_frame_is_chosen_from_a_map_with_several(tmp_path: Path) -> None:
    seg = phantom()
    frames = [seg.labels, np.roll(seg.labels, 2, axis=0)]
    made = SimpleITK.JoinSeries([SimpleITK.GetImageFromArray(np.ascontiguousarray(own.T)) for own in frames])
    made.SetSpacing((*map(float, seg.grid.spacing), 1.0))
    path = tmp_path / "cine.nii.gz"
    SimpleITK.WriteImage(made, str(path))
    with pytest.raises(fp.InputError, match="--frame"):
        fp.read_segmentation(path, seg.structures)
    for number, own in enumerate(frames, 1):
        np.testing.assert_array_equal(fp.read_segmentation(path, seg.structures, frame=number).labels, own)
    with pytest.raises(fp.InputError, match="has no frame 3, it holds 2"):
        fp.read_segmentation(path, seg.structures, frame=3)


def write_cine(frames: list[np.ndarray], path: Path) -> Path:
    made = SimpleITK.JoinSeries([SimpleITK.GetImageFromArray(np.ascontiguousarray(own.T)) for own in frames])
    made.SetSpacing((*map(float, phantom().grid.spacing), 1.0))
    SimpleITK.WriteImage(made, str(path))
    return path


def test_all_frames_with_labels_are_read_and_the_others_told(tmp_path: Path) -> None:
    seg = phantom()
    none = np.zeros_like(seg.labels)
    frames = [none, seg.labels, none, np.roll(seg.labels, 2, axis=0)]
    found = fp.read_frames(write_cine(frames, tmp_path / "cine.nii.gz"), seg.structures)
    assert list(found) == [2, 4]
    for number, own in found.items():
        np.testing.assert_array_equal(own.labels, frames[number - 1])
        assert "2 of 4 frames hold no label and are left out: 1, 3" in [n["what"] for n in own.info["notices"]]
    with pytest.raises(fp.InputError, match="in any of its 2 frames"):
        fp.read_frames(write_cine([none, none], tmp_path / "empty.nii.gz"), seg.structures)
    single = tmp_path / "single.nii.gz"
    fp.write_segmentation(seg, single)
    assert list(fp.read_frames(single, seg.structures)) == [1]


@pytest.mark.slow
def test_the_command_takes_the_frames_of_a_file_as_phases(tmp_path: Path) -> None:
    seg = lv_ellipsoid().segmentation(spacing=(2.0, 2.0, 8.0), apex="uncapped")
    path = write_cine([seg.labels, np.zeros_like(seg.labels), seg.labels], tmp_path / "cine.nii.gz")
    small = ["--preset", "acdc", "--vertices", "300", "--edge-length", "8", "--quiet"]
    assert main(["mesh", str(path), "--sequence", "-o", str(tmp_path / "out"), *small]) == 0
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert [(phase["name"], phase["time"]) for phase in record["phases"]] == [("frame001", 1.0), ("frame003", 3.0)]
    meshes = [fp.read_mesh(tmp_path / "out" / "phases" / name / "mesh.vtu") for name in ("frame001", "frame003")]
    np.testing.assert_array_equal(meshes[0].cells["tetra"], meshes[1].cells["tetra"])
    assert np.abs(meshes[1].point_data["displacement"]).max() < 1e-6  # the frames are the same


@pytest.mark.parametrize("preset", sorted(set(PRESETS) - {"slicer"}))
def test_presets_name_cavity_and_wall(preset: str) -> None:
    numbers = [number for name, own in PRESETS[preset].items() if name not in TISSUES for number in own]
    assert {"lv", "myo"} <= set(PRESETS[preset])
    assert len(numbers) == len(set(numbers))


def test_a_base_plane_takes_the_place_of_that_of_the_labels() -> None:
    seg = phantom()
    own = fp.find_base(seg)
    given = fp.find_base(seg, base=(*(own.point - 6.0 * own.normal), *(2.0 * own.normal)), base_offset=1.0)
    np.testing.assert_allclose(given.signed_distance([own.point]), 7.0)
    np.testing.assert_allclose(given.normal, own.normal)
    assert given.source == "given"


@pytest.mark.slow
def test_the_command_meshes_masks_at_a_given_base(tmp_path: Path) -> None:
    seg = phantom()
    files = {name: write_mask(mask, seg, tmp_path / f"{name}.nii.gz") for name, mask in masks_of(seg).items()}
    own = fp.find_base(seg)
    plane = ",".join(f"{x:.6f}" for x in (*(own.point - 4.0 * own.normal), *own.normal))
    masks = [text for name, file in files.items() for text in ("--mask", f"{name}={file}")]
    out = tmp_path / "out"
    small = ["--mesher", "sweep", "--vertices", "300", "--edge-length", "6", "--quiet"]
    assert main(["mesh", *masks, "-o", str(out), f"--base={plane}", *small]) in (0, 1)
    mesh = fp.read_mesh(out / "mesh.vtu")
    base = mesh.planes["base"]
    np.testing.assert_allclose(base.signed_distance([own.point]), 4.0, atol=1e-3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "label map"),
        (["map.nii", "--mask", "lv=a.nii"], "label map"),
        (["--mask", "a.nii"], "NAME=FILE"),
        (["--mask", "lv=a.nii", "--preset", "acdc"], "name their structures themselves"),
        (["map.nii", "--base", "1,2"], "X,Y,Z,NX,NY,NZ"),
        (["map.nii", "--sequence", "--frame", "2"], "leave one of the two out"),
    ],
)
def test_what_does_not_go_together_is_told(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["mesh", *arguments, "-o", str(tmp_path / "out")]) == 2
    assert words in capsys.readouterr().err
