"""A volume mesh to openCARP: ``.pts .elem .lon``, and ``.surf .vtx`` for every facet tag, in micrometres."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Final

import numpy as np

from femprep.export.fibres import directions
from femprep.export.names import facet_names, facet_nodes, region_names
from femprep.export.split import linear
from femprep.export.text import rows
from femprep.mesh.elements import FACET_CORNERS
from femprep.model import VolumeMesh
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
MICROMETRES: Final = 1000.0


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.pts``, ``.elem`` (with the region tag), ``.lon``, and ``stem.<tag>.surf`` and ``.vtx``.

    openCARP measures in micrometres, whatever the unit option says, numbers from 0, and knows linear elements alone:
    of quadratic ones the corners are written. ``.lon`` holds the fibre of each element, and the sheet where there is
    one; without fibres it holds zeros, which openCARP takes as isotropic. ``stem.tags.txt`` names the tags,
    ``stem.aha.dat`` holds the AHA segment of each element.
    """
    mesh = linear(mesh, "openCARP")
    with (folder / f"{stem}.pts").open("w", encoding="ascii", newline="\n") as file:
        file.write(f"{len(mesh.points)}\n" + rows(mesh.points * MICROMETRES, separator=" ", width=None))
    with (folder / f"{stem}.elem").open("w", encoding="ascii", newline="\n") as file:
        file.write(f"{mesh.n_cells}\n")
        first = 0
        for kind, block in mesh.cells.items():
            name, order = CARP_TYPES[kind]
            text = rows(block[:, list(order)], mesh.region[first : first + len(block)], separator=" ")
            file.write("".join(f"{name} {line}\n" for line in text.splitlines()))
            first += len(block)
    with (folder / f"{stem}.lon").open("w", encoding="ascii", newline="\n") as file:
        found = directions(mesh)
        if found is None:
            file.write("1\n" + "0 0 0\n" * mesh.n_cells)
        elif "sheet" in mesh.cell_data:
            file.write("2\n" + rows(*found, separator=" ", width=None))
        else:
            file.write("1\n" + rows(found[0], separator=" ", width=None))
    for name, tag in facet_names(mesh).items():
        (folder / f"{stem}.{name}.surf").write_text(_surface(mesh, tag), encoding="ascii")
        nodes = facet_nodes(mesh, tag)
        (folder / f"{stem}.{name}.vtx").write_text(f"{len(nodes)}\nextra\n{rows(nodes)}", encoding="ascii")
    if "aha" in mesh.cell_data:
        (folder / f"{stem}.aha.dat").write_text(rows(np.asarray(mesh.cell_data["aha"])), encoding="ascii")
    names = {**region_names(mesh), **facet_names(mesh)}
    (folder / f"{stem}.tags.txt").write_text("".join(f"{tag} {name}\n" for name, tag in names.items()), "utf-8")


def _surface(mesh: VolumeMesh, tag: int) -> str:
    lines, first = [], 0
    for kind, block in mesh.facets.items():
        corners = FACET_CORNERS[kind]
        chosen = block[mesh.facet_tag[first : first + len(block)] == tag][:, :corners]
        lines += [f"{CARP_FACETS[corners]} {line}\n" for line in rows(chosen, separator=" ").splitlines()]
        first += len(block)
    return f"{len(lines)}\n" + "".join(lines)
