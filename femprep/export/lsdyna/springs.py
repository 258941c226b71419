"""A tagged mesh in, the springs of its pericardium as an LS-DYNA keyword file has them out.

Each is a discrete element from a node to the ground that acts along a direction of its own; all are of one material
with a stiffness of 1, and each has its stiffness as the factor on its force (Keyword User's Manual I,
``*ELEMENT_DISCRETE``, ``*DEFINE_SD_ORIENTATION``).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from femprep.export.deck.springs import pericardial_springs
from femprep.export.deck.text import number
from femprep.model import VolumeMesh
from femprep.options import ExportOptions

#: Title of their part, and number of their material and of the node set of the basal ring.
PERICARDIUM: Final = "pericardium"
NUMBER: Final = 201


def springs(mesh: VolumeMesh, options: ExportOptions, part: int, section: int) -> Iterator[str]:
    """Part, section, material, directions and elements; nothing where the mesh has no pericardium.

    Parameters
    ----------
    mesh : VolumeMesh
    options : ExportOptions
    part, section : int
        Numbers that are free.
    """
    found = pericardial_springs(mesh, options)
    if found is None:
        return
    yield f"*PART\n{PERICARDIUM}\n{part:10d}{section:10d}{NUMBER:10d}\n"
    yield f"*SECTION_DISCRETE\n{section:10d}{0:10d}\n{0.0:10.1f}{0.0:10.1f}\n"
    yield f"*MAT_SPRING_ELASTIC\n{NUMBER:10d}{1.0:10.1f}\n*DEFINE_SD_ORIENTATION\n"
    for i, normal in enumerate(found.normal.tolist(), start=1):
        yield f"{i:10d}{0:10d}{''.join(f'{number(x, 10):>10}' for x in normal)}\n"
    first = mesh.n_cells + (len(mesh.purkinje.edges) if mesh.purkinje else 0) + 1
    yield "*ELEMENT_DISCRETE\n"
    for i, (node, k) in enumerate(zip((found.node + 1).tolist(), found.stiffness.tolist())):
        yield f"{first + i:8d}{part:8d}{node:8d}{0:8d}{i + 1:8d}{number(k, 16):>16}\n"
