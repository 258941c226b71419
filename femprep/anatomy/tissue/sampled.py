"""Labels along a wall in; points all over it, each with its volume, scores and label, and the outlines' levels, out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.anatomy.tissue.field import TissueField
from femprep.anatomy.tissue.label_volumes import label_volumes
from femprep.anatomy.tissue.levels import levels_for
from femprep.anatomy.tissue.wall_samples import sample_part
from femprep.model import FloatArray, IntArray

#: Outlines give way by no more than this many pixels.
_GIVE: Final = 1.0


@dataclass(frozen=True)
class Sampled:
    """Points of all parts of a wall.

    Attributes
    ----------
    scores : (q, tissues) array
        How far inside each tissue, mm.
    nearest : (q,) array
        Number of the tissue of the nearest pixel, from 1; 0 for none.
    element : (q,) array
        Element of the mesh.
    volume : (q,) array
        mm3.
    position : (q,) array
        Slice of the image, 0 the first; outside of it below or beyond.
    place : (q, 3) array
        mm.
    """

    scores: FloatArray
    nearest: IntArray
    element: IntArray
    volume: FloatArray
    position: FloatArray
    place: FloatArray

    def sums(self, values: npt.NDArray[Any], count: int) -> FloatArray:
        """Volume of the points of each of ``count`` elements times their values ``(q,)``."""
        found = np.bincount(self.element, weights=self.volume * values, minlength=count)
        return np.asarray(found, dtype=np.float64)


def sample(field: TissueField) -> Sampled:
    """Sample a wall, finer than the pixels of the image."""
    step = float(min(field.grid.spacing[field.maps.plane]))
    found = []
    for k, part in enumerate(field.parts):
        samples = sample_part(part, step)
        feet = field.feet(k, samples.nodes, samples.weights)
        place = np.einsum("qi,qij->qj", samples.weights, part.mesh.points[samples.nodes])
        element = part.cells[samples.element]
        found.append((field.scores(feet), field.nearest(feet), element, samples.volume, feet.position, place))
    return Sampled(*(np.concatenate(parts) for parts in zip(*found)))


def volumes_of(field: TissueField, sampled: Sampled) -> FloatArray:
    """Volume of each tissue by its labels, mm3.

    It is that of their voxels, and beyond the image's last slices that of the wall on which their labels go on. Where
    the rest of the wall is labelled too, outlines of the image and of the mesh may differ: it then is the volume of the
    wall nearest to each label, so that a tissue ends where the wall does.
    """
    count, last = sampled.scores.shape[1], field.grid.shape[field.grid.stack_axis] - 0.5
    beyond = (sampled.position < -0.5) | (sampled.position > last)
    rows = np.ones_like(beyond) if field.told else beyond
    found: FloatArray = np.asarray(
        np.bincount(sampled.nearest[rows], weights=sampled.volume[rows], minlength=count + 1)[1:], dtype=np.float64
    )
    if field.told:
        return found
    return found + label_volumes(field.mesh, field.locator, np.asarray(field.labels), field.grid, count)


def levels_of(field: TissueField, sampled: Sampled, wanted: FloatArray) -> FloatArray:
    """How far the outline of each tissue gives way for a volume, mm."""
    pixel = float(max(field.grid.spacing[field.maps.plane]))
    return levels_for(sampled.scores, sampled.volume, wanted, 0.0, _GIVE * pixel)
