"""Reading and writing label maps: formats, places in the world, headers that lie, files that are damaged."""

from __future__ import annotations

import gzip
import json
import logging
import struct
import subprocess
import sys
import warnings

import numpy as np
import pytest
from full_disks import small_disk, small_files
from scipy.spatial.transform import Rotation

from femprep.errors import DiskFullError, FileError, InputError, OptionError
from femprep.image import Grid, Segmentation, read_frames, read_image, read_segmentation, write_segmentation
from femprep.phantoms import lv_ellipsoid

SimpleITK = pytest.importorskip("SimpleITK")
FORMATS = ["nii", "nii.gz", "nrrd", "mha", "mhd", "nhdr"]
DIRECTION = Rotation.from_euler("xyz", [20, -30, 50], degrees=True).as_matrix()


def noise() -> Segmentation:
    """Labels that are not compressed to next to nothing."""
    labels = np.random.default_rng(0).integers(0, 4, (30, 40, 12)).astype(np.uint8)
    return Segmentation(labels, heart().grid, heart().structures)


def heart(grid: Grid | None = None) -> Segmentation:
    labels = np.zeros((30, 40, 12), dtype=np.uint8)
    labels[5:25, 10:30, 2:9] = 2
    labels[9:21, 14:26, 2:9] = 3
    labels[3, 3, 3] = 1
    grid = grid or Grid(labels.shape, (1.5, 1.25, 8.0), (10.0, -20.0, 30.0), DIRECTION)
    return Segmentation(labels, grid, {"lv": (3,), "myo": (2,), "rv": (1,)})


@pytest.fixture
def nifti(tmp_path):
    """Bytes of a plain NIfTI-1 file; offsets in them are those of the format's definition."""
    path = tmp_path / "plain.nii"
    write_segmentation(heart(), path)
    return bytearray(path.read_bytes())


def image(array: np.ndarray) -> object:
    made = SimpleITK.GetImageFromArray(array)
    made.SetSpacing((1.5, 1.25, 8.0))
    return made


@pytest.mark.parametrize("ending", FORMATS)
def test_round_trip(tmp_path, ending):
    seg, path = heart(), tmp_path / f"heart.{ending}"
    write_segmentation(seg, path)
    back = read_segmentation(path, preset="acdc")
    np.testing.assert_array_equal(back.labels, seg.labels)
    assert back.labels.dtype == np.uint8
    np.testing.assert_allclose(back.grid.spacing, seg.grid.spacing, rtol=1e-6)
    np.testing.assert_allclose(back.grid.origin, seg.grid.origin, rtol=1e-6)
    np.testing.assert_allclose(back.grid.direction, seg.grid.direction, atol=1e-6)
    assert back.structures == {"rv": (1,), "myo": (2,), "lv": (3,)}
    json.dumps(dict(back.info))


@pytest.mark.parametrize("ending", FORMATS)
def test_voxels_lie_where_itk_puts_them(tmp_path, ending):
    path = tmp_path / f"heart.{ending}"
    write_segmentation(heart(), path)
    grid = read_segmentation(path, preset="acdc").grid
    truth = SimpleITK.ReadImage(str(path))
    for index in ((0, 0, 0), (29, 0, 0), (0, 39, 0), (0, 0, 11), (7, 8, 9)):
        np.testing.assert_allclose(
            grid.to_world([index])[0], truth.TransformIndexToPhysicalPoint(index), rtol=0, atol=1e-10
        )


def test_nrrd_in_another_space_is_brought_to_lps(tmp_path):
    path = tmp_path / "ras.nrrd"
    header = (
        "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: right-anterior-superior\nsizes: 4 5 3\n"
        "space directions: (1.5,0,0) (0,1.25,0) (0,0,8)\nencoding: raw\nspace origin: (1,2,3)\n\n"
    )
    path.write_bytes(header.encode() + bytes([3] * 60))
    grid = read_segmentation(path, {"lv": 3}).grid
    np.testing.assert_allclose(grid.to_world([[1, 1, 1]]), [[-2.5, -3.25, 11.0]])


@pytest.mark.parametrize("dtype", [np.int16, np.int32, np.uint16, np.float32, np.float64])
def test_whole_numbers_of_any_type_are_labels(tmp_path, dtype):
    path = tmp_path / "typed.nii.gz"
    SimpleITK.WriteImage(image(heart().labels.T.astype(dtype)), str(path))
    back = read_segmentation(path, preset="acdc")
    np.testing.assert_array_equal(back.labels, heart().labels)
    assert back.labels.dtype == np.uint8


# --- voxel sizes -------------------------------------------------------------------------------------------------


def test_affine_without_spacing_is_recognised(tmp_path, nifti, caplog):
    """As in ACDC: qform 0, sform diag(-1, -1, 1), sizes in pixdim only."""
    struct.pack_into("<2h", nifti, 252, 0, 2)
    struct.pack_into("<12f", nifti, 280, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0)
    path = tmp_path / "acdc.nii"
    path.write_bytes(nifti)
    with caplog.at_level(logging.WARNING):
        seg = read_segmentation(path, preset="acdc")
    np.testing.assert_allclose(seg.grid.spacing, (1.5, 1.25, 8.0))
    np.testing.assert_array_equal(seg.grid.direction, np.eye(3))
    assert seg.info["spacing_source"] == "pixdim"
    assert [notice["what"] for notice in seg.info["notices"]] == [
        "the affine carries no voxel sizes (sform says 1 x 1 x 1 mm, pixdim 1.5 x 1.25 x 8 mm); "
        "those of pixdim were taken"
    ]
    assert not caplog.records


def test_sizes_in_the_affine_only_are_taken_from_there(tmp_path, nifti, caplog):
    for pixdim in (1.0, 0.0):
        struct.pack_into("<3f", nifti, 80, pixdim, pixdim, pixdim)
        path = tmp_path / "sform.nii"
        path.write_bytes(nifti)
        seg = read_segmentation(path, preset="acdc")
        np.testing.assert_allclose(seg.grid.spacing, (1.5, 1.25, 8.0), rtol=1e-6)
        np.testing.assert_allclose(seg.grid.direction, DIRECTION, atol=1e-6)
        assert seg.info["spacing_source"] == "sform"
    assert "pixdim carries no voxel sizes" in caplog.text


def test_sizes_that_contradict_each_other_are_doubted(tmp_path, nifti, caplog):
    struct.pack_into("<3f", nifti, 80, 2.0, 2.0, 5.0)
    path = tmp_path / "both.nii"
    path.write_bytes(nifti)
    seg = read_segmentation(path, preset="acdc")
    np.testing.assert_allclose(seg.grid.spacing, (2.0, 2.0, 5.0))
    assert "contradicts itself (sform says 1.5 x 1.25 x 8 mm, pixdim 2 x 2 x 5 mm)" in caplog.text


def test_absent_sizes_are_warned_about_and_can_be_given(tmp_path, caplog):
    path = tmp_path / "one.nii.gz"
    write_segmentation(heart(Grid((30, 40, 12), (1, 1, 1), (0, 0, 0), np.eye(3))), path)
    seg = read_segmentation(path, preset="acdc")
    assert "1 x 1 x 1 mm for 30 x 40 x 12 voxels: they look absent" in caplog.text
    assert len(seg.info["notices"]) == 1
    given = read_segmentation(path, preset="acdc", spacing=(1.4, 1.4, 8.0))
    np.testing.assert_array_equal(given.grid.spacing, (1.4, 1.4, 8.0))
    assert given.info["spacing_source"] == "given"
    assert "replaced by 1.4 x 1.4 x 8 mm as given" in given.info["notices"][0]["what"]


def test_missing_affine_is_said(tmp_path, nifti):
    struct.pack_into("<2h", nifti, 252, 0, 0)
    path = tmp_path / "none.nii"
    path.write_bytes(nifti)
    assert "no affine" in read_segmentation(path, preset="acdc").info["notices"][0]["what"]


def sheared(nifti: bytearray, *, qform: bool) -> None:
    """Give a file an sform whose axes are not at right angles."""
    struct.pack_into("<h", nifti, 252, int(qform))
    struct.pack_into("<12f", nifti, 280, 1.5, 0.5, 0, 0, 0, 1.25, 0, 0, 0, 0, 8, 0)


@pytest.mark.parametrize("read", [read_segmentation, read_frames, read_image])
def test_sheared_affine_is_refused(tmp_path, nifti, read):
    sheared(nifti, qform=False)
    path = tmp_path / "sheared.nii"
    path.write_bytes(nifti)
    with pytest.raises(InputError, match="not at right angles"):
        read(path, **({} if read is read_image else {"preset": "acdc"}))


def test_a_sheared_sform_beside_a_qform_is_reported(tmp_path, nifti):
    sheared(nifti, qform=True)
    path = tmp_path / "both.nii"
    path.write_bytes(nifti)
    assert any("qform was taken" in one["what"] for one in read_segmentation(path, preset="acdc").info["notices"])


@pytest.mark.parametrize("axes", [(0.0,) * 9, (2.0, 2.0, 0.0, 2.0, 2.0, 0.0, 0.0, 0.0, 8.0)])
@pytest.mark.parametrize("ending", ["nii", "nhdr"])
def test_axes_that_span_no_volume_are_refused(tmp_path, nifti, axes, ending):
    struct.pack_into("<h", nifti, 252, 0)
    for row in range(3):
        struct.pack_into("<3f", nifti, 280 + 16 * row, *axes[3 * row : 3 * row + 3])
    path = tmp_path / f"flat.{ending}"
    path.write_bytes(nifti)
    if ending == "nhdr":
        (tmp_path / "flat.raw").write_bytes(bytes(nifti[352:]))
        steps = " ".join(f"({axes[n]},{axes[n + 3]},{axes[n + 6]})" for n in range(3))
        path.write_text(
            "NRRD0004\ntype: uchar\ndimension: 3\nspace: LPS\nsizes: 30 40 12\n"
            f"space directions: {steps if any(axes) else '(1,0,0) (1,0,0) (0,0,1)'}\n"
            "kinds: domain domain domain\nencoding: raw\ndata file: flat.raw\n"
        )
    with pytest.raises(FileError, match="span no volume"):
        read_segmentation(path, preset="acdc")


@pytest.mark.parametrize("place", [256, 268, 280, 320])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_an_affine_that_is_not_finite_is_refused(tmp_path, nifti, place, value):
    """ITK loops for ever on an infinite one."""
    struct.pack_into("<2h", nifti, 252, 1, 1)
    struct.pack_into("<f", nifti, place, value)
    path = tmp_path / "infinite.nii"
    path.write_bytes(nifti)
    with pytest.raises(FileError, match="its affine holds numbers that are not finite; mend the header"):
        read_segmentation(path, preset="acdc")


# --- what is no label map ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.full((12, 40, 30), 0.7), "14400 voxels are no integers .* 0.7"),
        (np.full((12, 40, 30), -1, dtype=np.int16), "negative labels .* -1"),
        (np.full((12, 40, 30), 1e12), "label 1e.12, which is too large"),
        (np.zeros((12, 40, 30), dtype=np.uint8), "holds no label"),
        (np.ones((40, 30), dtype=np.uint8), r"2-D image \(30 x 40\)"),
        (np.ones((1, 40, 30), dtype=np.uint8), r"2-D image \(30 x 40 x 1\)"),
    ],
)
def test_no_label_map(tmp_path, array, message):
    path = tmp_path / "bad.nii.gz"
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(array), str(path))
    with pytest.raises(InputError, match=message) as caught:
        read_segmentation(path, preset="acdc")
    assert "\n" not in str(caught.value)


def test_nan_voxels_are_refused(tmp_path):
    array = heart().labels.T.astype(np.float32)
    array[5, 5, 5] = np.nan
    path = tmp_path / "nan.nrrd"
    SimpleITK.WriteImage(image(array), str(path))
    with pytest.raises(InputError, match=r"1 voxel is no integer .*nan"):
        read_segmentation(path, preset="acdc")
    array.view(np.uint32)[5, 5, 5] = 0x7F800001  # NaN of the kind that signals: numpy warns of it
    SimpleITK.WriteImage(image(array), str(path))
    with warnings.catch_warnings(), pytest.raises(InputError, match=r"1 voxel is no integer .*nan"):
        warnings.simplefilter("error")
        read_segmentation(path, preset="acdc")


@pytest.mark.parametrize("ending", ["nii", "nii.gz"])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_voxels_of_nifti_that_are_no_numbers_are_refused(tmp_path, ending, kind):
    sound = heart().labels.T.astype(kind)
    spoiled = sound.copy()
    spoiled[5, 5, 5], spoiled[0, 0, 0], spoiled[-1, -1, -1] = np.nan, np.inf, -np.inf
    path = tmp_path / f"nan.{ending}"
    SimpleITK.WriteImage(SimpleITK.JoinSeries([image(sound), image(spoiled)]), str(path))
    with pytest.raises(InputError, match=r"nan\.nii.*: 3 voxels are no numbers"):
        read_segmentation(path, preset="acdc", frame=2)
    np.testing.assert_array_equal(read_segmentation(path, preset="acdc", frame=1).labels, heart().labels)


@pytest.mark.parametrize("short", [0, 3])
def test_floats_of_more_bytes_than_the_header_says_are_refused(tmp_path, nifti, short):
    """Doubles, said to have 32 bits: the file is as long as that makes it, or a little longer."""
    struct.pack_into("<2h", nifti, 70, 64, 32)
    path = tmp_path / "double.nii"
    path.write_bytes(bytes(nifti[:352]) + bytes(4 * heart().labels.size + short))
    with pytest.raises(FileError, match=r"double\.nii: "):
        read_segmentation(path, preset="acdc")


def test_voxels_that_are_no_numbers_are_found_in_the_other_byte_order(tmp_path, nifti):
    path, end = tmp_path / "big.nii", len(nifti) - 352
    for kind, places in (("h", [*range(40, 56, 2), 70, 72, 252, 254]), ("i", [0]), ("f", [*range(76, 124, 4)])):
        for place in places:
            struct.pack_into(f">{kind}", nifti, place, struct.unpack_from(f"<{kind}", nifti, place)[0])
    nifti[256:328] = np.frombuffer(bytes(nifti[256:328]), "<f4").astype(">f4").tobytes()
    struct.pack_into(">2h", nifti, 70, 16, 32)
    voxels = heart().labels.T.astype(">f4")
    assert voxels.size == end
    path.write_bytes(bytes(nifti[:352]) + voxels.tobytes())
    np.testing.assert_array_equal(read_segmentation(path, preset="acdc").labels, heart().labels)
    voxels[3, 2, 1] = np.nan
    path.write_bytes(bytes(nifti[:352]) + voxels.tobytes())
    with pytest.raises(InputError, match="1 voxel is no number"):
        read_segmentation(path, preset="acdc")


@pytest.mark.parametrize("ending", ["nii.gz", "nrrd"])
def test_several_frames_are_refused_and_a_single_one_is_taken(tmp_path, ending):
    path = tmp_path / f"frames.{ending}"
    one = image(heart().labels.T.copy())
    SimpleITK.WriteImage(SimpleITK.JoinSeries([one, one * 0, one]), str(path))
    with pytest.raises(
        InputError, match=r"4-D image \(30 x 40 x 12 x 3\).*3 frames, .* 1, 3: .*--sequence(?!.*--mask)"
    ):
        read_segmentation(path, preset="acdc")
    masks = [image((label == heart().labels.T).astype(np.uint8)) for label in (0, 2, 3)]
    SimpleITK.WriteImage(SimpleITK.JoinSeries(masks), str(path))
    with pytest.raises(InputError, match=r"4-D image .*0 and 1 alone.*--mask lv=FILE"):
        read_segmentation(path, preset="acdc")
    classes = [image(np.where(label == heart().labels.T, 0.94, 0.02).astype(np.float32)) for label in range(4)]
    for several in (SimpleITK.JoinSeries(classes), SimpleITK.Compose(classes)):
        SimpleITK.WriteImage(several, str(path))
        with pytest.raises(InputError, match="argmax"):
            read_segmentation(path, preset="acdc")
    SimpleITK.WriteImage(SimpleITK.JoinSeries([one]), str(path))
    np.testing.assert_array_equal(read_segmentation(path, preset="acdc").labels, heart().labels)


def test_vectors_and_complex_numbers_are_refused(tmp_path):
    path = tmp_path / "vector.nii.gz"
    one = image(heart().labels.T.copy())
    SimpleITK.WriteImage(SimpleITK.Compose(one, one, one), str(path))
    with pytest.raises(InputError, match="3 values per voxel"):
        read_segmentation(path, preset="acdc")
    SimpleITK.WriteImage(image(heart().labels.T.astype(np.complex64)), str(path))
    with pytest.raises(InputError, match="2 values per voxel"):
        read_segmentation(path, preset="acdc")


# --- files ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("compress", [True, False])
@pytest.mark.parametrize("ending", ["nii", "nii.gz", "nrrd", "mha"])
@pytest.mark.parametrize("keep", [0.02, 0.5, 0.95])
def test_file_cut_short(tmp_path, ending, compress, keep):
    path = tmp_path / f"cut.{ending}"
    SimpleITK.WriteImage(image(heart().labels.T.copy()), str(path), compress)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(keep * len(whole))])
    with pytest.raises(FileError) as caught:
        read_segmentation(path, preset="acdc")
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("ending", ["nii.gz", "nrrd", "mha"])
def test_one_flipped_bit_in_compressed_voxels(tmp_path, ending):
    path = tmp_path / f"flipped.{ending}"
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 4, (12, 40, 30)).astype(np.uint8)
    SimpleITK.WriteImage(image(noise), str(path), True)
    data = bytearray(path.read_bytes())
    data[-400] ^= 16
    path.write_bytes(data)
    with pytest.raises(FileError, match=r"damaged|cut short"):
        read_segmentation(path, preset="acdc")


@pytest.mark.parametrize("ending", ["mhd", "nhdr"])
def test_detached_voxels_that_are_missing(tmp_path, ending):
    path = tmp_path / f"detached.{ending}"
    write_segmentation(heart(), path)
    for other in tmp_path.iterdir():
        if other != path:
            other.unlink()
    with pytest.raises(FileError, match="which does not exist; keep the two files together"):
        read_segmentation(path, preset="acdc")


def test_files_that_are_no_images(tmp_path):
    for name, content, message in (
        ("none.nii", None, "no such file"),
        ("empty.nii", b"", "file is empty"),
        ("junk.nii.gz", b"hello" * 100, "not a NIfTI file"),
        ("junk.nrrd", b"hello" * 100, "not readable"),
        ("junk.mha", b"hello" * 100, "has no ElementDataFile"),
        ("image.txt", b"hello", "unknown image format; expected .mha"),
    ):
        path = tmp_path / name
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(FileError, match=message) as caught:
            read_segmentation(path, preset="acdc")
        assert "\n" not in str(caught.value)
    with pytest.raises(FileError, match="is a folder"):
        read_segmentation(tmp_path, preset="acdc")


def test_uncompressed_file_named_gz_is_read(tmp_path, nifti):
    path = tmp_path / "plain.nii.gz"
    path.write_bytes(nifti)
    assert read_segmentation(path, preset="acdc").present == (1, 2, 3)


def test_big_endian_header_is_understood(tmp_path, nifti):
    big = bytearray(nifti)
    for kind, first, count in (("i", 0, 1), ("h", 40, 8), ("h", 68, 4), ("f", 76, 8), ("f", 108, 3), ("h", 252, 2)):
        values = struct.unpack_from(f"<{count}{kind}", nifti, first)
        struct.pack_into(f">{count}{kind}", big, first, *values)
    struct.pack_into(">18f", big, 256, *struct.unpack_from("<18f", nifti, 256))
    path = tmp_path / "big.nii"
    path.write_bytes(big)
    np.testing.assert_array_equal(read_segmentation(path, preset="acdc").labels, heart().labels)
    path.write_bytes(big[:-1000])
    with pytest.raises(FileError, match="cut short"):
        read_segmentation(path, preset="acdc")


@pytest.mark.slow
def test_nothing_is_written_to_standard_error(tmp_path, nifti):
    """ITK and MetaIO complain from native code; the user gets femprep's line alone."""
    struct.pack_into("<2h", nifti, 252, 0, 2)
    struct.pack_into("<12f", nifti, 280, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0)
    (tmp_path / "acdc.nii").write_bytes(nifti)
    (tmp_path / "junk.mha").write_bytes(b"hello")
    script = (
        "import sys, femprep\n"
        "femprep.read_segmentation(sys.argv[1] + '/acdc.nii', preset='acdc')\n"
        "try:\n    femprep.read_segmentation(sys.argv[1] + '/junk.mha', preset='acdc')\n"
        "except OSError: pass\n"
        "print('said by us', file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, str(tmp_path)], capture_output=True, text=True, check=True)
    assert done.stderr == "said by us\n"


def test_poses_that_disagree_are_reported(tmp_path, nifti):
    def said(**fields: tuple[str, int, tuple[float, ...]]) -> list[str]:
        content = bytearray(nifti)
        for kind, place, values in fields.values():
            struct.pack_into(kind, content, place, *values)
        path = tmp_path / "changed.nii"
        path.write_bytes(content)
        notices = read_segmentation(path, preset="acdc").info["notices"]
        return [notice["what"] for notice in notices if "qform" in notice["what"]]

    assert said() == []
    sign = struct.unpack_from("<f", nifti, 76)[0]
    (line,) = said(pixdim=("<f", 76, (-1.0 if sign >= 0 else 1.0,)))
    assert "mirrored, turned by 0.0 degrees" in line
    assert "the sform was taken" in line
    quaternion = np.array(struct.unpack_from("<3f", nifti, 256))
    now = Rotation.from_quat([*quaternion, np.sqrt(1.0 - quaternion @ quaternion)])
    turned = (now * Rotation.from_euler("z", 30, degrees=True)).as_quat()
    (line,) = said(quaternion=("<3f", 256, tuple(turned[:3] * np.sign(turned[3]))))
    assert "turned by 30.0 degrees" in line
    offset = struct.unpack_from("<3f", nifti, 268)
    (line,) = said(offset=("<3f", 268, (offset[0] + 12.0, *offset[1:])))
    assert "turned by 0.0 degrees, 12.0 mm apart" in line
    assert said(offset=("<3f", 268, (offset[0] + 0.1, *offset[1:]))) == []
    assert said(offset=("<3f", 268, (0.0, 0.0, 0.0)), codes=("<2h", 252, (0, 2))) == []


def test_labels_that_went_through_floats_are_rounded(tmp_path):
    path = tmp_path / "heart.nii.gz"
    labels = heart().labels.T
    SimpleITK.WriteImage(image(labels * np.float32(0.9999)), str(path))
    seg = read_segmentation(path, preset="acdc")
    assert np.array_equal(seg.labels.T, labels)
    assert any("rounded" in notice["what"] for notice in seg.info["notices"])
    SimpleITK.WriteImage(image(labels * np.float32(0.97)), str(path))
    with pytest.raises(InputError, match="no integers"):
        read_segmentation(path, preset="acdc")


# --- structures ----------------------------------------------------------------------------------------------------


def test_structures_by_hand_replace_those_of_the_preset(tmp_path):
    path = tmp_path / "heart.nii.gz"
    write_segmentation(heart(), path)
    seg = read_segmentation(path, {"lv": (3, 1), "scar": 5}, preset="acdc")
    assert seg.structures == {"rv": (1,), "myo": (2,), "lv": (3, 1), "scar": (5,)}
    assert seg.info["absent"] == {"scar": [5]}
    assert np.count_nonzero(seg.mask("lv")) == 12 * 12 * 7 + 1
    with pytest.raises(InputError, match=r"label 5 of structure 'scar' does not occur in .*heart.nii.gz"):
        seg.object("scar")


def test_presets_with_scar_count_it_as_wall_and_do_without_it(tmp_path):
    path = tmp_path / "heart.nii.gz"
    labels = np.where(heart().labels == 3, 1, heart().labels)
    for scarred in (False, True):
        labels[5:9, 10:14, 4] = 3 if scarred else 2
        write_segmentation(Segmentation(labels, heart().grid, {"lv": (1,)}), path)
        seg = read_segmentation(path, preset="emidec")
        assert seg.structures["myo"] == ((2, 3) if scarred else (2,))
        by_hand = read_segmentation(path, {"lv": 1, "myo": 2, "scar": 3})
        assert by_hand.structures["myo"] == seg.structures["myo"]
        assert np.array_equal(by_hand.mask("myo"), seg.mask("myo"))
    assert any("no label 4 of myo" in notice["what"] for notice in seg.info["notices"])


def test_what_is_not_there_is_answered_with_what_is(tmp_path):
    path = tmp_path / "heart.nii.gz"
    write_segmentation(heart(), path)
    with pytest.raises(InputError, match=r"labels there: 1, 2, 3, of .* mL; did you mean --preset acdc or "):
        read_segmentation(path, preset="mmwhs").object("lv")
    with pytest.raises(InputError, match=r"structure 'la' is not defined .* labels there: 1, 2, 3"):
        read_segmentation(path, preset="acdc").object("la")
    with pytest.raises(FileError, match=r"no such file; did you mean 'heart.nii.gz'"):
        read_segmentation(tmp_path / "hart.nii.gz", preset="acdc")


def test_structures_that_cannot_be(tmp_path):
    path = tmp_path / "heart.nii.gz"
    write_segmentation(heart(), path)
    with pytest.raises(OptionError, match="unknown preset 'acd'; expected one of acdc"):
        read_segmentation(path, preset="acd")
    with pytest.raises(OptionError, match=r"no structures: give a preset .*; labels there: 1.*, of .* mL"):
        read_segmentation(path)
    with pytest.raises(OptionError, match=r"preset 'slicer' takes segments by their names.*heart.nii.gz has none"):
        read_segmentation(path, preset="slicer")
    with pytest.raises(InputError, match="0 is background"):
        read_segmentation(path, {"lv": 0})
    with pytest.raises(OptionError, match="spacing"):
        read_segmentation(path, {"lv": 3}, spacing=(1.0, -1.0, 8.0))
    with pytest.raises(OptionError, match="unknown option 'spacings'"):
        read_segmentation(path, {"lv": 3}, spacings=(1.0, 1.0, 8.0))


def test_writing_where_it_cannot_be(tmp_path):
    with pytest.raises(FileError, match="unknown image format"):
        write_segmentation(heart(), tmp_path / "heart.stl")
    with pytest.raises(FileError, match="cannot be written"):
        write_segmentation(heart(), tmp_path / "nowhere" / "heart.nii.gz")


@pytest.mark.parametrize("name", ["heart.nii", "heart.nii.gz", "heart.nrrd", "heart.mha", "heart.mhd"])
def test_writing_what_finds_no_room(tmp_path, name):
    path = tmp_path / name
    path.write_text("earlier")
    with small_files(100), pytest.raises(FileError, match="cannot be written"):
        write_segmentation(heart(), path)
    assert path.read_text() == "earlier"
    assert [entry.name for entry in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["heart.nii", "heart.nii.gz", "heart.mha"])
def test_writing_on_a_full_disk(tmp_path, name):
    with small_disk(tmp_path / "disk", "8k") as disk:
        (disk / "full").write_bytes(bytes(4096))
        with pytest.raises(DiskFullError, match="no room is left"):
            write_segmentation(noise(), disk / name)
        assert [entry.name for entry in disk.iterdir()] == ["full"]


def test_large_labels_keep_their_numbers(tmp_path):
    labels = np.zeros((6, 6, 6), dtype=np.int64)
    labels[2:4, 2:4, 2:4] = 70000
    seg = Segmentation(labels, Grid((6, 6, 6), (1, 1, 2), (0, 0, 0), np.eye(3)), {"lv": (70000,)})
    write_segmentation(seg, tmp_path / "large.nrrd")
    assert read_segmentation(tmp_path / "large.nrrd", {"lv": 70000}).object("lv").voxels == 8


def test_gzip_level_does_not_matter(tmp_path, nifti):
    path = tmp_path / "heart.nii.gz"
    path.write_bytes(gzip.compress(bytes(nifti), 1))
    assert read_segmentation(path, preset="acdc").present == (1, 2, 3)


@pytest.mark.parametrize("key", [b"Com\xffent", b"sform_code", b"xyzt_units"])
def test_fields_of_a_header_that_are_no_text_or_not_of_its_format(tmp_path, key: bytes) -> None:
    seg = lv_ellipsoid().segmentation((3.0, 3.0, 10.0))
    path = tmp_path / "heart.mha"
    write_segmentation(seg, path)
    head, mark, rest = path.read_bytes().partition(b"ElementDataFile")
    path.write_bytes(head + key + b" = no number\n" + mark + rest)
    found = read_segmentation(path, structures=dict(seg.structures))
    assert np.array_equal(found.labels, seg.labels)
    assert found.info["spacing_source"] == "header"


def test_voxels_that_would_begin_before_the_file_are_refused(tmp_path, nifti):
    """Their sum with the voxels' bytes was less than any file has: 348 bytes gave 368 million voxels."""
    path = tmp_path / "labels.nii"
    struct.pack_into("<f", nifti, 108, -2.0e24)
    path.write_bytes(nifti[:348])
    with pytest.raises(FileError, match="header is damaged"):
        read_segmentation(path, preset="acdc")


def test_a_name_of_voxels_that_no_file_can_have_is_refused(tmp_path):
    path = tmp_path / "labels.mhd"
    fields = ("ObjectType = Image", "NDims = 3", "DimSize = 2 2 2", "ElementType = MET_UCHAR", "ElementDataFile = ")
    path.write_text("\n".join(fields) + 300 * "a" + "\n")
    with pytest.raises(FileError, match="File name too long"):
        read_segmentation(path, preset="acdc")
