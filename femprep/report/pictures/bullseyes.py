"""A mesh with AHA segments in, bull's eyes of its wall thickness, its quality or any of its data out, as SVG."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, Literal

import numpy as np

from femprep.anatomy import bulls_eye_svg, segment_means, wall_thickness
from femprep.anatomy.aha import SEGMENTS
from femprep.errors import InputError
from femprep.mesh.measures.volume_elements import element_measures
from femprep.model import FloatArray, VolumeMesh

Statistic = Literal["mean", "least", "largest"]

#: What the report shows: a field, what is taken of it in each segment, its title, the format of its numbers.
SHOWN: Final[tuple[tuple[str, Statistic, str, str], ...]] = (
    ("thickness", "mean", "wall thickness, mm", "{:.1f}"),
    ("mean_ratio", "mean", "mean ratio, mean", "{:.2f}"),
    ("minimum_dihedral", "least", "smallest dihedral angle", "{:.0f}"),
)
#: Elements that are measured at once.
_CHUNK: Final = 200_000


def element_field(mesh: VolumeMesh, name: str, measured: Mapping[str, FloatArray] | None = None) -> FloatArray:
    """A value per element: ``thickness``, a measure of element quality, or scalar cell data of the mesh.

    ``measured`` are thickness and measures of quality where they are known already.

    Raises
    ------
    InputError
        There is no such field; the message lists those that are.
    """
    if name == "thickness":
        return measured[name] if measured is not None and name in measured else wall_thickness(mesh)
    if name in mesh.cell_data:
        values = np.asarray(mesh.cell_data[name], dtype=np.float64)
        if values.ndim != 1:
            raise InputError(f"cell data {name!r} have shape {values.shape}; a bull's eye shows one number per element")
        return values
    measured = quality_measures(mesh) if measured is None else measured
    if name not in measured:
        scalars = [key for key, values in mesh.cell_data.items() if np.asarray(values).ndim == 1]
        raise InputError(f"the mesh has no field {name!r}; choose from {', '.join(['thickness', *measured, *scalars])}")
    return measured[name]


def quality_measures(mesh: VolumeMesh, wanted: Sequence[str] | None = None) -> dict[str, FloatArray]:
    """Measures of quality of all elements; those that are for tetrahedra alone only where there are no others.

    All measures, or the wanted ones of them.
    """
    found = []
    for kind, block in mesh.cells.items():
        for first in range(0, len(block), _CHUNK):
            own = element_measures(mesh.points, block[first : first + _CHUNK], kind)
            found.append(own if wanted is None else {name: own[name] for name in wanted if name in own})
    shared = [name for name in found[0] if all(name in block for block in found)]
    return {name: np.concatenate([block[name] for block in found]) for name in shared}


def segment_values(mesh: VolumeMesh, values: FloatArray, statistic: Statistic = "mean") -> FloatArray:
    """Volume-weighted mean, least or largest value in each of the 17 segments; NaN in an empty one.

    Raises
    ------
    InputError
        The mesh has no AHA segments.
    """
    means = segment_means(mesh, values)
    if statistic == "mean":
        return means
    pick = np.min if statistic == "least" else np.max
    segment = np.asarray(mesh.cell_data["aha"])
    return np.array([pick(values[segment == k]) if np.any(segment == k) else np.nan for k in range(1, 18)])


def draw(
    mesh: VolumeMesh,
    name: str,
    *,
    statistic: Statistic = "mean",
    label: str | None = None,
    text: str = "{:.3g}",
    measured: Mapping[str, FloatArray] | None = None,
) -> str:
    """Bull's eye of one field as SVG text; titled by its name and statistic where no label is given.

    Raises
    ------
    InputError
        The mesh has no AHA segments, or no such field.
    """
    if "aha" not in mesh.cell_data:
        raise InputError("the mesh has no AHA segments; mesh with --fibres, or call add_aha first")
    values = segment_values(mesh, element_field(mesh, name, measured), statistic)
    return bulls_eye_svg(values, label=f"{name}, {statistic}" if label is None else label, text=text)


def thickness_of_segments(
    mesh: VolumeMesh, measured: Mapping[str, FloatArray] | None = None
) -> dict[str, float | None] | None:
    """Mean thickness of the wall in each of the 17 AHA segments by its name, mm; None where the mesh has none."""
    if "aha" not in mesh.cell_data:
        return None
    values = segment_values(mesh, element_field(mesh, "thickness", measured)).tolist()
    return {
        SEGMENTS[number]: round(value, 4) if math.isfinite(value) else None
        for number, value in enumerate(values, start=1)
    }


def report_bulls_eyes(mesh: VolumeMesh, measured: Mapping[str, FloatArray] | None = None) -> list[str]:
    """Bull's eyes of thickness and quality for the page of a run; none where the mesh has no AHA segments."""
    if "aha" not in mesh.cell_data:
        return []
    measured = quality_measures(mesh) if measured is None else measured
    eyes = [
        draw(mesh, name, statistic=statistic, label=title, text=text, measured=measured)
        for name, statistic, title, text in SHOWN
    ]
    for one in mesh.info.get("tissues", {}).get("tissues", ()):
        values = [0.0 if value is None else value for value in one["transmurality_of_segments"] or ()]
        if values:
            label = f"{one['name']}, transmurality, %"
            eyes.append(bulls_eye_svg(values, label=label, text="{:.0f}", limits=(0.0, 100.0)))
    return eyes + [draw(mesh, name, label=f"{name}, mean") for name in mesh.info.get("sampled", {})]
