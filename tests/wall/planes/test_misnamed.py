"""Structures under other numbers than their own are told as such."""

from __future__ import annotations

import numpy as np
import pytest

import femprep as fp
from femprep.errors import InputError, OptionError
from femprep.phantoms import biventricular
from femprep.preflight import check_apart, check_options
from femprep.wall.planes.misnamed import require_order


@pytest.fixture(scope="module")
def both() -> fp.Segmentation:
    return biventricular().segmentation(spacing=(2.0, 2.0, 8.0))


def named(seg: fp.Segmentation, *wrong: str) -> fp.Segmentation:
    """The map with the numbers of lv, myo and rv in another order."""
    numbers = dict(zip(("lv", "myo", "rv"), (seg.structures[name] for name in wrong)))
    return fp.Segmentation(seg.labels, seg.grid, numbers)


@pytest.mark.parametrize("wrong", [("myo", "lv", "rv"), ("rv", "myo", "lv"), ("rv", "lv", "myo"), ("myo", "lv")])
def test_exchanged_numbers_are_told_with_the_right_ones(both: fp.Segmentation, wrong: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match="seem to be swapped") as caught:
        require_order(named(both, *wrong))
    for name, own in zip(("lv", "myo", "rv"), wrong):
        given = f"--structure {name}={both.structures[name][0]}"
        assert (given in str(caught.value)) == (name != own), given


def test_a_base_is_not_looked_for_under_exchanged_numbers(both: fp.Segmentation) -> None:
    with pytest.raises(InputError, match="seem to be swapped"):
        fp.find_base(named(both, "myo", "lv", "rv"))


def test_right_numbers_pass(both: fp.Segmentation) -> None:
    require_order(both)
    assert fp.find_base(both).source.startswith("labels")


def test_label_that_would_close_the_ring_is_told_where_no_base_is_found(both: fp.Segmentation) -> None:
    labels = np.array(both.labels)
    (myo,) = both.structures["myo"]
    middle = np.argwhere(both.mask("lv")).mean(axis=0)
    away = np.indices(labels.shape[:2]) - middle[:2, None, None]
    sector = np.abs(np.arctan2(away[1], away[0])) < 0.5
    scarred = (labels == myo) & sector[:, :, None]
    labels[scarred] = 9
    seg = fp.Segmentation(labels, both.grid, both.structures)
    with pytest.raises(InputError, match=rf"inside the wall .*label 9 .*--structure myo={myo},9 if"):
        fp.mesh_segmentation(seg)
    labels[scarred] = 0
    with pytest.raises(InputError, match="closes around the cavity in none of slices"):
        fp.mesh_segmentation(fp.Segmentation(labels, both.grid, both.structures))


def test_a_label_of_two_structures_is_refused(both: fp.Segmentation) -> None:
    with pytest.raises(OptionError, match="'lv' and 'myo' both have label 3"):
        check_options(fp.Options(preset="acdc", structures={"myo": (2, 3)}))
    check_apart({"lv": (3,), "body": (2, 3)})
    with pytest.raises(OptionError, match="'lv' and 'myo' both have label 3"):
        fp.mesh_segmentation(fp.Segmentation(both.labels, both.grid, {"lv": (3,), "myo": (3,)}))
