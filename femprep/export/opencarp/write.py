"""A volume mesh to openCARP: ``.pts .elem .lon``, ``.surf .vtx`` of every facet tag, UVC, a ``.par`` to start from."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

import numpy as np

from femprep.export.deck.fibres import directions
from femprep.export.deck.fields import user_fields
from femprep.export.deck.names import facet_names, facet_nodes, region_names
from femprep.export.deck.split import linear
from femprep.export.deck.springs import RING, ring_nodes
from femprep.export.deck.text import lines, rows
from femprep.export.opencarp.binary import write_directions, write_elements, write_points
from femprep.export.opencarp.par import parameters, waves
from femprep.export.opencarp.uvc import universal
from femprep.export.purkinje import PURKINJE, directions_of
from femprep.mesh.elements import FACET_CORNERS
from femprep.model import FloatArray, IntArray, PurkinjeNet, TagArray, VolumeMesh, is_blood
from femprep.model.blocks import block_rows, chosen_rows
from femprep.options import ExportOptions

log = logging.getLogger(__name__)

#: openCARP's element types, and which of our nodes each of theirs is: the second face of a prism and of a
#: hexahedron runs the other way round (meshtool's topology utilities list the faces).
CARP_TYPES: Final = {
    "tetra": ("Tt", (0, 1, 2, 3)),
    "wedge": ("Pr", (0, 1, 2, 3, 5, 4)),
    "hexahedron": ("Hx", (0, 1, 2, 3, 4, 7, 6, 5)),
}
CARP_FACETS: Final = {3: "Tr", 4: "Qd"}
#: Facets of ``.surf`` are wound to see the element, as MeshTool winds them; ours are wound to be seen from outside.
INWARD: Final = {3: (0, 2, 1), 4: (0, 3, 2, 1)}
MICROMETRES: Final = 1000.0
#: The fibre of tissue that has none, as MeshTool writes it: an element with a fibre of no length is bath.
NO_FIBRE: Final = (1.0, 0.0, 0.0)


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.pts``, ``.elem`` (with the region tag), ``.lon``, and ``stem.<tag>.surf`` and ``.vtx``.

    openCARP measures in micrometres, whatever the unit option says, numbers from 0, and knows linear elements alone:
    of quadratic ones the corners are written. ``.lon`` holds the fibre of each element, and the sheet where there is
    one; tissue without fibres has ``1 0 0``, and blood ``0 0 0``, by which openCARP and MeshTool tell a bath.
    ``stem.tags.txt`` names the tags, ``stem.aha.dat`` holds the AHA segment of each element, ``stem.uvc_*.dat`` the
    ventricular coordinates of each point, and ``stem.par`` is a beat that starts at the nodes of the endocardia.

    Fields of the user's are ``stem.cell_<name>.dat`` and ``stem.point_<name>.dat``, with a number behind the name for
    each component of a vector.

    Purkinje fibres are a mesh of their own, ``stem.purkinje.pts``, ``.elem`` (lines, ``Ln``) and ``.lon``;
    ``stem.purkinje.dat`` tells for each of its points which point of ``stem.pts`` it is, or -1, below a line with the
    speed. The beat then enters the wall at their junctions, by the time of arrival in steps of 2 ms:
    ``stem.purkinje_<ms>.vtx``.
    """
    mesh = linear(mesh, "openCARP")
    with (folder / f"{stem}.pts").open("w", encoding="ascii", newline="\n") as file:
        file.write(f"{len(mesh.points)}\n")
        file.writelines(lines(mesh.points * MICROMETRES, separator=" ", width=None))
    with (folder / f"{stem}.elem").open("w", encoding="ascii", newline="\n") as file:
        file.write(f"{mesh.n_cells}\n")
        for name, nodes, tag in _elements(mesh):
            file.writelines(lines(nodes, tag, separator=" ", before=f"{name} "))
    with (folder / f"{stem}.lon").open("w", encoding="ascii", newline="\n") as file:
        axes = _axes(mesh)
        file.write(f"{len(axes)}\n")
        file.writelines(lines(*axes, separator=" ", width=None))
    _write_beside(mesh, folder, stem)


def write_binary(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.bpts``, ``.belem`` and ``.blon`` for ``.pts .elem .lon``, single precision, the same beside.

    Millions of elements are written and read in a second; openCARP and MeshTool take either.
    """
    mesh = linear(mesh, "openCARP")
    write_points(folder / f"{stem}.bpts", mesh.points * MICROMETRES)
    write_elements(folder / f"{stem}.belem", list(_elements(mesh)))
    write_directions(folder / f"{stem}.blon", _axes(mesh))
    _write_beside(mesh, folder, stem)


def _elements(mesh: VolumeMesh) -> Iterator[tuple[str, IntArray, TagArray]]:
    """openCARP's type, its nodes in openCARP's order and the tag of each element, block by block."""
    for kind, block, own in block_rows(mesh.cells):
        name, order = CARP_TYPES[kind]
        yield name, block[:, list(order)], mesh.region[own]


def _write_beside(mesh: VolumeMesh, folder: Path, stem: str) -> None:
    """Write what is text always: facets, their nodes, data, names, a beat."""
    nodes = {name: facet_nodes(mesh, tag) for name, tag in facet_names(mesh).items()}
    for name, tag in facet_names(mesh).items():
        _write(folder / f"{stem}.{name}.surf", _surface(mesh, tag))
    if (ring := ring_nodes(mesh)).size:
        nodes[RING] = ring
    if mesh.purkinje is not None:
        _write_net(mesh.purkinje, folder, f"{stem}.{PURKINJE}")
        nodes |= waves(mesh.purkinje)
    for name, own in nodes.items():
        (folder / f"{stem}.{name}.vtx").write_text(f"{len(own)}\nextra\n{rows(own)}", encoding="ascii")
    if "aha" in mesh.cell_data:
        _write(folder / f"{stem}.aha.dat", lines(np.asarray(mesh.cell_data["aha"])))
    for kind, fields in zip(("cell", "point"), user_fields(mesh)):
        for name, values in (column for field in fields for column in field.columns()):
            _write(folder / f"{stem}.{kind}_{name}.dat", lines(values, width=None))
    for name, values in universal(mesh).items():
        _write(folder / f"{stem}.uvc_{name}.dat", lines(values, width=None))
    (folder / f"{stem}.par").write_text(parameters(mesh, stem), encoding="utf-8")
    names = {**region_names(mesh), **facet_names(mesh)}
    (folder / f"{stem}.tags.txt").write_text("".join(f"{tag} {name}\n" for name, tag in names.items()), "utf-8")


def _write(path: Path, text: Iterable[str]) -> None:
    with path.open("w", encoding="ascii", newline="\n") as file:
        file.writelines(text)


def _write_net(net: PurkinjeNet, folder: Path, stem: str) -> None:
    """Purkinje fibres as a mesh of lines, and which points of the wall's mesh its own are."""
    lined = "".join(f"Ln {line}\n" for line in rows(net.edges, net.edge_tag, separator=" ").splitlines())
    places = rows(net.points * MICROMETRES, separator=" ", width=None)
    (folder / f"{stem}.pts").write_text(f"{len(net.points)}\n{places}", encoding="ascii")
    (folder / f"{stem}.elem").write_text(f"{len(net.edges)}\n{lined}", encoding="ascii")
    (folder / f"{stem}.lon").write_text(f"1\n{rows(directions_of(net), separator=' ', width=None)}", encoding="ascii")
    (folder / f"{stem}.dat").write_text(f"# {net.speed!r} m/s\n{rows(net.mesh_point)}", encoding="ascii")


def _axes(mesh: VolumeMesh) -> tuple[FloatArray, ...]:
    """The directions of ``.lon``, an element a row of each."""
    found = directions(mesh)
    if found is None:
        axes: tuple[FloatArray, ...] = (np.tile(NO_FIBRE, (mesh.n_cells, 1)),)
    else:
        axes = found if "sheet" in mesh.cell_data else found[:1]
    blood = is_blood(mesh.region)
    return tuple(np.where(blood[:, None], 0.0, one) for one in axes) if blood.any() else axes


def _surface(mesh: VolumeMesh, tag: int) -> Iterator[str]:
    found = chosen_rows(mesh.facets, mesh.facet_tag == tag)
    yield f"{sum(map(len, found.values()))}\n"
    for kind, chosen in found.items():
        corners = FACET_CORNERS[kind]
        yield from lines(chosen[:, list(INWARD[corners])], separator=" ", before=f"{CARP_FACETS[corners]} ")
