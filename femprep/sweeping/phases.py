"""Swept meshes of the phases of one heart in, displacements of their nodes out: same connectivity, so node by node."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femprep.errors import InputError
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.measures.sample_points import family
from femprep.model import VolumeMesh


def template_of(mesh: VolumeMesh) -> dict[str, int | str]:
    """What a swept mesh's connectivity follows from: options of the sweep that give the same to any other heart.

    Parameters
    ----------
    mesh : VolumeMesh
        From :func:`~femprep.sweeping.sweep`, or a file of it read back.

    Returns
    -------
    dict
        ``element``, ``template``, ``columns``, ``rows``, ``layers``, ``order``.

    Raises
    ------
    InputError
        The mesh was not swept.

    Examples
    --------
    >>> sorted(fp.template_of(swept))
    ['columns', 'element', 'layers', 'order', 'rows', ...]
    """
    info = mesh.info
    if info.get("mesher") != "sweep":
        raise InputError("the mesh given as a template was not swept; give a mesh.vtu made with --mesher sweep")
    if "refinement" in info:
        raise InputError("the mesh given as a template was refined after its sweep; give the mesh.vtu it was made from")
    numbers = {name: int(info[name]) for name in ("columns", "rows", "layers")}
    ((kind, _),) = mesh.cells.items()
    order = 2 if ELEMENTS[kind].quadratic else 1
    return {"element": family(kind), "template": str(info["template"]), **numbers, "order": order}


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

    Examples
    --------
    >>> still, moved = fp.displacements([swept, swept])
    >>> float(abs(moved.point_data["displacement"]).max())
    0.0
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
