"""A volume mesh to Medit's ``.mesh`` (FreeFEM, MMG): tags as references, fibres beside it in a ``.sol``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from femprep.export.fibres import directions
from femprep.export.names import facet_names, region_names
from femprep.export.split import linear
from femprep.export.text import rows
from femprep.export.units import UNITS
from femprep.model import VolumeMesh
from femprep.options import ExportOptions

#: Medit's sections; node order is ours.
MEDIT_SECTIONS: Final = {
    "tetra": "Tetrahedra",
    "wedge": "Prisms",
    "hexahedron": "Hexahedra",
    "triangle": "Triangles",
    "quad": "Quadrilaterals",
}


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.mesh`` and, where there are fibres, ``stem.fiber.sol``.

    References are the tags; comments name them. Elements are linear: of quadratic ones the corners are written. The
    ``.sol`` holds for each element the fibre and, where there is one, the sheet.
    """
    mesh = linear(mesh, "Medit")
    with (folder / f"{stem}.mesh").open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(_mesh(mesh, options))
    found = directions(mesh)
    if found is not None:
        vectors = found if "sheet" in mesh.cell_data else found[:1]
        with (folder / f"{stem}.fiber.sol").open("w", encoding="ascii", newline="\n") as file:
            file.writelines(_solution(mesh, vectors))


def _mesh(mesh: VolumeMesh, options: ExportOptions) -> Iterator[str]:
    units = UNITS[options.length_unit]
    yield f"MeshVersionFormatted 2\n\n# femprep volume mesh; {units.line}\n"
    names = {**region_names(mesh), **facet_names(mesh)}
    yield "".join(f"# {tag} {name}\n" for name, tag in names.items())
    yield f"\nDimension 3\n\nVertices\n{len(mesh.points)}\n"
    yield rows(mesh.points * units.per_mm, np.zeros(len(mesh.points), dtype=int), separator=" ", width=None)
    for blocks, tags in ((mesh.facets, mesh.facet_tag), (mesh.cells, mesh.region)):
        first = 0
        for kind, block in blocks.items():
            yield f"\n{MEDIT_SECTIONS[kind]}\n{len(block)}\n"
            yield rows(block + 1, tags[first : first + len(block)], separator=" ")
            first += len(block)
    yield "\nEnd\n"


def _solution(mesh: VolumeMesh, vectors: tuple[np.ndarray, ...]) -> Iterator[str]:
    yield "MeshVersionFormatted 2\n\nDimension 3\n"
    first = 0
    for kind, block in mesh.cells.items():
        # Number of fields, and of each its kind: 2 is a vector.
        yield f"\nSolAt{MEDIT_SECTIONS[kind]}\n{len(block)}\n{len(vectors)} {' '.join('2' for _ in vectors)}\n"
        yield rows(*(v[first : first + len(block)] for v in vectors), separator=" ", width=None)
        first += len(block)
    yield "\nEnd\n"
