"""The same heart through both doors: meshed from template surfaces, and from STL files of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import own_shapes as shapes
import pytest

import femprep as fp
from femprep.cli import main
from femprep.errors import InputError, OptionError
from femprep.report.volumes import cavity_volume
from femprep.template import charge_template

BASE = (0.0, 0.0, 20.0, 0.0, 0.0, 1.0)


def _write(surfaces: dict[str, fp.Surface], folder: Path) -> dict[str, Path]:
    import trimesh

    found = {}
    for name, surface in surfaces.items():
        found[name] = folder / f"{name}.stl"
        trimesh.Trimesh(surface.points, surface.triangles, process=False).export(found[name])
    return found


def _read(files: dict[str, Path]) -> dict[str, fp.Surface]:
    return {name: fp.read_surface(path) for name, path in files.items()}


def test_a_template_laid_on_a_surface_is_even_and_holds_its_volume(tmp_path: Path) -> None:
    given = shapes.closed("lv")
    laid = fp.fit_surface(_read(_write({"lv": given}, tmp_path))["lv"], vertices=300)
    quality = fp.surface_quality(laid)
    assert len(laid.points) == 300
    assert laid.volume == pytest.approx(given.volume, rel=0.01)  # edges are 10 mm long
    assert quality.q.mean > 0.95
    assert laid.info["distance_mean_mm"] < 0.15
    assert laid.shape is not None
    assert laid.directions is not None


def test_labels_keep_what_is_for_labels_alone() -> None:
    with pytest.raises(fp.OptionError, match="method 'paper' fits labels"):
        fp.fit_surface(shapes.closed("lv"), method="paper")


@pytest.mark.slow
def test_a_wall_is_built_from_surfaces_without_a_template_and_of_unequal_numbers(tmp_path: Path) -> None:
    files = _write({"lv": shapes.closed("lv", 300), "epi": shapes.closed("epi", 400)}, tmp_path)
    found = _read(files)
    wall = fp.build_wall(epi=found["epi"], endo={"lv": found["lv"]}, base=fp.Plane(BASE[:3], BASE[3:]))
    assert wall.volume == pytest.approx(shapes.PHANTOM.wall_volume, rel=0.02)


@pytest.mark.slow
def test_the_whole_way_by_the_sweep_writes_a_folder_with_hashes_and_distances(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = _write(shapes.heart(), tmp_path)
    out = tmp_path / "out"
    named = [word for name, path in files.items() for word in ("--surface", f"{name}={path}")]
    options = ["--mesher", "sweep", "--edge-length", "10", "--vertices", "300", "--quiet"]
    status = main(["mesh", *named, "-o", str(out), "--base", ",".join(map(str, BASE)), *options])
    assert status == 0, capsys.readouterr().err
    record = json.loads((out / "run.json").read_text())
    assert {one["name"]: one["path"] for one in record["input"]["surfaces"]} == {"lv": "lv.stl", "epi": "epi.stl"}
    assert all(len(one["sha256"]) == 64 for one in record["input"]["surfaces"])
    assert any("taken to be in mm" in line for line in record["notices"])
    quality = json.loads((out / "quality.json").read_text())
    assert {one["surface"] for one in quality["given_fidelity"]} == {"endo", "epi"}
    assert all(0.0 < one["mean_mm"] < 0.35 for one in quality["given_fidelity"])
    assert "surfaces that were given" in (out / "report.html").read_text()
    assert {one["name"]: one["given_ml"] for one in record["volumes"]}["cavity"] == pytest.approx(
        shapes.PHANTOM.cavity_volume / 1000.0, rel=0.02
    )


def test_what_cannot_be_meshed_is_one_line_and_status_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = _write(shapes.heart(), tmp_path)
    out = tmp_path / "out"
    assert main(["mesh", "--surface", f"lv={files['lv']}", "-o", str(out)]) == 2
    assert main(["mesh", "--surface", f"lv={files['lv']}", "--surface", "lv", "-o", str(out)]) == 2
    both = [word for name, path in files.items() for word in ("--surface", f"{name}={path}")]
    capsys.readouterr()
    assert main(["mesh", *both, "-o", str(out), "--fibres"]) == 2
    said = capsys.readouterr().err
    assert "fibres need a base" in said
    assert len(said.strip().splitlines()) == 1
    assert not out.exists()


def test_second_images_that_cannot_be_laid_along_own_surfaces_are_refused() -> None:
    surfaces = shapes.heart()
    values = np.ones((4, 4, 4))
    near, far = (
        fp.IntensityImage(values, fp.Grid(values.shape, (40.0, 40.0, 40.0), np.full(3, at), np.eye(3)))
        for at in (-60.0, 900.0)
    )
    with pytest.raises(OptionError, match="second images need a base"):
        fp.mesh_surfaces(surfaces, images={"t1": near})
    with pytest.raises(InputError, match="the image for 't1' does not meet the heart"):
        fp.mesh_surfaces(surfaces, images={"t1": far}, wall={"base": BASE})


@pytest.mark.slow
def test_both_doors_give_the_same_mesh(tmp_path: Path) -> None:
    directions = charge_template(1500).directions
    template = {n: replace(one, directions=directions) for n, one in shapes.heart(1500).items()}
    found = {}
    for door, surfaces in (("template", template), ("stl", _read(_write(shapes.heart(1500), tmp_path)))):
        # Swept, as fTetWild's facets of 5 mm cut off a few tenths of a percent more or less from run to run.
        volume = {"edge_length": 5.0, "mesher": "sweep"}
        found[door] = fp.mesh_surfaces(surfaces, volume=volume, wall={"base": BASE}, fibres={})
    one, other = found["template"], found["stl"]
    assert one.quality.passed
    assert other.quality.passed
    assert other.quality.volume == pytest.approx(one.quality.volume, rel=0.005)
    assert cavity_volume(other.mesh) == pytest.approx(cavity_volume(one.mesh), rel=0.005)
    assert other.quality.measures["mean_ratio"].mean == pytest.approx(one.quality.measures["mean_ratio"].mean, abs=0.02)
    assert other.quality.measures["minimum_dihedral"].min > 15.0
