"""The options of a deck's material in, the moduli its formats ask for out."""

from __future__ import annotations

from dataclasses import dataclass

from femprep.options import ExportOptions


def shear_and_bulk(options: ExportOptions) -> tuple[float, float]:
    """Shear and bulk modulus, kPa, that agree with Young's modulus and Poisson's ratio in small deformations."""
    shear = options.young_modulus / (2 * (1 + options.poisson_ratio))
    return shear, options.young_modulus / (3 * (1 - 2 * options.poisson_ratio))


@dataclass(frozen=True)
class Moduli:
    """Engineering constants along fibre (1), sheet (2) and normal (3), kPa and -."""

    e1: float
    e2: float
    e3: float
    nu12: float
    nu13: float
    nu23: float
    g12: float
    g13: float
    g23: float


def orthotropic(options: ExportOptions) -> Moduli:
    """A linear material that is stiffer along the fibres: ``nu12`` is the contraction across when pulled along."""
    across = options.young_modulus
    along = across * options.fibre_stiffness
    shear = across / (2 * (1 + options.poisson_ratio))
    nu = options.poisson_ratio
    return Moduli(along, across, across, nu, nu, nu, shear, shear, shear)
