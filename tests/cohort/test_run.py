"""A cohort of phantoms: what stands in its tables, and what counts as done when it is run again."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import cohorts
import jsonschema
import pytest
from cohorts import Quiet
from greys import cine, write_image

import femprep as fp
from femprep.cli.schema import schema_folder

pytestmark = pytest.mark.slow


@pytest.fixture
def copy(undisturbed: Quiet, tmp_path: Path) -> Path:
    return shutil.copytree(undisturbed.out, tmp_path / "out")


def test_every_subject_has_a_row_with_its_reason_and_figures(undisturbed: Quiet) -> None:
    assert undisturbed.status == 1, undisturbed.said
    assert undisturbed.said == ""
    rows = cohorts.rows(undisturbed.out)
    assert [rows[name]["reason"] for name in rows] == ["done", "done", "done", "image-unreadable"]
    assert [rows[name]["exit_status"] for name in rows] == [0, 0, 0, 2]
    cavities = [rows[f"heart{number}"]["cavity_ml"] for number in range(3)]
    assert cavities == sorted(cavities)
    for number in range(3):
        row = rows[f"heart{number}"]
        assert row["mass_g"] == pytest.approx(1.05 * row["wall_ml"])
        assert abs(row["cavity_ml"] / row["label_cavity_ml"] - 1.0) < 0.1
        assert 0.0 < row["mean_ratio_min"] < row["mean_ratio_mean"] <= 1.0
    assert cohorts.left_behind(undisturbed.out) == []


def test_records_are_of_the_schema_and_the_table_has_the_same_rows(undisturbed: Quiet) -> None:
    record = json.loads((undisturbed.out / "cohort.json").read_text())
    jsonschema.validate(record, json.loads((schema_folder() / "cohort.json").read_text()))
    assert record["asked"] == 4
    assert record["counts"] == {"meshed": 3, "refused": 1}
    with (undisturbed.out / "cohort.tsv").open(newline="") as file:
        table = list(csv.DictReader(file, delimiter="\t"))
    assert [row["subject"] for row in table] == [row["subject"] for row in record["subjects"]]
    assert table[0]["cavity_ml"] == f"{record['subjects'][0]['cavity_ml']:.6g}"
    assert table[0]["thickness_aha_17_mm"] == "n/a"  # no fibres, no segments


def test_seconds_are_those_of_the_stages_and_memory_is_told(undisturbed: Quiet) -> None:
    with (undisturbed.out / "timings.tsv").open(newline="") as file:
        timings = {row["subject"]: row for row in csv.DictReader(file, delimiter="\t")}
    for number in range(3):
        row = timings[f"heart{number}"]
        assert float(row["stages_seconds"]) <= float(row["seconds"])
        stages = json.loads((undisturbed.out / f"heart{number}" / "run.json").read_text())["stages"]
        assert [stages[0]["name"], stages[-1]["name"]] == ["read", "write"]
        assert 50.0 < float(row["peak_memory_mb"]) < 5000.0
        assert row["attempts"] == "1"


def test_run_again_makes_nothing_anew_and_tells_the_same(undisturbed: Quiet, copy: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in copy.glob("heart*/**/*")}
    done = cohorts.run(undisturbed.source, copy)
    assert done.returncode == 1, done.stderr
    assert {path: path.stat().st_mtime_ns for path in copy.glob("heart*/**/*")} == before
    assert cohorts.comparable(copy) == cohorts.comparable(undisturbed.out)


def test_other_input_options_and_lost_files_are_made_anew(undisturbed: Quiet, copy: Path, tmp_path: Path) -> None:
    source = shutil.copytree(undisturbed.source, tmp_path / "in")
    shutil.copy(source / "heart2.nii.gz", source / "heart0.nii.gz")
    (copy / "heart1" / "mesh.vtu").unlink()
    kept = (copy / "heart2" / "run.json").stat().st_mtime_ns
    assert cohorts.run(source, copy).returncode == 1
    rows = cohorts.rows(copy)
    assert rows["heart0"]["sha256"] == rows["heart2"]["sha256"]
    assert rows["heart0"]["cavity_ml"] == rows["heart2"]["cavity_ml"]
    assert (copy / "heart1" / "mesh.vtu").read_bytes() == (undisturbed.out / "heart1" / "mesh.vtu").read_bytes()
    assert (copy / "heart2" / "run.json").stat().st_mtime_ns == kept
    assert cohorts.run(source, copy, "--layers", "2").returncode == 1
    assert (copy / "heart2" / "run.json").stat().st_mtime_ns != kept


def test_fresh_makes_all_anew(undisturbed: Quiet, copy: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in copy.glob("heart*/run.json")}
    assert cohorts.run(undisturbed.source, copy, "--fresh").returncode == 1
    assert all(path.stat().st_mtime_ns != time for path, time in before.items())
    assert cohorts.comparable(copy) == cohorts.comparable(undisturbed.out)


def test_phases_of_a_patient_are_one_sequence_with_an_ejection_fraction(undisturbed: Quiet, tmp_path: Path) -> None:
    source = tmp_path / "in" / "patient"
    source.mkdir(parents=True)
    for name, phase in (("heart2", "frame01"), ("heart0", "frame10")):
        shutil.copy(undisturbed.source / f"{name}.nii.gz", source / f"{phase}.nii.gz")
    done = cohorts.run(source.parent, tmp_path / "out", "--sequence")
    assert done.returncode in (0, 1), done.stderr
    row = cohorts.rows(tmp_path / "out")["patient"]
    assert row["kind"] == "sequence"
    assert 5.0 < row["ejection_fraction_percent"] < 60.0
    written = (tmp_path / "out" / "patient" / "run.json").stat().st_mtime_ns
    assert cohorts.run(source.parent, tmp_path / "out", "--sequence").returncode == done.returncode
    assert (tmp_path / "out" / "patient" / "run.json").stat().st_mtime_ns == written


def test_images_of_a_table_stand_on_the_pages_and_other_ones_are_made_anew(undisturbed: Quiet, tmp_path: Path) -> None:
    lines = ["subject\timage\tphase\tintensity_image"]
    for name, phase in (("heart2", "ED"), ("heart0", "ES")):
        shutil.copy(undisturbed.source / f"{name}.nii.gz", tmp_path)
        image = cine(fp.read_segmentation(tmp_path / f"{name}.nii.gz", preset="acdc"))
        write_image(image, tmp_path / f"{name}-cine.nii.gz")
        lines.append(f"p\t{name}.nii.gz\t{phase}\t{name}-cine.nii.gz")
    (tmp_path / "subjects.tsv").write_text("\n".join(lines) + "\n")
    out = tmp_path / "out"
    done = cohorts.run(tmp_path / "subjects.tsv", out, "--sequence", workers=1)
    assert done.returncode in (0, 1), done.stderr
    record = json.loads((out / "p" / "run.json").read_text())
    assert [phase["image"]["path"] for phase in record["phases"]] == ["heart2-cine.nii.gz", "heart0-cine.nii.gz"]
    assert (out / "p" / "report.html").read_text().count('class="lit"') > 10
    # The thumbnail on the cohort's page has the image, and leads to the page of the sequence.
    page = (out / "cohort.html").read_text()
    assert page.count('class="lit"') == 1
    assert 'href="p/report.html"' in page
    written = (out / "p" / "run.json").stat().st_mtime_ns
    cohorts.run(tmp_path / "subjects.tsv", out, "--sequence", workers=1)
    assert (out / "p" / "run.json").stat().st_mtime_ns == written
    shutil.copy(tmp_path / "heart2-cine.nii.gz", tmp_path / "heart0-cine.nii.gz")
    cohorts.run(tmp_path / "subjects.tsv", out, "--sequence", workers=1)
    assert (out / "p" / "run.json").stat().st_mtime_ns != written


def test_surfaces_alone(undisturbed: Quiet, tmp_path: Path) -> None:
    # Every structure that is named has its surface: a preset's right ventricle, which phantoms have not, is refused.
    options = ("--structure", "lv=3", "--structure", "myo=2", "--vertices", "300")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    env = {**cohorts.environment(), "TMPDIR": str(scratch)}
    done = cohorts.run(undisturbed.source, tmp_path / "out", "--surfaces", options=options, env=env)
    assert done.returncode == 1, done.stderr
    assert list(scratch.iterdir()) == []
    row = cohorts.rows(tmp_path / "out")["heart0"]
    assert (row["kind"], row["status"]) == ("surfaces", "meshed")
    assert row["surface_quality_min"] > 0.3
    assert row["elements"] is None


@pytest.mark.parametrize(("more", "words"), [
    (("--workers", "0"), "--workers is 0"),
    (("--subject-time-limit", "0"), "--subject-time-limit is 0"),
    (("--memory-limit", "-1"), "--memory-limit is -1"),
    (("--surfaces", "--sequence"), "two things"),
    (("--scheduler", "tcp://127.0.0.1:1", "--workers", "1"), "leave one out"),
    (("--edge-length", "-1"), "option --edge-length is -1"),
    (("--format", "none"), "format"),
    (("--anatomy", "whole-heart"), "mesher 'sweep'"),
])  # fmt: skip
def test_wrong_options_are_one_line_and_make_nothing(
    undisturbed: Quiet, tmp_path: Path, more: tuple[str, ...], words: str
) -> None:
    done = cohorts.run(undisturbed.source, tmp_path / "out", *more, workers=None)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_folder_that_no_cohort_wrote_is_refused(undisturbed: Quiet, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("mine")
    done = cohorts.run(undisturbed.source, tmp_path / "out")
    assert done.returncode == 2
    assert "holds files that no cohort wrote" in done.stderr
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mine.txt"]
