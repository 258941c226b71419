"""The example of the anatomies gives the figures it is meant to show, and draws its pictures."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parent.parent / "examples" / "06_anatomies.py"


@pytest.mark.slow
def test_ventricles_with_their_blood(tmp_path) -> None:
    example = runpy.run_path(str(EXAMPLE))
    found = example["main"](edge=4.5, only=("lv",), vertices=700, pictures=tmp_path)["lv"]
    assert found["failures"] == "none"
    assert found["blood_lv_ml"] == pytest.approx(found["exact_blood_lv_ml"], rel=0.03)
    assert found["interface_facets"] > 500
    picture = tmp_path / "anatomy-lv.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert 20_000 < picture.stat().st_size < 200_000
