"""A mesh, wall or surface in, files out: the format chosen from the table, each file whole or not at all."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from femprep.errors import InputError, cannot_write
from femprep.export.content import content_of, require_elements
from femprep.export.files import whole_files
from femprep.export.table import FORMATS, format_of, require_formats
from femprep.model import Surface, VolumeMesh, Wall
from femprep.options import ExportOptions, choose, takes


@takes(ExportOptions)
def write_mesh(
    mesh: VolumeMesh,
    path: str | Path,
    *,
    format: str | None = None,
    options: ExportOptions | None = None,
    **changes: Any,
) -> list[Path]:
    """Write a volume mesh for a solver.

    Parameters
    ----------
    mesh : VolumeMesh
    path : path
        File to write (a folder, for a format that is one). Its folder must exist; an earlier file is replaced when
        the new one is whole, and what else a folder holds stays.
    format : str, optional
        A name of ``FORMATS``; from the ending where it is unambiguous.
    options : ExportOptions, optional
        Units, and the analysis step of a deck.
    **changes
        Options by name in place of those given.

    Returns
    -------
    list of Path
        The files and folders written.

    Raises
    ------
    OptionError
        The format is unknown, or an option wrong.
    FileError
        The folder cannot be written.
    DiskFullError
        There is no room; nothing of it is left.
    InputError
        The mesh has no elements, or the format cannot hold it.

    Examples
    --------
    >>> [path.name for path in fp.write_mesh(mesh, "heart.inp")]
    ['heart.inp']
    """
    path = Path(path)
    kind = format_of(path) if format is None else require_formats([format])[0]
    options = choose(ExportOptions, options, changes)
    require_elements(mesh)
    kind.require(content_of(mesh), options)
    path = path.absolute()
    with whole_files(path.parent) as (partial, moved):
        made, home = (partial / path.name, path) if kind.folder else (partial, path.parent)
        made.mkdir(exist_ok=True)
        kind.writer(mesh, made, path.name if kind.folder else path.stem, options)
        stale = [home / name for name in kind.optional if not (made / name).exists()]
    for file in stale:
        if file.is_dir():
            shutil.rmtree(file)
        else:
            file.unlink(missing_ok=True)
    return moved


@takes(ExportOptions)
def write_format(
    mesh: VolumeMesh, folder: str | Path, format: str, *, options: ExportOptions | None = None, **changes: Any
) -> list[Path]:
    """Write a volume mesh into an output folder under the name that its format has there.

    Parameters
    ----------
    mesh : VolumeMesh
    folder : path
        An existing folder; ``FORMATS[format].filename`` is made in it, with its own subfolder where it has one.
    format : str
        A name of ``FORMATS``.
    options, **changes
        As for :func:`write_mesh`.

    Returns
    -------
    list of Path

    Raises
    ------
    OptionError, FileError, InputError
        As for :func:`write_mesh`.
    """
    require_formats([format])
    path = Path(folder) / FORMATS[format].filename
    made = Path(folder).is_dir() and not path.parent.exists()
    if made:
        try:
            path.parent.mkdir()
        except OSError as error:
            raise cannot_write(f"folder {str(path.parent)!r}", error, "choose another") from None
    try:
        return write_mesh(mesh, path, format=format, options=options, **changes)
    except BaseException:
        if made:
            path.parent.rmdir()
        raise


def write_facets(mesh: VolumeMesh, path: str | Path) -> Path:
    """Write the tagged facets of a mesh as VTK polygons (``.vtp``).

    Point data ``GlobalNodeID`` and cell data ``GlobalElementID`` count the mesh's points and the owning elements
    **from 1**, as SimVascular does; cell data ``facet_tag`` and all facet data come along. Of a quadratic facet only
    the corners are written: VTK polygons have no mid-side nodes.

    Raises
    ------
    FileError
        The folder cannot be written.

    Examples
    --------
    >>> fp.write_facets(mesh, "facets.vtp").name
    'facets.vtp'
    """
    from femprep.export.vtk.polydata import facets_polydata

    return _save(facets_polydata(mesh), path)


def write_purkinje(mesh: VolumeMesh, path: str | Path) -> Path:
    """Write the Purkinje fibres of a mesh as VTK lines (``.vtp``).

    Cell data ``facet_tag`` name the endocardium, point data ``activation`` the time of arrival, ms; ``GlobalNodeID``
    counts the mesh's points **from 1** at junctions and is 0 elsewhere.

    Raises
    ------
    InputError
        The mesh has none.
    FileError
        The folder cannot be written.

    Examples
    --------
    >>> grown = fp.add_purkinje(mesh, generations=3)  # doctest: +SKIP
    >>> fp.write_purkinje(grown, "purkinje.vtp").name  # doctest: +SKIP
    'purkinje.vtp'
    """
    from femprep.export.purkinje import purkinje_polydata

    if mesh.purkinje is None:
        raise InputError("the mesh has no Purkinje fibres to write; add them (add_purkinje, or --purkinje)")
    return _save(purkinje_polydata(mesh.purkinje), path)


def write_wall(wall: Wall, path: str | Path) -> Path:
    """Write a wall as VTK polygons (``.vtp``): cell data ``facet_tag``, point data ``template``.

    Raises
    ------
    FileError
        The folder cannot be written.

    Examples
    --------
    >>> fp.write_wall(wall, "wall.vtp").name
    'wall.vtp'
    """
    from femprep.export.vtk.polydata import wall_polydata

    return _save(wall_polydata(wall), path)


def write_surface(surface: Surface, path: str | Path) -> Path:
    """Write a closed surface as VTK polygons (``.vtp``), vertex numbering kept, with all its point data.

    The unit vectors on the template sphere become point data ``direction``.

    Raises
    ------
    FileError
        The folder cannot be written.

    Examples
    --------
    >>> fp.write_surface(endo, "lv.stl").name
    'lv.stl'
    """
    from femprep.export.vtk.polydata import surface_polydata

    return _save(surface_polydata(surface), path)


def _save(polygons: Any, path: str | Path) -> Path:
    from femprep.export.vtk.xml import save

    path = Path(path).absolute()
    with whole_files(path.parent) as (partial, _):
        save(polygons, partial / path.name)
    return path
