"""Fields from mesh to mesh by ventricular coordinates: exact on the mesh itself, turned with the wall; back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from second_images import AXES, ventricle

import femprep as fp
from femprep.errors import InputError


def angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.degrees(np.arccos(np.clip(np.abs(np.sum(a * b, axis=1)), 0.0, 1.0)))


def test_a_mesh_gives_itself_its_own_values_back() -> None:
    mesh = ventricle()
    mesh = mesh.with_data(point={"load": mesh.points[:, 2] ** 2})
    names = ["fiber", "sheet", "aha", "load", "region", "transmural"]
    found = fp.transfer(mesh, mesh, names)
    for name in ("fiber", "sheet", "aha", "transmural"):
        np.testing.assert_array_equal(found.cell_data[name], mesh.cell_data[name])
    for name in ("load", "transmural"):
        np.testing.assert_array_equal(found.point_data[name], mesh.point_data[name])
    np.testing.assert_array_equal(found.region, mesh.region)
    record = found.info["transfer"]
    assert record["place_back_largest_mm"] == 0.0
    assert [one["name"] for one in record["fields"]] == [
        "fiber",
        "sheet",
        "aha",
        "region",
        "transmural",
        "load",
        "transmural",
    ]
    assert {one["back_mean"] for one in record["fields"]} == {0.0}
    assert fp.transfer(mesh, mesh, "aha", there_and_back=False).info["transfer"]["fields"][0]["back_mean"] is None


def test_a_mesh_moved_by_nothing_finds_its_places_by_coordinates() -> None:
    mesh = ventricle()
    # The same places under other numbers: no short cut, the coordinates have to find them.
    turned = replace(mesh, cells={"tetra": mesh.cells["tetra"][:, [1, 2, 0, 3]]}, info={})
    found = fp.transfer(mesh, turned, ["fiber", "aha"], there_and_back=False)
    # Along the apex' line the height is 0: elements with an edge on it meet others that are flat in the coordinates,
    # which may be the ones found.
    apical = (mesh.point_data["apicobasal"][mesh.cells["tetra"]] == 0.0).sum(axis=1) >= 2
    np.testing.assert_array_equal(found.cell_data["aha"], mesh.cell_data["aha"])
    assert angles(found.cell_data["fiber"], mesh.cell_data["fiber"])[~apical].max() < 0.1
    assert apical.mean() < 0.02


@pytest.mark.slow
def test_there_and_back_between_unlike_meshes_is_below_an_element() -> None:
    fine, coarse = ventricle(size=6), ventricle("hexahedron", 3, 3)
    found = fp.transfer(fine, coarse, ["transmural", "aha", "fiber"])
    record = found.info["transfer"]
    # No place comes back an element off; nearly all stay nearer to their own element than to the next one.
    assert record["place_back_largest_mm"] < record["source_edge_mm"]
    assert record["place_back_95_mm"] < 0.5 * record["source_edge_mm"]
    told = {(one["name"], one["on"]): one for one in record["fields"]}
    # The depth is itself a coordinate, linear in both meshes; of elements it is off by half a layer of the coarse one.
    assert told["transmural", "points"]["back_mean"] < 1e-3
    assert told["transmural", "elements"]["back_largest"] < 0.5 / 3
    assert told["aha", "elements"]["unit"] == "%"
    # By way of the smaller elements less than one of the coarse mesh comes back in another segment.
    around = fp.transfer(coarse, fine, "aha").info["transfer"]
    assert around["fields"][0]["back_mean"] < 100.0 / coarse.n_cells
    # At the apex, where the coordinates have no angle, a place comes back anywhere in its own element by rounding, that
    # differs with the processor: half a cube's diagonal at most. Elsewhere it is a tenth of an edge off.
    assert around["place_back_largest_mm"] < 0.5 * np.sqrt(3.0) * around["source_edge_mm"]
    assert around["place_back_95_mm"] < 0.1 * around["source_edge_mm"]


def test_on_an_unlike_mesh_segments_are_off_by_no_element_and_fibres_by_no_layer() -> None:
    fine, coarse = ventricle(size=6), ventricle("hexahedron", 3, 3)
    found = fp.transfer(fine, coarse, ["aha", "fiber"], there_and_back=False)
    block, own, new = coarse.cells["hexahedron"], coarse.cell_data["aha"], found.cell_data["aha"]
    # Centres of elements lie on the very border of segments, to either side by rounding: a neighbour's segment will do.
    around = [set(own[np.isin(block, nodes).any(axis=1)]) for nodes in block]
    assert all(tag in tags for tag, tags in zip(new, around))
    inner = np.array([len(tags) == 1 for tags in around])
    assert inner.sum() > 20
    np.testing.assert_array_equal(new[inner], own[inner])
    # By the rule fibres turn by 120 degrees through the wall: by 15 in half a layer of the fine mesh, 20 of the coarse.
    # The coarse mesh's own fibres are those of its elements' axes, which at the apex are a quarter turn wide.
    off = angles(found.cell_data["fiber"], coarse.cell_data["fiber"])
    assert np.median(off) < 7.5
    height = coarse.point_data["apicobasal"][block].mean(axis=1)
    assert np.percentile(off[height > 0.3], 95) < 20.0


def test_directions_and_vectors_turn_with_the_heart() -> None:
    mesh = ventricle(size=3, layers=3)
    a = np.radians(70.0)
    turn = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]]) @ np.array(
        [[1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [0.0, 0.8, 0.6]]
    )
    source = mesh.with_data(
        cell={"push": 3.0 * mesh.cell_data["fiber"]}, point={"way": np.tile([0.0, 0.0, 1.0], (len(mesh.points), 1))}
    )
    other = replace(mesh, points=1.2 * mesh.points @ turn.T + [5.0, 6.0, 7.0], cell_data={}, info={})
    found = fp.transfer(source, other, ["fiber", "push", "way"], there_and_back=False)
    assert np.mean(angles(found.cell_data["fiber"], mesh.cell_data["fiber"] @ turn.T) < 0.1) > 0.99
    push = np.linalg.norm(found.cell_data["push"] - source.cell_data["push"] @ turn.T, axis=1)
    assert np.mean(push < 0.01) > 0.99
    assert np.median(angles(found.point_data["way"], source.point_data["way"] @ turn.T)) < 0.1
    assert found.info["transfer"]["fields"][0]["back_mean"] is None


def test_fibres_sheets_and_normals_stay_at_right_angles() -> None:
    source = ventricle(size=3, layers=3)
    found = fp.transfer(source, ventricle(size=4, layers=2), ["fiber", "sheet", "normal"], there_and_back=False)
    frame = np.stack([found.cell_data[name] for name in ("fiber", "sheet", "normal")], axis=1)
    np.testing.assert_allclose(
        np.einsum("nij,nkj->nik", frame, frame), np.tile(np.eye(3), (len(frame), 1, 1)), atol=1e-6
    )


def test_a_mirrored_heart_gets_mirrored_fibres() -> None:
    mesh = ventricle(size=3, layers=3)
    flip = np.array([-1.0, 1.0, 1.0])
    cells = {"tetra": mesh.cells["tetra"][:, [1, 0, 2, 3]]}
    facets = {"triangle": mesh.facets["triangle"][:, ::-1]}
    twin = replace(mesh, points=mesh.points * flip, cells=cells, facets=facets, cell_data={}, info={})
    found = fp.transfer(mesh, twin, "fiber", there_and_back=False)
    assert np.mean(angles(found.cell_data["fiber"], mesh.cell_data["fiber"] * flip) < 0.1) > 0.99


def test_what_cannot_be_transferred_is_refused() -> None:
    mesh = ventricle(size=3, layers=2)
    bare = replace(mesh, point_data={})
    with pytest.raises(InputError, match="the target has no point data transmural"):
        fp.transfer(mesh, bare, "fiber")
    with pytest.raises(InputError, match="the source has no field 'strain'; it has region"):
        fp.transfer(mesh, mesh, "strain")
    with pytest.raises(InputError, match="no field named"):
        fp.transfer(mesh, mesh, [])
    wide = mesh.with_data(cell={"stress": np.zeros((mesh.n_cells, 6))})
    with pytest.raises(InputError, match=r"field 'stress' has shape .* a number or three"):
        fp.transfer(wide, mesh, "stress")
    cut = np.where(mesh.facet_tag == fp.FACET_TAGS["base"], mesh.facet_tag, mesh.facet_tag)
    cut[0] = fp.FACET_TAGS["apex"]
    with pytest.raises(InputError, match="cut off at its apex"):
        fp.transfer(replace(mesh, facet_tag=cut), mesh, "fiber")
    assert AXES.length == 80.0
