"""A second run into the same folder: what the user added stays, and what is in the way is named before any work."""

from __future__ import annotations

from pathlib import Path

import pytest

import femprep as fp
from femprep.cli import main
from femprep.phantoms import lv_ellipsoid


@pytest.fixture(scope="module")
def heart(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("heart") / "heart.nii.gz"
    fp.write_segmentation(lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0)), path)
    return path


@pytest.fixture(scope="module")
def once(heart: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("once") / "out"
    assert main(["surface", str(heart), "-o", str(out), *SURFACES, "--object", "cavity=lv", "--object", "lv"]) == 0
    return out


SURFACES = ["--preset", "acdc", "--vertices", "300", "--quiet"]


@pytest.mark.slow
def test_surfaces_made_anew_leave_what_was_added(heart: Path, once: Path) -> None:
    (once / "state.pvsm").write_text("view")
    (once / "surfaces" / "lv_cut.vtp").write_text("cut")
    assert main(["surface", str(heart), "-o", str(once), *SURFACES, "--object", "lv"]) == 0
    files = {path.relative_to(once).as_posix() for path in once.rglob("*") if path.is_file()}
    ours = {"run.json", "methods.md", "methods.bib", "surfaces/lv.vtp"}
    assert files == {*ours, "state.pvsm", "surfaces/lv_cut.vtp"}
    assert (once / "state.pvsm").read_text() == "view"


# The image does not exist: were any work begun, that would be said.
@pytest.mark.parametrize(
    ("command", "name"),
    [
        (["mesh", "none.nii", "--format", "abaqus"], "mesh.inp"),
        (["mesh", "none.nii", "--format", "dolfinx"], "dolfinx/info.json"),
        (["mesh", "ed.nii", "es.nii", "--sequence"], "phases/ed/mesh.vtu"),
        (["surface", "none.nii", "--object", "cavity=lv"], "surfaces/cavity.vtp"),
        (["demo"], "report.html"),
    ],
)
def test_file_in_the_way_is_named_before_any_work(
    once: Path, command: list[str], name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = once / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("mine")
    structures = [] if command[0] == "demo" else ["--preset", "acdc"]
    try:
        assert main([*command, "-o", str(once), *structures, "--quiet"]) == 2
    finally:
        text = path.read_text()
        path.unlink()
    assert text == "mine"
    said = capsys.readouterr().err
    assert len(said.splitlines()) == 1
    assert repr(name) in said


def test_edited_file_is_named_before_any_work(once: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = once / "surfaces" / "lv.vtp"
    kept = path.read_bytes()
    path.write_bytes(kept + b"\n")
    try:
        assert main(["mesh", "none.nii", "-o", str(once), "--preset", "acdc", "--quiet"]) == 2
    finally:
        path.write_bytes(kept)
    assert "'surfaces/lv.vtp', changed since" in capsys.readouterr().err
