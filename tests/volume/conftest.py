"""One coarse wall and a mesh of it, shared by the tests of this folder."""

from __future__ import annotations

from pathlib import Path

import pytest
from analytic_walls import ellipsoid_wall

import femprep as fp
from femprep.model import VolumeMesh, Wall
from femprep.volume import tetrahedralize

#: What both meshes below were asked for.
ASKED = {"edge_length": 6.0, "mean_ratio": 0.82, "retries": 0}


@pytest.fixture(scope="session")
def coarse_wall() -> Wall:
    return ellipsoid_wall(rings=10, layers=2)


@pytest.fixture(scope="session")
def coarse_mesh() -> VolumeMesh:
    """What fTetWild once gave of it, which gives another one each time."""
    return fp.read_mesh(Path(__file__).with_name("coarse.vtu"))


@pytest.fixture(scope="session")
def fresh_mesh(coarse_wall: Wall) -> VolumeMesh:
    """What fTetWild gives now."""
    return tetrahedralize(coarse_wall, **ASKED)
