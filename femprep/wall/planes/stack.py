"""Label map in, the slices of the left ventricle out: areas, closed rings, and which end is basal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt
from scipy.ndimage import binary_fill_holes, find_objects, label

from femprep.errors import InputError
from femprep.image.long_axis import is_stack
from femprep.image.slices import relative_slope
from femprep.image.topology import label_pieces
from femprep.model import BoolArray, FloatArray
from femprep.options.advice import GIVE_END

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

#: An open slice between closed ones ends the heart where more than this share of its cavity's outline is open.
_GAPING: Final = 0.2


@dataclass(frozen=True)
class Stack:
    """The slices of the left ventricle, seen along the stack.

    Attributes
    ----------
    axis : int
        Grid axis of the stack.
    cavity : (s,) array
        Voxels of the cavity's largest piece in each slice of the grid.
    bare : (s,) array
        Share of the cavity in each slice that the next slice towards the base does not cover.
    open : (s,) array
        Share of the cavity's outline in each slice that does not border on myocardium; 1 without cavity.
    basal : int
        +1 where the slices run from apex to base, -1 where they run from base to apex.
    thick : bool
        Whether the image is a stack of thick slices, which have numbers in messages.
    evidence : mapping
        What told the basal end, JSON-ready.
    """

    axis: int
    cavity: npt.NDArray[np.int64]
    bare: FloatArray
    open: FloatArray
    basal: int
    thick: bool
    evidence: dict[str, Any]

    @property
    def closed(self) -> BoolArray:
        """Whether the myocardium closes around a cavity in each slice, ``(s,)``."""
        return np.asarray(self.open == 0.0)

    @property
    def ring(self) -> tuple[int, int]:
        """First and last closed ring of the longest run of slices, ``(0, -1)`` where none closes.

        Of thick slices one that is a little open between closed ones does not end the run: the heart goes on beyond it.
        Of thin ones it may be the tilt of the valves.
        """
        best = (0, -1)
        for (run,) in find_objects(label(self.open <= (_GAPING if self.thick else 0.0))[0]):
            rings = run.start + np.flatnonzero(self.closed[run])
            if len(rings) and rings[-1] - rings[0] > best[1] - best[0]:
                best = (int(rings[0]), int(rings[-1]))
        return best

    @property
    def gaps(self) -> list[int]:
        """Slices between the first and the last ring that do not close."""
        first, last = self.ring
        return [number for number in range(first, last) if not self.closed[number]]


def read_stack(seg: Segmentation, basal_end: str = "auto", what: str = "the base") -> Stack:
    """Look at the slices of the left ventricle: areas, closed rings, basal end.

    Parameters
    ----------
    seg : Segmentation
        The label map.
    basal_end : {"auto", "first", "last"}
        Which end of the stack is basal, where it is known.
    what : str
        What is sought, for the messages.

    Raises
    ------
    InputError
        A structure is empty, lies in one slice only, or both ends look alike.
    """
    axis = int(seg.stack_axis)
    inside = np.moveaxis(label_pieces(seg.mask("lv"))[0] == 1, axis, 0)
    tissue = np.moveaxis(np.asarray(seg.mask("myo"), dtype=bool), axis, 0)
    both = inside | tissue
    for name, mask in (("lv", inside), ("myo", tissue)):
        if not mask.any():
            raise InputError(f"structure {name!r} has no voxel, so {what} cannot be found; check the label numbers")
    # What cavity and myocardium enclose together, as a papillary muscle that has no label, opens no ring.
    open_ = np.array([open_share(c, b) for c, b in zip(inside, binary_fill_holes(both))])
    cavity_area, muscle_area = (m.sum(axis=(1, 2)).astype(np.int64) for m in (inside, tissue))
    slices = np.flatnonzero(cavity_area + muscle_area)
    if len(slices) < 2:
        raise InputError(f"'lv' and 'myo' lie in slice {slices[0]} alone; {what} needs at least 2 slices")
    other = "rv" in seg.structures and set(seg.structures["rv"]) <= set(seg.present)
    right = np.moveaxis(seg.mask("rv"), axis, 0).sum(axis=(1, 2)) if other else np.zeros_like(cavity_area)
    trend, evidence = _trend(cavity_area, muscle_area, right, open_ == 0.0, slices)
    if basal_end == "auto":
        if trend == 0.0:
            raise InputError(f"both ends of the stack look alike, so {what} cannot be found", advice=[GIVE_END])
        basal = 1 if trend > 0 else -1
    else:
        basal = 1 if basal_end == "last" else -1
        evidence["given"] = basal_end
    covering = np.roll(both, -basal, axis=0)
    bare = (inside & ~covering).sum(axis=(1, 2)) / np.maximum(cavity_area, 1)
    evidence["basal_end"] = "last" if basal > 0 else "first"
    return Stack(axis, cavity_area, bare, open_, basal, is_stack(seg.grid), evidence)


def open_share(cavity: BoolArray, both: BoolArray) -> float:
    """Share of the pixels next to the cavity in this slice that are no myocardium; beyond the image there is none."""
    if not cavity.any():
        return 1.0
    inside = np.pad(cavity, 1)
    around = np.zeros_like(inside)
    around[1:-1, 1:-1] = inside[2:, 1:-1] | inside[:-2, 1:-1] | inside[1:-1, 2:] | inside[1:-1, :-2]
    around[0], around[-1], around[:, 0], around[:, -1] = inside[1], inside[-2], inside[:, 1], inside[:, -2]
    around &= ~inside
    return float((around & ~np.pad(both, 1)).sum() / around.sum())


def _trend(
    cavity: npt.NDArray[np.int64],
    muscle: npt.NDArray[np.int64],
    right: npt.NDArray[np.int64],
    closed: BoolArray,
    slices: npt.NDArray[np.int64],
) -> tuple[float, dict[str, Any]]:
    """Evidence for the basal end: positive where it is the last slice.

    The cross-section grows towards the base (slope of its area over the slices, relative to its mean), and that of the
    right ventricle more so: where the left one is a tube, as after an infarction of its apex, that tells alone. A slice
    of myocardium without cavity is an apical cap, a ring that does not close is near the valve: each at an end counts
    as much as a clear slope.
    """
    area = (cavity + muscle)[slices].astype(float)
    slope, right_slope = relative_slope(area), relative_slope(right[slices])
    half = len(slices) // 2
    low, high = slices[:half], slices[-half:]

    def count(where: BoolArray) -> tuple[int, int]:
        return int(where[low].sum()), int(where[high].sum())

    caps = count((cavity == 0) & (muscle > 0))
    open_rings = count((cavity > 0) & ~closed)
    signs = np.sign(caps[0] - caps[1]) + np.sign(open_rings[1] - open_rings[0])
    score = slope + right_slope + 0.05 * float(signs)
    evidence = {
        "area_slope_per_slice": round(slope, 4),
        "rv_slope_per_slice": round(right_slope, 4),
        "apical_caps_first_last": list(caps),
        "open_rings_first_last": list(open_rings),
    }
    return score, evidence
