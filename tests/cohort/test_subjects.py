"""Subjects of a folder or a table: names, phases, options; what is wrong with a table is told with its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from femprep.cohort.subjects import read_subjects
from femprep.errors import FemprepError, FileError, InputError, OptionError
from femprep.options import Options

OPTIONS = Options(preset="acdc", volume={"edge_length": 5.0})


def touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()


def table(folder: Path, *lines: str) -> Path:
    path = folder / "subjects.tsv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_each_file_of_a_folder_that_matches_is_a_subject(tmp_path: Path) -> None:
    touch(tmp_path, "b/p2_gt.nii.gz", "a/p1_gt.nii.gz", "a/p1.nii.gz", "notes.txt")
    found = read_subjects(tmp_path, OPTIONS, pattern="**/*_gt.nii.gz")
    assert [subject.name for subject in found] == ["p1_gt", "p2_gt"]
    assert found[0].images == (tmp_path / "a/p1_gt.nii.gz",)
    assert found[0].options == OPTIONS


def test_files_of_one_name_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    touch(tmp_path, "b/seg.nii.gz", "a/seg.nii.gz")
    assert [subject.name for subject in read_subjects(tmp_path, OPTIONS)] == ["a_seg", "b_seg"]


def test_files_of_one_folder_are_phases_of_a_sequence(tmp_path: Path) -> None:
    touch(tmp_path, "p1/frame12_gt.nii.gz", "p1/frame01_gt.nii.gz", "p2/frame01_gt.nii.gz", "p2/frame10_gt.nii.gz")
    found = read_subjects(tmp_path, OPTIONS, kind="sequence")
    assert {subject.name: [path.name for path in subject.images] for subject in found} == {
        "p1": ["frame01_gt.nii.gz", "frame12_gt.nii.gz"],
        "p2": ["frame01_gt.nii.gz", "frame10_gt.nii.gz"],
    }


def test_columns_of_a_table_are_options_of_a_subject(tmp_path: Path) -> None:
    touch(tmp_path, "a.nii.gz", "b.nii.gz")
    source = table(
        tmp_path,
        "subject\timage\tvolume.edge_length\tflip\tstructures.lv\twall.basal_end\tfibres",
        "one\ta.nii.gz\t2.5\ttrue\t7,8\tfirst\t{}",
        "two\tb.nii.gz\tn/a\t\t\t\tn/a",
    )
    one, two = read_subjects(source, OPTIONS)
    assert one.options.volume.edge_length == 2.5
    assert one.options.flip
    assert one.options.labels["lv"] == (7, 8)
    assert one.options.wall.basal_end == "first"
    assert one.options.fibres is not None
    assert one.options.preset == "acdc"
    assert two.options == OPTIONS


def test_phases_in_a_table_are_one_sequence_or_subjects_of_their_own(tmp_path: Path) -> None:
    touch(tmp_path, "ed.nii.gz", "es.nii.gz")
    source = table(tmp_path, "subject\timage\tphase", "p\ted.nii.gz\tED", "p\tes.nii.gz\tES")
    assert [subject.name for subject in read_subjects(source, OPTIONS)] == ["p_ED", "p_ES"]
    (found,) = read_subjects(source, OPTIONS, kind="sequence")
    assert [path.name for path in found.images] == ["ed.nii.gz", "es.nii.gz"]


def test_images_to_show_are_those_of_the_line(tmp_path: Path) -> None:
    touch(tmp_path, "ed.nii.gz", "es.nii.gz", "cine/4d.nii.gz")
    source = table(
        tmp_path,
        "subject\timage\tphase\tintensity_image",
        "p\ted.nii.gz\tED\tcine/4d.nii.gz:1",
        "p\tes.nii.gz\tES\tcine/4d.nii.gz:12",
    )
    cine = tmp_path / "cine" / "4d.nii.gz"
    assert [one.shown for one in read_subjects(source, OPTIONS)] == [((cine, 1),), ((cine, 12),)]
    (found,) = read_subjects(source, OPTIONS, kind="sequence")
    assert found.shown == ((cine, 1), (cine, 12))
    source.write_text(source.read_text().replace("cine/4d.nii.gz:12", "n/a"))
    with pytest.raises(InputError, match="1 of the 2 phases of 'p' have an intensity_image"):
        read_subjects(source, OPTIONS, kind="sequence")
    source.write_text(source.read_text().replace("4d", "5d"))
    with pytest.raises(FileError, match=r"line 2: image .*5d.nii.gz' is not there"):
        read_subjects(source, OPTIONS)


@pytest.mark.parametrize(("lines", "kind", "words"), [
    (("subject\timage", "p\tnone.nii.gz"), FileError, "line 2: image .*none.nii.gz' is not there"),
    (("subject\timage\tedge_length", "p\ta.nii.gz\t2"), OptionError, "'edge_length' is no option.*volume.edge_length"),
    (("subject\timage\tvolume.edge_length", "p\ta.nii.gz\t-2"), OptionError, "line 2: option 'volume.edge_length'"),
    (("subject\timage", "p\t"), InputError, "line 2: no image"),
    (("subject\timage", "p\ta.nii.gz\tmore"), FileError, "line 2: it has not 2 cells"),
    (("subject\timage", "p\ta.nii.gz", "p\ta.nii.gz"), InputError, "tell them apart by the column phase"),
    (("subject\timage", "p\ta.nii.gz", "P\ta.nii.gz"), InputError, "two subjects are called"),
    (("subject\timage", "../p\ta.nii.gz"), InputError, "cannot name a subject"),
    (("subject\timage", "failures\ta.nii.gz"), InputError, "cannot name a subject"),
    (("subject,image", "p,a.nii.gz"), FileError, "needed are subject and image"),
    (("subject\timage",), InputError, "no line with a subject"),
    (("subject\timage\tvolume.edge_length", "p\ta.nii.gz\t" + 3000 * "["), OptionError, "line 2: .*edge_length"),
])  # fmt: skip
def test_what_is_wrong_with_a_table_is_told(
    tmp_path: Path, lines: tuple[str, ...], kind: type[FemprepError], words: str
) -> None:
    touch(tmp_path, "a.nii.gz")
    with pytest.raises(kind, match=words):
        read_subjects(table(tmp_path, *lines), OPTIONS)


def test_folder_without_a_match_and_no_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no file matches"):
        read_subjects(tmp_path, OPTIONS)
    with pytest.raises(FileError, match="is no folder"):
        read_subjects(tmp_path / "none", OPTIONS)
    (tmp_path / "image.tsv").write_bytes(b"\x1f\x8b\xff\xfe")
    with pytest.raises(FileError, match="cannot be read as a table"):
        read_subjects(tmp_path / "image.tsv", OPTIONS)
