"""A tagged mesh in, the springs of its pericardium as a deck of Abaqus and CalculiX has them out.

A spring along a normal that is no axis, of a stiffness of its own, would need a set and an orientation for each point.
So each point has a partner with one displacement ``q = sqrt(k) n . u`` and a spring of stiffness 1 on it: the energy
``q^2 / 2`` is that of a spring of stiffness k along n, and all springs are one set.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from femprep.export.deck.springs import pericardial_springs
from femprep.export.deck.text import rows
from femprep.export.deck.units import UNITS
from femprep.model import VolumeMesh
from femprep.options import ExportOptions

#: Names of the sets of partners and of springs; a mesh read back has neither.
PARTNERS: Final = "pericardium_partners"
SPRINGS: Final = "pericardium_springs"


def springs(mesh: VolumeMesh, options: ExportOptions) -> Iterator[str]:
    """Partners, equations and springs; nothing where the mesh has no pericardium or the deck no step."""
    found = pericardial_springs(mesh, options)
    if options.step == "none" or found is None:
        return
    count = len(found.node)
    partner = np.arange(len(mesh.points) + 1, len(mesh.points) + 1 + count)
    yield f"*NODE, NSET={PARTNERS}\n"
    yield rows(partner, mesh.points[found.node] * UNITS[options.length_unit].per_mm)
    yield f"*ELEMENT, TYPE=SPRING1, ELSET={SPRINGS}\n"
    yield rows(np.arange(mesh.n_cells + 1, mesh.n_cells + 1 + count), partner)
    factor = np.sqrt(found.stiffness)[:, None] * found.normal
    for own, node, (x, y, z) in zip(partner.tolist(), (found.node + 1).tolist(), factor.tolist()):
        yield f"*EQUATION\n4\n{own}, 1, -1., {node}, 1, {x:.13e}, {node}, 2, {y:.13e}, {node}, 3, {z:.13e}\n"
    yield f"*SPRING, ELSET={SPRINGS}\n1\n1.\n"
    # Of the three displacements of a partner two mean nothing.
    yield f"*BOUNDARY\n{PARTNERS}, 2, 3\n"
