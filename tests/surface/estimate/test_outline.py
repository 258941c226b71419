from __future__ import annotations

from pathlib import Path

import pytest

from femprep.image import read_segmentation
from femprep.mesh.topology import euler_characteristic, volume
from femprep.phantoms import lv_ellipsoid
from femprep.surface.estimate.outline import outlines


@pytest.mark.parametrize("scale", [0.05, 0.2, 1.0])
def test_hearts_of_any_size_have_an_outline(scale: float) -> None:
    """From a mouse's of some microlitres to a man's."""
    axes = [tuple(scale * side for side in sides) for sides in ((22.0, 22.0, 50.0), (32.0, 32.0, 60.0))]
    body = lv_ellipsoid(*axes, 15.0 * scale)  # type: ignore[arg-type]
    obj = body.segmentation(spacing=(1.4 * scale, 1.4 * scale, 8.0 * scale)).object("lv")
    (points, cells), (coarse, triangles) = outlines(obj, 300)
    assert euler_characteristic(cells) == euler_characteristic(triangles) == 2
    assert volume(points, cells) == pytest.approx(obj.volume, rel=0.1)
    assert volume(coarse, triangles) == pytest.approx(obj.volume, rel=0.12)


@pytest.mark.data
@pytest.mark.parametrize("name", ["patient051_frame01", "patient061_frame01"])
def test_an_outline_reaches_the_last_slice_of_a_right_ventricle_that_winds(data: Path, name: str) -> None:
    """There its labels hardly overlap those of the slice before."""
    path = data / "acdc/training" / name.split("_")[0] / f"{name}_gt.nii.gz"
    obj = read_segmentation(path, preset="acdc").object("rv")
    (points, _), _ = outlines(obj, 1000)
    heights = obj.grid.to_index(points + obj.barycentre)[:, obj.stack_axis]
    last = obj.mask.any(axis=tuple(axis for axis in range(3) if axis != obj.stack_axis)).nonzero()[0][[0, -1]]
    assert heights.min() < last[0]
    assert heights.max() > last[1]
