"""A closed surface in, the smooth surface it stands for out, ready for projections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femprep.mesh.patches import PatchSurface
from femprep.mesh.topology import edge_table, quarters
from femprep.model import Surface
from femprep.model.products import unit_vectors
from femprep.surface.fitting.placed_parametrisation import PlacedShape


def patches_of(surface: Surface) -> PatchSurface:
    """The smooth surface of a closed surface: the one its template was placed on, else patches through its points.

    Parameters
    ----------
    surface : Surface
        Of triangles; where it has a ``shape`` the patches follow that map, to fourth order in half an edge.
    """
    if isinstance(surface.shape, PlacedShape):
        own = surface.shape.surface
        mirrored = np.linalg.det(surface.shape.axes) < 0.0
        triangles = own.triangles[:, ::-1] if mirrored else own.triangles
        return PatchSurface(surface.shape.to_world(own.points), triangles)
    fine = denser(surface)
    return PatchSurface(fine.points, fine.triangles)


def denser(surface: Surface) -> Surface:
    """Split every triangle in four, the new vertices on the smooth surface between the ends of their edges.

    Parameters
    ----------
    surface : Surface
        Triangles; with ``shape`` and ``directions`` for its smooth surface.

    Returns
    -------
    Surface
        The old vertices first. A surface without a shape is returned as it is.
    """
    if surface.shape is None or surface.directions is None:
        return surface
    table = edge_table(surface.triangles)
    middle = unit_vectors(surface.directions[table.nodes].mean(axis=1))
    return replace(
        surface,
        points=np.concatenate([surface.points, surface.shape(middle)]),
        cells=quarters(table, surface.triangles, len(surface.points)),
        directions=np.concatenate([surface.directions, middle]),
        point_data={},
    )
