"""Every attempt of a surface fit is told, by name and status; one of them is taken."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femprep.errors import StageError
from femprep.image import Grid, LabelObject, make_object, read_segmentation
from femprep.report.manifest import plain
from femprep.report.notices import lines
from femprep.surface import fit_surface
from femprep.surface.fitting import laying, smooth
from femprep.surface.fitting.laying import Laid
from femprep.surface.fitting.ways import (
    ACCEPTANCE,
    BEGINNINGS,
    FALLBACK,
    LAYING_WAYS,
    Acceptance,
    Beginning,
    FitAttempt,
)


def ball():
    at = 2.0 * (np.indices((24, 24, 24)) - 11.5)
    mask = np.linalg.norm(at, axis=0) < 18.0
    return make_object(mask, Grid(mask.shape, np.full(3, 2.0), np.zeros(3), np.eye(3)), "lv")


def test_a_ball_takes_the_first_way() -> None:
    (told,) = fit_surface(ball(), vertices=300).info["attempts"]
    found = FitAttempt(**told)
    assert (found.beginning, found.way, found.status) == (BEGINNINGS[0].name, LAYING_WAYS[0].name, "taken")
    assert found.least_quality >= ACCEPTANCE.fair
    assert found.mean_quality >= ACCEPTANCE.mean
    assert found.distance_pixels <= ACCEPTANCE.distance
    assert plain(told) == told  # fit for run.json


@pytest.mark.slow
def test_all_ways_are_told_where_none_is_good_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laying, "ACCEPTANCE", Acceptance(distance=1e-6, greatest=1e-6, fair=2.0))
    told = [FitAttempt(**each) for each in fit_surface(ball(), vertices=300).info["attempts"]]
    drawn = [way.name for way in LAYING_WAYS if not way.known]
    assert [(one.beginning, one.way) for one in told] == [
        *((BEGINNINGS[0].name, way.name) for way in LAYING_WAYS),
        *((BEGINNINGS[1].name, name) for name in drawn),
    ]
    assert [one.status for one in told].count("taken") == 1
    # Of the maps on one surface the one with the best triangles alone is measured against the labels, and the others.
    assert sum(one.distance_pixels is not None for one in told) == 2 * (
        1 + sum(way.wanted != "uneven" for way in LAYING_WAYS)
    )
    assert min(told, key=lambda one: one.distance_pixels or np.inf).status in {"taken", "sound"}


@pytest.mark.parametrize("fails", ["folded", "raises"])
def test_attempts_are_told_where_the_harmonic_field_is_taken_instead(
    monkeypatch: pytest.MonkeyPatch, fails: str
) -> None:
    def folded(obj: LabelObject, beginning: Beginning, *_: object) -> list[Laid]:
        if fails == "raises" and beginning is BEGINNINGS[1]:
            raise StageError("a matrix of the fit is not positive definite")
        return [Laid(FitAttempt(beginning=beginning.name, status="folded"))]

    monkeypatch.setattr(smooth, "_fitted", folded)
    surface = fit_surface(ball(), vertices=200, singularities=60, control_points=60)
    assert surface.info["method"] == "even"
    assert any("is taken in its place" in line for line in lines(surface.info))
    told = [FitAttempt(**each) for each in surface.info["attempts"]]
    assert [(one.beginning, one.status) for one in told] == [
        (BEGINNINGS[0].name, "folded"),
        (BEGINNINGS[1].name, "folded" if fails == "folded" else "no mesh"),
        (FALLBACK[0], "taken"),
    ]
    assert told[-1].least_quality > 0.5
    assert 0.0 < told[-1].distance_pixels < told[-1].greatest_pixels < 1.0
    assert plain(surface.info["attempts"]) == surface.info["attempts"]


@pytest.mark.slow
def test_a_mesh_that_cannot_be_bent_leaves_it_to_the_next_beginning(monkeypatch: pytest.MonkeyPatch) -> None:
    fitted = smooth._fitted

    def crumpled(obj: LabelObject, beginning: Beginning, *rest: Any) -> list[Laid]:
        if beginning is BEGINNINGS[0]:
            raise StageError("a matrix of the fit is not positive definite")
        return fitted(obj, beginning, *rest)

    monkeypatch.setattr(smooth, "_fitted", crumpled)
    surface = fit_surface(ball(), vertices=200)
    assert surface.info["method"] == "smooth"
    told = [FitAttempt(**each) for each in surface.info["attempts"]]
    assert (told[0].beginning, told[0].status) == (BEGINNINGS[0].name, "no mesh")
    assert (told[-1].beginning, told[-1].status) == (BEGINNINGS[1].name, "taken")


def test_a_body_without_tips_is_not_begun_a_third_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laying, "ACCEPTANCE", Acceptance(greatest=1e-6))
    begun = {each["beginning"] for each in fit_surface(ball(), vertices=200).info["attempts"]}
    assert begun == {one.name for one in BEGINNINGS if not one.tips}


def test_the_table_is_frozen() -> None:
    with pytest.raises(FrozenInstanceError):
        LAYING_WAYS[0].finer = 1.0  # type: ignore[misc]


@pytest.mark.slow
@pytest.mark.data
def test_a_tip_cut_off_by_a_coarse_mesh_is_followed_by_a_finer_one(data: Path) -> None:
    seg = read_segmentation(data / "acdc/training/patient062/patient062_frame01_gt.nii.gz", preset="acdc")
    told = [FitAttempt(**each) for each in fit_surface(seg.object("rv")).info["attempts"]]
    (taken,) = (one for one in told if one.status == "taken")
    assert taken.beginning == BEGINNINGS[-1].name
    assert taken.greatest_pixels <= ACCEPTANCE.greatest
    assert all(one.greatest_pixels > ACCEPTANCE.greatest for one in told if one.status == "sound")
