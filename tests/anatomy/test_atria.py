"""Fibres of atria on a barrel whose rings and symmetries tell them exactly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from anatomy_meshes import _tagged

import femprep as fp
from femprep.anatomy.atria import BUNDLES
from femprep.anatomy.veins import name_veins
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh
from femprep.phantoms import four_chambers

INNER, OUTER, STRETCH = 20.0, 22.5, 1.3
SIDES = {"left_pulmonary": [(10.0, 0.0, 30.0)], "right_pulmonary": [(-10.0, 0.0, 30.0)]}


def barrel(around: int = 32, along: int = 24, across: int = 2) -> VolumeMesh:
    """An ellipsoidal shell along z, cut at both ends: below by the mitral ring, above by veins."""
    turn = np.arange(around) * 2 * np.pi / around
    polar = np.linspace(0.35, np.pi - 0.6, along + 1)
    r, p, t = np.meshgrid(np.linspace(INNER, OUTER, across + 1), polar, turn, indexing="ij")
    points = np.stack([r * np.sin(p) * np.cos(t), r * np.sin(p) * np.sin(t), STRETCH * r * np.cos(p)], -1)
    number = np.arange(r.size).reshape(r.shape)
    beside = np.roll(number, -1, axis=2)
    low = [own[:-1, i, :] for i in (slice(1, None), slice(None, -1)) for own in (number, beside)]
    high = [own[1:, i, :] for i in (slice(1, None), slice(None, -1)) for own in (number, beside)]
    order = [low[0], low[1], low[3], low[2], high[0], high[1], high[3], high[2]]
    hexes = np.stack(order, axis=-1).reshape(-1, 8)
    layer, height, _ = np.unravel_index(np.arange(r.size), r.shape)

    def tag(nodes: np.ndarray) -> np.ndarray:
        every = [
            (own[nodes] == end).all(axis=1) for own, end in ((layer, 0), (layer, across), (height, along), (height, 0))
        ]
        return np.select(every, [FACET_TAGS[name] for name in ("endo_la", "epi", "mitral", "veins")])

    mesh = _tagged(points.reshape(-1, 3), {"hexahedron": hexes}, tag_by_nodes=tag)
    return replace(mesh, region=np.full(mesh.n_cells, REGION_TAGS["la"]))


@pytest.fixture(scope="module")
def found() -> VolumeMesh:
    return fp.add_atrial_fibres(barrel(), SIDES)


def shape(mesh: VolumeMesh) -> tuple[int, ...]:
    return 2, 24, 32


def test_fibres_are_unit_along_the_wall_in_every_element(found: VolumeMesh) -> None:
    triad = np.stack([found.cell_data[name] for name in ("fiber", "sheet", "normal")], axis=2)
    np.testing.assert_allclose(
        np.einsum("nij,nik->njk", triad, triad), np.tile(np.eye(3), (len(triad), 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(triad), 1.0, atol=1e-12)
    # Round the middle of the wall its normal is that of the ellipsoid.
    centre = found.points[found.cells["hexahedron"]].mean(axis=1)
    normal = centre / [1.0, 1.0, STRETCH**2]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    middle = np.abs(centre[:, 2]) < 12.0
    lean = np.degrees(np.arcsin(np.abs(np.einsum("ij,ij->i", found.cell_data["fiber"], normal))))
    assert lean[middle].max() < 1.0
    assert lean.max() < 8.0


def test_fibres_near_the_valve_run_round_it(found: VolumeMesh) -> None:
    own = found.cell_data["atrial_bundle"] == BUNDLES["la"][0]
    centre = found.points[found.cells["hexahedron"]].mean(axis=1)
    rows = own.reshape(shape(found)).any(axis=(0, 2))
    assert (own.reshape(shape(found)) == rows[:, None]).all()
    assert rows[-1]
    round_ = np.column_stack([-centre[:, 1], centre[:, 0], np.zeros(len(centre))])
    round_ /= np.linalg.norm(round_, axis=1)[:, None]
    cosine = np.abs(np.einsum("ij,ij->i", found.cell_data["fiber"], round_))[own]
    np.testing.assert_allclose(cosine, 1.0, atol=1e-9)


def test_the_mirror_image_of_veins_on_both_sides_has_the_mirrored_fibres(found: VolumeMesh) -> None:
    grid = found.cell_data["fiber"].reshape(*shape(found), 3)
    bundle = found.cell_data["atrial_bundle"].reshape(shape(found))
    # An element at angle t has its mirror image at -t across the plane of both kinds of veins.
    mirror = grid[:, :, ::-1] * [1.0, -1.0, 1.0]
    np.testing.assert_array_equal(bundle, bundle[:, :, ::-1])
    np.testing.assert_allclose(np.abs(np.einsum("...i,...i", grid, mirror)), 1.0, atol=1e-6)


def test_fibres_turn_gently_within_a_bundle(found: VolumeMesh) -> None:
    grid = found.cell_data["fiber"].reshape(*shape(found), 3)
    bundle = found.cell_data["atrial_bundle"].reshape(shape(found))
    across = np.abs(np.einsum("...i,...i", grid[1:], grid[:-1]))[bundle[1:] == bundle[:-1]]
    assert np.degrees(np.arccos(across.min().clip(0, 1))) < 8.0
    assert set(np.unique(bundle)) == set(BUNDLES["la"])


def test_where_the_wall_is_of_one_thickness_it_is_told(found: VolumeMesh) -> None:
    thickness = found.info["atria"]["thickness_mm"]["la"]
    assert OUTER - INNER <= thickness["median"] <= STRETCH * (OUTER - INNER)


def test_veins_that_are_not_told_apart_are_asked_for() -> None:
    with pytest.raises(
        fp.InputError, match=r"need left_pulmonary.*fibres.veins = \{ left_pulmonary = \[\[x, y, z\]\] \}"
    ):
        fp.add_atrial_fibres(barrel())
    with pytest.raises(fp.InputError, match="right_pulmonary"):
        fp.add_atrial_fibres(barrel(), {"left_pulmonary": [(10.0, 0.0, 30.0)]})
    with pytest.raises(fp.InputError, match="no atrium"):
        fp.add_atrial_fibres(replace(barrel(), region=np.ones(barrel().n_cells)))


def test_options_that_cannot_give_fibres_of_atria_are_refused() -> None:
    seg = four_chambers().segmentation(spacing=(6.0, 6.0, 6.0))
    atria = {"atria": "piersanti"}
    with pytest.raises(fp.OptionError, match="those of anatomy whole-heart, not biv"):
        fp.mesh_segmentation(seg, anatomy="biv", fibres=atria)
    with pytest.raises(fp.OptionError, match="openings = labels"):
        fp.mesh_segmentation(seg, anatomy="whole-heart", fibres=atria)
    with pytest.raises(fp.OptionError, match="nodes = false"):
        fp.mesh_segmentation(seg, anatomy="whole-heart", fibres={**atria, "nodes": True})


def test_veins_are_named_by_where_they_lie() -> None:
    """Six flat triangles stand for rims: right ones towards the right atrium, the appendage towards its ventricle."""
    at = {
        "endo_la": (0, 0, 0), "endo_ra": (60, 0, 0), "endo_rv": (40, -60, -60),
        "right_pulmonary": (20, 20, 20), "left_pulmonary": (-20, 20, 20), "left_appendage": (-20, -20, 20),
        "superior_cava": (45, 15, 25), "inferior_cava": (55, 0, -25),
    }  # fmt: skip
    rims = [("left_pulmonary", (0, 0, -25)), *((name, (0, 0, 0)) for name in at)]
    corner = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    points = np.concatenate([np.add(at[name], off) + corner for name, off in rims])
    tag = [FACET_TAGS.get(name, FACET_TAGS["veins"]) for name, _ in rims]
    top = len(points)
    cells = np.column_stack([np.arange(top).reshape(-1, 3), np.full(len(rims), top)])
    mesh = VolumeMesh(np.vstack([points, [[0.0, 0.0, 500.0]]]), {"tetra": cells}, np.ones(len(cells)),
                      {"triangle": cells[:, :3]}, np.array(tag))  # fmt: skip
    found = name_veins(mesh, ["la", "ra"], {})
    for k, (name, _) in enumerate(rims):
        if not name.startswith("endo"):
            assert set(cells[k, :3]) <= set(found[name])
    assert sum(len(own) for own in found.values()) == 3 * 6
