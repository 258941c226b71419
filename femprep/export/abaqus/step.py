"""A tagged mesh in, fibres, material and passive-inflation step of an Abaqus and CalculiX deck out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from femprep.export.deck.fibres import directions
from femprep.export.deck.fields import UserField
from femprep.export.deck.material import orthotropic, shear_and_bulk
from femprep.export.deck.names import facet_names, held
from femprep.export.deck.text import lines
from femprep.export.deck.units import UNITS, Units
from femprep.export.inflation import pressures
from femprep.model import VolumeMesh
from femprep.options import ExportOptions

#: Name of the orientation whose first axis is the fibre, the second the sheet.
ORIENTATION = "fibres"


def orientation(mesh: VolumeMesh) -> Iterator[str]:
    """Fibre and sheet of each element as ``*DISTRIBUTION`` and ``*ORIENTATION``; nothing without fibres.

    Abaqus wants the table, CalculiX (which knows but one kind) passes over it with a warning.
    """
    found = directions(mesh)
    if found is None:
        return
    yield "*DISTRIBUTION TABLE, NAME=fibre_table\nCOORD3D, COORD3D\n"
    yield "*DISTRIBUTION, NAME=fibre_directions, LOCATION=ELEMENT, TABLE=fibre_table\n"
    yield ", 1., 0., 0., 0., 1., 0.\n"
    yield from lines(np.arange(1, mesh.n_cells + 1), *found)
    yield f"*ORIENTATION, NAME={ORIENTATION}, SYSTEM=RECTANGULAR\nfibre_directions\n"


def initial_fields(cells: list[UserField], points: list[UserField]) -> Iterator[str]:
    """Fields of the user's for Abaqus: initial field variables of nodes, and distributions over elements.

    Abaqus knows scalars of elements as a table of LENGTH. The deck itself must not hold them: CalculiX stops at field
    variables, and takes whatever distribution comes last for orientations.
    """
    for number, (name, values) in enumerate((column for field in points for column in field.columns()), start=1):
        yield f"** {name} of nodes\n*INITIAL CONDITIONS, TYPE=FIELD, VARIABLE={number}\n"
        yield from lines(np.arange(1, len(values) + 1), values.astype(np.float64))
    if cells:
        yield "*DISTRIBUTION TABLE, NAME=scalar_table\nLENGTH\n"
    for name, values in (column for field in cells for column in field.columns()):
        yield f"*DISTRIBUTION, NAME={name}, LOCATION=ELEMENT, TABLE=scalar_table\n, 0.\n"
        yield from lines(np.arange(1, len(values) + 1), values.astype(np.float64))


def step(mesh: VolumeMesh, options: ExportOptions) -> Iterator[str]:
    """Section, material, base held, pressure on every endocardium; nothing where no step is asked for."""
    if options.step == "none":
        return
    units = UNITS[options.length_unit]
    oriented = f", ORIENTATION={ORIENTATION}" if options.material == "orthotropic" else ""
    yield "*MATERIAL, NAME=myocardium\n" + _material(options, units)
    yield f"*SOLID SECTION, ELSET=EALL, MATERIAL=myocardium{oriented}\n"
    supports = held(facet_names(mesh))
    yield "*BOUNDARY\n" + "".join(f"{name}, 1, 3\n" for name in supports)
    # Increments of a tenth where large deformations need them, and at least one of a thousandth.
    yield (
        "*STEP, NLGEOM=YES, INC=1000\n*STATIC\n0.1, 1., 0.001, 0.1\n"
        if options.material == "neo-hookean"
        else "*STEP\n*STATIC\n"
    )
    yield "*DSLOAD\n"
    for name, pressure in pressures(facet_names(mesh), options).items():
        yield f"{name}, P, {pressure * units.per_kpa:.12g}\n"
    # Reactions and displacements as a table (.dat) and, for pictures, as fields (.frd).
    yield "".join(f"*NODE PRINT, NSET={name}, TOTALS=ONLY\nRF\n" for name in supports)
    yield "*NODE PRINT, NSET=NALL\nU\n"
    yield "*NODE FILE\nU, RF\n*END STEP\n"


def _material(options: ExportOptions, units: Units) -> str:
    scale = units.per_kpa
    if options.material == "neo-hookean":
        # C10 = mu / 2 and D1 = 2 / K agree with E and nu in small deformations.
        shear, bulk = (modulus * scale for modulus in shear_and_bulk(options))
        return f"*HYPERELASTIC, NEO HOOKE\n{shear / 2:.12g}, {2 / bulk:.12g}\n"
    if options.material == "orthotropic":
        m = orthotropic(options)
        first = (m.e1 * scale, m.e2 * scale, m.e3 * scale, m.nu12, m.nu13, m.nu23, m.g12 * scale, m.g13 * scale)
        line = ", ".join(f"{value:.12g}" for value in first)
        return f"*ELASTIC, TYPE=ENGINEERING CONSTANTS\n{line}\n{m.g23 * scale:.12g}\n"
    return f"*ELASTIC\n{options.young_modulus * scale:.12g}, {options.poisson_ratio:.12g}\n"
