"""A mesh and the stiffness of a pericardium at its points in; the fields of its springs, by the mesh's facets, out."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.measures.nodal_areas import nodal_areas
from femprep.model import FACET_TAGS, FloatArray, VolumeMesh
from femprep.model.blocks import chosen_rows, nodes_of

#: Point data whose values belong to the points of one mesh: areas have no values in between.
STIFFNESS = "pericardium"


def with_springs(mesh: VolumeMesh, stiffness: FloatArray) -> VolumeMesh:
    """The mesh with springs of a stiffness ``(n,)``, kPa/mm, at the points of its epicardium: area, normal, rim."""
    facets = chosen_rows(mesh.facets, mesh.facet_tag == FACET_TAGS["epi"])
    area, normal = nodal_areas(mesh.points, facets)
    on = np.zeros(len(mesh.points), dtype=bool)
    on[nodes_of(facets)] = True
    ring = np.zeros(len(mesh.points), dtype=np.int32)
    ring[nodes_of(chosen_rows(mesh.facets, np.isin(mesh.facet_tag, [FACET_TAGS["base"], FACET_TAGS["base_rv"]])))] = 1
    ring[~on] = 0
    return mesh.with_data(
        point={
            STIFFNESS: np.where(on, stiffness, 0.0),
            "pericardium_area": area,
            "pericardium_normal": normal,
            "basal_ring": ring,
        }
    )


def springs_renewed(mesh: VolumeMesh) -> VolumeMesh:
    """A mesh whose point data came from another one, with the springs of its own facets, where it has any."""
    given: Any = mesh.point_data.get(STIFFNESS)
    return mesh if given is None else with_springs(mesh, np.asarray(given, dtype=np.float64))
