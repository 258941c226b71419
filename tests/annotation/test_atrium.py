"""An atrium alone: its cavity, outside, valve and veins named; which atrium it is asked where it is not clear."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import femprep as fp
from femprep.annotation.shell import shell_of
from femprep.model import VolumeMesh

VEINS = ((1.0, 0.5, 0.6), (1.0, -0.5, 0.6), (-1.0, 0.5, 0.6), (-1.0, -0.5, 0.6))
INNER, WALL, VALVE, VEIN = 22.0, 2.5, 13.0, 6.0


def atrium(veins: tuple[tuple[float, float, float], ...]) -> VolumeMesh:
    """A spherical shell of wedges with round holes: a valve below, veins above."""
    ball = trimesh.creation.icosphere(3)
    ways, triangles = np.asarray(ball.vertices), np.asarray(ball.faces)
    middle = ways[triangles].mean(axis=1)
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    for way, radius in [((0.0, 0.0, -1.0), VALVE), *((vein, VEIN) for vein in veins)]:
        along = np.array(way) / np.linalg.norm(way)
        keep = np.arccos(np.clip(middle @ along, -1.0, 1.0)) * INNER > radius
        triangles, middle = triangles[keep], middle[keep]
    points = np.concatenate([ways * radius for radius in (INNER, INNER + 0.5 * WALL, INNER + WALL)])
    cells = np.concatenate([np.hstack([triangles + k * len(ways), triangles + (k + 1) * len(ways)]) for k in (0, 1)])
    return VolumeMesh(points, {"wedge": cells}, np.ones(len(cells)))


def test_a_left_atrium_is_named_with_its_openings_thickness_and_fibres() -> None:
    veins = {side: [tuple(20.0 * np.array(v)) for v in VEINS if sign * v[0] > 0] for side, sign in
             (("left_pulmonary", 1), ("right_pulmonary", -1))}  # fmt: skip
    found = fp.annotate(atrium(VEINS), fibres={"veins": veins})
    mesh, shell = found.mesh, shell_of(found.mesh)
    assert set(mesh.facet_names) == {"endo_la", "epi", "mitral", "veins"}
    assert set(mesh.region_names) == {"la"}
    assert [one.name for one in found.openings] == ["mitral", *["veins"] * 4]
    assert found.openings[0].normal[2] < -0.99
    radius = np.linalg.norm(shell.centre, axis=1)
    assert (radius[mesh.facet_tag == mesh.facet_names["endo_la"]] < INNER + 0.1).all()
    assert np.mean(radius[mesh.facet_tag == mesh.facet_names["epi"]] > INNER + WALL - 0.3) > 0.98
    assert np.median(mesh.cell_data["thickness"]) == pytest.approx(WALL, rel=0.05)
    assert {1, 2, 3, 4} >= set(np.unique(mesh.cell_data["atrial_bundle"])) > {1}
    np.testing.assert_allclose(np.linalg.norm(mesh.cell_data["fiber"], axis=1), 1.0, rtol=1e-9)
    assert found.quality.passed


def test_an_atrium_with_two_veins_may_be_either_and_the_option_decides() -> None:
    mesh = atrium(VEINS[::3])
    with pytest.raises(fp.InputError, match="right-atrium"):
        fp.annotate(mesh, fibres=None)
    found = fp.annotate(mesh, fibres=None, anatomy="right-atrium")
    assert {"endo_ra", "tricuspid", "veins"} <= set(found.mesh.facet_names)


def test_veins_that_are_not_told_apart_leave_names_without_fibres() -> None:
    found = fp.annotate(atrium(VEINS))
    assert "endo_la" in found.mesh.facet_names
    assert "fiber" not in found.mesh.cell_data
    assert any("left_pulmonary" in line and "openings" in line for line in found.quality.failures)
