"""Slices and long-axis views of phantoms displaced by known motions: found, undone, and surfaces fitted to both."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

import femprep as fp
from femprep.mesh.search.closest import ClosestFinder
from femprep.phantoms import four_chambers

HEART = four_chambers()
PARTS = {"lv": ("lv",), "rv": ("rv",), "la": ("la",)}
PIXEL = 1.8


def label(points):
    """Label of each point of the phantom."""
    found = np.zeros(len(points), dtype=int)
    for name, region in HEART.regions.items():
        found[HEART.inside(name, points)] = region.label
    return found


def view(name, degrees, moved=(0.0, 0.0)):
    """A view through the long axis, displaced in its plane by so many mm."""
    angle = np.radians(degrees)
    axes = np.column_stack([[np.cos(angle), np.sin(angle), 0.0], [0.0, 0.0, 1.0]])
    index = np.stack(np.meshgrid(np.arange(110), np.arange(90), indexing="ij"), axis=-1).reshape(-1, 2)
    start = axes @ np.array([-90.0, -60.0])
    points = start + (index * PIXEL) @ axes.T
    labels = label(points - axes @ np.asarray(moved)).reshape(110, 90)
    structures = {region.structure: (region.label,) for region in HEART.regions.values()}
    return fp.PlaneView(name, labels, structures, start, axes, [PIXEL, PIXEL], 6.0)


def heart(*views, rms=0.0, seed=0):
    """The phantom's stack with displaced slices, with views; and the shifts."""
    grid = HEART.grid((PIXEL, PIXEL, 9.0), margin=(8, 8, 1))
    shifts = np.random.default_rng(seed).normal(scale=rms / np.sqrt(2.0), size=(grid.shape[2], 2))
    seg = HEART.segmentation(grid=grid, shifts=shifts)
    return seg.with_views(*views), shifts


def left(found, shifts):
    """Rms length of what is left of shifts, their mean removed."""
    off = found.shift - shifts[found.index]
    return float(np.sqrt(((off - off.mean(axis=0)) ** 2).sum(axis=1).mean()))


@pytest.fixture(scope="module")
def displaced():
    views = (view("4ch", 0.0, (1.5, -1.0)), view("2ch", 60.0, (-1.0, 1.5)), view("3ch", -60.0, (0.5, 1.0)))
    seg, shifts = heart(*views, rms=3.0)
    return seg, shifts, fp.estimate_shifts(seg)


def test_shifts_are_found_from_stack_and_views_together(displaced):
    _, shifts, found = displaced
    assert left(found, shifts) < 0.7
    assert left(found, shifts) < 1.5 * found.expected
    assert not found.left_out


def test_views_agree_with_each_other_once_they_are_moved_back(displaced):
    seg, _, found = displaced
    aligned = fp.align_slices(seg, found)
    assert [each.name for each in aligned.views] == ["4ch", "2ch", "3ch"]
    # All three were cut through the long axis, so that the tops of the left atrium have to meet there.
    tops = [each.to_world(np.argwhere(each.mask("la")))[:, 2].max() for each in aligned.views]
    before = [each.to_world(np.argwhere(each.mask("la")))[:, 2].max() for each in seg.views]
    assert np.ptp(tops) < 0.75 * np.ptp(before)


def test_each_motion_is_reported(displaced):
    seg, _, found = displaced
    record = fp.align_slices(seg, found).info["slice_shifts"]
    words = " ".join(notice["what"] for notice in record["notices"])
    assert "expected residual" in words
    assert all(name in words for name in ("4ch", "2ch", "3ch"))


def test_a_view_of_something_else_is_left_out():
    wrong = view("3ch", -60.0)
    wrong = fp.PlaneView("3ch", wrong.labels, wrong.structures, [-20.0, 10.0, -30.0], wrong.axes, [1.1, 1.1], 6.0)
    seg, shifts = heart(view("4ch", 0.0), view("2ch", 60.0), wrong, rms=2.0)
    found = fp.estimate_shifts(seg)
    assert found.left_out == ("3ch",)
    assert left(found, shifts) < 0.7
    assert len(fp.align_slices(seg, found).views) == 2


def test_views_bring_surfaces_nearer_to_the_truth():
    seg, _ = heart(view("4ch", 0.0), view("2ch", 60.0), view("3ch", -60.0))
    grid = seg.grid
    # The apical slices are missing, as they often are.
    labels = np.array(seg.labels)
    labels[..., : np.flatnonzero(seg.mask("lv").any(axis=(0, 1)))[0] + 1] = 0
    seg = fp.Segmentation(labels, grid, seg.structures, views=seg.views)
    alone = fp.Segmentation(labels, grid, seg.structures)
    sphere = np.random.default_rng(0).normal(size=(4000, 3))
    truth = HEART.exact_surface("lv", sphere / np.linalg.norm(sphere, axis=1, keepdims=True))

    def off(one):
        found = fp.fit_surface(one.object("lv"), vertices=500)
        return ClosestFinder(found.points, found.triangles)(truth).distance.mean()

    assert off(seg) < 0.6 * off(alone)


def test_slices_of_one_structure_alone_are_moved_back():
    seg, shifts = heart(rms=3.0)
    seg = fp.Segmentation(seg.labels, seg.grid, {"lv": seg.structures["lv"]})
    found = fp.estimate_shifts(seg)
    # A shift that varies slowly along the stack stays, as it looks like a bend of the heart.
    assert left(found, shifts) < 0.7 * np.sqrt((np.var(shifts[found.index], axis=0)).sum())
    assert 0.5 < left(found, shifts) / found.expected < 1.5


def test_a_slice_that_contradicts_all_others_is_left_out_and_interpolated():
    seg, _ = heart(rms=2.0)
    labels = np.array(seg.labels)
    wrong = int(np.median(np.flatnonzero(seg.mask("lv").any(axis=(0, 1)))))
    # The slice is drawn too small.
    middle = np.argwhere(labels[..., wrong] > 0).mean(axis=0)
    labels[..., wrong] = ndimage.affine_transform(labels[..., wrong], np.eye(2) / 0.7, middle - middle / 0.7, order=0)
    seg = fp.Segmentation(labels, seg.grid, {name: seg.structures[name] for name in ("lv", "rv", "myo")})
    found = fp.estimate_shifts(seg)
    assert found.slices_left_out == (wrong,)
    aligned = fp.align_slices(seg, found)
    areas = aligned.mask("lv").sum(axis=(0, 1))[wrong - 1 : wrong + 2]
    assert areas.min() > 0.8 * areas.max()
    assert any(f"slice {wrong} " in notice["what"] for notice in aligned.info["slice_shifts"]["notices"])
