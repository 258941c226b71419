"""A template is laid another way where it leaves the labels in one place, though the surface does not."""

from __future__ import annotations

from pathlib import Path

import pytest

from femprep.image import read_segmentation
from femprep.surface import fit_surface, label_distance
from femprep.surface.fitting.laying import Off
from femprep.surface.fitting.ways import ACCEPTANCE


def test_distances_are_counted_in_what_is_accepted() -> None:
    off = Off(2.0 * ACCEPTANCE.distance, 3.0 * ACCEPTANCE.greatest)
    assert off.short(Off(0.0, 0.0), 0.0) == (2.0, 3.0)


def test_flat_triangles_are_allowed_half_of_what_they_cut_off_in_the_mean() -> None:
    best = Off(ACCEPTANCE.distance, 1.0)
    assert Off(0.5, 1.0).short(best, 2.0 * (0.5 - ACCEPTANCE.distance)).mean == pytest.approx(1.0)


def test_a_surface_that_is_too_far_itself_excuses_nothing() -> None:
    assert Off(0.5, 1.0).short(Off(2.0 * ACCEPTANCE.distance, 1.0), 10.0).mean == pytest.approx(0.5 / 0.25)


@pytest.mark.slow
@pytest.mark.data
def test_a_stub_in_one_slice_of_a_real_cavity_is_followed(data: Path) -> None:
    seg = read_segmentation(data / "acdc/training/patient071/patient071_frame01_gt.nii.gz", preset="acdc")
    cavity = seg.object("lv")
    surface = fit_surface(cavity)
    told = surface.info["attempts"]
    assert told[0]["greatest_pixels"] > ACCEPTANCE.greatest >= told[-1]["greatest_pixels"]
    assert [one["status"] for one in told] == ["sound", "taken"]
    assert label_distance(surface, cavity).farthest <= ACCEPTANCE.greatest * min(seg.grid.spacing)
