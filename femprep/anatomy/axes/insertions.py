"""Axes and the sides of a biventricular wall in, the axes with the insertions of the right ventricle out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femprep.anatomy.axes.ventricular_axes import VentricularAxes
from femprep.model import FACET_TAGS, FloatArray, VolumeMesh
from femprep.model.blocks import chosen_rows


def with_insertions(mesh: VolumeMesh, axes: VentricularAxes, side: FloatArray, *, keep_septal: bool) -> VentricularAxes:
    """The axes with the RV insertion points: where on the epicardium the two ventricles meet.

    Half-way up, as from labels: the median, before and behind, over the middle half of the heights of the groove.

    Parameters
    ----------
    mesh : VolumeMesh
    axes : VentricularAxes
    side : (n,) array
        At its points: positive in the left ventricle, negative in the right one.
    keep_septal : bool
        Otherwise the middle between the insertions becomes the septal direction.
    """
    centres = [np.empty((0, 3))]
    for chosen in chosen_rows(mesh.facets, mesh.facet_tag == FACET_TAGS["epi"]).values():
        mixed = (side[chosen] < 0).any(axis=1) & (side[chosen] > 0).any(axis=1)
        centres.append(mesh.points[chosen[mixed]].mean(axis=1))
    groove = np.concatenate(centres)
    if not len(groove):
        return axes
    height = axes.height(groove)
    groove = groove[(height >= np.percentile(height, 25)) & (height <= np.percentile(height, 75))]
    turn = axes.turn(groove)
    if not ((turn > 0).any() and (turn < 0).any()):
        return axes
    ends = np.radians([np.median(turn[turn < 0]), np.median(turn[turn > 0])])
    out = float(np.median(axes.radius(groove)))
    at = axes.apex + float(np.median(axes.height(groove))) * axes.long_axis
    ways = [axes.across(a) for a in (*ends, ends.mean())]
    points = {"inferior": at + out * ways[0], "anterior": at + out * ways[1]}
    septal = axes.septal if keep_septal else ways[2]
    return replace(axes, septal=septal, insertions=points)
