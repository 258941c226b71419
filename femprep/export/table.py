"""The one table of file formats: names, endings, where each is written, what it carries, who has read it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from femprep.errors import InputError, OptionError
from femprep.export.format import Format
from femprep.model import FACET_TAGS
from femprep.options import ExportOptions

if TYPE_CHECKING:
    from femprep.export.content import Content

#: Files of dolfinx' and legacy FEniCS' meshes: either's may be written over the other's.
_XDMF_OPTIONAL: Final = (
    *("markers_{stem}.json", "info_{stem}.json", "microstructure_{stem}.json"),
    *(f"{{stem}}_{name}.{ending}" for name in ("fiber", "sheet") for ending in ("xdmf", "h5")),
)
_XDMF_FIXED: Final = (
    *("markers.json", "info.json", "microstructure.json"),
    *(f"microstructure.bp/{name}" for name in ("data.0", "md.0", "md.idx")),
)
_XDMF_MARK: Final = ("info_{stem}.json", '"source": "femprep"')
#: Files beside openCARP's that not every mesh has.
_CARP_OPTIONAL: Final = (
    *("{stem}.aha.dat", *(f"{{stem}}.uvc_{name}.dat" for name in ("z", "rho", "phi", "ven"))),
    *(f"{{stem}}.{name}.{ending}" for name in FACET_TAGS for ending in ("surf", "vtx")),
    *(f"{{stem}}.purkinje.{ending}" for ending in ("pts", "elem", "lon", "dat")),
    *("{stem}.purkinje_[0-9]*.vtx", "{stem}.basal_ring.vtx", "{stem}.cell_*.dat", "{stem}.point_*.dat"),
)
_CARP_MARK: Final = ("{stem}.tags.txt", "")

FORMATS: Final[Mapping[str, Format]] = MappingProxyType(
    {
        entry.name: entry
        for entry in (
            Format(
                name="vtu",
                endings=(".vtu",),
                filename="mesh.vtu",
                home="vtu.write:write",
                program="VTK, ParaView",
                carries=(
                    "regions, facet tags, all cell and point data, names, planes, Purkinje fibres (facets and these as "
                    "field data)"
                ),
                elements="all",
                units="mm",
                read_by="VTK, meshio",
            ),
            Format(
                name="abaqus",
                endings=(".inp",),
                filename="mesh.inp",
                home="abaqus.write:write",
                program="Abaqus, CalculiX",
                carries=(
                    "regions and AHA segments (ELSET, NSET), facet tags (NSET, element SURFACE), fibres and sheets "
                    "(DISTRIBUTION, ORIENTATION), springs of the pericardium, three materials and an inflation step on "
                    "request; your own fields of elements and points in a file to include (DISTRIBUTION, INITIAL "
                    "CONDITIONS)"
                ),
                elements="all",
                units="as asked, named in the file",
                read_by="CalculiX",
                unread_by="Abaqus",
                needs="inflation:require",
                optional=("{stem}.fields.inp",),
                mark=("{stem}.inp", "femprep volume mesh"),
            ),
            Format(
                name="dolfinx",
                endings=(),
                filename="dolfinx/mesh.xdmf",
                home="xdmf.write:write",
                program="dolfinx, cardiac_geometries, fenicsx-pulse",
                carries=(
                    "cell tags, facet tags, names (markers.json), fibres as a checkpoint (microstructure.bp; in "
                    "mesh.h5 with all else), other cell and point data"
                ),
                elements="tetra, tetra10, hexahedron; of hexahedron20 the corners; others cut into tetrahedra",
                units="as asked, named in info.json",
                read_by=(
                    "dolfinx 0.5; cardiac_geometries 0.9 on dolfinx 0.9 and 0.16 on 0.11, fenicsx-pulse 0.9 and 0.12, "
                    "where FEMPREP_DOLFINX_PYTHON names a Python that has them"
                ),
                beside=(
                    *("mesh.h5", "markers.json", "info.json", "microstructure.json"),
                    *("markers_mesh.json", "info_mesh.json", "microstructure_mesh.json"),
                ),
                optional=_XDMF_OPTIONAL,
                fixed=_XDMF_FIXED,
                mark=_XDMF_MARK,
            ),
            Format(
                name="fenics",
                endings=(),
                filename="fenics/mesh.xdmf",
                home="xdmf.write:write_fenics",
                program="legacy FEniCS",
                carries="as dolfinx, and fibres and sheets as checkpoints",
                elements="tetra; others cut into tetrahedra",
                units="as asked, named in info.json",
                read_by="dolfin 2019.2",
                beside=("mesh.h5", "markers.json", "info.json", "markers_mesh.json", "info_mesh.json"),
                optional=_XDMF_OPTIONAL,
                fixed=_XDMF_FIXED,
                mark=_XDMF_MARK,
            ),
            Format(
                name="gmsh",
                endings=(".msh",),
                filename="mesh.msh",
                home="gmsh.write:write",
                program="Gmsh 2.2, scikit-fem, dolfinx, many more",
                carries=(
                    "regions and facet tags as named physical groups, point data, your own fields of elements "
                    "(ElementNodeData)"
                ),
                elements="all",
                units="as asked, named in the file",
                read_by="Gmsh, scikit-fem, dolfinx 0.5 (through gmsh), meshio",
            ),
            Format(
                name="gmsh41",
                endings=(),
                filename="mesh41.msh",
                home="gmsh.write:write_41",
                program="Gmsh 4.1, dolfinx",
                carries="regions and facet tags as entities and named physical groups, cell, facet and point data",
                elements="all",
                units="as asked, named in the file",
                read_by="Gmsh, dolfinx 0.5 (through gmsh), meshio",
            ),
            Format(
                name="febio",
                endings=(".feb",),
                filename="mesh.feb",
                home="febio.write:write",
                program="FEBio 4",
                carries=(
                    "parts, regions and AHA segments (ElementSet), facet tags (NodeSet, Surface), fibres and sheets "
                    "(mat_axis), your own fields of elements and points (ElementData, NodeData), springs of the "
                    "pericardium, three materials and an inflation step on request"
                ),
                elements="all",
                units="as asked, named in the file",
                read_by="FEBio 4.11 and febio-python; solved where FEMPREP_FEBIO names FEBio",
                needs="inflation:require",
            ),
            Format(
                name="opencarp",
                endings=(".pts",),
                filename="opencarp/mesh.pts",
                home="opencarp.write:write",
                program="openCARP, MeshTool",
                carries=(
                    "region tags, fibres and sheets, blood as bath (.lon), facet tags (.surf, .vtx), AHA segments and "
                    "ventricular coordinates after UVC (.dat), your own fields of elements and points (.dat), Purkinje "
                    "fibres (lines), a beat to start from (.par)"
                ),
                elements="linear; of quadratic ones the corners",
                units="micrometres",
                read_by="MeshTool (pymeshtool 1.3)",
                unread_by="openCARP",
                beside=("mesh.elem", "mesh.lon", "mesh.tags.txt", "mesh.par"),
                optional=_CARP_OPTIONAL,
                parts=("{stem}.*.surf", "{stem}.bpts"),
                mark=_CARP_MARK,
            ),
            Format(
                name="opencarp-binary",
                endings=(".bpts",),
                filename="opencarp-binary/mesh.bpts",
                home="opencarp.write:write_binary",
                program="openCARP, MeshTool",
                carries="as opencarp; points, elements and fibres in binary files, quick for millions of elements",
                elements="linear; of quadratic ones the corners",
                units="micrometres, single precision",
                read_by="MeshTool (pymeshtool 1.3)",
                unread_by="openCARP",
                beside=("mesh.belem", "mesh.blon", "mesh.tags.txt", "mesh.par"),
                optional=_CARP_OPTIONAL,
                parts=("{stem}.*.surf", "{stem}.pts"),
                mark=_CARP_MARK,
            ),
            Format(
                name="svmultiphysics",
                endings=(),
                filename="svmultiphysics",
                home="svmultiphysics.write:write",
                program="svMultiPhysics, SimVascular",
                carries=(
                    "mesh-complete folder: regions (DOMAIN_ID), faces with global numbers, fibres and sheets "
                    "(FIB_DIR), cell and point data, caps of the cavities, springs of the pericardium, two "
                    "materials and an inflation step on request (inflation.xml)"
                ),
                elements="all",
                units="as asked, named in the record of the mesh file",
                read_by="VTK; svMultiPhysics (of July 2026), solved where FEMPREP_SVMULTIPHYSICS names it",
                unread_by="SimVascular",
                needs="svmultiphysics.step:require",
                folder=True,
                beside=("mesh-complete.mesh.vtu",),
                optional=(
                    *("fibersLong.vtu", "fibersSheet.vtu", "inflation.xml", "inflation.dat", "pericardium.vtp"),
                    *(f"caps/{name}.vtp" for name in ("lv", "rv", "la", "ra")),
                    *(f"inflation_{name}.dat" for name in ("lv", "rv", "la", "ra")),
                    *(f"mesh-surfaces/{name}.vtp" for name in FACET_TAGS),
                ),
                parts=("mesh-surfaces/*.vtp",),
                mark=("mesh-complete.mesh.vtu", "femprep_json"),
            ),
            Format(
                name="med",
                endings=(".med",),
                filename="mesh.med",
                home="med.write:write",
                program="Salome, code_aster",
                carries="groups for regions, AHA segments, facets and their nodes, fibres and other data as fields",
                elements="all",
                units="as asked, named in the file",
                read_by="medconforme, Gmsh, meshio",
                unread_by="Salome, code_aster",
            ),
            Format(
                name="medit",
                endings=(".mesh",),
                filename="mesh.mesh",
                home="medit.write:write",
                program="FreeFEM, MMG",
                carries=(
                    "regions and facet tags as references, fibres, sheets, AHA segments and your own fields of "
                    "elements and points (.sol)"
                ),
                elements="linear; of quadratic ones the corners",
                units="as asked, named in the file",
                read_by="FreeFEM, meshio",
                optional=("{stem}.fiber.sol", "{stem}.aha.sol", "{stem}.cell_*.sol", "{stem}.point_*.sol"),
                mark=("{stem}.mesh", "femprep volume mesh"),
            ),
            Format(
                name="ls-dyna",
                endings=(".k",),
                filename="mesh.k",
                home="lsdyna.write:write",
                program="LS-DYNA",
                carries=(
                    "parts, regions and AHA segments (SET_SOLID), facet tags (SET_NODE_LIST, SET_SEGMENT), fibres and "
                    "sheets (ELEMENT_SOLID_ORTHO), your own fields of elements (INITIAL_FIELD_SOLID), Purkinje fibres "
                    "(ELEMENT_BEAM), springs of the pericardium (ELEMENT_DISCRETE)"
                ),
                elements="tetra, tetra10, wedge, hexahedron; others refused",
                units="as asked, named in the file",
                read_by="ansys-dyna-core (PyDyna)",
                unread_by="LS-DYNA",
                needs="lsdyna.write:require",
            ),
        )
    }
)


def markdown_table() -> str:
    """The table as the page of formats has it."""
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


def refusals(content: Content, formats: Iterable[str], options: ExportOptions) -> dict[str, str]:
    """Formats that cannot hold a mesh with such content, and why."""
    found = {}
    for entry in require_formats(formats):
        try:
            entry.require(content, options)
        except InputError as error:
            found[entry.name] = str(error)
    return found


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
