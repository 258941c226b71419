"""A cut through a heart as layers of one SVG: the image, the labels, the outlines of the mesh, places off them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.image.underlay import Underlay
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.report.pictures.colours import colour
from femprep.report.pictures.raster import png_address

#: Layers from the lowest to the top; a page can leave each of them out.
LAYERS: Final = ("image", "labels", "planes", "outlines", "off")
_OFF: Final = "#ff0000"
_PLANE: Final = "#000000"


@dataclass(frozen=True, eq=False)
class Overlay:
    """What pictures show with the labels of a heart.

    Attributes
    ----------
    surfaces : mapping of str to (points, triangles)
        Their cuts are drawn over the labels; mm LPS.
    off : sequence of (n, 3) arrays
        Points that lie off the labels, mm LPS: drawn as dots where a picture comes near them.
    under : Underlay, optional
        The image to lay under them.
    limits : (float, float)
        Its values that are black and white.
    """

    surfaces: Mapping[str, tuple[FloatArray, IntArray]]
    off: Sequence[FloatArray] = ()
    under: Underlay | None = None
    limits: tuple[float, float] = (0.0, 1.0)


class Drawing:
    """Layers of a picture, filled one after another.

    Parameters
    ----------
    low : (2,) array
        Upper left corner, in units of the drawing.
    size : (2,) array
        Width and height in these units.
    unit : (2,) array
        Width and height of a unit, mm.
    """

    def __init__(self, low: FloatArray, size: FloatArray, unit: npt.ArrayLike = (1.0, 1.0)) -> None:
        self._low, self._size, self._unit = low, size, np.asarray(unit, dtype=np.float64)
        self._layers: dict[str, list[str]] = {name: [] for name in LAYERS}

    def raster(self, layer: str, pixels: npt.NDArray[np.uint8]) -> None:
        """Fill the picture with pixels, ``(rows, columns)`` of grey or with colours and opacity."""
        self._layers[layer].append(
            f'<image href="{png_address(pixels)}" width="{self._size[0]:g}" height="{self._size[1]:g}" '
            'preserveAspectRatio="none"/>'
        )

    def fill(self, layer: str, path: str, shade: str) -> None:
        """Fill a path, written from the corner on."""
        self._layers[layer].append(f'<path d="{path}" fill="{shade}"/>')

    def outline(self, name: str, segments: FloatArray) -> None:
        """Draw where a surface of this name meets the plane, segments ``(k, 2, 2)``."""
        path = "".join(f"M{a[0]:.2f} {a[1]:.2f}L{b[0]:.2f} {b[1]:.2f}" for a, b in segments - self._low)
        self._layers["outlines"].append(
            f'<path d="{path}" stroke="{colour(name)}" fill="none" vector-effect="non-scaling-stroke"/>'
        )

    def plane(self, segments: FloatArray) -> None:
        """Draw where another slice or view crosses the picture, segments ``(k, 2, 2)``."""
        path = "".join(f"M{a[0]:.2f} {a[1]:.2f}L{b[0]:.2f} {b[1]:.2f}" for a, b in segments - self._low)
        self._layers["planes"].append(
            f'<path d="{path}" stroke="{_PLANE}" stroke-width=".6" stroke-opacity=".5" '
            'vector-effect="non-scaling-stroke"/>'
        )

    def dots(self, places: FloatArray) -> None:
        """Mark places ``(n, 2)`` that lie off the labels."""
        path = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in places - self._low)
        if path:
            self._layers["off"].append(
                f'<path d="{path}" stroke="{_OFF}" stroke-width="4" stroke-linecap="round" fill="none" '
                'vector-effect="non-scaling-stroke"/>'
            )

    def svg(self, width: int, label: str, mark: str = "") -> str:
        """The picture: ``width`` pixels of the screen wide, called ``label``, with a mark in its corner."""
        size = self._size * self._unit
        body = "".join(f'<g class="{name}">{"".join(parts)}</g>' for name, parts in self._layers.items() if parts)
        lit = ' class="lit"' if self._layers["image"] else ""
        height = 0.05 * float(size[0])
        corner = f'<text x="2" y="{1 + height:.1f}" font-size="{height:.1f}">{mark}</text>' if mark else ""
        return (
            f'<svg{lit} viewBox="0 0 {size[0]:.2f} {size[1]:.2f}" width="{width}" role="img" aria-label="{label}">'
            f'<g transform="scale({self._unit[0]:.5f} {self._unit[1]:.5f})" stroke-width="1.4">{body}</g>{corner}</svg>'
        )


def runs(mask: BoolArray) -> str:
    """SVG path of a 2-D mask: one rectangle for each run of pixels."""
    padded = np.pad(mask.T.astype(np.int8), ((0, 0), (1, 1)))
    column, edge = np.nonzero(np.diff(padded, axis=1))  # the first pixel of a run and the first behind it, by turns
    found = zip(column[::2].tolist(), edge[::2].tolist(), edge[1::2].tolist())
    return "".join(f"M{a} {j}h{b - a}v1h{a - b}z" for j, a, b in found)
