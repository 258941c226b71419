"""Wedges as VTK's documentation or its working code orders them, in; in the order of the latter, and ours, out."""

from __future__ import annotations

import logging

import numpy as np

from femprep.model import FloatArray, IntArray

log = logging.getLogger(__name__)


def turned_wedges(wedges: IntArray, points: FloatArray) -> IntArray:
    """Wedges that all follow VTK's documentation (0-1-2 outward, as meshio writes them) in VTK's working order.

    VTK's own volumes and shape functions, Abaqus, Gmsh and femprep have 0-1-2 inward. Where only some are negative,
    they are inverted elements and stay.
    """
    a, b, c, top = (points[wedges[:, i]] for i in (0, 1, 2, 3))
    if np.all(np.einsum("ij,ij->i", np.cross(b - a, c - a), top - a) < 0):
        log.info("the wedges have their first triangle outward, as VTK's documentation says: turned")
        return wedges[:, [0, 2, 1, 3, 5, 4]]
    return wedges
