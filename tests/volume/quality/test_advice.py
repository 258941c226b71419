"""A stage that fails on displaced slices says what correcting shifts reaches; a mesh off its labels what helps it."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import femprep as fp
from femprep.errors import InputError, StageError
from femprep.image import leave_out_slices
from femprep.mesh.measures.volume_elements import element_measures
from femprep.model import Surface, VolumeMesh
from femprep.options import Options
from femprep.options.advice import SEQUENCE
from femprep.phantoms import lv_ellipsoid
from femprep.volume.quality.advice import Reached, surfaces_reached, what_helps, with_hints, with_shape_help
from femprep.volume.quality.fidelity import Fidelity, surface_fidelity
from femprep.volume.quality.limits import SHAPES, judge_shapes
from femprep.volume.quality.verdicts import Verdicts
from femprep.volume.runs import NoMeshError
from femprep.wall.anatomies import WallSurfaces
from femprep.wall.outlines import Outline

OPTIONS = Options(preset="acdc", surface={"vertices": 300})


#: Limits that one element alone would miss.
LIMITS = {"purpose": "general", "minimum_dihedral": None, "mean_of_mean_ratio": None}


def tetrahedron() -> VolumeMesh:
    """One corner of a cube."""
    return VolumeMesh(np.vstack([np.zeros(3), np.eye(3)]), {"tetra": np.array([[0, 1, 2, 3]])}, np.ones(1))


@pytest.fixture(scope="module")
def displaced() -> fp.Segmentation:
    """An LV two of whose slices lie more than a centimetre beside the others."""
    grid = lv_ellipsoid().grid((2.5, 2.5, 8.0))
    shifts = np.zeros((grid.shape[2], 2))
    shifts[6], shifts[9] = (15.0, 0.0), (0.0, -12.0)
    return lv_ellipsoid().segmentation((2.5, 2.5, 8.0), shifts=shifts)


def reached_on(seg: fp.Segmentation) -> Reached:
    """What surfaces of the map reach with other options of its image."""

    def reached(options: Options) -> float | None:
        left = leave_out_slices(seg, options.image.leave_out) if options.image.leave_out else seg
        return surfaces_reached(fp.align_slices(left) if options.image.correct_shifts else left, options)

    return reached


def message(seg: fp.Segmentation, options: Options, error: Exception) -> str:
    with pytest.raises(type(error)) as caught, with_hints(seg, options, {}, reached_on(seg)):
        raise error
    return str(caught.value)


@pytest.mark.slow
def test_an_error_keeps_what_it_holds(displaced: fp.Segmentation) -> None:
    error = NoMeshError("no mesh after 3 attempts", [])
    words = message(displaced, OPTIONS, error)
    assert words.startswith("no mesh after 3 attempts; --correct-shifts")
    assert error.records == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", [StageError, InputError])
def test_shifts_of_centimetres_are_said(displaced: fp.Segmentation, kind: type[Exception]) -> None:
    line = message(displaced, OPTIONS, kind("the surface folds"))
    assert line.startswith("the surface folds; --correct-shifts")
    largest = float(re.search(r"up to ([\d.]+) mm", line)[1])
    assert abs(largest - 15.0) < 2.0
    assert "(slice 6)" in line
    after, before = map(float, re.search(r"zig-zag by ([\d.]+) mm instead of ([\d.]+)", line).groups())
    assert after < 0.2 * before
    reached = float(re.search(r"surfaces lie within ([\d.]+) pixels", line)[1])
    assert reached < OPTIONS.limits.maximum_label_distance


def test_nothing_is_said_where_it_would_not_help(displaced: fp.Segmentation) -> None:
    straight = lv_ellipsoid().segmentation((2.5, 2.5, 8.0))
    assert message(straight, OPTIONS, StageError("it folds")) == "it folds"
    corrected = OPTIONS.model_copy(update={"image": fp.ImageOptions(correct_shifts=True)})
    assert message(displaced, corrected, StageError("it folds")) == "it folds"


@pytest.mark.slow
def test_the_pipeline_says_it(displaced: fp.Segmentation, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise StageError("the wall is no ball")

    monkeypatch.setattr("femprep.pipeline.ANATOMIES", {"lv": fails})
    with pytest.raises(StageError, match=r"the wall is no ball; .*--correct-shifts"):
        fp.mesh_segmentation(displaced, OPTIONS)


def apart(seg: fp.Segmentation) -> tuple[WallSurfaces, Surface, Fidelity]:
    """Surfaces of a left ventricle, its epicardium 10 mm beside its labels, and how far they lie from them."""
    objects = {"lv": seg.object("lv"), "epi": seg.object("lv", "myo")}
    endo, epi = (fp.fit_surface(obj, vertices=300) for obj in objects.values())
    away = replace(epi, points=epi.points + np.array([10.0, 0.0, 0.0]))
    outlines = Outline("endo", objects["lv"]), Outline("epi", objects["epi"])
    found = surface_fidelity({"endo": endo, "epi": away}, outlines, seg.grid)
    return WallSurfaces(objects, {"lv": endo}, epi, outlines=outlines), away, found


@pytest.mark.slow
def test_what_leaves_the_labels_is_told_apart() -> None:
    """The surfaces a wall is built from, an epicardium drawn around chambers for one, or the mesh between them."""
    seg = lv_ellipsoid().segmentation((2.5, 2.5, 8.0))
    near, away, found = apart(seg)
    (line,) = what_helps(seg, found, replace(near, epi=away), OPTIONS, {}, reached_on(seg))
    assert "more --vertices" in line
    (line,) = what_helps(seg, found, near, OPTIONS, {}, reached_on(seg))
    assert re.search(r"within [01]\.\d pixels.* a smaller --edge-length", line)
    # The endocardium, which is near its labels, is none of the reasons.
    (line,) = what_helps(seg, found, replace(near, endo={"lv": away}), OPTIONS, {}, reached_on(seg))
    assert "a smaller --edge-length" in line


@pytest.mark.slow
def test_where_moving_slices_back_suffices_nothing_else_is_advised(displaced: fp.Segmentation) -> None:
    near, _, found = apart(displaced)
    (line,) = what_helps(displaced, found, near, OPTIONS, {}, reached_on(displaced))
    assert re.search(r"slice 6 by 1\d\.\d mm.*--correct-shifts .* within [01]\.\d pixels$", line)
    corrected = OPTIONS.model_copy(update={"image": fp.ImageOptions(correct_shifts=True)})
    (line,) = what_helps(displaced, found, near, corrected, {}, reached_on(displaced))
    assert re.search(r"--leave-out 6 .* [01]\.\d pixels$", line)


@pytest.mark.slow
def test_slices_are_not_left_out_where_that_does_not_suffice(displaced: fp.Segmentation) -> None:
    near, _, found = apart(displaced)
    beside, finer = what_helps(displaced, found, near, OPTIONS, {}, lambda _: None)
    assert beside.endswith("; mend their labels")
    assert "a smaller --edge-length" in finer


def test_a_swept_mesh_of_poor_elements_names_the_other_mesher() -> None:
    swept = Options(volume={"mesher": "sweep"})
    good = fp.check(tetrahedron(), **LIMITS, minimum_mean_ratio=0.1)
    poor = fp.check(tetrahedron(), **LIMITS, minimum_mean_ratio=0.99)
    assert with_shape_help(good, swept, {}) is good
    assert with_shape_help(poor, Options(), {}) is poor
    assert "--mesher tetwild" in with_shape_help(poor, swept, {}).failures[-1]
    in_sequence = with_shape_help(poor, swept, SEQUENCE).failures[-1]
    assert "--mesher" not in in_sequence
    assert "without --sequence" in in_sequence


def test_every_limit_on_shapes_counts_for_that() -> None:
    held = Verdicts()
    limits = fp.CheckOptions(**{**dict.fromkeys(SHAPES, 0.5), "maximum_dihedral": 90.0})
    judge_shapes({"tetra": element_measures(tetrahedron().points, tetrahedron().cells["tetra"], "tetra")}, limits, held)
    assert {one.name for one in held.limits} == SHAPES
