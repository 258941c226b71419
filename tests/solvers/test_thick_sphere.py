"""A thick sphere under inner pressure, whose inflation is known in closed form, by our neo-Hookean deck in CalculiX.

Of an incompressible neo-Hookean material with shear modulus ``mu`` the pressure is ``mu / 2`` times the difference of
``4 / s + 1 / s^4`` between the stretches ``s`` of the outer and the inner surface (Rivlin 1949, doi
10.1098/rsta.1949.0009; Ogden, Non-linear Elastic Deformations, 1984, section 5.3.2).
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from meshes import quadratic
from scipy.optimize import brentq
from solver_tools import calculix_results, run_calculix

from femprep.export import write_mesh
from femprep.mesh.elements import boundary_faces
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh

pytestmark = pytest.mark.solver

INNER, OUTER, YOUNG, POISSON = 20.0, 30.0, 30.0, 0.499
LAYERS, ALONG = 3, 4


def stretch_inside(pressure: float) -> float:
    """Stretch of the inner surface of the incompressible sphere, for a pressure in kPa."""

    def outside(stretch: float) -> float:
        return float(np.cbrt(1 + (stretch**3 - 1) * INNER**3 / OUTER**3))

    def excess(stretch: float) -> float:
        sides = [4 / s + 1 / s**4 for s in (outside(stretch), stretch)]
        return YOUNG / 6 * (sides[0] - sides[1]) - pressure

    return float(brentq(excess, 1.0, 1.6))


def octant() -> VolumeMesh:
    """An eighth of the sphere in wedges of fifteen nodes, all of them on spheres."""
    places = [(i, j, ALONG - i - j) for i in range(ALONG + 1) for j in range(ALONG + 1 - i)]
    number = {place: row for row, place in enumerate(places)}
    up = [[(i, j), (i + 1, j), (i, j + 1)] for i, j, k in places if k > 0]
    down = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j, k in places if k > 1]
    faces = np.array([[number[i, j, ALONG - i - j] for i, j in face] for face in up + down])
    radii = np.linspace(INNER, OUTER, LAYERS + 1)
    directions = np.array(places, dtype=float)
    points = np.concatenate([radius * directions for radius in radii])
    layers = [np.hstack([faces + k * len(places), faces + (k + 1) * len(places)]) for k in range(LAYERS)]
    wedges = np.concatenate(layers)
    straight = quadratic(VolumeMesh(points, {"wedge": wedges}, np.full(len(wedges), REGION_TAGS["lv"])))
    # On the planes through the corners the radius is the sum of coordinates; from there to the spheres.
    radius = straight.points.sum(axis=1, keepdims=True) / ALONG
    mesh = replace(straight, points=radius * straight.points / np.linalg.norm(straight.points, axis=1, keepdims=True))
    found = boundary_faces(mesh.cells)
    tags = []
    for sides in found.values():
        far = np.linalg.norm(mesh.points[sides.nodes], axis=2)
        inner, outer = np.isclose(far, INNER).all(axis=1), np.isclose(far, OUTER).all(axis=1)
        tags.append(np.select([inner, outer], [FACET_TAGS["endo"], FACET_TAGS["epi"]], FACET_TAGS["base"]))
    return replace(mesh, facets={kind: sides.nodes for kind, sides in found.items()}, facet_tag=np.concatenate(tags))


@pytest.mark.parametrize("pressure", [1.0, 4.0])
def test_inner_radius_of_a_neo_hookean_sphere(pressure: float, tmp_path: Path) -> None:
    mesh = octant()
    deck = tmp_path / "sphere.inp"
    moduli = {"young_modulus": YOUNG, "poisson_ratio": POISSON}
    write_mesh(mesh, deck, step="inflation", material="neo-hookean", pressure=pressure, **moduli)
    # An eighth of the sphere: each of its planes is held along its normal alone.
    held = [f"{node + 1}, {axis + 1}" for node, axis in np.argwhere(np.abs(mesh.points) < 1e-9)]
    text = deck.read_text()
    assert text.count("base, 1, 3\n") == 1
    deck.write_text(text.replace("base, 1, 3\n", "\n".join(held) + "\n"))
    result = run_calculix(deck)
    assert result.returncode == 0, result.stdout[-2000:]
    _, displacement = calculix_results(deck.with_suffix(".dat"))
    radius = np.linalg.norm(mesh.points, axis=1)
    inside = np.isclose(radius, INNER)
    found = np.linalg.norm((mesh.points + displacement)[inside], axis=1) / INNER
    wanted = stretch_inside(pressure)
    assert wanted > 1.03
    assert np.abs(found - wanted).max() < 0.02 * (wanted - 1)
