from __future__ import annotations

import numpy as np
import pytest
from wall_shapes import Ellipsoid, plane_z, template_surface

import femprep as fp
from femprep.mesh.measures.triangles import edge_lengths, triangle_quality
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import fold_angles
from femprep.model import Surface
from femprep.volume.quality.fidelity import surface_fidelity
from femprep.wall.clipping.clip import clip
from femprep.wall.clipping.improve import improve
from femprep.wall.clipping.mend import mend
from femprep.wall.outlines import Outline


def folded() -> Surface:
    """An ellipsoid a few of whose vertices, far from the rim, are pulled across their neighbours."""
    surface = template_surface(Ellipsoid((25.0, 25.0, 40.0)), 1500)
    points = surface.points.copy()
    near = np.linalg.norm(points - [20.0, 0.0, -25.0], axis=1)
    for vertex in np.argsort(near)[:4]:
        points[vertex] += [0.0, 6.0, 1.0]
    return Surface(points, surface.cells, "lv", directions=surface.directions)


def test_a_fold_is_smoothed_and_reported():
    surface = folded()
    clipped = clip(surface, {"base": plane_z(10.0)})
    assert len(self_intersections(clipped.points, clipped.triangles)) > 0
    middles = surface.points[surface.cells].mean(axis=1)
    poor = middles[triangle_quality(surface.points, surface.cells) < 0.5]
    info = mend(clipped)
    assert len(self_intersections(clipped.points, clipped.triangles)) == 0
    assert triangle_quality(clipped.points, clipped.triangles).min() >= 0.25
    assert fold_angles(clipped.points, clipped.triangles)[1].max() < 110.0
    assert info["surface"] == "lv"
    assert 0.1 < info["farthest_off_the_fit_mm"] < 4.0
    # Far from the fold, and from other triangles of the stretched template that are slid to better ones, nothing moved.
    far = (np.linalg.norm(clipped.points[:, None] - poor, axis=2) > 18.0).all(axis=1)
    far &= np.linalg.norm(clipped.points - [20.0, 0.0, -25.0], axis=1) > 25.0
    inner = far & (clipped.template >= 0) & (clipped.points[:, 2] < -5.0)
    assert inner.sum() > 200
    assert np.abs(clipped.points[inner] - surface.points[clipped.template[inner]]).max() < 1e-9


def test_a_fair_surface_is_left_alone():
    clipped = clip(template_surface(Ellipsoid((25.0, 25.0, 40.0)), 600), {"base": plane_z(10.0)})
    improve(clipped)
    before = clipped.points.copy()
    assert mend(clipped) is None
    assert (clipped.points == before).all()


def test_a_sharp_rim_stays():
    """A lens, as a right ventricle at its end: where vertices slide off its rim, triangles cut it off."""
    clipped = clip(template_surface(Ellipsoid((30.0, 5.0, 40.0)), 800), {"base": plane_z(10.0)})
    before, edge = clipped.points.copy(), float(edge_lengths(clipped.points, clipped.triangles).mean())
    poor = int((triangle_quality(clipped.points, clipped.triangles) < 0.3).sum())
    improve(clipped)
    assert ClosestFinder(clipped.points, clipped.triangles)(before).distance.max() <= 0.12 * edge
    assert (triangle_quality(clipped.points, clipped.triangles) < 0.3).sum() < poor


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize("case", ["patient001_frame12", "patient004_frame15"])
def test_the_tip_of_a_right_ventricle_stays_in_the_wall(data, case):
    """It ends in sharp edges; slid over and smoothed away, it was 2.9 and 4.2 pixels from its outlines."""
    seg = fp.read_segmentation(data / "acdc" / "training" / case[:10] / f"{case}_gt.nii.gz", preset="acdc")
    fitted = fp.fit_surface(seg.object("rv"))
    base = fp.find_common_base(seg)
    clipped = clip(fitted, {"base": base})
    improve(clipped)
    mend(clipped)
    cut = Surface(clipped.points, clipped.triangles, "rv")
    (record,) = surface_fidelity({"rv": cut}, [Outline("rv", seg.object("rv"))], seg.grid, {"base": base}).records
    assert record.greatest_pixels < 2.0
    assert triangle_quality(clipped.points, clipped.triangles).min() > 0.2
