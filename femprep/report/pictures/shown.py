"""A mesh in; it and what its page colours it by out: thickness and quality of its elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from femprep.anatomy import wall_thickness
from femprep.model import FloatArray, VolumeMesh
from femprep.report.pictures.bullseyes import quality_measures

#: Measures of quality that are shown.
QUALITY: Final = ("mean_ratio", "minimum_dihedral")


@dataclass(frozen=True, eq=False)
class Shown:
    """What a page shows of a mesh.

    Attributes
    ----------
    mesh : VolumeMesh
    fields : mapping of str to (n,) array
        ``thickness``, mm (where there is a wall), and the measures of ``QUALITY``, at its elements.
    """

    mesh: VolumeMesh
    fields: Mapping[str, FloatArray]


def shown(mesh: VolumeMesh) -> Shown:
    """Measure what a page shows of a mesh."""
    fields = quality_measures(mesh, QUALITY)
    if sum(name == "epi" or name.startswith("endo") for name in mesh.facet_names) > 1:
        fields = {"thickness": wall_thickness(mesh), **fields}
    return Shown(mesh, fields)
