"""Parts of a mesh whose nodes were not merged: joined where they coincide, refused where they only touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from anatomy_meshes import ellipsoid

import femprep as fp
from femprep.annotation.parts import with_parts_joined
from femprep.annotation.shell import shell_of
from femprep.model import VolumeMesh


def in_two(mesh: VolumeMesh) -> tuple[VolumeMesh, VolumeMesh]:
    """The elements on either side of the plane x = 0, each part with points of its own."""
    cells = mesh.cells["tetra"]
    side = mesh.points[cells].mean(axis=1)[:, 0] > 0.0
    halves = []
    for chosen in (side, ~side):
        used, own = np.unique(cells[chosen], return_inverse=True)
        halves.append(VolumeMesh(mesh.points[used], {"tetra": own.reshape(-1, 4)}, np.ones(chosen.sum())))
    return halves[0], halves[1]


def together(one: VolumeMesh, other: VolumeMesh) -> VolumeMesh:
    cells = np.concatenate([one.cells["tetra"], other.cells["tetra"] + len(one.points)])
    return VolumeMesh(np.concatenate([one.points, other.points]), {"tetra": cells}, np.ones(len(cells)))


def test_parts_with_nodes_of_their_own_are_joined_and_named_as_one() -> None:
    whole = ellipsoid("tetra").mesh
    parts = together(*in_two(whole))
    assert len(parts.points) > len(whole.points)
    found = fp.annotate(parts, fibres=None)
    assert len(found.mesh.points) == len(whole.points)
    assert any("joined" in one["what"] for one in found.mesh.info["notices"])
    truth = fp.annotate(replace(whole, facets={}, facet_tag=[], facet_data={}), fibres=None)
    areas = [found.quality.facet_tags["endo"].area, truth.quality.facet_tags["endo"].area]
    assert areas[0] == pytest.approx(areas[1])


def test_a_mesh_without_coincident_nodes_stays_as_it_is() -> None:
    whole = ellipsoid("tetra").mesh
    assert with_parts_joined(whole, shell_of(whole)) is whole


def test_parts_that_touch_without_common_nodes_are_refused() -> None:
    one, other = in_two(ellipsoid("tetra").mesh)
    fine = fp.refine(one, levels=1, optimised=False)
    bare = VolumeMesh(fine.points, fine.cells, np.ones(fine.n_cells))
    with pytest.raises(fp.InputError, match="without common nodes"):
        fp.annotate(together(bare, other), fibres=None)
