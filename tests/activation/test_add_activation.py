"""Times of activation: exact on slabs, along fibres by the speed along fibres, only where muscle of ventricles is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from anatomy_meshes import ellipsoid, grown, slab

import femprep as fp
from femprep.model import FACET_TAGS, REGION_TAGS, PurkinjeNet

SPEEDS = {"fibre_speed": 0.6, "sheet_speed": 0.3, "normal_speed": 0.2}


def fibred(mesh: fp.VolumeMesh, fiber: tuple[float, ...], sheet: tuple[float, ...]) -> fp.VolumeMesh:
    data = {"fiber": np.tile(fiber, (mesh.n_cells, 1)), "sheet": np.tile(sheet, (mesh.n_cells, 1))}
    return mesh.with_data(cell=data)


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron", "mixed", "tetra10", "wedge15", "hexahedron20"])
@pytest.mark.parametrize(("fiber", "sheet", "speed"), [
    ((1.0, 0, 0), (0, 1.0, 0), 0.6), ((0, 1.0, 0), (1.0, 0, 0), 0.3), ((0, 1.0, 0), (0, 0, 1.0), 0.2),
], ids=["along", "sheet", "normal"])  # fmt: skip
def test_a_front_from_the_whole_endocardium_is_exact(kind: str, fiber, sheet, speed: float) -> None:
    names = {"tetra10": "tetra", "wedge15": "wedge", "hexahedron20": "hexahedron"}
    mesh = slab(names.get(kind, kind)).mesh
    mesh = fibred(grown(mesh) if kind in names else mesh, fiber, sheet)
    found = fp.add_activation(mesh, **SPEEDS)
    np.testing.assert_allclose(found.point_data["activation"], mesh.points[:, 0] / speed, atol=1e-9)
    record = found.info["activation"]
    assert record["begins"] == "all nodes of the endocardia"
    assert record["last_ms"] == pytest.approx(10.0 / speed, abs=1e-3)
    assert record["never_reached"] == 0


def test_it_begins_at_junctions_by_their_arrival() -> None:
    mesh = fibred(slab("tetra").mesh, (0, 0, 1.0), (0, 1.0, 0))
    end = int(np.argmin(np.linalg.norm(mesh.points - [0, 10.0, 15.0], axis=1)))
    points = np.array([mesh.points[end] + [0, 0, 5.0], mesh.points[end]])
    net = PurkinjeNet(points, np.array([[0, 1]]), np.array([FACET_TAGS["endo"]]), np.array([-1, end]), speed=2.5)
    found = fp.add_activation(replace(mesh, purkinje=net), **SPEEDS)
    times = found.point_data["activation"]
    assert times[end] == pytest.approx(2.0)
    assert times.min() == times[end]
    # Along the line of the fibre through the junction it runs by the fibre's speed.
    on = np.flatnonzero(np.all(np.abs(mesh.points[:, :2] - mesh.points[end, :2]) < 1e-9, axis=1))
    np.testing.assert_allclose(times[on], 2.0 + np.abs(mesh.points[on, 2] - mesh.points[end, 2]) / 0.6, rtol=1e-12)


def test_atria_and_blood_conduct_nothing() -> None:
    mesh = fibred(slab("tetra", (2, 2, 6)).mesh, (0, 0, 1.0), (1.0, 0, 0))
    centre = mesh.points[mesh.cells["tetra"]].mean(axis=1)
    for other in ("la", "blood_lv"):
        region = np.where(centre[:, 2] > 15.0, REGION_TAGS[other], REGION_TAGS["lv"])
        found = fp.add_activation(replace(mesh, region=region)).point_data["activation"]
        above = mesh.points[:, 2] > 15.0 + 1e-9
        assert np.all(found[above] == -1.0)
        assert np.all(found[~above] >= 0.0)


def test_a_piece_that_no_way_leads_to_is_told() -> None:
    mesh = fibred(slab("tetra", (2, 2, 2)).mesh, (0, 0, 1.0), (1.0, 0, 0))
    n = len(mesh.points)
    apart = fp.VolumeMesh(
        np.vstack([mesh.points, mesh.points + 100.0]),
        {"tetra": np.vstack([mesh.cells["tetra"], mesh.cells["tetra"] + n])},
        np.tile(mesh.region, 2),
        mesh.facets,
        mesh.facet_tag,
        {name: np.tile(values, (2, 1)) for name, values in mesh.cell_data.items()},
    )
    found = fp.add_activation(apart)
    assert found.info["activation"]["never_reached"] == n
    assert "never activated" in found.info["activation"]["notices"][0]["what"]
    assert np.all(found.point_data["activation"][n:] == -1.0)


def test_finer_meshes_of_a_ventricle_agree() -> None:
    last = []
    for size, layers in ((3, 2), (6, 4), (9, 6)):
        mesh = fp.add_fibres(ellipsoid("hexahedron", size=size, layers=layers).mesh)
        last.append(fp.add_activation(mesh).info["activation"]["last_ms"])
    assert abs(last[2] - last[1]) < abs(last[1] - last[0]) + 0.5
    assert last[2] == pytest.approx(10.0 / 0.30, rel=0.25)  # the wall is 10 mm thick, sheets run through it


def test_what_it_needs() -> None:
    mesh = slab("tetra", (1, 1, 1)).mesh
    with pytest.raises(fp.InputError, match="fibres"):
        fp.add_activation(mesh)
    bare = fibred(fp.VolumeMesh(mesh.points, mesh.cells, mesh.region), (0, 0, 1.0), (1.0, 0, 0))
    with pytest.raises(fp.InputError, match="endocardium"):
        fp.add_activation(bare)
    with pytest.raises(fp.OptionError, match="fibre_speed"):
        fp.add_activation(mesh, fibre_speed=0.0)
    # Found by a damaged command line: its square is beyond all numbers.
    with pytest.raises(fp.OptionError, match="fibre_speed"):
        fp.add_activation(mesh, fibre_speed=1e300)
