"""Labels and the slice a base lies in, in; how much further in the base lies so that no surface rounds off there, out.

Fitted surfaces are smooth, labels that end in a slice are not: the surface leaves the wall some millimetres before the
end and rounds off into a cap. In a slice of 5 mm and more the middle lies clear of that; in thinner ones it does not.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

import numpy as np

from femprep.model import Notice
from femprep.wall.planes.stack import Stack

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

#: So far within the end of the labels surfaces follow the wall, mm: of phantoms on voxels of .5 to 2 mm they are then
#: no more than .95 mm off it, and up to 2.2 mm nearer to the end.
CLEAR: Final = 2.5
#: Less than this is no move, mm: slices of 5 mm are stored as 4.9998, too.
_LEAST: Final = 0.1
#: Structures of the objects that the left ventricle's surfaces are fitted to.
LEFT: Final = (("lv",), ("lv", "myo"))
#: Labels end where less than this share of their voxels in the base's slice is left.
_END: Final = 0.5


def inward_of_end(seg: Segmentation, stack: Stack, number: int, objects: Iterable[tuple[str, ...]]) -> float:
    """How far a base in the middle of a slice is to be moved towards the apex, mm; 0 where no labels end near it.

    Parameters
    ----------
    seg, stack
        The labels.
    number : int
        The slice.
    objects : iterable of tuples of str
        Structures of each object a surface is fitted to.
    """
    height = float(seg.grid.spacing[stack.axis])
    within = [_slices_to_end(seg, stack, number, own) + 0.5 for own in objects]
    inward = CLEAR - height * min(within)
    return inward if inward > _LEAST else 0.0


def _slices_to_end(seg: Segmentation, stack: Stack, number: int, structures: tuple[str, ...]) -> int:
    """Slices beyond this one, towards the base, that the labels of an object go on in."""
    held = np.moveaxis(seg.mask(*structures), stack.axis, 0).sum(axis=(1, 2))
    beyond = held[number + stack.basal :: stack.basal] if 0 <= number + stack.basal < len(held) else held[:0]
    ended = np.flatnonzero(beyond < _END * held[number])
    return int(ended[0]) if len(ended) else len(beyond)


def inward_note(inward: float) -> str:
    """The same for a plane's source, behind the slice that it names."""
    return f"; {inward:.1f} mm further in" if inward else ""


def round_off_notices(inward: float) -> tuple[Notice, ...]:
    """That the base lies further in than the middle of its slice, where it does."""
    if inward <= 0.0:
        return ()
    words = (
        "the base plane was moved by {amount} towards the apex, as the labels end near it and surfaces round off there "
        "(--base-offset moves it back)"
    )
    return (Notice.of("moved", words, amount=inward, unit="mm"),)
