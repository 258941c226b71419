"""A volume mesh to Medit's ``.mesh`` (FreeFEM, MMG): tags as references, fibres and AHA segments in a ``.sol``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.export.deck.fibres import directions
from femprep.export.deck.fields import UserField, user_fields
from femprep.export.deck.names import facet_names, region_names
from femprep.export.deck.split import linear
from femprep.export.deck.text import lines
from femprep.export.deck.units import UNITS
from femprep.export.verdict import verdict_comments
from femprep.model import VolumeMesh
from femprep.model.blocks import block_rows
from femprep.options import ExportOptions

#: How comments at the top of our file begin.
OURS: Final = "femprep volume mesh"
#: Medit's sections; node order is ours.
MEDIT_SECTIONS: Final = {
    "tetra": "Tetrahedra",
    "wedge": "Prisms",
    "hexahedron": "Hexahedra",
    "triangle": "Triangles",
    "quad": "Quadrilaterals",
}


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.mesh`` and, where the mesh has them, ``stem.fiber.sol`` and ``stem.aha.sol``.

    References are the tags; comments name them. Elements are linear: of quadratic ones the corners are written. The
    first ``.sol`` holds for each element the fibre and, where there is one, the sheet; the second its AHA segment,
    because an element has but one reference. Fields of the user's are ``stem.cell_<name>.sol`` and
    ``stem.point_<name>.sol``.
    """
    mesh = linear(mesh, "Medit")
    with (folder / f"{stem}.mesh").open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(_mesh(mesh, options))
    found, (of_cells, of_points) = directions(mesh), user_fields(mesh)
    cells: dict[str, tuple[np.ndarray, ...]] = {}
    if found is not None:
        cells["fiber"] = found if "sheet" in mesh.cell_data else found[:1]
    if "aha" in mesh.cell_data:
        cells["aha"] = (np.asarray(mesh.cell_data["aha"]),)
    cells |= {f"cell_{field.name}": _parts(field) for field in of_cells}
    places = {MEDIT_SECTIONS[kind]: own for kind, _, own in block_rows(mesh.cells)}
    _write_solutions(folder, stem, places, cells)
    at_points = {f"point_{field.name}": _parts(field) for field in of_points}
    _write_solutions(folder, stem, {"Vertices": slice(None)}, at_points)


def _parts(field: UserField) -> tuple[np.ndarray, ...]:
    """A vector as such, others by their components: Medit knows but scalars, vectors and symmetric tensors."""
    return (field.values,) if field.values.shape[1] == 3 else tuple(values for _, values in field.columns())


def _mesh(mesh: VolumeMesh, options: ExportOptions) -> Iterator[str]:
    units = UNITS[options.length_unit]
    yield f"MeshVersionFormatted 2\n\n# {OURS}; {units.line}\n" + verdict_comments(mesh, "#")
    names = {**region_names(mesh), **facet_names(mesh)}
    yield "".join(f"# {tag} {name}\n" for name, tag in names.items())
    yield f"\nDimension 3\n\nVertices\n{len(mesh.points)}\n"
    yield from lines(mesh.points * units.per_mm, np.zeros(len(mesh.points), dtype=int), separator=" ", width=None)
    for blocks, tags in ((mesh.facets, mesh.facet_tag), (mesh.cells, mesh.region)):
        for kind, block, own in block_rows(blocks):
            yield f"\n{MEDIT_SECTIONS[kind]}\n{len(block)}\n"
            yield from lines(block + 1, tags[own], separator=" ")
    yield "\nEnd\n"


def _write_solutions(folder: Path, stem: str, places: Mapping[str, slice], files: Mapping[str, Any]) -> None:
    """Write a ``.sol`` file of fields for each name, with a section for each kind of element, or for the points."""
    for name, fields in files.items():
        # Number of fields, and of each its kind: 1 is a scalar, 2 a vector.
        kinds = f"{len(fields)} {' '.join(str(values.ndim) for values in fields)}"
        with (folder / f"{stem}.{name}.sol").open("w", encoding="ascii", newline="\n") as file:
            file.write("MeshVersionFormatted 2\n\nDimension 3\n")
            for section, own in places.items():
                file.write(f"\nSolAt{section}\n{len(fields[0][own])}\n{kinds}\n")
                file.writelines(lines(*(values[own] for values in fields), separator=" ", width=None))
            file.write("\nEnd\n")
