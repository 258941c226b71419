"""The space between walls: voxels within tissue, balls that do not pass, chambers parted where they are narrowest."""

from __future__ import annotations

import numpy as np
import pytest
from anatomy_meshes import ellipsoid
from scipy.ndimage import distance_transform_edt

import femprep as fp
from femprep.annotation.parting import part_cavities
from femprep.annotation.shell import shell_of
from femprep.annotation.space import Space, flood, space_of


def balls(*centres: float, radius: float = 19.0, neck: float = 8.0, step: float = 1.5) -> Space:
    """Hollow balls along x in a block of tissue, with a neck from the first to the last."""
    x, y, z = np.meshgrid(*[np.arange(-size, size, step) for size in (45.0, 24.0, 24.0)], indexing="ij")
    void = np.any([(x - c) ** 2 + y**2 + z**2 < radius**2 for c in centres], axis=0)
    void |= (y**2 + z**2 < neck**2) & (x > min(centres)) & (x < max(centres))
    origin = np.array([-45.0, -24.0, -24.0])
    nothing = np.zeros(void.shape, dtype=bool)
    return Space(origin, step, ~void, distance_transform_edt(void, sampling=step), nothing)


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_voxels_within_a_mesh_have_its_volume(kind: str) -> None:
    mesh = ellipsoid(kind, size=6).mesh
    space = space_of(shell_of(mesh))
    volume = fp.check(mesh).volume
    assert np.count_nonzero(space.tissue) * space.step**3 == pytest.approx(volume, rel=0.02)


def test_two_chambers_are_parted_at_their_neck() -> None:
    space = balls(-20.0, 20.0)
    seeds = part_cavities(space)
    assert seeds.max() == 2
    basin = flood(space, seeds)
    left, right = (int(space.at(basin, np.array([[c, 0.0, 0.0]]))[0]) for c in (-20.0, 20.0))
    assert {left, right} == {1, 2}
    x = space.world(np.argwhere(basin == left))[:, 0]
    assert x.max() < 5.0
    assert np.all(basin[space.tissue] == 0)
    assert np.all(basin[~space.tissue] > 0)


def test_one_chamber_stays_whole() -> None:
    assert part_cavities(balls(0.0)).max() == 1
