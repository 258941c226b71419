"""The example of the main job gives the figures it is meant to show."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parent.parent / "examples" / "02_left_ventricle.py"


@pytest.mark.slow
def test_left_ventricle(tmp_path: Path) -> None:
    picture = tmp_path / "pictures" / "lv.png"
    figures = runpy.run_path(str(EXAMPLE))["main"](edge=5.0, picture=picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert [path.name for path in picture.parent.iterdir()] == ["lv.png"]
    assert figures["cavity_ml"] == pytest.approx(figures["exact_cavity_ml"], rel=0.03)
    assert figures["wall_ml"] == pytest.approx(figures["exact_wall_ml"], rel=0.06)
    assert figures["smallest_dihedral"] >= 10.0
    assert figures["mean_ratio"] >= 0.82
    assert figures["depth_angle_correlation"]["lv"] < -0.95
