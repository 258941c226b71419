"""Rings of valves and veins, and cut ends of vessels, on a tube whose lengths along the surface are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from meshes import wedges_to_tets

from femprep.annotation.cavities import _ends
from femprep.annotation.reading import Name
from femprep.annotation.region_facets import facets_of_regions
from femprep.annotation.shell import Shell, shell_of
from femprep.annotation.vein_ends import vein_rim
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh

INNER, OUTER, LENGTH = 14.0, 18.0, 40.0


def tube(step: float = 1.0) -> VolumeMesh:
    """A tube along z: an atrium above z = 0, a ventricle below."""
    around, along, across = int(2 * np.pi * INNER / step), int(LENGTH / step), 3
    turn = np.arange(around) * 2 * np.pi / around
    height = np.linspace(-LENGTH / 2, LENGTH / 2, along + 1)
    radius = np.linspace(INNER, OUTER, across + 1)
    z, r, t = np.meshgrid(height, radius, turn, indexing="ij")
    points = np.stack([r * np.cos(t), r * np.sin(t), z], axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(z.shape)
    a = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    b = [np.roll(own, -1, axis=2) for own in a]
    wedges = [np.stack([a[0], a[1], a[2], b[0], b[1], b[2]], -1), np.stack([a[0], a[2], a[3], b[0], b[2], b[3]], -1)]
    tets = wedges_to_tets(np.concatenate([own.reshape(-1, 6) for own in wedges]))
    p = points[tets]
    negative = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0]) < 0
    tets[negative] = tets[negative][:, [1, 0, 2, 3]]
    middle = points[tets].mean(axis=1)
    return VolumeMesh(points, {"tetra": tets}, np.where(middle[:, 2] > 0, REGION_TAGS["la"], REGION_TAGS["lv"]))


@pytest.fixture(scope="module")
def shell() -> Shell:
    return shell_of(tube())


def within(shell: Shell) -> np.ndarray:
    return np.asarray(np.hypot(*shell.centre.T[:2]) < INNER + 0.5)


def test_the_way_along_a_surface_is_that_on_the_unrolled_one(shell: Shell) -> None:
    start = int(np.argmin(np.linalg.norm(shell.centre - [INNER, 0.0, 0.0], axis=1)))
    way = shell.along(np.array([start]), 12.0)
    turn = np.arctan2(shell.centre[:, 1], shell.centre[:, 0]) * INNER
    flat = np.hypot(turn, shell.centre[:, 2])
    reached = np.isfinite(way)
    assert within(shell)[reached].all()
    # Never shorter than straight, but for the curve and the start within a facet; longer by a tenth at most.
    assert (way[reached] > 0.98 * flat[reached] - 0.5).all()
    assert (way[reached] < 1.1 * flat[reached] + 0.5).all()
    assert reached[within(shell) & (flat < 10.0)].all()
    chosen = within(shell) & (shell.centre[:, 2] < 5.0)
    assert np.isinf(shell.along(np.array([start]), 12.0, chosen)[shell.centre[:, 2] > 5.0]).all()
    assert np.isinf(shell.along(np.empty(0, dtype=np.int64), 12.0)).all()


def test_the_ring_of_a_valve_lies_where_atrium_and_ventricle_meet() -> None:
    mesh = tube()
    shell = shell_of(mesh)
    inside, z = within(shell), shell.centre[:, 2]
    # Found 8 mm too low by the space between the walls, as where a cavity narrows elsewhere.
    tag = np.where(inside, np.where(z > -8.0, FACET_TAGS["endo_la"], FACET_TAGS["endo_lv"]), FACET_TAGS["epi"])
    tag[inside & (np.abs(z + 8.0) < 2.0)] = FACET_TAGS["mitral"]
    mesh = replace(mesh, facets=shell.facets, facet_tag=tag.astype(np.int32))
    told = Name(1.0, "most of the file's region 3 lie there")
    found = facets_of_regions(mesh, shell, {"lv": told, "la": told}).facet_tag
    ring = found == FACET_TAGS["mitral"]
    assert inside[ring].all()
    assert np.abs(z[ring]).max() < 3.0
    assert ring[inside & (np.abs(z) < 1.5)].all()
    width = shell.area[ring].sum() / (2 * np.pi * INNER)
    assert width == pytest.approx(2 * 2.0, abs=1.0)
    assert (found[inside & ~ring & (z < -3.0)] == FACET_TAGS["endo_lv"])[z[inside & ~ring & (z < -3.0)] < -8.0].all()
    untouched = facets_of_regions(mesh, shell, {"lv": Name(1.0, "between the surfaces that are nearest"), "la": told})
    np.testing.assert_array_equal(untouched.facet_tag, tag)


def test_the_bare_end_of_a_vessel_is_the_vessels(shell: Shell) -> None:
    z, inside = shell.centre[:, 2], within(shell)
    tag = np.where(inside & (z < 0), FACET_TAGS["endo_lv"], FACET_TAGS["epi"]).astype(np.int32)
    tag[(z > 0) & (z < 10.0)] = FACET_TAGS["aorta_wall"]
    bare = z > 8.0
    _ends(shell, tag, bare, [FACET_TAGS["aorta_wall"]])
    np.testing.assert_array_equal(tag == FACET_TAGS["aorta_wall"], z > 0)
    alone = np.full(len(shell), FACET_TAGS["epi"], dtype=np.int32)
    _ends(shell, alone, bare, [FACET_TAGS["aorta_wall"]])
    assert (alone == FACET_TAGS["epi"]).all()


def rim_of(points: np.ndarray | None = None) -> tuple[Shell, np.ndarray, np.ndarray]:
    """The tube, its points moved; facets within it, and those of the rim at its upper end."""
    mesh = tube()
    still = shell_of(mesh)
    shell = still if points is None else shell_of(replace(mesh, points=points))
    inside = within(still) & (np.abs(still.normal[:, 2]) < 0.5)
    apart = still.pairs[(inside[still.pairs].sum(axis=1) == 1) & (still.centre[still.pairs][..., 2] > 0).all(axis=1)]
    return shell, inside, vein_rim(shell, inside, apart.ravel(), np.array([0.0, 0.0, 1.0]))


def test_the_rim_of_a_vein_cut_flat_lies_along_the_plane_of_the_cut() -> None:
    shell, inside, rim = rim_of()
    below = LENGTH / 2 - shell.centre[:, 2]
    np.testing.assert_array_equal(rim, below < np.where(inside, 3.0, 1.25))


def test_the_rim_of_a_vein_cut_crooked_lies_along_the_crest() -> None:
    points = tube().points
    turn = np.arctan2(points[:, 1], points[:, 0])
    bent = points + np.where(points[:, 2] > 0, 2.0 * np.cos(2 * turn), 0.0)[:, None] * [0.0, 0.0, 1.0]
    shell, inside, rim = rim_of(bent)
    turn = np.arctan2(shell.centre[:, 1], shell.centre[:, 0])
    below = LENGTH / 2 + 2.0 * np.cos(2 * turn) - shell.centre[:, 2]
    # The crest may run along the inner or the outer edge of the cut, which is wider than the rim.
    assert rim[inside & (below < 1.5)].all()
    assert not rim[below > 4.0].any()
    assert below[rim & inside].max() > 2.0


def test_the_rim_of_a_valve_of_a_vessel_is_flat() -> None:
    mesh = tube()
    shell = shell_of(mesh)
    inside, z = within(shell), shell.centre[:, 2]
    mesh = replace(mesh, region=np.where(mesh.region == REGION_TAGS["la"], REGION_TAGS["aorta"], REGION_TAGS["lv"]))
    tag = np.where(inside, FACET_TAGS["endo_lv"], FACET_TAGS["epi"])
    tag[inside & (z < -5.0) & (z > -9.0)] = FACET_TAGS["aortic"]
    mesh = replace(mesh, facets=shell.facets, facet_tag=tag.astype(np.int32))
    found = facets_of_regions(mesh, shell, {"aorta": Name(1.0, "most of the file's region 3 lie there")}).facet_tag
    vessel = (mesh.region == REGION_TAGS["aorta"])[shell.element]
    assert (found[vessel] == FACET_TAGS["aorta_wall"]).all()
    np.testing.assert_array_equal(found == FACET_TAGS["aortic"], inside & ~vessel & (z > -2.0))
