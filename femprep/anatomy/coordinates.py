"""VolumeMesh in, the same mesh with ventricular coordinates on nodes and elements out.

===================  ==========================================================================================
transmural           0 on an endocardium, 1 on the epicardium and in the middle of the septum
apicobasal           0 at the apex, 1 at the base
rotational           0 to 1 about the long axis: 0 mid-septal, 1/4 anterior, 1/2 lateral, 3/4 inferior
rotational_cos, sin  its cosine and sine; interpolate these, never the angle, which jumps from 1 to 0
transventricular     0 in the left, 1 in the right ventricle (of the septum each half)
===================  ==========================================================================================

Each is the solution of a Laplace problem made linear in distance (Schuler et al. 2021, Cobiveco, doi
10.1016/j.media.2021.102247; see :mod:`femprep.anatomy.laplace.fields`). A mirrored heart has the coordinates of its
twin.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from femprep.anatomy.axes.ventricular_axes import VentricularAxes, septum_notices
from femprep.anatomy.laplace.fields import WallFields
from femprep.model import FloatArray, VolumeMesh, noted


def add_coordinates(
    mesh: VolumeMesh, *, axes: VentricularAxes | None = None, fields: WallFields | None = None
) -> VolumeMesh:
    """Add ventricular coordinates to a mesh.

    Parameters
    ----------
    mesh : VolumeMesh
        Of any element types, with facets tagged ``endo`` (or ``endo_lv``, ``endo_rv``), ``epi``, ``base``, and ``apex``
        where the wall is cut there.
    axes : VentricularAxes, optional
        From labels, for the septum and the hand; found from the mesh where not given.
    fields : WallFields, optional
        Of this mesh, where they exist already: nothing is solved twice.

    Returns
    -------
    VolumeMesh
        With the coordinates in ``point_data`` and ``cell_data``, ``info["axes"]`` and ``info["coordinates"]``.

    Raises
    ------
    InputError
        Facets are missing, or a piece of the mesh touches no tagged boundary.

    References
    ----------
    Schuler et al. 2021, doi 10.1016/j.media.2021.102247

    Examples
    --------
    >>> sorted(set(fp.add_coordinates(mesh, axes=fp.ventricular_axes(seg)).point_data) - set(mesh.point_data))
    [...]
    """
    fields = fields or WallFields(mesh, axes)
    space = fields.space
    cells, points = _coordinates(fields, space.to_cells), _coordinates(fields, space.to_points)
    record: dict[str, Any] = {
        "names": sorted(points),
        "apex_nodes": len(fields.apex_nodes),
        "apicobasal_length_mm": round(fields.axes.length, 3),
        "rotational_zero": "mid-septum (assumed)" if "septal" in fields.axes.info.get("assumed", ()) else "mid-septum",
    }
    record = noted(record, *septum_notices(fields.axes))
    info = {**mesh.info, "axes": fields.axes.record(), "coordinates": record}
    return replace(mesh.with_data(cell=cells, point=points), info=info)


def _coordinates(fields: WallFields, spread: Callable[[FloatArray], FloatArray]) -> dict[str, FloatArray]:
    """All coordinates, spread from the nodes of the fields to elements or to points."""
    cosine, sine = fields.turn
    found = {"transmural": 1.0 - np.abs(spread(fields.across_distance)), "apicobasal": spread(fields.upward_distance)}
    if fields.biventricular:
        found["transventricular"] = (spread(fields.side) < 0).astype(float)
    return found | _rotational(spread(cosine), spread(sine))


def _rotational(cosine: FloatArray, sine: FloatArray) -> dict[str, FloatArray]:
    """Unit cosine and sine, and the angle they stand for as a fraction of the turn in [0, 1)."""
    length = np.hypot(cosine, sine)
    cosine = np.divide(cosine, length, out=np.ones_like(cosine), where=length > 0)
    sine = np.divide(sine, length, out=np.zeros_like(sine), where=length > 0)
    turn = np.arctan2(sine, cosine) / (2 * np.pi) % 1.0
    return {"rotational": np.where(turn >= 1.0, 0.0, turn), "rotational_cos": cosine, "rotational_sin": sine}
