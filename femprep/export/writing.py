"""A mesh, wall or surface in, files out: the format chosen from the table, each file whole or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from femprep.errors import InputError, cannot_write
from femprep.export.beside import clear, leftovers
from femprep.export.content import content_of, require_elements
from femprep.export.files import whole_files
from femprep.export.table import FORMATS, require_formats
from femprep.export.target import require_file, target_of
from femprep.mesh.length_unit import require_unit
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
        File to write (a folder, for a format that is one). Its folder must exist. An earlier mesh of that path is
        replaced, with all its files, when the new one is whole; what else a folder holds stays. A symbolic link is
        replaced by the file, and what it leads to stays.
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
        The format is unknown, the ending is another's, or an option is wrong.
    FileError
        The folder cannot be written, or holds files of others where those of the mesh have to stand.
    DiskFullError
        There is no room; nothing of it is left.
    InputError
        The mesh has no elements, the format cannot hold it, or a unit is asked for and that of the mesh is not known.

    Examples
    --------
    >>> [path.name for path in fp.write_mesh(mesh, "heart.inp")]
    ['heart.inp']
    """
    target = target_of(path, format)
    kind, folder = target.format, target.folder
    options = choose(ExportOptions, options, changes)
    require_elements(mesh)
    if kind.units.startswith("micrometres") or options.step != "none" or "length_unit" in options.model_fields_set:
        require_unit(mesh)
    kind.require(content_of(mesh), options)
    with whole_files(folder.parent if kind.folder else folder) as (partial, moved):
        made = partial / folder.name if kind.folder else partial
        made.mkdir(exist_ok=True)
        kind.writer(mesh, made, target.stem, options)
        stale = leftovers(target, made)
    clear(stale)
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

    path = Path(path)
    require_file(path)
    path = path.absolute()
    with whole_files(path.parent) as (partial, _):
        save(polygons, partial / path.name)
    return path
