"""Seventeen values, or a mesh and a value per element, in; a bull's-eye plot out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from femprep.anatomy.aha import segment_means
from femprep.errors import InputError, MissingDependencyError
from femprep.model import VolumeMesh

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Rings of the plot, from outside: first segment of each, its segments, inner and outer radius.
_RINGS = ((1, 6, 3.0, 4.0), (7, 6, 2.0, 3.0), (13, 4, 1.0, 2.0))


def bulls_eye(
    values: npt.ArrayLike,
    mesh: VolumeMesh | None = None,
    *,
    ax: Axes | None = None,
    label: str = "",
    cmap: str = "viridis",
    limits: tuple[float, float] | None = None,
    text: str | None = "{:.3g}",
) -> Axes:
    """Draw a field as the AHA's polar map: the base outside, the anterior wall at the top, the septum on the left.

    Parameters
    ----------
    values : (17,) array, or (n_cells,) array with a mesh
        One value per segment; or per element, of which the volume-weighted mean in each segment is drawn.
    mesh : VolumeMesh, optional
        With ``cell_data["aha"]``.
    ax : matplotlib Axes, optional
        Where to draw; a new figure where not given.
    label : str
        Name and unit of the value, at the colour bar.
    cmap : str
        Name of matplotlib's colour map.
    limits : pair of float, optional
        Smallest and largest value of the colours.
    text : str, optional
        Format of the number in each segment; ``None`` for none. A segment without a value (NaN) is grey.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    InputError
        There are not 17 values.
    MissingDependencyError
        matplotlib is not installed (the extra ``plot``).
    """
    numbers = segment_means(mesh, values) if mesh is not None else np.asarray(values, dtype=float)
    if numbers.shape != (17,):
        raise InputError(f"a bull's eye has 17 values, not {numbers.shape}; give the mesh with values per element")
    try:
        from matplotlib import colormaps
        from matplotlib import pyplot as plt
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize
        from matplotlib.patches import Wedge
    except ImportError as error:
        raise MissingDependencyError("plots need matplotlib; install femprep[plot]") from error
    if ax is None:
        _, ax = plt.subplots(figsize=(5.0, 4.4))
    known = numbers[np.isfinite(numbers)]
    low, high = limits or ((float(known.min()), float(known.max())) if len(known) else (0.0, 1.0))
    scale = ScalarMappable(Normalize(low, high if high > low else low + 1.0), colormaps[cmap])

    def piece(segment: int, inner: float, outer: float, start: float, stop: float) -> None:
        value = numbers[segment - 1]
        colour: Any = scale.to_rgba(value) if np.isfinite(value) else "lightgrey"
        ax.add_patch(
            Wedge((0, 0), outer, start, stop, width=outer - inner, facecolor=colour, edgecolor="black", lw=0.8)
        )
        if text is None:
            return
        middle, radius = np.radians((start + stop) / 2), (inner + outer) / 2 if inner else 0.0
        bright = np.isfinite(value) and float(np.dot(colour[:3], (0.3, 0.59, 0.11))) < 0.5
        words = text.format(value) if np.isfinite(value) else "-"
        at = (radius * np.cos(middle), radius * np.sin(middle))
        ax.text(*at, words, ha="center", va="center", fontsize=8, color="white" if bright else "black")

    for first, count, inner, outer in _RINGS:
        width = 360.0 / count
        for k in range(count):
            start = 90.0 - width / 2 + k * width  # counter-clockwise from the top: anterior, septal, inferior, lateral
            piece(first + k, inner, outer, start, start + width)
    piece(17, 0.0, 1.0, 0.0, 360.0)
    for words, y in (("anterior", 4.25), ("inferior", -4.25)):
        ax.text(0, y, words, ha="center", va="bottom" if y > 0 else "top", fontsize=9)
    for words, x in (("septal", -4.25), ("lateral", 4.25)):
        ax.text(x, 0, words, ha="center", va="center", rotation=90, fontsize=9)
    ax.set(xlim=(-4.7, 4.7), ylim=(-4.8, 4.8), aspect="equal")
    ax.set_axis_off()
    ax.figure.colorbar(scale, ax=ax, label=label, shrink=0.7)
    return ax
