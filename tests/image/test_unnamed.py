"""Labels inside the left ventricle under no name are refused, those beside it are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

import femprep as fp
from femprep.errors import InputError
from femprep.image.unnamed import require_named
from femprep.model import BoolArray
from femprep.phantoms import biventricular, four_chambers


@pytest.fixture(scope="module")
def both() -> fp.Segmentation:
    return biventricular().segmentation(spacing=(2.0, 2.0, 8.0))


def sector(seg: fp.Segmentation, half: float) -> BoolArray:
    """Voxels on one side of the middle of the cavity."""
    middle = np.argwhere(seg.mask("lv")).mean(axis=0)
    away = np.indices(seg.labels.shape) - middle[:, None, None, None]
    return np.asarray(np.abs(np.arctan2(away[1], away[0])) < half)


def painted(seg: fp.Segmentation, mask: BoolArray, label: int = 9) -> fp.Segmentation:
    labels = np.array(seg.labels)
    labels[mask] = label
    return replace(seg, labels=labels)


@pytest.mark.parametrize("half", [0.4, 1.0, 1.8])
@pytest.mark.parametrize("layer", ["transmural", "inner", "outer", "middle"])
def test_scar_is_refused_as_wall(both: fp.Segmentation, half: float, layer: str) -> None:
    inner = distance_transform_edt(~both.mask("lv"), sampling=both.grid.spacing)
    outer = distance_transform_edt(both.mask("lv", "myo"), sampling=both.grid.spacing)
    depth = inner / (inner + outer + 1e-9)
    part = {"transmural": depth >= 0, "inner": depth < 0.5, "outer": depth >= 0.5, "middle": abs(depth - 0.5) < 0.25}
    scar = both.mask("myo") & sector(both, half) & part[layer]
    lv, myo = both.structures["lv"][0], both.structures["myo"][0]
    with pytest.raises(InputError, match=rf"inside the wall .* 9 .*--structure myo={myo},9 if .*lv={lv},9"):
        require_named(painted(both, scar))


@pytest.mark.parametrize("where", ["mural", "apical", "loose"])
def test_what_fills_part_of_the_cavity_is_refused_as_cavity(both: fp.Segmentation, where: str) -> None:
    cavity = both.mask("lv")
    inner = distance_transform_edt(cavity, sampling=both.grid.spacing)
    size = cavity.sum(axis=(0, 1))
    apical = (size > 0) & (size <= np.sort(size[size > 0])[2])
    part = {"mural": (inner < 12.0) & sector(both, 0.6), "apical": apical[None, None, :], "loose": inner > 8.0}
    with pytest.raises(InputError, match=r"inside the cavity .* 9 .*--structure lv=\d,9 if"):
        require_named(painted(both, cavity & part[where]))


def test_several_labels_are_listed_with_their_volumes(both: fp.Segmentation) -> None:
    scar = both.mask("myo") & sector(both, 0.8)
    core = both.mask("myo") & sector(both, 0.2)
    seg = painted(painted(both, scar), core, 7)
    volume = np.count_nonzero(core) * seg.grid.voxel_volume / 1e3
    with pytest.raises(InputError, match=rf"labels 7, 9 \({volume:.1f}, .* mL\)"):
        require_named(seg)


def test_a_name_of_no_chamber_is_looked_at_too(both: fp.Segmentation) -> None:
    seg = painted(both, both.mask("myo") & sector(both, 0.8))
    with pytest.raises(InputError, match="9 'infarct'"):
        require_named(replace(seg, structures={**both.structures, "infarct": (9,)}))


def test_a_few_voxels_are_a_notice(both: fp.Segmentation) -> None:
    few = np.zeros(both.labels.shape, dtype=bool)
    few[tuple(np.argwhere(both.mask("myo"))[500])] = True
    found = require_named(painted(both, few)).info["notices"]
    assert found[-1]["kind"] == "left out"
    assert "label 9" in found[-1]["what"]


def test_chambers_beside_the_left_ventricle_need_no_name(both: fp.Segmentation) -> None:
    for seg in (both, four_chambers().segmentation(spacing=(2.0, 2.0, 2.0))):
        alone = replace(seg, structures={name: seg.structures[name] for name in ("lv", "myo")})
        assert require_named(alone).info == seg.info


def test_holes_of_the_cavity_name_the_option_that_fills_them(both: fp.Segmentation) -> None:
    hole = both.mask("lv") & (distance_transform_edt(both.mask("lv"), sampling=both.grid.spacing) > 10.0)
    with pytest.raises(InputError, match="--fill-papillary"):
        require_named(painted(both, hole, 0))
    filled = fp.fill_papillary(painted(both, hole, 0))
    assert require_named(filled) is filled
