"""The options of a deck's material in, the moduli its formats ask for out."""

from __future__ import annotations

from femprep.options import ExportOptions


def shear_and_bulk(options: ExportOptions) -> tuple[float, float]:
    """Shear and bulk modulus, kPa, that agree with Young's modulus and Poisson's ratio in small deformations."""
    shear = options.young_modulus / (2 * (1 + options.poisson_ratio))
    return shear, options.young_modulus / (3 * (1 - 2 * options.poisson_ratio))
