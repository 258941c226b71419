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
    found = fp.transfer(mesh, mesh, ["fiber", "sheet", "aha", "load", "region", "transmural"])
    # Of the elements on the line at the apex where the height is 0 throughout, another one may be the one found.
    assert np.mean(angles(found.cell_data["fiber"], mesh.cell_data["fiber"]) < 0.1) > 0.995
    np.testing.assert_array_equal(found.cell_data["aha"], mesh.cell_data["aha"])
    np.testing.assert_array_equal(found.region, mesh.region)
    assert np.mean(np.abs(found.cell_data["transmural"] - mesh.cell_data["transmural"]) < 1e-6) > 0.995
    load = np.abs(found.point_data["load"] - mesh.point_data["load"])
    assert np.percentile(load, 99) < 1e-6 * mesh.point_data["load"].max()


def test_there_and_back_between_unlike_meshes_is_below_an_element() -> None:
    fine, coarse = ventricle(size=6), ventricle("hexahedron", 3, 3)
    found = fp.transfer(fine, coarse, ["transmural", "aha", "fiber"])
    record = found.info["transfer"]
    assert record["place_back_mean_mm"] < 0.25 * record["source_edge_mm"]
    assert record["place_back_95_mm"] < record["source_edge_mm"] < 0.7 * record["target_edge_mm"]
    told = {(one["name"], one["on"]): one for one in record["fields"]}
    assert told["transmural", "points"]["back_mean"] < 0.02
    assert told["aha", "elements"]["unit"] == "%"
    # Elements of the coarse mesh hold several of the fine one: by way of those their segments come back.
    around = fp.transfer(coarse, fine, "aha").info["transfer"]
    assert around["fields"][0]["back_mean"] < 5.0
    assert around["place_back_mean_mm"] < 0.1 * around["source_edge_mm"]
    # The coarse mesh's own fibres, by the same rule.
    assert np.median(angles(found.cell_data["fiber"], coarse.cell_data["fiber"])) < 8.0


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
