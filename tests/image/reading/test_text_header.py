"""Headers of NRRD and MetaImage: most of the cases below ended the process in ITK, the others never get there."""

import pytest

from femprep import read_segmentation
from femprep.errors import FileError

META = "ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\n{}ElementType = MET_UCHAR\n{}"
NRRD = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n{}{}"


def read(path, header, extra="", last=""):
    data = bytes([0, 1, 2, 3] * 16)
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
        pytest.param("", "", "has no ElementDataFile", id="no voxels"),
    ],
)
def test_a_damaged_metaimage_is_refused(tmp_path, extra, last, words):
    with pytest.raises(FileError, match=words):
        read(tmp_path / "labels.mha", META, extra, last)


@pytest.mark.parametrize(
    ("extra", "last", "words"),
    [
        pytest.param(f"space: {1100 * 'a'}\n", "\n", "a 'space' of 1108 characters", id="field"),
        pytest.param(f"spacing {1100 * 'a'}\n", "\n", "of 1109 characters", id="line without a mark"),
        pytest.param("", f"data file: LIST\n# {1100 * 'a'}\nb\nc\nd\n", "of 1103 characters", id="name in a list"),
        pytest.param("", "data file: %d%s%s%n 1 4 1\n", "voxels in '%d%s%s%n 1 4 1'", id="pattern"),
        pytest.param("", "data file: %d%n 1 4 1\ndata file:=voxels.raw\n", "voxels in '%d%n 1 4 1'", id="hidden"),
        pytest.param("", "data file: %999999999d 1 4 1 2\n", "voxels in '%999999999d", id="long number"),
    ],
)
def test_a_damaged_nrrd_is_refused(tmp_path, extra, last, words):
    with pytest.raises(FileError, match=words):
        read(tmp_path / ("labels.nhdr" if "data" in last else "labels.nrrd"), NRRD, extra, last)


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
