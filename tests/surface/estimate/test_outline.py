from __future__ import annotations

import pytest

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
