"""One coarse wall and its mesh, shared by the tests of this folder: fTetWild takes seconds."""

from __future__ import annotations

import pytest
from analytic_walls import ellipsoid_wall

from femprep.model import VolumeMesh, Wall
from femprep.volume import tetrahedralize


@pytest.fixture(scope="session")
def coarse_wall() -> Wall:
    return ellipsoid_wall(rings=10, layers=2)


@pytest.fixture(scope="session")
def coarse_mesh(coarse_wall: Wall) -> VolumeMesh:
    return tetrahedralize(coarse_wall, edge_length=6.0, mean_ratio=0.82, retries=0)
