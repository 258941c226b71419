"""Cavities closed by fans, and which of them are open: closed, wound, with the volume of flat caps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.topology import is_closed, is_consistently_wound
from femprep.wall import open_cavities


@pytest.mark.parametrize("kind", list(ELEMENTS))
def test_a_fan_closes_it_with_the_same_volume(kind: str) -> None:
    mesh = truncated_ellipsoid(kind)
    flat, fans = fp.cavity_surface(mesh), fp.cavity_surface(mesh, centre=True)
    for surface in (flat, fans):
        assert is_closed(surface.triangles)
        assert is_consistently_wound(surface.triangles)
    # Rims that lie in a plane: the caps are the same plane figures.
    assert fans.volume == pytest.approx(flat.volume, rel=1e-12)
    assert flat.volume > 0
    numbers = np.asarray(fans.point_data["GlobalNodeID"])
    middles = numbers == 0
    assert middles.sum() == 2  # base and the cut apex
    np.testing.assert_array_equal(fans.points[~middles], mesh.points[numbers[~middles] - 1])
    assert fans.info["cap_triangles"] == 24
    # Every triangle of the fans has a middle, none of the endocardium has.
    own = middles[fans.triangles].sum(axis=1)
    assert own[-24:].tolist() == [1] * 24
    assert own[:-24].max() == 0


def test_open_cavities() -> None:
    mesh = truncated_ellipsoid("tetra")
    assert open_cavities(mesh) == ["lv"]
    assert open_cavities(replace(mesh, facet_tag=np.where(mesh.facet_tag == 101, 112, mesh.facet_tag))) == ["rv"]
    closed = replace(mesh, facet_tag=np.full(mesh.n_facets, 101))  # all of the boundary: no rim
    assert open_cavities(closed) == []
    assert open_cavities(replace(mesh, facet_tag=np.full(mesh.n_facets, 102))) == []


def test_a_rim_that_touches_itself_is_refused() -> None:
    mesh = truncated_ellipsoid("tetra")
    own = np.flatnonzero(mesh.facet_tag == 101)
    nodes = np.concatenate(list(mesh.facets.values()))
    # Two holes in the endocardium with a node in common and no edge.
    first = own[len(own) // 2]
    shared = [len(np.intersect1d(nodes[first], nodes[other])) for other in own]
    tag = np.array(mesh.facet_tag)
    tag[[first, own[shared.index(1)]]] = 102
    torn = replace(mesh, facet_tag=tag)
    assert open_cavities(torn) == []
    for centre in (False, True):
        with pytest.raises(fp.InputError, match="touches itself at a node"):
            fp.cavity_surface(torn, centre=centre)
