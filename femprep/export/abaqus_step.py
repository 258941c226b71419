"""A tagged mesh in, material and passive-inflation step of an Abaqus and CalculiX deck out."""

from __future__ import annotations

from collections.abc import Iterator

from femprep.errors import InputError
from femprep.export.names import facet_names
from femprep.export.units import UNITS
from femprep.model import VolumeMesh
from femprep.options import ExportOptions


def step(mesh: VolumeMesh, options: ExportOptions) -> Iterator[str]:
    """Section, material, base held, pressure on every endocardium; nothing where no step is asked for.

    Raises
    ------
    InputError
        The mesh has no ``base`` to hold or no endocardium to press on.
    """
    if options.step == "none":
        return
    names = facet_names(mesh)
    endo = [name for name in names if name == "endo" or name.startswith("endo_")]
    if "base" not in names or not endo:
        found = ", ".join(names) or "none"
        raise InputError(f"an inflation step needs facets tagged base and endo; this mesh has {found}")
    units = UNITS[options.length_unit]
    yield "*MATERIAL, NAME=myocardium\n*ELASTIC\n"
    yield f"{options.young_modulus * units.per_kpa:.12g}, {options.poisson_ratio:.12g}\n"
    yield "*SOLID SECTION, ELSET=EALL, MATERIAL=myocardium\n"
    yield "*BOUNDARY\nbase, 1, 3\n"
    yield "*STEP\n*STATIC\n*DSLOAD\n"
    for name in endo:
        yield f"{name}, P, {options.pressure * units.per_kpa:.12g}\n"
    # Reactions and displacements as a table (.dat) and, for pictures, as fields (.frd).
    yield "*NODE PRINT, NSET=base, TOTALS=ONLY\nRF\n*NODE PRINT, NSET=NALL\nU\n"
    yield "*NODE FILE\nU, RF\n*END STEP\n"
