"""Tissue of the heart's own label map becomes regions of its mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import femprep as fp
from femprep.anatomy.tissue.regions import own_tissue, without_tissues
from femprep.phantoms import lv_ellipsoid


@pytest.fixture(scope="module")
def scarred() -> fp.Segmentation:
    seg = lv_ellipsoid().segmentation(spacing=(2.0, 2.0, 8.0))
    labels = np.array(seg.labels)
    middle = np.argwhere(seg.mask("lv")).mean(axis=0)
    i, j, _ = np.indices(labels.shape)
    labels[seg.mask("myo") & (np.abs(np.arctan2(j - middle[1], i - middle[0])) < 0.6)] = 9
    myo = seg.structures["myo"]
    return replace(seg, labels=labels, structures={**seg.structures, "myo": (*myo, 9), "scar": (9,), "edema": (8,)})


def test_scar_of_the_hearts_own_map_is_a_region(scarred: fp.Segmentation) -> None:
    run = fp.mesh_segmentation(scarred, volume={"mesher": "sweep", "edge_length": 6.0}, surface={"vertices": 400})
    assert {"lv", "scar"} <= set(run.mesh.region_names)
    (record,) = run.mesh.info["tissues"]["tissues"]
    assert record["region_ml"] == pytest.approx(record["voxels_ml"], rel=0.1)


def test_tissue_that_a_map_names_and_does_not_hold_is_none(scarred: fp.Segmentation) -> None:
    found = own_tissue(scarred)
    assert found is not None
    assert dict(found.structures) == {"scar": (9,)}
    assert own_tissue(replace(scarred, structures={**scarred.structures, "scar": (7,)})) is None


def test_a_sequence_keeps_tissue_as_wall(scarred: fp.Segmentation) -> None:
    seg = without_tissues(scarred)
    assert set(seg.structures) == {"lv", "myo"}
    assert np.array_equal(seg.mask("myo"), scarred.mask("myo"))
    assert "scar" in seg.info["notices"][-1]["what"]
    assert without_tissues(seg) is seg
