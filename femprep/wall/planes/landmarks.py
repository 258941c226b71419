"""Segmentation in, base and apex Plane out: where the wall is cut.

Both planes are slices of the image (perpendicular to the stack, oblique where the image is), put at the centre of the
last slice on their side in which the myocardium closes around the cavity. There the contours of both surfaces were
drawn; half a slice further out, at the face of the voxel, the fitted surfaces already round off into their caps. The
base lies further in where slices are thinner than that (:mod:`~femprep.wall.planes.round_off`).
"""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femprep.errors import InputError
from femprep.model import Notice, Plane
from femprep.model.products import length
from femprep.options import WallOptions, choose, takes
from femprep.wall.planes.annulus import annulus_base
from femprep.wall.planes.base_slice import base_notices, base_slice, closed_rings
from femprep.wall.planes.misnamed import require_order
from femprep.wall.planes.oblique import look_across
from femprep.wall.planes.round_off import LEFT, inward_note, inward_of_end, round_off_notices
from femprep.wall.planes.stack import Stack, read_stack

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

logger = logging.getLogger(__name__)


def slice_plane(
    seg: Segmentation,
    stack: Stack,
    slice_: int,
    towards: int,
    inward: float,
    source: str,
    notices: tuple[Notice, ...] = (),
) -> Plane:
    """Plane through the centre of a slice, its normal along the stack in the given sense."""
    index = (np.asarray(seg.labels.shape, dtype=float) - 1.0) / 2.0
    index[stack.axis] = slice_
    point = seg.grid.to_world(index)
    # A grid of ITK is orthogonal, so the direction of the stack is also the normal of its slices.
    normal = towards * seg.grid.direction[:, stack.axis] / length(seg.grid.direction[:, stack.axis])
    return Plane(point - inward * normal, normal, source=source, notices=notices)


@takes(WallOptions)
def find_base(seg: Segmentation, *, options: WallOptions | None = None, **changes: Any) -> Plane:
    """Base plane of the left ventricle, from its labels.

    Which end of the stack is basal is found from how the cross-section grows, from apical caps and from open rings.
    The plane goes through the centre of the most basal slice in which the myocardium closes around the cavity: the
    open, C-shaped rings beside the valve and slices that hold cavity or myocardium alone lie beyond it. One that is
    open between closed ones does not end the heart, and a notice tells of it. A slice that leaves more than a tenth of
    the next slice's cavity bare is passed over, two at most; ``source`` says so. Where the labels end less than 2.5 mm
    beyond the centre it lies 2.5 mm within their end, which a notice tells.

    Parameters
    ----------
    seg : Segmentation
        Label map with the structures ``lv`` and ``myo``.
    options, **changes
        :class:`~femprep.options.WallOptions`; ``base``, ``basal_end`` and ``base_offset`` matter here.

    Returns
    -------
    Plane
        Its normal points away from the apex, to the side that is cut away.

    Raises
    ------
    InputError
        A structure is missing or has another's number, both ends look alike, the myocardium closes around the cavity
        in no slice, or most of the cavity would lie beyond the plane.

    Examples
    --------
    >>> fp.find_base(seg).source
    'labels: ...'
    """
    chosen = choose(WallOptions, options, changes)
    if chosen.base is not None:
        return given_base(seg, chosen)
    require_order(seg)
    view = look_across(seg, chosen.basal_end)
    stack = read_stack(view.seg, basal_end=view.basal_end, what="the base")
    base = base_slice(view.seg, stack)
    inward = inward_of_end(view.seg, stack, base.number, LEFT)
    source = f"labels: {view.words or centre(stack, base.number)}{base.note}{inward_note(inward)}"
    logger.info("base plane: %s; %s", source, stack.evidence)
    notices = view.notices + base_notices(view.seg, stack, base) + round_off_notices(inward)
    return slice_plane(view.seg, stack, base.number, stack.basal, chosen.base_offset + inward, source, notices)


def given_base(seg: Segmentation, options: WallOptions, below: tuple[str, ...] = ()) -> Plane:
    """The base plane that was given, or that of the mitral annulus, below other valves, moved by the offset."""
    assert options.base is not None
    if options.base == "annulus":
        plane = annulus_base(seg, below)
    else:
        plane = Plane(np.array(options.base[:3]), np.array(options.base[3:]), "given")
    return replace(plane, point=plane.point - options.base_offset * plane.normal)


@takes(WallOptions)
def find_apex(seg: Segmentation, *, options: WallOptions | None = None, **changes: Any) -> Plane:
    """Apex plane of the left ventricle, from its labels: where a wall that is clipped at the apex ends.

    It goes through the centre of the most apical slice in which the myocardium closes around the cavity.

    Parameters
    ----------
    seg : Segmentation
        Label map with the structures ``lv`` and ``myo``.
    options, **changes
        :class:`~femprep.options.WallOptions`; ``basal_end`` matters here.

    Returns
    -------
    Plane
        Its normal points away from the base, to the side that is cut away.

    Raises
    ------
    InputError
        As :func:`find_base`; also where the only closed ring is the one the base lies in.

    Examples
    --------
    >>> bool(fp.find_base(seg).normal @ fp.find_apex(seg).normal < 0)
    True
    """
    chosen = choose(WallOptions, options, changes)
    view = look_across(seg, chosen.basal_end)
    stack = read_stack(view.seg, basal_end=view.basal_end, what="the apex")
    ring = closed_rings(stack, "the apex")
    if ring[0] == ring[1]:
        raise InputError(
            f"the myocardium closes around the cavity in slice {ring[0]} alone, where the base is; "
            "a wall clipped at the apex needs at least 2 such slices"
        )
    slice_ = ring[0] if stack.basal > 0 else ring[1]
    source = f"labels: {view.words or centre(stack, slice_)}"
    return slice_plane(view.seg, stack, slice_, -stack.basal, 0.0, source)


def centre(stack: Stack, number: int) -> str:
    """Where a plane through the middle of a slice lies, in words."""
    return f"centre of slice {number}, {stack.evidence['basal_end']} end basal"
