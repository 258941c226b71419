"""Swept meshes of the phases of one heart in, displacements of their nodes out: same connectivity, so node by node."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femprep.errors import InputError
from femprep.model import VolumeMesh


def displacements(meshes: Sequence[VolumeMesh], reference: int = 0) -> list[VolumeMesh]:
    """Give each phase the displacement of its nodes from a reference phase.

    Parameters
    ----------
    meshes : sequence of VolumeMesh
        Phases of equal connectivity: swept with the same ``columns``, ``rows``, ``layers`` and ``element``.
    reference : int
        Number of the phase the displacements are from.

    Returns
    -------
    list of VolumeMesh
        The same meshes with ``point_data["displacement"]`` ``(n, 3)``, mm: position less that in the reference phase.

    Raises
    ------
    InputError
        There is no such phase, or a phase differs from the reference in connectivity.
    """
    if not 0 <= reference < len(meshes):
        raise InputError(f"reference phase {reference} asked for, but there are {len(meshes)} phases, counted from 0")
    first = meshes[reference]
    for number, mesh in enumerate(meshes):
        same = list(mesh.cells) == list(first.cells) and len(mesh.points) == len(first.points)
        if not same or any(not np.array_equal(mesh.cells[k], first.cells[k]) for k in first.cells):
            raise InputError(
                f"phase {number} differs in connectivity from phase {reference}: {len(mesh.points)} and "
                f"{len(first.points)} points; sweep all phases with the same columns, rows and layers"
            )
    return [mesh.with_data(point={"displacement": mesh.points - first.points}) for mesh in meshes]
