"""What labels and options tell is said before any surface is fitted; what fails later costs no more than it must."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.errors import FileError, InputError, MissingDependencyError, OptionError, ResourceError, StageError
from femprep.options import Options
from femprep.phantoms import biventricular, four_chambers, lv_ellipsoid
from femprep.pipeline import fit_surfaces, mesh_segmentation

Refusal = Callable[..., str]


@pytest.fixture(scope="module")
def ventricle() -> fp.Segmentation:
    return lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped")


@pytest.fixture(scope="module")
def heart() -> fp.Segmentation:
    return four_chambers().segmentation(spacing=(2.0, 2.0, 2.0))


@pytest.fixture(scope="module")
def open_heart(heart: fp.Segmentation) -> fp.Segmentation:
    """The heart with a mitral valve: its left ventricle reaches up to the atrium in a column of 10 mm radius."""
    labels = np.array(heart.labels)
    points = heart.grid.to_world(np.argwhere(labels >= 0))
    x, y, z = points.T.reshape(3, *labels.shape)
    column = (np.hypot(x, y) < 10.0) & (z > 30.0) & (z < 60.0) & (labels != heart.structures["la"][0])
    labels[column] = heart.structures["lv"][0]
    return fp.Segmentation(labels, heart.grid, heart.structures)


@pytest.fixture
def refusal(monkeypatch: pytest.MonkeyPatch) -> Refusal:
    """The message a run is refused with, and that it is before any surface is begun."""

    def begun(*_: Any) -> None:
        raise AssertionError("surfaces were begun")

    monkeypatch.setattr("femprep.pipeline.ANATOMIES", dict.fromkeys(("lv", "biv", "whole-heart"), begun))

    def refused(seg: fp.Segmentation, kind: type[Exception] = OptionError, **options: Any) -> str:
        with pytest.raises(kind) as caught:
            fp.mesh_segmentation(seg, **options)
        line = str(caught.value)
        assert "\n" not in line
        return line

    return refused


@pytest.mark.slow
def test_nothing_is_refused_without_a_reason(ventricle, heart, open_heart, monkeypatch) -> None:
    valve = (0.0, 0.0, 49.0, 0.0, 0.0, 1.0, 10.0)

    def begun(*_: Any) -> None:
        raise StageError("surfaces were begun")

    monkeypatch.setattr("femprep.pipeline.ANATOMIES", dict.fromkeys(("lv", "whole-heart"), begun))
    for seg, options in (
        (ventricle, {"fibres": {}, "formats": ("abaqus", "ls-dyna"), "export": {"step": "inflation"}}),
        (ventricle, {"fibres": {}, "formats": ("febio",), "export": {"step": "inflation", "material": "orthotropic"}}),
        (ventricle, {"volume": {"mesher": "sweep", "order": 2}, "sweep": {"columns": 40}, "formats": ("ls-dyna",)}),
        (ventricle, {"volume": {"edge_length": 9.0}}),  # the wall is 10 mm thick
        (ventricle, {"volume": {"elements_through_wall": 6}, "wall": {"apex": "clipped"}}),
        (ventricle, {"surface": {"method": "paper"}, "blood_pool": True}),
        (heart, {"anatomy": "whole-heart", "formats": ("abaqus",)}),
        (open_heart, {"anatomy": "whole-heart", "fibres": {}, "wall": {"openings": "labels"}}),
        (open_heart, {"anatomy": "whole-heart", "fibres": {}, "wall": {"valves": {"mitral": valve}}}),
    ):
        with pytest.raises(StageError, match="were begun"):
            fp.mesh_segmentation(seg, **options)


def test_fibres_of_a_heart_with_closed_valves(refusal: Refusal, heart) -> None:
    line = refusal(heart, anatomy="whole-heart", fibres={})
    assert "--valve" in line
    assert "--valve" in line
    assert "leave fibres out" in line


def test_fibres_where_the_labels_show_no_valve(refusal: Refusal, heart) -> None:
    assert "leave fibres out" in refusal(heart, anatomy="whole-heart", fibres={}, wall={"openings": "labels"})


def test_fibres_on_the_command_line(
    heart, tmp_path: Path, capsys: pytest.CaptureFixture[str], refusal: Refusal
) -> None:
    fp.write_segmentation(heart, tmp_path / "heart.nii.gz")
    names = [f"{name}={labels[0]}" for name, labels in heart.structures.items()]
    arguments = [word for name in names for word in ("--structure", name)]
    out = tmp_path / "out"
    run = ["mesh", str(tmp_path / "heart.nii.gz"), "-o", str(out), "--anatomy", "whole-heart", "--fibres", *arguments]
    assert main([*run, "--quiet"]) == 2
    assert not out.exists()
    (line,) = capsys.readouterr().err.splitlines()
    assert "--valve" in line


def test_fibres_of_a_cavity_that_is_closed_all_round(refusal: Refusal, heart) -> None:
    valves = {"mitral": (0.0, 0.0, 45.75, 0.0, 0.0, 1.0, 10.0)}
    line = refusal(heart, InputError, anatomy="whole-heart", fibres={}, wall={"valves": valves})
    assert "closed all round" in line


def test_fibres_without_axes(refusal: Refusal, ventricle, monkeypatch) -> None:
    def none(*_: Any, **__: Any) -> None:
        raise InputError("both ends look alike")

    monkeypatch.setattr("femprep.preflight.ventricular_axes", none)
    line = refusal(ventricle, InputError, fibres={})
    assert "both ends look alike" in line
    assert "leave fibres out" in line


def test_a_valve_beside_the_heart(refusal: Refusal, heart) -> None:
    valves = {"mitral": (300.0, 0.0, 0.0, 0.0, 0.0, 1.0, 10.0)}
    line = refusal(heart, InputError, anatomy="whole-heart", wall={"valves": valves})
    assert "300.0" in line
    assert "'lv' to 'la'" in line


@pytest.mark.parametrize(
    ("format", "options", "said"),
    [
        ("ls-dyna", {"volume": {"mesher": "sweep", "order": 2}, "sweep": {"element": "wedge"}}, "wedge15"),
        ("ls-dyna", {"volume": {"mesher": "sweep"}, "sweep": {"element": "hexahedron", "order": 2}}, "hexahedron20"),
        ("abaqus", {"export": {"step": "inflation", "material": "orthotropic"}}, "needs fibres"),
        ("febio", {"export": {"step": "inflation", "material": "orthotropic"}}, "needs fibres"),
    ],
)
def test_formats_that_cannot_hold_the_mesh(refusal: Refusal, ventricle, format, options, said) -> None:
    line = refusal(ventricle, formats=(format,), **options)
    assert said in line
    assert format in line


def test_a_step_on_a_whole_heart_has_no_base_to_hold(refusal: Refusal, heart) -> None:
    line = refusal(heart, anatomy="whole-heart", formats=("abaqus",), export={"step": "inflation"})
    assert "needs facets tagged base" in line


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"volume": {"mesher": "sweep"}, "sweep": {"columns": 41}}, "multiple of 5"),
        ({"volume": {"mesher": "sweep"}, "sweep": {"element": "hexahedron", "columns": 42}}, "multiple of 4"),
        ({"volume": {"mesher": "sweep"}, "sweep": {"element": "wedge", "template": "quad"}}, "needs template"),
        ({"surface": {"cells": "quad"}}, "triangles alone"),
        ({"formats": ("abacus",)}, "unknown format"),
    ],
)
def test_options_that_do_not_go_together(refusal: Refusal, ventricle, options, said) -> None:
    assert said in refusal(ventricle, **options)


def test_options_that_do_not_go_together_are_said_in_plain_words() -> None:
    with pytest.raises(OptionError) as caught:
        mesh_segmentation(None, anatomy="biv", volume={"mesher": "sweep"})
    assert str(caught.value).startswith("mesher 'sweep' fills the wall of anatomy lv")


def test_a_small_heart_is_not_thickened_throughout(refusal: Refusal) -> None:
    """Its labels are .6 mm thick; a wall of 1 mm would be another heart's."""
    thin = lv_ellipsoid((20.0, 20.0, 40.0), (20.6, 20.6, 40.6), 14.0).segmentation(spacing=(0.3, 0.3, 3.0))
    assert "--minimum-thickness 0.2" in refusal(thin, volume={"edge_length": 0.5})
    assert "choose at most 0.6" in refusal(thin, volume={"edge_length": 3.5}, wall={"minimum_thickness": 0.2})


@pytest.mark.parametrize(("anatomy", "more"), [("lv", ()), ("biv", ("--rv-wall-thickness 0.",))])
def test_lengths_of_a_human_heart_are_refused_for_a_mouse(
    refusal: Refusal, anatomy: str, more: tuple[str, ...]
) -> None:
    seg = biventricular().segmentation(spacing=(2.0, 2.0, 8.0))
    mouse = replace(seg, grid=replace(seg.grid, spacing=seg.grid.spacing / 10.0))
    said = refusal(mouse, anatomy=anatomy, **({"volume": {"mesher": "sweep"}} if anatomy == "lv" else {}))
    for option in ("--minimum-thickness 0.", "--edge-length 0.", *more):
        assert option in said


def test_edge_lengths_against_wall_and_memory(refusal: Refusal, ventricle, heart) -> None:
    assert "mm thick" in refusal(ventricle, volume={"edge_length": 60.0})
    assert "memory_limit" in refusal(ventricle, ResourceError, volume={"edge_length": 0.2})
    # An odd number, which the mesher itself has to make; twenty are refined, and need less.
    assert "memory_limit" in refusal(ventricle, ResourceError, volume={"edge_length": 0.5, "elements_through_wall": 19})
    assert "memory_limit" in refusal(heart, ResourceError, anatomy="whole-heart", volume={"edge_length": 0.2})


def test_sizing_fields(refusal: Refusal, ventricle, tmp_path: Path) -> None:
    import pyvista

    path = str(tmp_path / "sizes.vtp")
    assert "is not there" in refusal(ventricle, FileError, volume={"sizing": path})
    sphere = pyvista.Sphere(radius=40.0)
    sphere.save(path)
    assert "no point data" in refusal(ventricle, FileError, volume={"sizing": path})
    for length, kind, said in ((-1.0, InputError, "positive"), (0.1, ResourceError, "memory_limit")):
        sphere.point_data["edge_length"] = np.full(sphere.n_points, length)
        sphere.save(path)
        assert said in refusal(ventricle, kind, volume={"sizing": path})


def test_planes_beside_the_heart(refusal: Refusal, ventricle) -> None:
    assert "cuts all of it away" in refusal(ventricle, InputError, wall={"base_offset": 200.0})
    line = refusal(ventricle, InputError, wall={"base_offset": -200.0})
    assert "cuts nothing away" in line
    assert "--base-offset" in line
    assert "--basal-end" not in line
    given = refusal(ventricle, InputError, wall={"base": (0.0, 0.0, 900.0, 0.0, 0.0, 1.0)})
    assert given.endswith("change --base")
    line = refusal(ventricle, InputError, wall={"base_offset": 70.0, "apex": "clipped"})
    assert "between base and apex plane" in line


def test_memory_of_a_later_surface(refusal: Refusal, ventricle) -> None:
    surface = {"method": "paper", "memory_limit": 0.001, "control_points": 300}
    assert "memory_limit" in refusal(ventricle, ResourceError, surface=surface)


def test_a_mesher_that_is_not_installed(refusal: Refusal, ventricle, monkeypatch) -> None:
    monkeypatch.setattr("femprep.preflight.find_spec", lambda name: None)
    assert "pip install" in refusal(ventricle, MissingDependencyError)


def test_a_later_phase_that_cannot_be_meshed(refusal: Refusal, ventricle) -> None:
    labels = np.array(ventricle.labels)
    labels[0, 0, 0] = ventricle.structures["lv"][0]
    second = fp.Segmentation(labels, ventricle.grid, ventricle.structures)
    with pytest.raises(InputError, match=r"phase 1: object 'lv' is in 2 pieces"):
        fp.mesh_sequence([ventricle, second], image={"policy": "strict"})


def test_a_second_surface_that_cannot_be_fitted(ventricle, monkeypatch) -> None:
    def begun(*_: Any, **__: Any) -> None:
        raise AssertionError("a surface was begun")

    monkeypatch.setattr("femprep.pipeline.fit_surface", begun)
    with pytest.raises(InputError, match="'rv'"):
        fit_surfaces(ventricle, {"lv": ("lv",), "rv": ("rv",)}, Options())


@pytest.mark.slow
def test_a_mesh_whose_fibres_fail_is_written_without(ventricle, tmp_path: Path, monkeypatch) -> None:
    def fails(*_: Any, **__: Any) -> None:
        raise StageError("the field does not converge")

    monkeypatch.setattr("femprep.stages.furnish.add_fibres", fails)
    fp.write_segmentation(ventricle, tmp_path / "heart.nii.gz")
    config = tmp_path / "run.toml"
    config.write_text('[export]\nstep = "inflation"\nmaterial = "orthotropic"\n')
    out = tmp_path / "out"
    sizes = ["--mesher", "sweep", "--edge-length", "6", "--vertices", "500", "--preset", "acdc", "--quiet"]
    formats = ["--format", "abaqus", "--format", "gmsh", "--config", str(config)]
    assert main(["mesh", str(tmp_path / "heart.nii.gz"), "-o", str(out), "--fibres", *sizes, *formats]) == 1
    failures = json.loads((out / "quality.json").read_text())["failures"]
    assert failures[0] == "fibres: not made: the field does not converge"
    assert failures[1].startswith("abaqus: not written: the orthotropic material needs fibres")
    assert len(failures) == 2
    assert (out / "mesh.msh").exists()
    assert not (out / "mesh.inp").exists()
    assert "the field does not converge" in (out / "report.html").read_text()
    assert "aha" not in fp.read_mesh(out / "mesh.vtu").cell_data
    assert main(["check", str(out / "mesh.vtu"), "--quiet"]) == 1
    assert main(["check", str(out / "mesh.msh"), "--quiet"]) == 1


@pytest.mark.parametrize("emptied", [[5], [5, 6]])
@pytest.mark.parametrize("mesher", ["tetwild", "sweep"])
def test_empty_slices_in_the_middle_of_the_stack(refusal: Refusal, ventricle, emptied: list[int], mesher: str) -> None:
    labels = np.array(ventricle.labels)
    labels[:, :, emptied] = 0
    seg = fp.Segmentation(labels, ventricle.grid, ventricle.structures)
    line = refusal(seg, InputError, volume={"mesher": mesher})
    said = "slice 5 holds nothing" if len(emptied) == 1 else "slices 5 to 6 hold nothing"
    assert "is in 2 pieces of" in line
    assert said in line
    assert "label what is missing" in line
    assert "plane" not in line


def test_a_speck_beyond_an_empty_slice_is_left_out(ventricle, monkeypatch) -> None:
    labels = np.array(ventricle.labels)
    cavity = np.argwhere(labels == 3)
    last = int(cavity[:, 2].min())
    labels[:, :, last] = 0
    labels[tuple(cavity[cavity[:, 2] == last][0])] = 3
    labels[:, :, last + 1] = 0
    monkeypatch.setattr("femprep.pipeline.ANATOMIES", {"lv": lambda *_: 1 / 0})
    with pytest.raises(ZeroDivisionError):
        fp.mesh_segmentation(fp.Segmentation(labels, ventricle.grid, ventricle.structures))
