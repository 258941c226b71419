"""Papillary muscles become cavity, the wall stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import femprep as fp
from femprep.image.papillary import fill_helps
from femprep.phantoms import lv_ellipsoid


@pytest.fixture(scope="module")
def plain() -> fp.Segmentation:
    return lv_ellipsoid().segmentation(spacing=(1.5, 1.5, 8.0))


def with_muscles(seg: fp.Segmentation, label: int) -> tuple[fp.Segmentation, int]:
    """Two columns from the wall into the cavity, of some label, and their number of voxels."""
    cavity = seg.mask("lv")
    middle = np.argwhere(cavity).mean(axis=0)
    i, j, _ = np.indices(cavity.shape)
    muscles = cavity & (np.abs(j - middle[1]) < 3.0) & (np.abs(i - middle[0]) > 8.0)
    labels = np.array(seg.labels)
    labels[muscles] = label
    return replace(seg, labels=labels), int(np.count_nonzero(muscles))


@pytest.mark.parametrize("structure", ["myo", None])
def test_muscles_are_filled(plain: fp.Segmentation, structure: str | None) -> None:
    seg, count = with_muscles(plain, plain.structures[structure][0] if structure else 0)
    filled = fp.fill_papillary(seg)
    assert np.count_nonzero(plain.mask("lv") & ~filled.mask("lv")) < 0.15 * count
    assert np.count_nonzero(filled.mask("lv") & ~plain.mask("lv")) < 0.02 * np.count_nonzero(plain.mask("lv"))
    assert filled.info["notices"][-1]["amount"] > 0.8 * count * seg.grid.voxel_volume / 1e3
    (line,) = fill_helps(seg)
    assert "--fill-papillary" in line


def test_a_plain_cavity_stays_nearly_as_it_is(plain: fp.Segmentation) -> None:
    filled = fp.fill_papillary(plain)
    assert np.count_nonzero(filled.labels != plain.labels) < 0.02 * np.count_nonzero(plain.mask("lv"))
    assert fill_helps(plain) == []


def test_a_septum_that_bulges_into_the_cavity_stays_wall(plain: fp.Segmentation) -> None:
    """Cavity and wall are indented together: the wall there is as thick as elsewhere."""
    middle = np.argwhere(plain.mask("lv")).mean(axis=0)
    i, j, _ = np.indices(plain.labels.shape)
    shift = np.rint(6.0 * np.exp(-(((j - middle[1]) / 8.0) ** 2))).astype(int)
    source = np.clip(np.where(i > middle[0], i + shift, i), 0, plain.labels.shape[0] - 1)
    seg = replace(plain, labels=np.take_along_axis(np.asarray(plain.labels), source, axis=0))
    added = np.count_nonzero(fp.fill_papillary(seg).mask("lv")) - np.count_nonzero(seg.mask("lv"))
    assert added < 0.02 * np.count_nonzero(seg.mask("lv"))
