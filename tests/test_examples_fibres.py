"""The example of fibres gives the angles it asks for and the thickness of the exact heart, and draws both."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parent.parent / "examples" / "04_fibres.py"


@pytest.mark.slow
def test_fibres(tmp_path: Path) -> None:
    image = pytest.importorskip("matplotlib.image", reason="matplotlib is not installed: no bull's eye")
    figures = runpy.run_path(str(EXAMPLE))["main"](edge=6.0, picture=tmp_path / "fibres.png")
    assert figures["empty_segments"] == []
    assert figures["endo_angle_degrees"] == pytest.approx(60.0, abs=2.0)
    assert figures["epi_angle_degrees"] == pytest.approx(-60.0, abs=2.0)
    assert figures["depth_angle_correlation"] < -0.99
    assert figures["angle_error_degrees"] < 3.0
    assert figures["thickness_error_mm"] < 0.4
    thickness = np.array(figures["thickness_mm"])
    # 9 mm in each radius; across the wall, which narrows towards the apex, less.
    assert np.all((thickness > 7.0) & (thickness < 9.5))
    assert thickness[:6].mean() > thickness[12:16].mean()
    pixels = image.imread(tmp_path / "fibres.png")[:, :, :3]
    streamlines = pixels[:, : pixels.shape[1] * 2 // 5]
    red = streamlines[:, :, 0] - streamlines[:, :, 2] > 0.3
    blue = streamlines[:, :, 2] - streamlines[:, :, 0] > 0.3
    assert red.mean() > 0.005  # right-handed inside
    assert blue.mean() > 0.02  # left-handed outside
