"""A number of cells in, a unit sphere of quadrilaterals out: a cube blown up, with equal angles along its faces."""

from __future__ import annotations

import numpy as np

from femprep.errors import InputError
from femprep.model import IntArray
from femprep.model.functions import sine_cosine
from femprep.model.products import unit_vectors
from femprep.template.sphere import Template

#: Cells along an edge of the cube, at most.
MOST = 60


def cubed_template(vertices: int) -> Template:
    """Cubed sphere whose number of vertices, 6 n^2 + 2, is nearest to the one asked for; at least 8."""
    cells = max(1, round(float(np.sqrt(max(vertices - 2, 0) / 6.0))))
    # The root's nearest number is not always the nearest number of vertices.
    return cubed_sphere(
        min((cells - 1, cells, cells + 1), key=lambda n: (abs(6 * n * n + 2 - vertices) if n > 0 else 1e9, n))
    )


def cubed_sphere(cells: int) -> Template:
    """Quadrilateral mesh of the unit sphere: each face of a cube in ``cells`` x ``cells``, carried to the sphere.

    The lines of a face are at equal angles seen from the centre [1]_, so that cells differ in size by less than 1 to
    1.5. Three cells meet at the eight corners, four everywhere else.

    Parameters
    ----------
    cells : int
        Cells along an edge of the cube, 1 to 60. There are ``6 cells^2`` quadrilaterals and ``6 cells^2 + 2`` vertices.

    Returns
    -------
    Template
        Vertices from north (+z) to south, cells counter-clockwise seen from outside.

    Raises
    ------
    InputError
        The number is out of range.

    References
    ----------
    .. [1] Ronchi, Iacono, Paolucci, The cubed sphere, J. Comput. Phys. 124(1), 1996. doi:10.1006/jcph.1996.0047
    """
    if not 1 <= cells <= MOST:
        raise InputError(f"cubed sphere with {cells} cells along an edge asked for, expected 1 to {MOST}")
    # Corners in whole numbers from -cells to cells, so that faces meet in equal points.
    line = 2 * np.arange(cells + 1) - cells
    u, v = np.meshgrid(line, line, indexing="ij")
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    square = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=2).reshape(-1, 4)
    corners: list[IntArray] = []
    quads: list[IntArray] = []
    for axis in range(3):
        for side in (-1, 1):
            lattice = np.empty((u.size, 3), dtype=np.int64)
            lattice[:, axis] = side * cells
            lattice[:, (axis + 1) % 3], lattice[:, (axis + 2) % 3] = u.ravel(), v.ravel()
            quads.append((square if side > 0 else square[:, ::-1]) + len(corners) * u.size)
            corners.append(lattice)
    lattice, index = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    sine, cosine = sine_cosine(0.25 * np.pi * lattice / cells)
    directions = unit_vectors(sine / cosine)
    # By the lattice where heights are equal but for rounding.
    order = np.lexsort((lattice[:, 1], lattice[:, 0], -np.round(directions[:, 2], 12)))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    faces = rank[index.ravel()[np.concatenate(quads)]]
    turn = (np.argmin(faces, axis=1)[:, None] + np.arange(4)) % 4
    faces = np.take_along_axis(faces, turn, axis=1)
    return Template(directions[order], faces[np.lexsort(faces.T[::-1])])
