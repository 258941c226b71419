"""Seventeen values, or a mesh and a value per element, in; a bull's-eye plot out, by matplotlib or as SVG text."""

from __future__ import annotations

from collections.abc import Iterator
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from femprep.anatomy.aha import SEGMENTS, segment_means
from femprep.errors import InputError, MissingDependencyError, OptionError, did_you_mean, quoted
from femprep.model import FloatArray, VolumeMesh
from femprep.model.arrays import floats
from femprep.model.markup import escape
from femprep.options import require_number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Rings of the plot, from outside: first segment of each, its segments, inner and outer radius.
_RINGS: Final = ((1, 6, 3.0, 4.0), (7, 6, 2.0, 3.0), (13, 4, 1.0, 2.0))
#: Tenths of matplotlib's colour map viridis, red, green, blue.
_VIRIDIS: Final = np.array(
    [
        *((68, 1, 84), (72, 40, 120), (62, 73, 137), (49, 104, 142), (38, 130, 142), (31, 158, 137)),
        *((53, 183, 121), (110, 206, 88), (181, 222, 43), (253, 231, 37)),
    ]
)
#: How bright red, green and blue look.
_LUMINANCE: Final = (0.3, 0.59, 0.11)


class _Piece(NamedTuple):
    """A segment's place: inner and outer radius, and the angles it lies between, degrees counter-clockwise from x."""

    segment: int
    inner: float
    outer: float
    start: float
    stop: float

    @property
    def middle(self) -> tuple[float, float]:
        """Where its number stands."""
        turn, radius = np.radians((self.start + self.stop) / 2), (self.inner + self.outer) / 2 if self.inner else 0.0
        return float(radius * np.cos(turn)), float(radius * np.sin(turn))


def _pieces() -> Iterator[_Piece]:
    for first, count, inner, outer in _RINGS:
        width = 360.0 / count
        for k in range(count):
            start = 90.0 - width / 2 + k * width  # counter-clockwise from the top: anterior, septal, inferior, lateral
            yield _Piece(first + k, inner, outer, start, start + width)
    yield _Piece(17, 0.0, 1.0, 0.0, 360.0)


def _limits(numbers: FloatArray, limits: tuple[float, float] | None) -> tuple[float, float]:
    """Values of the first and the last colour."""
    known = numbers[np.isfinite(numbers)]
    if limits is None:
        limits = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    try:
        low, high = map(float, limits)
    except (TypeError, ValueError):
        low = high = np.nan
    if not -np.inf < low <= high < np.inf:
        raise OptionError(f"limits is {quoted(limits)}, expected the smallest and the largest value of the colours")
    return low, high if high > low else low + 1.0


def _seventeen(values: npt.ArrayLike, mesh: VolumeMesh | None) -> FloatArray:
    numbers = segment_means(mesh, values) if mesh is not None else floats(values, "values of a bull's eye")
    if numbers.shape != (17,):
        raise InputError(f"a bull's eye has 17 values, not {numbers.shape}; give the mesh with values per element")
    return numbers


def _require_format(text: str) -> None:
    try:
        text.format(0.0)
    except (ValueError, IndexError, KeyError):
        raise OptionError(f"text is {text!r}, expected the format of a number such as '{{:.3g}}'") from None


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
    OptionError
        There is no such colour map or format, or ``limits`` are no two numbers, the smaller one first.
    MissingDependencyError
        matplotlib is not installed (the extra ``plot``).

    Examples
    --------
    >>> axes = fp.bulls_eye(range(17), label="segment")
    """
    if text is not None:
        _require_format(text)
    numbers = _seventeen(values, mesh)
    try:
        from matplotlib import colormaps
        from matplotlib import pyplot as plt
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize
        from matplotlib.patches import Wedge
    except ImportError as error:
        raise MissingDependencyError("plots need matplotlib; install femprep[plot]") from error
    if cmap not in colormaps:
        raise OptionError(
            f"cmap is {cmap!r}, which is no colour map of matplotlib"
            + did_you_mean(get_close_matches(cmap, list(colormaps)))
        )
    if ax is None:
        _, ax = plt.subplots(figsize=(5.0, 4.4))
    scale = ScalarMappable(Normalize(*_limits(numbers, limits)), colormaps[cmap])
    for piece in _pieces():
        value = numbers[piece.segment - 1]
        colour: Any = scale.to_rgba(value) if np.isfinite(value) else "lightgrey"
        place = (piece.outer, piece.start, piece.stop)
        ax.add_patch(Wedge((0, 0), *place, width=piece.outer - piece.inner, fc=colour, ec="black", lw=0.8))
        if text is not None:
            bright = np.isfinite(value) and float(np.dot(colour[:3], _LUMINANCE)) < 0.5
            words = text.format(value) if np.isfinite(value) else "-"
            ax.text(*piece.middle, words, ha="center", va="center", fontsize=8, color="white" if bright else "black")
    for words, y in (("anterior", 4.25), ("inferior", -4.25)):
        ax.text(0, y, words, ha="center", va="bottom" if y > 0 else "top", fontsize=9)
    for words, x in (("septal", -4.25), ("lateral", 4.25)):
        ax.text(x, 0, words, ha="center", va="center", rotation=90, fontsize=9)
    ax.set(xlim=(-4.7, 4.7), ylim=(-4.8, 4.8), aspect="equal")
    ax.set_axis_off()
    ax.figure.colorbar(scale, ax=ax, label=label, shrink=0.7)
    return ax


def bulls_eye_svg(
    values: npt.ArrayLike,
    mesh: VolumeMesh | None = None,
    *,
    label: str = "",
    limits: tuple[float, float] | None = None,
    text: str = "{:.3g}",
    width: int = 320,
) -> str:
    """The same plot as the text of an SVG picture, which needs no other package.

    Parameters
    ----------
    values, mesh, label, limits, text
        As for :func:`bulls_eye`.
    width : int
        Width of the picture, pixels.

    Returns
    -------
    str
        One ``<svg>`` element, fit for a page or a file of its own.

    Raises
    ------
    InputError
        There are not 17 values.
    OptionError
        ``limits`` are no two numbers, the smaller one first, ``width`` is less than one, or there is no such format.

    Examples
    --------
    >>> fp.bulls_eye_svg(range(17), label="segment").startswith("<svg")
    True
    """
    require_number("width", width, 1)
    _require_format(text)
    numbers = _seventeen(values, mesh)
    low, high = _limits(numbers, limits)
    shapes = []
    for piece in _pieces():
        value = float(numbers[piece.segment - 1])
        known = bool(np.isfinite(value))
        rgb = _colour((value - low) / (high - low)) if known else np.array([211, 211, 211])
        dark = float(np.dot(rgb, _LUMINANCE)) < 127.0
        x, y = piece.middle
        title = f"{piece.segment} {SEGMENTS[piece.segment]}"
        shapes.append(
            f'<path d="{_outline(piece)}" fill="{_hex(rgb)}" stroke="#000" stroke-width="0.02">'
            f"<title>{title}</title></path>"
            f'<text x="{x:.3f}" y="{-y:.3f}" dy="0.12" fill="{"#fff" if dark else "#000"}">'
            f"{escape(text.format(value)) if known else '-'}</text>"
        )
    sides = (("anterior", 0, -4.2, 0), ("inferior", 0, 4.45, 0), ("septal", -4.25, 0, -90), ("lateral", 4.25, 0, 90))
    shapes += [f'<text transform="translate({x} {y}) rotate({turn})">{words}</text>' for words, x, y, turn in sides]
    bar = [
        f'<rect x="{-3 + 0.1 * i:.1f}" y="5" width="0.11" height="0.35" fill="{_hex(_colour((i + 0.5) / 60))}"/>'
        for i in range(60)
    ]
    ends = (
        f'<text x="-3" y="5.8">{escape(text.format(low))}</text><text x="3" y="5.8">{escape(text.format(high))}</text>'
    )
    name = escape(label)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-4.7 -4.8 9.4 11" width="{width}" role="img" '
        f'aria-label="{name}" font-family="sans-serif" font-size="0.38" text-anchor="middle">'
        f'{"".join(shapes)}{"".join(bar)}{ends}<text x="0" y="5.8">{name}</text></svg>'
    )


def _colour(share: float) -> FloatArray:
    """Red, green and blue, 0 to 255, at a share of the colour map."""
    at = np.clip(share, 0.0, 1.0) * (len(_VIRIDIS) - 1)
    return np.array([np.interp(at, np.arange(len(_VIRIDIS)), channel) for channel in _VIRIDIS.T])


def _hex(rgb: npt.NDArray[Any]) -> str:
    return "#" + "".join(f"{round(float(part)):02x}" for part in rgb)


def _outline(piece: _Piece) -> str:
    """Path of a piece; y points down in SVG."""
    if piece.inner == 0.0:
        r = piece.outer
        return f"M {-r} 0 A {r} {r} 0 1 1 {r} 0 A {r} {r} 0 1 1 {-r} 0 Z"

    def at(radius: float, degrees: float) -> str:
        turn = np.radians(degrees)
        return f"{radius * np.cos(turn):.4f} {-radius * np.sin(turn):.4f}"

    return (
        f"M {at(piece.outer, piece.start)} A {piece.outer} {piece.outer} 0 0 0 {at(piece.outer, piece.stop)} "
        f"L {at(piece.inner, piece.stop)} A {piece.inner} {piece.inner} 0 0 1 {at(piece.inner, piece.start)} Z"
    )
