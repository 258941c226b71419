"""Walls of real segmentations, from the label map to the closed wall."""

from __future__ import annotations

import numpy as np
import pytest
from faults import faults
from slow_params import slow_but

from femprep.image import Segmentation, read_segmentation
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.topology import is_manifold
from femprep.model import FACET_TAGS, Plane
from femprep.surface import fit_surface
from femprep.wall import build_wall, extend_apex, find_apex, find_base

ACDC = "acdc/training/patient{}/patient{}_gt.nii.gz"
PIG = "pig/ep_pig_E774_SAX_{}_slices6-19_label.nii.gz"
FEW = ["041_frame01", "063_frame16"]
MANY = [
    *("007_frame01", "009_frame01", "012_frame13", "018_frame01", "021_frame13", "029_frame01", "078_frame09"),
    *("084_frame01", "093_frame01", "ED_phase00", "ES_phase11", "rodero01"),
]


def load(data, case: str) -> Segmentation:
    if case == "rodero01":
        return read_segmentation(data / "rodero01/rodero01_sax_vent_1.5x1.5x10_label.nii.gz", preset="acdc")
    if "phase" in case:
        return read_segmentation(data / PIG.format(case), structures={"lv": 1, "myo": 2})
    return read_segmentation(data / ACDC.format(case[:3], case), preset="acdc")


def labelled_volume(seg: Segmentation, base: Plane) -> float:
    """Volume of the cavity's voxels below a plane of the stack, mm3; a voxel the plane cuts counts by its share."""
    centres = seg.grid.to_world(np.argwhere(seg.mask("lv")))
    share = np.clip(0.5 - base.signed_distance(centres) / seg.grid.spacing[seg.stack_axis], 0.0, 1.0)
    return float(share.sum() * seg.grid.voxel_volume)


def make(data, case: str, apex: str = "closed"):
    seg = load(data, case)
    whole = seg.object("lv", "myo")
    endo = fit_surface(seg.object("lv"))
    boundary = extend_apex(seg, whole, endo=endo) if apex == "closed" else None
    epi = fit_surface(whole, boundary=boundary)
    plane = find_apex(seg) if apex == "clipped" else None
    return seg, build_wall(epi=epi, endo={"lv": endo}, base=find_base(seg), apex=plane)


def faults_of_wall(seg: Segmentation, wall) -> list[str]:
    """What a wall made from labels is not that it has to be."""
    quality = triangle_quality(wall.points, wall.triangles).min()
    volume, wanted = wall.info["volumes_mm3"]["lv"], labelled_volume(seg, wall.planes["base"])
    thickness = wall.info["thickness"]["minimum_mm"]
    base = wall.triangles[wall.facet_tag == FACET_TAGS["base"]]
    off = np.abs(wall.planes["base"].signed_distance(wall.points[base].reshape(-1, 3))).max()
    found = faults(
        (is_manifold(wall.triangles), "no manifold"),
        (quality >= 0.2, f"least quality {quality:.3f}"),
        (volume == pytest.approx(wanted, rel=0.03), f"cavity of {volume:.0f} mm3, {wanted:.0f} mm3 in the labels"),
        (thickness >= 1.0, f"least thickness {thickness:.2f} mm"),
        (off < 1e-9, f"a facet of the base {off:g} mm off its plane"),
    )
    if wall.info["apex"]["extrapolated"]:
        # The epicardium ends about as far beyond the cavity, away from the base, as it was said to, or half a pixel.
        lowest = {}
        for name in ("endo", "epi"):
            nodes = np.unique(wall.triangles[wall.facet_tag == FACET_TAGS[name]])
            lowest[name] = wall.planes["base"].signed_distance(wall.points[nodes]).min()
        made, said = lowest["endo"] - lowest["epi"], wall.info["apex"]["extrapolated_mm"]
        found += faults(
            (made == pytest.approx(said, rel=0.25, abs=0.75), f"apex {made:.1f} mm thick, said to be {said:.1f} mm")
        )
    return found


@pytest.mark.data
@pytest.mark.parametrize("case", slow_but(FEW[:1], FEW))
def test_a_wall_from_labels(data, case):
    assert faults_of_wall(*make(data, case)) == []


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize("case", MANY)
def test_many_walls_from_labels(data, case):
    assert faults_of_wall(*make(data, case)) == []


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize("case", ["007_frame01", "041_frame01"])
def test_walls_clipped_at_the_apex(data, case):
    seg, wall = make(data, case, apex="clipped")
    assert set(wall.planes) == {"base", "apex"}
    assert wall.info["apex"]["mode"] == "clipped"
    assert (wall.facet_tag == FACET_TAGS["apex"]).sum() > 50
    assert triangle_quality(wall.points, wall.triangles).min() >= 0.2
    assert seg.stack_axis == 2
