"""Headers of NRRD and MetaImage: most of the cases below ended the process in ITK or gave labels out of its memory."""

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
        pytest.param(
            f"\x0bName = {300 * 'a'}\n", "ElementDataFile = LOCAL\n", "a 'Name' of 300", id="text behind a tab"
        ),
        pytest.param(f"Name = {300 * 'a'}\n", "ElementDataFile = LOCAL\n", "a 'Name' of 300 characters", id="text"),
        pytest.param("", "ElementDataFile = %n%n 1 3 1\n", "voxels in '%n%n 1 3 1'", id="pattern"),
        pytest.param("", f"ElementDataFile = {40 * '%s'} 1 3 1\n", "voxels in '%s", id="texts in a pattern"),
        pytest.param("", f"ElementDataFile\0 = {400 * 'a'}\n", r"has 'ElementDataFile\\x00", id="NUL in a name"),
        pytest.param(
            "\xa0ElementDataFile = LOCAL\n",
            "ElementDataFile = %n%s 1 3 1\n",
            r"has '\\xa0ElementData",
            id="hidden",
        ),
        pytest.param(
            "Foo\nElementDataFile = LOCAL\n", "ElementDataFile = %n%s 1 3 1\n", r"has 'Foo\\nElementD", id="no mark"
        ),
        pytest.param(
            "Foo =\n\nElementDataFile = LOCAL\n", "ElementDataFile = %n%s 1 3 1\n", r"has 'Foo =\\n\\nEl", id="no value"
        ),
        pytest.param("", "", "before any ElementDataFile its header has", id="no voxels"),
        pytest.param("NDims = -1\n", "ElementDataFile = LOCAL\n", "has 'NDims' twice", id="axes twice"),
        pytest.param("Anat\x01 = RAI\n", "ElementDataFile = LOCAL\n", "Anat.x01 = RAI.n', no text", id="no text"),
        pytest.param("DimSize = 2 36 66666666,4\n", "ElementDataFile = LOCAL\n", "expected whole numbers", id="sizes"),
        pytest.param("DimSize = 4 4\n", "ElementDataFile = LOCAL\n", r"has 2 sizes, expected 3", id="too few sizes"),
        pytest.param("DimSize | = 1\n", "ElementDataFile = LOCAL\n", r"has 'DimSize \|', exp", id="almost sizes"),
        pytest.param(
            "HeaderSize = 5\n", "ElementDataFile = LOCAL\n", "has 'HeaderSize' '5'", id="voxels in the header"
        ),
    ],
)
def test_a_damaged_metaimage_is_refused(tmp_path, extra, last, words):
    header = META.replace("DimSize = 4 4 4\n", "") if extra.startswith("DimSize =") else META
    with pytest.raises(FileError, match=words):
        read(tmp_path / "labels.mha", header, extra, last)


def test_more_axes_than_itk_bears_are_refused(tmp_path):
    header = META.replace("NDims = 3", "NDims = 11").replace("4 4 4", "4 4 4" + 8 * " 1")
    with pytest.raises(FileError, match="has 11 sizes, expected NDims of at most 5 in place of 11"):
        read(tmp_path / "labels.mha", header, "", "ElementDataFile = LOCAL\n")


@pytest.mark.parametrize(
    ("extra", "last", "words"),
    [
        pytest.param(f"space: {1100 * 'a'}\n", "\n", "a 'space' of 1108 characters", id="field"),
        pytest.param(f"spacing {1100 * 'a'}\n", "\n", "of 1109 characters", id="line without a mark"),
        pytest.param("", f"data file: LIST\n# {1100 * 'a'}\nb\nc\nd\n", "of 1103 characters", id="name in a list"),
        pytest.param("", "data file: %d%s%s%n 1 4 1\n", "voxels in '%d%s%s%n 1 4 1'", id="pattern"),
        pytest.param("", "data file: %d%n 1 4 1\ndata file:=voxels.raw\n", "voxels in '%d%n 1 4 1'", id="hidden"),
        pytest.param("sizes: 2 36 66666666,4\n", "\n", "expected whole numbers", id="sizes"),
        pytest.param("byte skip: -70\n", "\n", "has 'byte skip' '-70'", id="voxels in the header"),
        pytest.param("", "data file: %999999999d 1 4 1 2\n", "voxels in '%999999999d", id="long number"),
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


def test_compressed_voxels_behind_two_marks_are_counted(tmp_path):
    extra = "CompressedData = = True\nCompressedDataSize = 64\n"
    with pytest.raises(FileError, match="incorrect header check"):
        read(tmp_path / "labels.mha", META, extra, "ElementDataFile = LOCAL\n")


def test_sizes_are_needed(tmp_path):
    with pytest.raises(FileError, match="its header has no DimSize"):
        read(tmp_path / "labels.mha", META.replace("DimSize = 4 4 4\n", ""), "", "ElementDataFile = LOCAL\n")


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
