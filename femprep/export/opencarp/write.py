"""A volume mesh to openCARP: ``.pts .elem .lon``, ``.surf .vtx`` of every facet tag, UVC, a ``.par`` to start from."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Final

import numpy as np

from femprep.export.fibres import directions
from femprep.export.names import facet_names, facet_nodes, region_names
from femprep.export.opencarp.par import parameters, waves
from femprep.export.opencarp.uvc import universal
from femprep.export.purkinje import PURKINJE, directions_of
from femprep.export.split import linear
from femprep.export.springs import RING, ring_nodes
from femprep.export.text import rows
from femprep.mesh.elements import FACET_CORNERS
from femprep.model import FloatArray, PurkinjeNet, VolumeMesh, is_blood
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

    Purkinje fibres are a mesh of their own, ``stem.purkinje.pts``, ``.elem`` (lines, ``Ln``) and ``.lon``;
    ``stem.purkinje.dat`` tells for each of its points which point of ``stem.pts`` it is, or -1, below a line with the
    speed. The beat then enters the wall at their junctions, by the time of arrival in steps of 2 ms:
    ``stem.purkinje_<ms>.vtx``.
    """
    mesh = linear(mesh, "openCARP")
    with (folder / f"{stem}.pts").open("w", encoding="ascii", newline="\n") as file:
        file.write(f"{len(mesh.points)}\n" + rows(mesh.points * MICROMETRES, separator=" ", width=None))
    with (folder / f"{stem}.elem").open("w", encoding="ascii", newline="\n") as file:
        file.write(f"{mesh.n_cells}\n")
        for kind, block, own in block_rows(mesh.cells):
            name, order = CARP_TYPES[kind]
            text = rows(block[:, list(order)], mesh.region[own], separator=" ")
            file.write("".join(f"{name} {line}\n" for line in text.splitlines()))
    with (folder / f"{stem}.lon").open("w", encoding="ascii", newline="\n") as file:
        axes = _axes(mesh)
        file.write(f"{axes.shape[1] // 3}\n" + rows(axes, separator=" ", width=None))
    for name, tag in facet_names(mesh).items():
        (folder / f"{stem}.{name}.surf").write_text(_surface(mesh, tag), encoding="ascii")
        nodes = facet_nodes(mesh, tag)
        (folder / f"{stem}.{name}.vtx").write_text(f"{len(nodes)}\nextra\n{rows(nodes)}", encoding="ascii")
    if (ring := ring_nodes(mesh)).size:
        (folder / f"{stem}.{RING}.vtx").write_text(f"{len(ring)}\nextra\n{rows(ring)}", encoding="ascii")
    if mesh.purkinje is not None:
        _write_net(mesh.purkinje, folder, f"{stem}.{PURKINJE}")
        for name, nodes in waves(mesh.purkinje).items():
            (folder / f"{stem}.{name}.vtx").write_text(f"{len(nodes)}\nextra\n{rows(nodes)}", encoding="ascii")
    if "aha" in mesh.cell_data:
        (folder / f"{stem}.aha.dat").write_text(rows(np.asarray(mesh.cell_data["aha"])), encoding="ascii")
    for name, values in universal(mesh).items():
        (folder / f"{stem}.uvc_{name}.dat").write_text(rows(values, width=None), encoding="ascii")
    (folder / f"{stem}.par").write_text(parameters(mesh, stem), encoding="utf-8")
    names = {**region_names(mesh), **facet_names(mesh)}
    (folder / f"{stem}.tags.txt").write_text("".join(f"{tag} {name}\n" for name, tag in names.items()), "utf-8")


def _write_net(net: PurkinjeNet, folder: Path, stem: str) -> None:
    """Purkinje fibres as a mesh of lines, and which points of the wall's mesh its own are."""
    lines = "".join(f"Ln {line}\n" for line in rows(net.edges, net.edge_tag, separator=" ").splitlines())
    places = rows(net.points * MICROMETRES, separator=" ", width=None)
    (folder / f"{stem}.pts").write_text(f"{len(net.points)}\n{places}", encoding="ascii")
    (folder / f"{stem}.elem").write_text(f"{len(net.edges)}\n{lines}", encoding="ascii")
    (folder / f"{stem}.lon").write_text(f"1\n{rows(directions_of(net), separator=' ', width=None)}", encoding="ascii")
    (folder / f"{stem}.dat").write_text(f"# {net.speed!r} m/s\n{rows(net.mesh_point)}", encoding="ascii")


def _axes(mesh: VolumeMesh) -> FloatArray:
    """The numbers of ``.lon``, an element a row."""
    found = directions(mesh)
    if found is None:
        axes = np.tile(NO_FIBRE, (mesh.n_cells, 1))
    else:
        axes = np.hstack(found) if "sheet" in mesh.cell_data else found[0].copy()
    axes[is_blood(mesh.region)] = 0.0
    return axes


def _surface(mesh: VolumeMesh, tag: int) -> str:
    lines = []
    for kind, chosen in chosen_rows(mesh.facets, mesh.facet_tag == tag).items():
        corners = FACET_CORNERS[kind]
        text = rows(chosen[:, list(INWARD[corners])], separator=" ")
        lines += [f"{CARP_FACETS[corners]} {line}\n" for line in text.splitlines()]
    return f"{len(lines)}\n" + "".join(lines)
