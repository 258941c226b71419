"""A volume mesh to FEBio 4 (``.feb``): parts, sets, surfaces, material axes, and a model that runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.export.deck.fibres import directions, segments
from femprep.export.deck.fields import UserField, user_fields
from femprep.export.deck.material import orthotropic, shear_and_bulk
from femprep.export.deck.names import facet_names, facet_nodes, region_names
from femprep.export.deck.springs import RING, has_pericardium, ring_nodes
from femprep.export.deck.text import wrapped
from femprep.export.deck.units import UNITS, Units
from femprep.export.febio.step import CONTROL, INWARD, epicardium, inflation, stiffness
from femprep.export.verdict import verdict_lines
from femprep.mesh.operations.turned import turned_facets
from femprep.model import IntArray, VolumeMesh
from femprep.model.blocks import block_rows, chosen_rows
from femprep.options import ExportOptions

#: FEBio's element and facet types; their node order is ours.
FEBIO_TYPES: Final = {
    "tetra": "tet4",
    "tetra10": "tet10",
    "wedge": "penta6",
    "wedge15": "penta15",
    "hexahedron": "hex8",
    "hexahedron20": "hex20",
}
FEBIO_FACETS: Final = {"triangle": "tri3", "triangle6": "tri6", "quad": "quad4", "quad8": "quad8"}


@dataclass(frozen=True)
class _Part:
    """One ``Elements`` block: a region's elements of one type, and which rows of the mesh they are."""

    name: str
    kind: str
    row: IntArray
    nodes: IntArray


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.feb``.

    A part (``Elements`` and domain) is named by its region, with the element type where a region has several.
    Element numbers follow the parts. ``NodeSet`` and ``Surface`` carry the facet tag's name, ``ElementSet`` those of
    regions and AHA segments; fibre and sheet are the material axes of every element, fields of the user's are maps of
    their name. The material is that of the
    options, so that FEBio reads the file with and without the inflation step.
    """
    with (folder / f"{stem}.feb").open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(_document(mesh, options))


def _document(mesh: VolumeMesh, options: ExportOptions) -> Iterator[str]:
    units = UNITS[options.length_unit]
    parts = _parts(mesh)
    yield f'<?xml version="1.0" encoding="UTF-8"?>\n<!-- femprep volume mesh; {units.line} -->\n'
    yield "".join(f"<!-- {line} -->\n" for line in verdict_lines(mesh))
    yield '<febio_spec version="4.0">\n<Module type="solid"/>\n'
    if options.step == "inflation":
        yield CONTROL
    yield f'<Material>\n<material id="1" name="myocardium" type="{_TYPES[options.material]}">\n'
    yield f"<density>{_density(options):.12g}</density>\n{_constants(options, units)}</material>\n</Material>\n"
    yield "<Mesh>\n"
    yield from _mesh(mesh, parts, units)
    yield "</Mesh>\n<MeshDomains>\n"
    yield "".join(f'<SolidDomain name="{part.name}" mat="myocardium"/>\n' for part in parts)
    yield "</MeshDomains>\n"
    yield from _mesh_data(mesh, parts, options)
    if options.step == "inflation":
        yield inflation(mesh, options)
    yield '<Output>\n<plotfile type="febio">\n<var type="displacement"/>\n<var type="stress"/>\n'
    yield '<var type="reaction forces"/>\n</plotfile>\n</Output>\n</febio_spec>\n'


def _mesh_data(mesh: VolumeMesh, parts: list[_Part], options: ExportOptions) -> Iterator[str]:
    """Material axes, the stiffness of the pericardium, and fields of the user's."""
    found, (of_cells, of_points) = directions(mesh), user_fields(mesh)
    if not (found or has_pericardium(mesh) or of_cells or of_points):
        return
    yield "<MeshData>\n"
    for part in parts if found else ():
        assert found
        yield f'<ElementData type="mat_axis" elem_set="{part.name}">\n'
        yield _axes(found[0][part.row], found[1][part.row])
        yield "</ElementData>\n"
    if has_pericardium(mesh):
        yield from stiffness(mesh, options)
    for field in of_cells:
        for part in parts:  # FEBio joins those of one name
            yield from _data(f'ElementData elem_set="{part.name}"', "e", field, part.row)
    for field in of_points:
        yield from _data('NodeData node_set="all"', "node", field, slice(None))
    yield "</MeshData>\n"


def _data(section: str, tag: str, field: UserField, rows: Any) -> Iterator[str]:
    """A field over some elements or nodes: a vector as such, others by their components."""
    for name, values in [(field.name, field.values)] if field.values.shape[1] == 3 else field.columns():
        yield f'<{section} name="{name}" data_type="{"vec3" if values.ndim == 2 else "scalar"}">\n'
        table = enumerate(values[rows].reshape(-1, values[0].size).tolist(), start=1)
        yield "".join(f'<{tag} lid="{i}">{",".join(map(repr, row))}</{tag}>\n' for i, row in table)
        yield f"</{section.split()[0]}>\n"


def _parts(mesh: VolumeMesh) -> list[_Part]:
    parts = []
    blocks: dict[str, list[tuple[str, IntArray, IntArray]]] = {}
    for kind, block, rows in block_rows(mesh.cells):
        for name, tag in region_names(mesh).items():
            row = np.flatnonzero(mesh.region[rows] == tag)
            if row.size:
                blocks.setdefault(name, []).append((kind, row + rows.start, block[row]))
    for name, found in blocks.items():
        for kind, row, nodes in found:
            parts.append(_Part(name if len(found) == 1 else f"{name}_{FEBIO_TYPES[kind]}", kind, row, nodes))
    return parts


def _mesh(mesh: VolumeMesh, parts: list[_Part], units: Units) -> Iterator[str]:
    points = (mesh.points * units.per_mm).tolist()
    yield '<Nodes name="all">\n'
    yield "".join(f'<node id="{i}">{x!r},{y!r},{z!r}</node>\n' for i, (x, y, z) in enumerate(points, start=1))
    yield "</Nodes>\n"
    first = 1
    number = np.empty(mesh.n_cells, dtype=np.int64)
    for part in parts:
        number[part.row] = np.arange(first, first + len(part.row))
        yield f'<Elements type="{FEBIO_TYPES[part.kind]}" name="{part.name}">\n'
        yield _numbered("elem", part.nodes + 1, first)
        yield "</Elements>\n"
        first += len(part.row)
    for name, tag in facet_names(mesh).items():
        yield f'<NodeSet name="{name}">\n{wrapped(facet_nodes(mesh, tag) + 1, 16, ",", ",")}</NodeSet>\n'
    if (ring := ring_nodes(mesh)).size:
        yield f'<NodeSet name="{RING}">\n{wrapped(ring + 1, 16, ",", ",")}</NodeSet>\n'
    yield from _surfaces(mesh)
    names = {part.name for part in parts}
    rows = {name: np.flatnonzero(mesh.region == tag) for name, tag in region_names(mesh).items()}
    for name, row in {**rows, **segments(mesh)}.items():
        if name not in names:  # FEBio makes an element set of every part by itself
            yield f'<ElementSet name="{name}">\n{wrapped(np.sort(number[row]), 16, ",", ",")}</ElementSet>\n'


def _surfaces(mesh: VolumeMesh) -> Iterator[str]:
    for name, tag in facet_names(mesh).items():
        yield f'<Surface name="{name}">\n'
        for kind, nodes, rows in block_rows(chosen_rows(mesh.facets, mesh.facet_tag == tag)):
            yield _numbered(FEBIO_FACETS[kind], nodes + 1, rows.start + 1)
        yield "</Surface>\n"
    if has_pericardium(mesh):
        yield f'<Surface name="{INWARD}">\n'
        for kind, nodes, rows in block_rows(epicardium(mesh)):
            yield _numbered(FEBIO_FACETS[kind], turned_facets(kind, nodes) + 1, rows.start + 1)
        yield "</Surface>\n"


def _numbered(tag: str, nodes: IntArray, first: int) -> str:
    return "".join(
        f'<{tag} id="{i}">{",".join(map(str, row))}</{tag}>\n' for i, row in enumerate(nodes.tolist(), start=first)
    )


def _axes(fiber: np.ndarray, sheet: np.ndarray) -> str:
    pairs = zip(fiber.tolist(), sheet.tolist())
    return "".join(
        f'<elem lid="{i}"><a>{a[0]!r},{a[1]!r},{a[2]!r}</a><d>{d[0]!r},{d[1]!r},{d[2]!r}</d></elem>\n'
        for i, (a, d) in enumerate(pairs, start=1)
    )


#: With large displacements ``isotropic elastic`` is St. Venant and Kirchhoff's law. FEBio's ``neo-Hookean`` is another
#: energy than the one of that name in Abaqus and CalculiX, which the Mooney-Rivlin material has with ``c2`` of zero.
_TYPES: Final = {
    "linear": "isotropic elastic",
    "neo-hookean": "Mooney-Rivlin",
    "orthotropic": "orthotropic elastic",
}


def _density(options: ExportOptions) -> float:
    """Density of myocardium, 1060 kg/m3, in the units of the deck."""
    return {"mm": 1.06e-9, "cm": 1.06, "m": 1060.0}[options.length_unit]


def _constants(options: ExportOptions, units: Units) -> str:
    scale = units.per_kpa
    if options.material == "neo-hookean":
        shear, bulk = (modulus * scale for modulus in shear_and_bulk(options))
        return f"<c1>{shear / 2:.12g}</c1>\n<c2>0</c2>\n<k>{bulk:.12g}</k>\n<pressure_model>Abaqus</pressure_model>\n"
    if options.material == "linear":
        return f"<E>{options.young_modulus * scale:.12g}</E>\n<v>{options.poisson_ratio:.12g}</v>\n"
    m = orthotropic(options)
    values = {"E1": m.e1, "E2": m.e2, "E3": m.e3, "G12": m.g12, "G23": m.g23, "G31": m.g13}
    lines = [f"<{name}>{value * scale:.12g}</{name}>" for name, value in values.items()]
    # FEBio asks for v31, the contraction along 1 when pulled along 3.
    ratios = {"v12": m.nu12, "v23": m.nu23, "v31": m.nu13 * m.e3 / m.e1}
    return "\n".join([*lines, *(f"<{name}>{value:.12g}</{name}>" for name, value in ratios.items())]) + "\n"
