"""The one table of file formats: names, endings, where each is written, what it carries, who has read it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Final

from femprep.errors import OptionError
from femprep.model import VolumeMesh
from femprep.options import ExportOptions

#: Writes a mesh as files into a folder that exists: ``writer(mesh, folder, stem, options)``.
Writer = Callable[[VolumeMesh, Path, str, ExportOptions], None]


@dataclass(frozen=True)
class Format:
    """One file format.

    Attributes
    ----------
    name : str
        Its name on the command line.
    endings : tuple of str
        File endings that mean this format; empty where the name has to be given.
    filename : str
        Where it goes in an output folder; the ending is the one ``write_mesh`` takes.
    home : str
        ``module:function`` of ``femprep.export`` that writes it.
    program : str
        For whom it is.
    carries : str
        What of a mesh it holds.
    elements : str
        Which elements it holds, and what becomes of the others.
    units : str
        In which unit of length it is, and whether the file names it.
    read_by : str
        The programs that read it in our tests.
    unread_by : str
        The programs it is meant for that our tests do not run.
    folder : bool
        Whether the path names a folder of files instead of one file.
    """

    name: str
    endings: tuple[str, ...]
    filename: str
    home: str
    program: str
    carries: str
    elements: str
    units: str
    read_by: str
    unread_by: str = ""
    folder: bool = False

    @property
    def writer(self) -> Writer:
        """The function that writes it."""
        module, function = self.home.split(":")
        writer: Writer = getattr(import_module(f"femprep.export.{module}"), function)
        return writer


FORMATS: Final[Mapping[str, Format]] = MappingProxyType(
    {
        entry.name: entry
        for entry in (
            Format(
                "vtu",
                (".vtu",),
                "mesh.vtu",
                "vtu:write",
                "VTK, ParaView",
                "regions, facet tags, all cell and point data, names, planes (facets as field data)",
                "all",
                "mm",
                "VTK, meshio",
            ),
            Format(
                "abaqus",
                (".inp",),
                "mesh.inp",
                "abaqus:write",
                "Abaqus, CalculiX",
                "regions and AHA segments (ELSET, NSET), facet tags (NSET, element SURFACE), fibres and sheets "
                "(DISTRIBUTION, ORIENTATION), three materials and an inflation step on request",
                "all",
                "as asked, named in the file",
                "CalculiX",
                "Abaqus",
            ),
            Format(
                "dolfinx",
                (),
                "dolfinx/mesh.xdmf",
                "xdmf:write",
                "dolfinx, cardiac_geometries",
                "cell tags, facet tags, names (markers.json), fibres and other cell and point data (cardiac_geometries "
                "takes the fibres by examples/cardiac_geometries_fibres.py)",
                "tetra, tetra10, hexahedron; of hexahedron20 the corners; others cut into tetrahedra",
                "as asked, named in info.json",
                "dolfinx 0.5; cardiac_geometries 0.12 on dolfinx 0.9, where a Python has them",
            ),
            Format(
                "fenics",
                (),
                "fenics/mesh.xdmf",
                "xdmf:write_fenics",
                "legacy FEniCS",
                "as dolfinx, and fibres and sheets as checkpoints",
                "tetra; others cut into tetrahedra",
                "as asked, named in info.json",
                "dolfin 2019.2",
            ),
            Format(
                "gmsh",
                (".msh",),
                "mesh.msh",
                "gmsh:write",
                "Gmsh 2.2, scikit-fem, dolfinx, many more",
                "regions and facet tags as named physical groups, point data",
                "all",
                "as asked, named in the file",
                "Gmsh, scikit-fem, dolfinx 0.5 (through gmsh), meshio",
            ),
            Format(
                "gmsh41",
                (),
                "mesh41.msh",
                "gmsh:write_41",
                "Gmsh 4.1, dolfinx",
                "regions and facet tags as entities and named physical groups, cell, facet and point data",
                "all",
                "as asked, named in the file",
                "Gmsh, dolfinx 0.5 (through gmsh), meshio",
            ),
            Format(
                "febio",
                (".feb",),
                "mesh.feb",
                "febio:write",
                "FEBio 4",
                "parts, regions and AHA segments (ElementSet), facet tags (NodeSet, Surface), fibres and sheets "
                "(mat_axis), three materials and an inflation step on request",
                "all",
                "as asked, named in the file",
                "febio-python",
                "FEBio",
            ),
            Format(
                "opencarp",
                (".pts",),
                "opencarp/mesh.pts",
                "opencarp:write",
                "openCARP, meshtool",
                "region tags, fibres and sheets (.lon), facet tags (.surf, .vtx), AHA segments (.dat)",
                "linear; of quadratic ones the corners",
                "micrometres",
                "a parser after meshtool's sources",
                "openCARP, meshtool",
            ),
            Format(
                "svmultiphysics",
                (),
                "svmultiphysics",
                "svmultiphysics:write",
                "svMultiPhysics, SimVascular",
                "mesh-complete folder: regions (DOMAIN_ID), faces with global numbers, fibres and sheets (FIB_DIR), "
                "cell and point data",
                "all",
                "as asked, not named",
                "VTK",
                "svMultiPhysics",
                folder=True,
            ),
            Format(
                "med",
                (".med",),
                "mesh.med",
                "med:write",
                "Salome, code_aster",
                "groups for regions, AHA segments, facets and their nodes, fibres and other data as fields",
                "all",
                "as asked, named in the file",
                "medconforme, Gmsh, meshio",
                "Salome, code_aster",
            ),
            Format(
                "medit",
                (".mesh",),
                "mesh.mesh",
                "medit:write",
                "FreeFEM, MMG",
                "regions and facet tags as references, fibres, sheets and AHA segments (.sol)",
                "linear; of quadratic ones the corners",
                "as asked, named in the file",
                "FreeFEM, meshio",
            ),
            Format(
                "ls-dyna",
                (".k",),
                "mesh.k",
                "lsdyna:write",
                "LS-DYNA",
                "parts, regions and AHA segments (SET_SOLID), facet tags (SET_NODE_LIST, SET_SEGMENT), fibres and "
                "sheets (ELEMENT_SOLID_ORTHO)",
                "tetra, tetra10, wedge, hexahedron; others refused",
                "as asked, named in the file",
                "ansys-dyna-core (PyDyna)",
                "LS-DYNA",
            ),
        )
    }
)


def markdown_table() -> str:
    """The table as the README has it."""
    head = ("`--format`", "for", "carries", "elements", "unit of length", "read in the tests by", "not read there by")
    body = [
        (f"`{e.name}`", e.program, e.carries, e.elements, e.units, e.read_by, e.unread_by or "-")
        for e in FORMATS.values()
    ]
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, ("---",) * len(head), *body))


def require_formats(names: Iterable[str]) -> tuple[Format, ...]:
    """The formats of those names.

    Raises
    ------
    OptionError
        A name is unknown; the message lists those that exist.
    """
    found = []
    for name in names:
        if name not in FORMATS:
            raise OptionError(f"unknown format {name!r}; choose from {', '.join(FORMATS)}")
        found.append(FORMATS[name])
    return tuple(found)


def format_of(path: Path) -> Format:
    """The format a file's ending means.

    Raises
    ------
    OptionError
        No format, or more than one, has that ending.
    """
    ending = path.suffix.lower()
    known = [entry for entry in FORMATS.values() if ending in entry.endings]
    if len(known) == 1:
        return known[0]
    if known:
        names = " or ".join(entry.name for entry in known)
        raise OptionError(f"the ending {ending!r} of {str(path)!r} may be {names}; name the format")
    listed = ", ".join(
        f"{entry.name} ({' '.join(entry.endings)})" if entry.endings else entry.name for entry in FORMATS.values()
    )
    raise OptionError(f"{str(path)!r} has no ending of a known format; name one of {listed}")
