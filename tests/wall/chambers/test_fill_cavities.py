"""The blood in the cavities of walls: closed, of the cavity's volume, capped in the wall's planes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from wall_shapes import cap_volume, ellipsoids, plane_z

from femprep.errors import InputError
from femprep.mesh.topology import edge_table, euler_characteristic, volume
from femprep.model import FACET_TAGS, Plane
from femprep.wall import build_wall, fill_cavities

INNER, OUTER = (25.0, 25.0, 45.0), (33.0, 33.0, 53.0)


@pytest.mark.parametrize("apex", [None, Plane((0.0, 0.0, -30.0), (0.0, 0.0, -1.0))], ids=["closed", "clipped"])
def test_wall_and_blood_fill_the_epicardium(apex):
    epi, endo = ellipsoids(vertices=600)
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0), apex=apex)
    blood = fill_cavities(wall)
    assert list(blood.cavities) == ["lv"]
    for cells in (blood.outer, blood.cavities["lv"]):
        table = edge_table(cells)
        assert set(table.count) == {2}
        assert set(table.forward) == {1}
        assert euler_characteristic(cells) == 2
    cavity = volume(blood.points, blood.cavities["lv"])
    assert wall.volume + cavity == pytest.approx(volume(blood.points, blood.outer), rel=1e-12)
    assert cavity == pytest.approx(wall.info["volumes_mm3"]["lv"], rel=1e-9)
    np.testing.assert_array_equal(blood.points[: len(wall.points)], wall.points)
    if apex is None:
        assert cavity == pytest.approx(cap_volume(INNER, 12.0), rel=0.02)
        assert blood.caps == {"cap_lv": wall.planes["base"]}
    else:  # two caps of one cavity lie in no one plane
        assert blood.caps == {}
    for name, plane in wall.planes.items():
        flat = blood.points[blood.outer[blood.outer_tag == FACET_TAGS[name]]].reshape(-1, 3)
        assert np.abs(plane.signed_distance(flat)).max() <= 1e-9


def test_a_closed_cavity_needs_no_cap():
    epi, endo = ellipsoids(vertices=300)
    wall = build_wall(epi=epi, endo={"lv": endo}, base=None)
    blood = fill_cavities(wall)
    assert len(blood.points) == len(wall.points)
    assert volume(blood.points, blood.cavities["lv"]) == pytest.approx(endo.volume, rel=1e-12)


def test_an_opening_in_no_plane_is_refused():
    epi, endo = ellipsoids(vertices=300)
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0))
    with pytest.raises(InputError, match=r"the opening of cavity 'lv' near .* lies in no plane of the wall"):
        fill_cavities(replace(wall, planes={"base": plane_z(13.0)}))


def test_a_wall_without_endocardium_is_refused():
    epi, endo = ellipsoids(vertices=300)
    wall = build_wall(epi=epi, endo={"lv": endo}, base=None)
    with pytest.raises(InputError, match="no facets tagged endo"):
        fill_cavities(replace(wall, facet_tag=np.full(len(wall.triangles), FACET_TAGS["epi"])))
