"""A volume mesh to an Abaqus and CalculiX deck (``.inp``): elements, sets and element surfaces for every tag."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.export.abaqus.springs import springs
from femprep.export.abaqus.step import initial_fields, orientation, step
from femprep.export.deck.fibres import segments
from femprep.export.deck.fields import user_fields
from femprep.export.deck.names import facet_names, facet_nodes, region_names, region_nodes
from femprep.export.deck.springs import RING, ring_nodes
from femprep.export.deck.text import lines, rows, wrapped
from femprep.export.deck.units import UNITS
from femprep.export.verdict import verdict_comments
from femprep.mesh.elements import match_facets
from femprep.model import IntArray, VolumeMesh
from femprep.model.blocks import block_rows
from femprep.options import ExportOptions

#: Element types; node order and face order (S1, S2...) are those of ``femprep.mesh.elements``.
ABAQUS_TYPES: Final = {
    "tetra": "C3D4",
    "tetra10": "C3D10",
    "wedge": "C3D6",
    "wedge15": "C3D15",
    "hexahedron": "C3D8",
    "hexahedron20": "C3D20",
}


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.inp``.

    ``ELSET`` and ``NSET`` of a region carry its name; so do ``NSET`` and ``SURFACE`` of a facet tag. ``EALL`` and
    ``NALL`` are everything; ``aha_1``... are the AHA segments. Fibres and sheets are the orientation ``fibres``.

    Fields of the user's are in ``stem.fields.inp``, which Abaqus reads where a deck includes it.
    """
    fields = user_fields(mesh)
    beside = f"{stem}.fields.inp" if any(fields) else ""
    for name, parts in ((f"{stem}.inp", _parts(mesh, options, beside)), (beside, initial_fields(*fields))):
        if name:
            with (folder / name).open("w", encoding="ascii", errors="replace", newline="\n") as file:
                file.writelines(parts)


def _parts(mesh: VolumeMesh, options: ExportOptions, fields: str) -> Iterator[str]:
    units = UNITS[options.length_unit]
    regions, facets = region_names(mesh), facet_names(mesh)
    yield "*HEADING\nfemprep volume mesh\n"
    yield f"** Units: {units.line}\n" + verdict_comments(mesh, "**")
    yield "** Tags: " + " ".join(f"{name}={tag}" for name, tag in {**regions, **facets}.items()) + "\n"
    if fields:
        yield f"** Further fields of elements and nodes, for Abaqus: *INCLUDE, INPUT={fields}\n"
    yield "*NODE, NSET=NALL\n"
    yield from lines(np.arange(1, len(mesh.points) + 1), mesh.points * units.per_mm)
    numbers = np.arange(1, mesh.n_cells + 1)
    for kind, block, own in block_rows(mesh.cells):
        yield f"*ELEMENT, TYPE={ABAQUS_TYPES[kind]}, ELSET=EALL\n"
        yield from element_rows(numbers[own], block + 1)
    for name, tag in regions.items():
        yield f"*ELSET, ELSET={name}\n" + wrapped(np.flatnonzero(mesh.region == tag) + 1, 16)
        yield f"*NSET, NSET={name}\n" + wrapped(region_nodes(mesh, tag) + 1, 16)
    for name, members in segments(mesh).items():
        yield f"*ELSET, ELSET={name}\n" + wrapped(members + 1, 16)
    element, face = match_facets(mesh.cells, mesh.facets)
    if np.any(element < 0):
        raise InputError(
            f"facet {int(np.flatnonzero(element < 0)[0])} lies on no element, and {int(np.sum(element < 0))} in all; "
            "an element surface needs facets that are faces of elements"
        )
    for name, tag in facets.items():
        chosen = mesh.facet_tag == tag
        yield f"*NSET, NSET={name}\n" + wrapped(facet_nodes(mesh, tag) + 1, 16)
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT\n" + surface_rows(element[chosen], face[chosen])
    if (ring := ring_nodes(mesh)).size:
        yield f"*NSET, NSET={RING}\n" + wrapped(ring + 1, 16)
    yield from orientation(mesh)
    yield from springs(mesh, options)
    yield from step(mesh, options)


def element_rows(numbers: IntArray, nodes: IntArray) -> Iterator[str]:
    """Number and nodes of each element; those with more than fifteen nodes go on in a second line."""
    if nodes.shape[1] <= 15:
        yield from lines(numbers, nodes)
        return
    for one, two in zip(lines(numbers, nodes[:, :15]), lines(nodes[:, 15:])):
        yield "".join(f"{a},\n{b}\n" for a, b in zip(one.splitlines(), two.splitlines()))


def surface_rows(element: IntArray, face: IntArray) -> str:
    """Element number and face label (S1, S2...) of each facet."""
    return rows(element + 1, np.array([f"S{number}" for number in range(1, 7)])[face])
