"""The example of long-axis views: surfaces of an aligned scan lie nearer to the phantom, and the picture is drawn."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parent.parent / "examples" / "08_long_axis.py"


@pytest.mark.slow
def test_aligned_surfaces_lie_within_half_a_millimetre(tmp_path: Path) -> None:
    errors = runpy.run_path(str(EXAMPLE))["run"](2, tmp_path)
    for name, error in errors["aligned"].items():
        assert error < 0.5
        assert error < 0.6 * errors["as scanned"][name]
    assert (tmp_path / "long-axis.png").read_bytes().startswith(b"\x89PNG")
