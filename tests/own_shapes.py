"""Surfaces as modellers bring them: cut open, with lids, flipped, torn, of phantoms whose volumes are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femprep.model import IntArray, Surface
from femprep.phantoms import lv_ellipsoid
from femprep.template import charge_template

PHANTOM = lv_ellipsoid()


def closed(name: str, vertices: int = 400) -> Surface:
    """The phantom's smooth surface of a name, closed, as a file of anyone's has it: without its template."""
    template = charge_template(vertices)
    points = PHANTOM.exact_surface(name, template.directions, truncated=False)
    return Surface(points, template.cells, name=name)


def heart(vertices: int = 400) -> dict[str, Surface]:
    """Endocardium and epicardium, closed."""
    return {name: closed(name, vertices) for name in ("lv", "epi")}


def cup(name: str, height: float = 20.0, vertices: int = 400) -> Surface:
    """The same, cut flat at a height along z, open."""
    import pyvista

    surface = closed(name, vertices)
    mesh = pyvista.PolyData.from_regular_faces(surface.points, surface.triangles)
    cut = mesh.clip(normal="z", origin=(0.0, 0.0, height)).extract_surface(algorithm="dataset_surface").triangulate()
    return Surface(np.asarray(cut.points, dtype=float), cut.regular_faces, name=name)


def lidded(name: str, height: float = 20.0, vertices: int = 400) -> Surface:
    """The same, its rim closed by a flat lid."""
    from femprep.mesh.topology import closed_by_fans

    sound = cup(name, height, vertices)
    return replace(sound, points=(made := closed_by_fans(sound.points, sound.triangles))[0], cells=made[1])


def without(surface: Surface, near: tuple[float, float, float], width: float) -> Surface:
    """A surface with a hole: triangles within half a width of a place left out."""
    middle = surface.points[surface.triangles].mean(axis=1)
    kept = np.linalg.norm(middle - near, axis=1) > 0.5 * width
    return replace(surface, cells=surface.triangles[kept])


def soup(surface: Surface) -> Surface:
    """A surface as STL has it: three corners of its own for every triangle, in single precision."""
    corners = surface.points[surface.triangles].reshape(-1, 3).astype(np.float32).astype(float)
    return replace(surface, points=corners, cells=np.arange(len(corners)).reshape(-1, 3))


def flipped(surface: Surface, rows: IntArray | slice = slice(None)) -> Surface:
    """A surface with some of its triangles wound the other way."""
    cells = surface.triangles.copy()
    cells[rows] = cells[rows][:, ::-1]
    return replace(surface, cells=cells)


def gable(name: str, steep: float = 2.0) -> Surface:
    """The same, cut by two planes like the sides of a roof."""
    import pyvista

    surface = closed(name)
    mesh = pyvista.PolyData.from_regular_faces(surface.points, surface.triangles)
    for side in (-steep, steep):
        mesh = mesh.clip(normal=(side, 0.0, 1.0), origin=(0.0, 0.0, 20.0)).extract_surface(algorithm="dataset_surface")
    mesh = mesh.triangulate()
    return Surface(np.asarray(mesh.points, dtype=float), mesh.regular_faces, name=name)


def bent(surface: Surface, radius: float = 40.0) -> Surface:
    """A surface along z bent to a U in the plane of x and z."""
    angle, reach = surface.points[:, 2] / radius, radius + surface.points[:, 0]
    points = np.column_stack([reach * np.sin(angle), surface.points[:, 1], -reach * np.cos(angle)])
    return replace(surface, points=points)
