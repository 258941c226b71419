"""A volume mesh as its file has it in, the same in mm out: by the unit stated, given, or guessed from its size."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from femprep.errors import InputError, OptionError
from femprep.mesh.measures.volume_elements import all_volumes
from femprep.model import FloatArray, Notice, VolumeMesh, noted, verdict_of
from femprep.model.blocks import nodes_of
from femprep.model.notice import NOTICES
from femprep.model.units import MILLIMETRES, check_size, plausible_units, unit_question

#: Key of a mesh's ``info`` for the unit of its file, ``{"unit": "cm", "by": "guess"}``. It is known by ``statement`` of
#: the file, by ``format``, ``option`` or ``guess``; by ``default`` it is mm where the mesh is no heart, and by
#: ``doubt`` where a heart's size does not decide.
UNIT: Final = "file_unit"
#: A mesh that fills this share of its box is a block or a cylinder and no heart's wall, nor is one of so few elements.
_FULL, _FEW = 0.65, 100
#: How the notice on the unit begins.
_TAKEN: Final = "lengths were taken to be in "


def in_millimetres(mesh: VolumeMesh, unit: str = "auto", *, heart: bool = False) -> VolumeMesh:
    """Bring a mesh to mm.

    Parameters
    ----------
    mesh : VolumeMesh
        One that femprep made is in mm.
    unit : {"auto", "mm", "cm", "m", "um"}
        Of the file the mesh came from.
    heart : bool
        Whether it is known to be a heart, even if it is a block or of few elements.

    Returns
    -------
    VolumeMesh
        ``info["file_unit"]`` holds the unit of the file and how it is known; a unit that was guessed or taken for
        granted is a notice.

    Raises
    ------
    InputError
        The file states another unit, or no heart is of such a size in the unit given.
    OptionError
        There is no such unit.
    """
    known = mesh.info.get(UNIT, {"unit": "mm", "by": "statement"} if _is_made(mesh) else {})
    by = known.get("by", "default")
    if unit not in ("auto", *MILLIMETRES):
        raise OptionError(f"unit is {unit!r}; expected auto, {', '.join(MILLIMETRES)}")
    if unit == "auto" and known and not (heart and by == "default"):
        return mesh
    if by == "statement" and unit != known["unit"]:
        raise InputError(f"the file states lengths in {known['unit']}, and the unit given is {unit}; leave --unit out")
    info = dict(mesh.info)
    if NOTICES in info:
        info[NOTICES] = [one for one in info[NOTICES] if not one["what"].startswith(_TAKEN)]
    before = MILLIMETRES[known.get("unit", "mm")]
    diagonal, volume, box = (size / before**power for size, power in zip(_sizes(mesh), (1, 3, 3)))
    fits = plausible_units(diagonal, volume)
    if unit != "auto":
        check_size("the mesh", diagonal, unit)
        by, words = "option", ""
    elif not heart and (volume > _FULL * box or mesh.n_cells < _FEW):
        unit, by = "mm", "default"
        words = f"mm: the mesh measures {diagonal:.4g} mm from corner to corner of its box; name another unit by --unit"
    elif len(fits) != 1:
        unit, by, words = "mm", "doubt", f"mm, but {unit_question('the mesh', diagonal, volume)}"
    else:
        unit, by = fits[0], "guess"
        words = f"{unit}: the mesh measures {diagonal * MILLIMETRES[unit]:.4g} mm from corner to corner of its box"
    scale = MILLIMETRES[unit] / before
    points: FloatArray = mesh.points if scale == 1.0 else mesh.points * scale
    info = noted(info, *([Notice.of("assumed", _TAKEN + words)] if words else []))
    return replace(mesh, points=points, info={**info, UNIT: {"unit": unit, "by": by}})


def is_external(mesh: VolumeMesh) -> bool:
    """Whether a mesh came from a file, or was annotated, and no mesher of femprep made it."""
    return UNIT in mesh.info and not _is_made(mesh)


def _is_made(mesh: VolumeMesh) -> bool:
    return "mesher" in {**mesh.info, **verdict_of(mesh)}


def _sizes(mesh: VolumeMesh) -> tuple[float, float, float]:
    """Diagonal and volume of the box around a mesh, and volume of its elements between them."""
    extent = np.ptp(mesh.points[nodes_of(mesh.cells)], axis=0)
    volume = np.abs(all_volumes(mesh.points, mesh.cells)).sum()
    return float(np.linalg.norm(extent)), float(volume), float(extent.prod())


def unit_doubt(mesh: VolumeMesh) -> str | None:
    """What is unclear about the unit of a mesh's file; None where it is known."""
    if mesh.info.get(UNIT, {}).get("by") != "doubt":
        return None
    diagonal, volume, _ = _sizes(mesh)
    return f"the unit of length is not known: {unit_question('the mesh', diagonal, volume)}"


def require_unit(mesh: VolumeMesh) -> None:
    """Make sure that the unit of a mesh's file is known, before lengths in mm matter.

    Raises
    ------
    InputError
        The mesh is a heart's in more than one unit, or in none; the message names the option that decides.
    """
    if doubt := unit_doubt(mesh):
        raise InputError(doubt)
