"""Every damage of a surface, and one upon another, leaves what can be written as a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fuzz.surface_cases import write
from fuzz.surface_damage import SURFACES, Shape
from own_shapes import heart


@pytest.fixture(scope="module")
def shape() -> Shape:
    wall = heart(200)["lv"]
    return Shape(np.array(wall.points), np.array(wall.triangles))


@pytest.mark.parametrize("first", SURFACES)
def test_damages_upon_one_another_can_be_written(first: str, shape: Shape, tmp_path: Path) -> None:
    random = np.random.default_rng(4)
    for second in SURFACES:
        for ending in (".stl", ".vtp"):
            path = tmp_path / f"{second}{ending}"
            write(SURFACES[second](random, SURFACES[first](random, shape)), path)
            assert path.stat().st_size > 80


def test_a_factor_beyond_every_heart_is_among_them(shape: Shape) -> None:
    random = np.random.default_rng(0)
    largest = [float(np.abs(SURFACES["scaled"](random, shape).points).max()) for _ in range(40)]
    assert max(largest) > 1e30
