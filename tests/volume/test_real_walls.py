"""Walls of real hearts: thin, thick, end-diastolic and end-systolic."""

import numpy as np
import pytest
from test_tetrahedra import holds

import femprep as fp
from femprep.volume import tetrahedralize


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize(
    ("case", "edge_length"),
    [("084/patient084_frame01", 2.5), ("041/patient041_frame01", 3.0), ("021/patient021_frame13", 5.0)],
)
def test_acdc_wall(data, case, edge_length):
    path = data / "acdc" / "training" / f"patient{case}_gt.nii.gz"
    seg = fp.read_segmentation(path, preset="acdc")
    outer = seg.object("lv", "myo")
    endo = fp.fit_surface(seg.object("lv"))
    epi = fp.fit_surface(outer, boundary=fp.extend_apex(seg, outer, endo=endo))
    wall = fp.build_wall(epi=epi, endo={"lv": endo}, base=fp.find_base(seg))
    mesh = tetrahedralize(wall, edge_length=edge_length)
    holds(mesh, wall)
    assert mesh.info["quality_reached"]
    assert len(mesh.info["attempts"]) == 1
    assert mesh.info["greatest_distance_from_wall_mm"] < 0.05 * edge_length
    assert np.isclose(mesh.info["volume_mm3"], wall.volume, rtol=0.01)
