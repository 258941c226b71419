"""The example of passive inflation: two solvers, two decks, one displacement, and reactions that balance."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from solver_tools import require_program, require_system_module

import femprep as fp
from femprep.phantoms import lv_ellipsoid

EXAMPLE = Path(__file__).parent.parent / "examples" / "03_passive_inflation.py"

pytestmark = pytest.mark.solver


@pytest.fixture(scope="module")
def main() -> Callable[..., dict[str, Any]]:
    require_program("ccx")
    require_system_module("dolfinx")
    found: Callable[..., dict[str, Any]] = runpy.run_path(str(EXAMPLE))["main"]
    return found


@pytest.mark.slow
def test_linear_inflation_of_the_phantom(main: Callable[..., dict[str, Any]], tmp_path: Path) -> None:
    figures = main(edge=6.0, out=tmp_path / "decks", picture=tmp_path / "inflation.png")
    # CalculiX prints seven digits.
    assert figures["calculix_greatest_mm"] == pytest.approx(figures["dolfinx_greatest_mm"], rel=1e-6)
    assert figures["greatest_difference_mm"] <= 1e-6
    assert figures["calculix_reaction_misfit"] <= 1e-6
    assert figures["dolfinx_reaction_misfit"] <= 1e-10
    assert 1.5 < figures["calculix_greatest_mm"] < 3.5
    # The cavity below the base plane in closed form; the fit of 8 mm slices and the chords of the elements take some.
    phantom = lv_ellipsoid()
    base = fp.find_base(phantom.segmentation(spacing=(1.4, 1.4, 8.0)))
    exact = phantom.volume("lv", high=float(phantom.height(base.point[None])[0])) / 1000.0
    assert figures["cavity_ml"] == pytest.approx(exact, rel=0.05)
    assert 1.08 < figures["calculix_cavity_ml"] / figures["cavity_ml"] < 1.3
    image = _pixels(tmp_path / "inflation.png")
    assert image.shape[:2] == (600, 1200)
    for half in (image[:, :600], image[:, 600:]):
        coloured = np.ptp(half.astype(int), axis=2) > 40
        assert 0.05 < coloured.mean() < 0.8


@pytest.mark.slow
def test_large_deformations(main: Callable[..., dict[str, Any]]) -> None:
    figures = main(edge=6.0, material="neo-hookean")
    assert figures["dolfinx_reaction_misfit"] <= 1e-8
    # CalculiX takes the pressure on the wall as it was one iteration before.
    assert figures["calculix_reaction_misfit"] <= 1e-4
    assert figures["greatest_difference_mm"] <= 1e-3 * figures["dolfinx_greatest_mm"]


@pytest.mark.data
@pytest.mark.slow
def test_a_real_left_ventricle(main: Callable[..., dict[str, Any]], data: Path) -> None:
    path = data / "acdc" / "training" / "patient007" / "patient007_frame01_gt.nii.gz"
    if not path.is_file():
        pytest.skip("the ACDC maps are not there")
    figures = main(fp.read_segmentation(path, preset="acdc"), edge=5.0)
    assert figures["calculix_greatest_mm"] == pytest.approx(figures["dolfinx_greatest_mm"], rel=1e-6)
    assert figures["calculix_reaction_misfit"] <= 1e-6
    assert figures["calculix_cavity_ml"] > 1.05 * figures["cavity_ml"]


def _pixels(path: Path) -> np.ndarray:
    from matplotlib.image import imread

    return np.rint(255 * imread(path)[:, :, :3]).astype(np.uint8)
