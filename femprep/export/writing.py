"""A mesh, wall or surface in, files out: the format chosen from the table, each file whole or not at all."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from femprep.errors import FemprepWarning, InputError, cannot_write, require_kind
from femprep.export.beside import clear, leftovers
from femprep.export.content import content_of, require_elements
from femprep.export.deck.fibres import require_vectors
from femprep.export.files import whole_files
from femprep.export.losses import losses
from femprep.export.table import FORMATS, require_formats
from femprep.export.target import Target, require_file, target_of
from femprep.export.vtk.surface_files import save_polydata
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

    Cell and point data of your own are written where the format has a place for them; what it does not hold of the mesh
    is left out with a :class:`~femprep.errors.FemprepWarning`.

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
        The mesh has no elements, the format cannot hold it, cell data ``fiber`` or ``sheet`` are no vectors, or a unit
        is asked for and that of the mesh is not known.

    Examples
    --------
    >>> [path.name for path in fp.write_mesh(mesh, "heart.inp")]
    ['heart.inp']
    """
    require_kind(mesh, VolumeMesh, "read_mesh")
    target = target_of(path, format)
    moved = _write(mesh, target, choose(ExportOptions, options, changes))
    for notice in losses(mesh, target.format.name):
        _warn(notice.what)
    return moved


def _warn(words: str, behind: int = 3) -> None:
    """Warn in the line that called the public function, which is some calls behind."""
    warnings.warn(words, FemprepWarning, stacklevel=behind)


def _write(mesh: VolumeMesh, target: Target, options: ExportOptions) -> list[Path]:
    kind, folder = target.format, target.folder
    require_elements(mesh)
    require_vectors(mesh)
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
        What the format does not hold is not reported here, see :func:`~femprep.export.losses.losses`.

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
        return _write(mesh, target_of(path, format), choose(ExportOptions, options, changes))
    except BaseException:
        if made:
            path.parent.rmdir()
        raise


def write_facets(mesh: VolumeMesh, path: str | Path) -> Path:
    """Write the tagged facets of a mesh: as VTK polygons (``.vtp``), or as :func:`write_surface` by another ending.

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
    """Write a wall: as VTK polygons (``.vtp``) with cell data ``facet_tag`` and point data ``template``.

    Other endings are those of :func:`write_surface`.

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
    """Write a closed surface in the format that the ending names.

    VTK polygons (``.vtp``) keep the vertex numbering and all point data; the unit vectors on the template
    sphere become point data ``direction``. ``.stl``, ``.ply``, ``.obj`` and ``.off`` hold triangles alone, STL and PLY
    in single precision: other data are left out with a :class:`~femprep.errors.FemprepWarning`.

    Raises
    ------
    OptionError
        The ending is none of these.
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
    path = Path(path)
    require_file(path)
    path = path.absolute()
    with whole_files(path.parent) as (partial, _):
        left_out = save_polydata(polygons, partial / path.name)
    if left_out:
        names = ", ".join(left_out)
        _warn(f"{path.name!r} leaves out the data {names}: {path.suffix} files hold none, .vtp files do", behind=4)
    return path
