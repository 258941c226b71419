"""A Segmentation, with long-axis views or without, in, the motions of its slices and views out; and these undone."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Final

import numpy as np

from femprep.errors import FemprepError
from femprep.image import shifts as stack
from femprep.image.grid import Grid
from femprep.image.left_out import leave_out_slices
from femprep.image.long_axis import is_stack
from femprep.image.object import make_object
from femprep.image.segmentation import Segmentation
from femprep.image.shifts import SliceShifts, ViewMotion
from femprep.mesh.blas import one_blas_thread
from femprep.model import FloatArray
from femprep.surface.alignment.crossing_lines import first_motions
from femprep.surface.alignment.joint import Agreement, RoughSurface, agree
from femprep.surface.alignment.planes import ImagePlane, objects_of, planes_of
from femprep.surface.estimate.observations import Observations
from femprep.surface.estimate.outline import outlines

#: Vertices of the surfaces that planes are moved onto.
_VERTICES: Final = 500
#: Shifts beyond the joint estimate's prior, mm.
_FAR: Final = 9.0
#: A stack of fewer slices shows no shifts.
_SLICES: Final = 5
#: A view contradicts the other planes where half of its outlines lie farther than this from the surfaces, mm, and so
#: many times farther than those of most planes. Slices that do so are tried with so many to either side: one is wrong
#: where half of its outlines lie this far from the surfaces through all others, mm.
_CONTRADICTS: Final = (1.5, 2.0)
_DOUBTFUL: Final = (0.6, 1.4)
_BESIDE: Final = 2
_WRONG: Final = 4.0


@one_blas_thread()
def estimate_shifts(seg: Segmentation) -> SliceShifts:
    """Estimate how far slices and views are displaced, from all structures of all planes together.

    Surfaces of all structures and the motions of all planes are estimated jointly: every plane moves so that what it
    shows lies on surfaces that are as smooth as the labels allow and pass through what all other planes show. Slices
    move in their planes, views as rigid bodies; each motion has a prior, of 3 mm rms for slices and 2 mm for views. A
    view that contradicts the other planes is left out, and so is a slice without which the others agree.

    A shift that varies slowly along the stack looks like a bend of the heart. Without views it is corrected only as far
    as the priors of both allow, and the deviations hold the rest. The centroids of several structures then give a
    second estimate (:func:`femprep.image.shifts.estimate_shifts`), better for hearts that are almost straight and where
    few slices are displaced; of the two the one of the smaller expected residual is returned, and that of the centroids
    where a slice lies farther off than 9 mm, three times the prior.

    Parameters
    ----------
    seg : Segmentation
        A stack of slices, with views or without.

    Returns
    -------
    SliceShifts
        To 0.01 mm. Zero where slices are displaced no farther than the estimate is uncertain.

    Examples
    --------
    >>> float(abs(fp.estimate_shifts(seg).shift).max()) < 1.0
    True
    """
    if not is_stack(seg.grid):
        return stack.estimate_shifts(seg)
    objects = objects_of(seg)
    planes = planes_of(seg, objects)
    if len(seg.views) > 1:
        return _jointly(seg, planes, objects)
    centroids, slices = stack.estimate_shifts(seg), [plane for plane in planes if not plane.view]
    if not seg.views and len(slices) < _SLICES:
        return centroids
    found = _jointly(replace(seg, views=()), slices, objects)
    far = centroids.largest > _FAR
    better = far or (bool(centroids.largest) and centroids.expected < found.expected)
    if seg.views:
        return _jointly(seg, _guessed(planes, centroids) if better else planes, objects)
    return centroids if better else found


def _guessed(planes: list[ImagePlane], guess: SliceShifts) -> list[ImagePlane]:
    """Planes whose prior is another estimate: one view determines shifts in one direction only."""
    known = {int(k): (-s, d) for k, s, d in zip(guess.index, guess.shift, guess.deviation)}
    return [
        replace(p, guess=known[p.number][0], prior=np.minimum(known[p.number][1], p.prior)) if p.number in known else p
        for p in planes
    ]


def _jointly(seg: Segmentation, planes: list[ImagePlane], objects: Mapping[str, tuple[str, ...]]) -> SliceShifts:
    """The joint estimate from planes of a segmentation."""
    left_out: list[str] = []
    out: list[int] = []
    found = _agreement(seg, planes, objects)
    while (worst := _contradicting(found)) is not None:
        if planes[worst].view:
            left_out.append(planes[worst].name)
            planes = [plane for plane in planes if plane is not planes[worst]]
            found = _agreement(seg, planes, objects)
            continue
        # Without views surfaces follow a wrong slice, and one beside it may lie off them farther: all near are tried.
        inner = [k for k, plane in enumerate(planes) if not plane.view][1:-1]
        near = [k for k in inner if abs(k - worst) <= (_BESIDE if planes[-1].number >= 0 else 0)]
        tried = {}
        for k in near:
            others = [plane for plane in planes if plane is not planes[k]]
            tried[k] = _agreement(leave_out_slices(seg, [*out, planes[k].number]), others, objects)
        off = {k: tried[k].off(found.planes[k]) for k in near}
        wrong = max(near, key=lambda k: off[k])
        if len(inner) < _SLICES or off[wrong] < _WRONG:
            break
        out.append(planes[wrong].number)
        planes = [plane for plane in planes if plane is not planes[wrong]]
        found = tried[wrong]
    planes = _undisplaced(found)
    slices = [plane for plane in planes if not plane.view]
    size = 2 * len(slices)
    away = np.concatenate([plane.motion for plane in slices])
    numbers = np.array([plane.number for plane in slices])
    return SliceShifts(
        axis=seg.stack_axis,
        index=numbers,
        shift=np.round(-away.reshape(-1, 2), 2) + 0.0,
        deviation=np.sqrt(np.diag(found.covariance)[:size].reshape(-1, 2).mean(axis=1)),
        evidence=float(away @ np.linalg.solve(found.covariance[:size, :size], away)),
        zigzag=stack.zigzags(seg, numbers, -away.reshape(-1, 2)),
        structures=tuple(seg.structures),
        views=tuple(_in_world(seg.grid, plane) for plane in planes if plane.view),
        left_out=tuple(left_out),
        slices_left_out=tuple(sorted(out)),
    )


def _agreement(seg: Segmentation, planes: list[ImagePlane], objects: Mapping[str, tuple[str, ...]]) -> Agreement:
    """Planes moved until they agree with each other."""
    moved = first_motions(planes)
    return agree(moved, _bodies(seg, moved, objects))


def _contradicting(found: Agreement) -> int | None:
    """The view that contradicts the other planes most; where none does, the inner slice."""
    inner = [k for k, plane in enumerate(found.planes) if not plane.view][1:-1]
    middle = float(np.median(found.misfit))
    views = [k for k, plane in enumerate(found.planes) if plane.view]
    for own, (least, times) in ((views, _CONTRADICTS), (inner, _DOUBTFUL)):
        worst = max(own, key=lambda k: found.misfit[k], default=None)
        if worst is not None and found.misfit[worst] > max(least, times * middle):
            return worst
    return None


def _undisplaced(found: Agreement) -> list[ImagePlane]:
    """The planes; slices, or views, that move no farther in the mean than they are uncertain stay where they are."""
    variance = np.split(np.diag(found.covariance), np.cumsum([len(plane.motion) for plane in found.planes])[:-1])
    planes = list(found.planes)
    for view, axes in ((False, 2), (True, 3)):
        own = [k for k, plane in enumerate(planes) if plane.view == view]
        moved = sum(float(np.linalg.norm(planes[k].motion[:axes])) for k in own)
        if moved <= sum(float(np.sqrt(variance[k][:axes].sum())) for k in own):
            for k in own:
                planes[k] = replace(planes[k], motion=np.zeros_like(planes[k].motion))
    return planes


def align_slices(seg: Segmentation, shifts: SliceShifts | None = None) -> Segmentation:
    """Move the slices of a stack back in their planes, and its views in space, against their breath-hold shifts.

    Labels move by whole pixels, so that none is resampled; what is left, at most half a pixel, the grid carries as an
    offset of the slice, which boundary points, contours and centroids have in them.

    Parameters
    ----------
    seg : Segmentation
    shifts : SliceShifts, optional
        As estimated from the labels where not given.

    Returns
    -------
    Segmentation
        On a grid that is wider by what slices moved; ``info["slice_shifts"]`` holds each slice's shift. The same one,
        with that record, where no slice is displaced.

    Examples
    --------
    >>> aligned = fp.align_slices(seg)
    >>> aligned.labels.shape == seg.labels.shape
    True
    """
    return stack.move_back(seg, estimate_shifts(seg) if shifts is None else shifts)


def _bodies(seg: Segmentation, planes: list[ImagePlane], objects: Mapping[str, tuple[str, ...]]) -> list[RoughSurface]:
    """Rough surfaces of the objects with the slices moved; objects of which none can be made are left out."""
    axis, flat = seg.stack_axis, list(seg.grid.flat_axes)
    count = seg.grid.shape[axis]
    slices = [plane for plane in planes if not plane.view]
    offsets = np.array(seg.grid.offset_at(np.arange(count)))
    for a, own in enumerate(flat):
        place = [plane.number for plane in slices]
        offsets[:, own] += np.interp(np.arange(count), place, [plane.motion[a] for plane in slices])
    grid = Grid(seg.grid.shape, seg.grid.spacing, np.zeros(3), np.eye(3), offsets, axis)
    bodies = []
    for name, parts in objects.items():
        with suppress(FemprepError):
            obj = make_object(seg.mask(*parts), grid, name)
            points, triangles = outlines(obj, _VERTICES)[1]
            shown = [view for one in seg.views if (view := one.showing(*parts)) is not None]
            turn: FloatArray = seg.grid.direction.T
            views = tuple(view.moved(turn, -turn @ seg.grid.origin) for view in shown)
            seen = Observations.of(replace(obj, views=views))
            middle = obj.barycentre
            bodies.append(
                RoughSurface(
                    name,
                    points + middle,
                    np.ascontiguousarray(triangles),
                    seen.faces[seen.end] + middle,
                    axis,
                    float(grid.spacing[axis]),
                )
            )
    return bodies


def _in_world(grid: Grid, plane: ImagePlane) -> ViewMotion:
    """The motion of a view in world coordinates."""
    turn = grid.direction
    rotation = turn @ plane.rotation @ turn.T
    middle = grid.origin + turn @ plane.middle
    way: FloatArray = turn @ plane.way
    return ViewMotion(plane.name, rotation, middle + way - rotation @ middle, float(np.linalg.norm(way)))
