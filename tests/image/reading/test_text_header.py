"""Headers of NRRD and MetaImage: voxels that are not all there are refused, of which ITK makes up labels."""

import zlib

import pytest

from femprep import read_segmentation
from femprep.errors import FileError

META = "ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\n{}ElementType = MET_UCHAR\n{}"
NRRD = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n{}{}"


VOXELS = bytes([0, 1, 2, 3] * 16)


def read(path, header, extra="", last="", data=VOXELS):
    path.with_name("voxels.raw").write_bytes(data)
    path.write_bytes(header.format(extra, last).encode("latin-1") + data)
    return read_segmentation(path, preset="acdc")


@pytest.mark.parametrize(
    ("extra", "last", "words"),
    [
        pytest.param("", "ElementDataFile = %n%n 1 3 1\n", "voxels in '%n%n 1 3 1'", id="pattern"),
        pytest.param("", "", "no ElementDataFile", id="no voxels"),
        pytest.param("DimSize = 2 36 66666666,4\n", "ElementDataFile = LOCAL\n", "expected whole numbers", id="sizes"),
    ],
)
def test_a_damaged_metaimage_is_refused(tmp_path, extra, last, words):
    with pytest.raises(FileError, match=words):
        read(tmp_path / "labels.mha", META, extra, last)


@pytest.mark.parametrize(
    ("extra", "last", "words"),
    [
        pytest.param("", "data file: %d%s%s%n 1 4 1\n", "voxels in '%d%s%s%n 1 4 1'", id="pattern"),
        pytest.param("sizes: 2 36 66666666,4\n", "\n", "expected whole numbers", id="sizes"),
    ],
)
def test_a_damaged_nrrd_is_refused(tmp_path, extra, last, words):
    with pytest.raises(FileError, match=words):
        read(tmp_path / ("labels.nhdr" if "data" in last else "labels.nrrd"), NRRD, extra, last)


@pytest.mark.parametrize(
    ("size", "voxels", "words"),
    [
        pytest.param(0, VOXELS, "has no CompressedDataSize, .* add 'CompressedDataSize = 15'", id="no size"),
        pytest.param(-1, VOXELS, "end too early", id="too small a size"),
        pytest.param(None, VOXELS[:-1], "63 bytes, expected 64", id="too few voxels"),
    ],
)
def test_compressed_voxels_that_are_not_all_there_are_refused(tmp_path, size, voxels, words):
    packed = zlib.compress(voxels)
    room = len(packed) + (size or 0)
    extra = "CompressedData = True\n" + (f"CompressedDataSize = {room}\n" if size != 0 else "")
    with pytest.raises(FileError, match=words):
        read(tmp_path / "labels.mha", META, extra, "ElementDataFile = LOCAL\n", packed)


def test_compressed_voxels_are_read(tmp_path):
    packed = zlib.compress(VOXELS)
    for name, size, last in (("mha", f"CompressedDataSize = {len(packed)}\n", "LOCAL"), ("mhd", "", "voxels.zraw")):
        (tmp_path / "voxels.zraw").write_bytes(packed)
        extra = f"CompressedData = True\n{size}"
        seg = read(tmp_path / f"labels.{name}", META, extra, f"ElementDataFile = {last}\n", packed)
        assert seg.labels.ravel(order="F").tolist() == list(VOXELS)


def test_what_others_write_into_headers_is_read(tmp_path):
    local = "ElementDataFile = LOCAL\n"
    tags = f"0008|0005 = {900 * 'a'}\nComment : {250 * 'a'}\n"  # keys of DICOM, colons: ITK takes both
    assert sorted(read(tmp_path / "labels.mha", META, tags, local).structures) == ["lv", "myo", "rv"]
    free = f"content: {2000 * 'a'}\n# {2000 * 'a'}\nSegment0_Tags:={100_000 * 'a'}: b\n"
    assert sorted(read(tmp_path / "labels.nrrd", NRRD, free, "\n").structures) == ["lv", "myo", "rv"]
    assert read(tmp_path / "labels.nhdr", NRRD, free, "data file: voxels.raw\n").grid.shape == (4, 4, 4)


def test_voxels_in_numbered_files_are_read(tmp_path):
    for number in range(4):
        (tmp_path / f"slice{number:02d}.raw").write_bytes(bytes([0, 1, 2, 3] * 4))
    nrrd = read(tmp_path / "labels.nhdr", NRRD, "", "data file: slice%02d.raw 0 3 1 2\n")
    meta = read(tmp_path / "labels.mhd", META, "", "ElementDataFile = slice%02d.raw 0 3 1\n")
    assert (nrrd.labels == meta.labels).all()
    assert nrrd.labels.max() == 3
