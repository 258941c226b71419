"""Anyone's mesh file in, a tagged volume mesh out."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import FemprepError, FileError, InputError
from femprep.export.deck.units import stated_unit
from femprep.export.deck.unread import UNREAD
from femprep.export.foreign import from_meshio
from femprep.export.hdf5 import require_hdf5
from femprep.export.heads import require_head
from femprep.export.midside import require_own_edges
from femprep.export.namemap import with_namemap
from femprep.export.others.dolfin import read as _dolfin
from femprep.export.others.tetgen import read as _tetgen
from femprep.export.through_meshio import meshio_mesh
from femprep.export.turned import MANY, turned_tetrahedra
from femprep.export.verdict import verdict_in
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.length_unit import UNIT, in_millimetres
from femprep.mesh.vtk.trial import HDF
from femprep.model import VolumeMesh
from femprep.model.arrays import FARTHEST
from femprep.model.notice import Notice, noted
from femprep.model.verdict import VERDICT


def read_mesh(path: str | Path, *, unit: str = "auto") -> VolumeMesh:
    """Read a volume mesh.

    Parameters
    ----------
    path : path
        ``.vtu`` (of PyAnsys Heart, too, with its ``.namemap.json`` beside it), ``.vtk``, ``.inp`` (Abaqus, CalculiX),
        ``.feb`` (FEBio), ``.k`` (LS-DYNA), ``.pts`` or ``.elem`` (openCARP), ``.xdmf``, ``.msh`` (Gmsh), ``.med``,
        ``.mesh`` (Medit, its ``.sol`` files beside it), ``.e`` and ``.exo`` (Exodus II), a ``mesh-complete`` folder
        (svMultiPhysics), and TetGen, DOLFIN XML and others through meshio.
    unit : {"auto", "mm", "cm", "m", "um"}
        Unit of length of the file. By default the one that the file states, or that its format always has; else the one
        in which the mesh is of a heart's size. Where a heart of that size is possible in more than one unit (a rat's in
        mm, a child's in cm), or in none, lengths are kept, and what needs mm refuses the mesh.

    Returns
    -------
    VolumeMesh
        Files of ours give every region, facet tag, name and fibre back. Of others', regions and facet tags are taken
        from the tag arrays, physical groups and sets that the file holds; elements keep their orientation, so that a
        check finds inverted ones. ``info["source"]`` says what was taken from where, and what was left out, a
        notice that as well. A region and facets of one name have it both, and numbers of their own. Lengths are in mm;
        ``info["file_unit"]`` holds the unit of the file, and a unit that was guessed is a notice. The limits by which
        a mesh of ours was judged come along, but from openCARP's files, which have no room for them.

    Raises
    ------
    FileError
        The file is missing, damaged, of an unknown format, or holds no volume elements.
    InputError
        No heart is of such a size in the unit given, or the file states another one.

    Examples
    --------
    >>> paths = fp.write_mesh(mesh, "heart.vtu")
    >>> fp.read_mesh("heart.vtu").facet_names
    {'endo': 101, 'epi': 102, 'base': 103}
    """
    path = Path(path)
    if not path.exists():
        raise FileError(f"mesh file {str(path)!r} does not exist")
    if not path.is_file() and not path.is_dir():  # to open a pipe waits for whoever writes into it
        raise FileError(f"{str(path)!r} is no regular file, expected a mesh")
    reader = "svmultiphysics" if path.is_dir() else _READERS.get(path.suffix.lower(), _meshio)
    try:
        if path.is_file():
            require_head(path, path.suffix.lower() in _XML)
        require_hdf5(path)
        mesh = import_module(f"femprep.export.{reader}.read").read(path) if isinstance(reader, str) else reader(path)
        if not mesh.n_cells:
            raise InputError(f"holds no volume elements; give a mesh of {', '.join(ELEMENTS)}")
        _require_finite(mesh)
        require_own_edges(mesh)
        mesh = _with_unit(_with_notice(mesh), path)
        if path.suffix.lower() in _COMMENTED and (verdict := verdict_in(path)):
            mesh = replace(mesh, info={**mesh.info, VERDICT: verdict})
    except FemprepError as error:
        raise FileError(f"{str(path)!r}: {error}" if repr(str(path))[1:-1] not in str(error) else str(error)) from error
    except Exception as error:
        # A parser that meets what it does not expect, of whatever library: the file is at fault, not the program.
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise FileError(f"{str(path)!r} is damaged or no mesh: {reason}") from error
    return in_millimetres(mesh, unit)


def _require_finite(mesh: VolumeMesh) -> None:
    wrong = np.flatnonzero(~(np.abs(mesh.points) < FARTHEST).all(axis=1))
    if wrong.size:
        raise InputError(
            f"point {wrong[0]} is {mesh.points[wrong[0]].tolist()} ({wrong.size} such); give finite numbers"
        )


def _with_notice(mesh: VolumeMesh) -> VolumeMesh:
    """The mesh with one notice of the elements and sets of its file that are not read."""
    source = mesh.info.get("source", {})
    kinds = source.get("left_out", ())
    found = [*([f"elements of types {', '.join(kinds)}"] if kinds else []), *source.get(UNREAD, ())]
    if not found:
        return mesh
    *parts, last = found
    words = f"{', '.join(parts)} and {last}" if parts else last
    return replace(mesh, info=noted(mesh.info, Notice.of("left out", f"{words} of the file are left out")))


def _with_unit(mesh: VolumeMesh, path: Path) -> VolumeMesh:
    """The mesh with the unit of length that its file states, or its format always has."""
    ending, unit = path.suffix.lower(), None
    if ending == ".med":
        unit = import_module("femprep.export.med.read").unit_of(path)
    elif ending in (*_COMMENTED, *_CARP):
        unit = "um" if ending in _CARP else stated_unit(path)
    if UNIT in mesh.info or unit is None:
        return mesh
    by = "format" if ending in _CARP else "statement"
    return replace(mesh, info={**mesh.info, UNIT: {"unit": unit, "by": by}})


def _vtk(path: Path) -> VolumeMesh:
    from femprep.export.vtu.read import read_foreign, read_own

    own = read_own(path)
    if own is None:
        return turned_tetrahedra(from_meshio(with_namemap(read_foreign(path), path)), MANY)
    # A unit that was in doubt when the file was written still is.
    if own.info.get(UNIT, {}).get("by") in ("doubt", "default") or "mesher" in own.info:
        return own
    return replace(own, info={**own.info, UNIT: {"unit": "mm", "by": "statement"}})


def _legacy_vtk(path: Path) -> VolumeMesh:
    from femprep.export.vtu.read import read_foreign

    try:
        return turned_tetrahedra(from_meshio(read_foreign(path)), MANY)
    except FileError as error:
        # Among them files of meshio's, whose integer type VTK does not know.
        try:
            found = meshio_mesh(path)
        except FemprepError:
            raise error from None
        said, count = _CELLS.search(path.read_bytes()), sum(len(block.data) for block in found.cells)
        if said is not None and int(said[1]) != count:  # those of types that it does not know are left out
            raise FileError(f"{str(path)!r} says it has {int(said[1])} cells, of which {count} are read") from error
        return from_meshio(found)


def _xdmf(path: Path) -> VolumeMesh:
    from femprep.export.xdmf.read import read_own

    own = read_own(path)
    if own is not None:
        return own
    try:
        return turned_tetrahedra(_meshio(path))
    except FileError as error:
        if _UNMIXED.search(str(error)):
            words = "mixes elements of several types, some with mid-side nodes, which are not read; write VTU"
            raise FileError(f"{str(path)!r} {words}") from error
        raise


def _hdf5(path: Path) -> VolumeMesh:
    import h5py

    from femprep.export.others.fenics import read

    with h5py.File(path, "r") as store:
        own = "VTKHDF" in store
    return _vtk(path) if own else read(path)


def _med(path: Path) -> VolumeMesh:
    from femprep.export.med.read import read

    return read(path, meshio_mesh(path))


def _meshio(path: Path) -> VolumeMesh:
    return from_meshio(meshio_mesh(path))


def _not_read(name: str) -> Callable[[Path], VolumeMesh]:
    """A reader that refuses a format, with what converts it."""

    def refuse(path: Path) -> VolumeMesh:
        raise InputError(f"{name} is not read; convert it first: meshio convert {path.name} {path.stem}.vtu")

    return refuse


#: How many cells a legacy file says that it has.
_CELLS: Final = re.compile(rb"^CELL_TYPES\s+(\d+)", re.MULTILINE)

#: What meshio says of XDMF's numbers of elements that it does not know among others.
_UNMIXED: Final = re.compile(r"KeyError (np\.\w+\()?\d+\)?$")

#: Endings of text files with comments, in which a mesh's verdict stands.
_COMMENTED: Final = (".inp", ".feb", ".k", ".key", ".msh", ".mesh")

#: Endings of openCARP's files, which are in micrometres.
_CARP: Final = (".pts", ".elem", ".bpts", ".belem")

#: Endings of files that are, or begin as, XML.
_XML: Final = (".vtu", ".feb", ".xdmf", ".xmf", ".xml", ".pvtu", ".vtp", ".vtm", ".vti")

#: Formats that no heart was found published in.
_REMOVED: Final = {
    "AVS UCD": (".avs",),
    "CGNS": (".cgns",),
    "FLAC3D": (".f3grid",),
    "HMF": (".hmf",),
    "Kratos": (".mdpa",),
    "MOAB": (".h5m",),
    "NASTRAN": (".bdf", ".fem", ".nas"),
    "Netgen": (".vol", ".gz"),
    "PERMAS": (".post", ".dato"),
    "SU2": (".su2",),
    "Tecplot": (".dat", ".tec"),
    "UGRID": (".ugrid",),
}

#: By the ending of a file: the folder of this room whose ``read`` reads it, or what is to be done.
_READERS: Final[dict[str, str | Callable[[Path], VolumeMesh]]] = {
    ".inp": "abaqus",
    ".feb": "febio",
    ".k": "lsdyna",
    ".key": "lsdyna",
    ".pts": "opencarp",
    ".elem": "opencarp",
    ".bpts": "opencarp",
    ".belem": "opencarp",
    **dict.fromkeys((".vtu", ".vtp", ".vtm"), _vtk),
    ".vtk": _legacy_vtk,
    **dict.fromkeys(HDF, _hdf5),
    ".xdmf": _xdmf,
    ".med": _med,
    ".msh": "gmsh",
    ".mesh": "medit",
    ".xml": _dolfin,
    ".node": _tetgen,
    ".ele": _tetgen,
    ".e": "exodus",
    ".exo": "exodus",
    ".ex2": "exodus",
    **{ending: _not_read(name) for name, endings in _REMOVED.items() for ending in endings},
}

#: Endings of meshes that are read by a reader of their own.
ENDINGS: Final = frozenset(_READERS)
