"""A heart's label map in; what lies inside its left ventricle under no name, refused or reported, out.

Scar that is left out of the myocardium leaves a skin of it, a thrombus that is left out of the cavity a dent.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.image.segmentation import Segmentation, count_labels
from femprep.image.topology import used_box
from femprep.model import BoolArray, FloatArray, Notice, noted

#: Structures that lie beside the left ventricle; of others, as of scar or papillary muscles, the place is looked at.
_BESIDE: Final = ("lv", "myo", "rv", "rv_wall", "la", "la_wall", "ra", "ra_wall")
#: Sum of two shares from which a label is inside: of its voxels that lie no farther from the cavity than the wall
#: reaches, and of its surface that meets cavity or wall. The right ventricles of ACDC's 200 maps have .96 at most, the
#: chambers and vessels of a whole heart .32; infarcts of a sixth to three fifths of a wall, or of its apex, 1.12 to 2.
_INSIDE: Final = 1.0
#: Share of the wall's volume up to which what is inside does not spoil the mesh.
_FEW: Final = 0.01


def require_named(seg: Segmentation) -> Segmentation:
    """The map, with a notice where a few voxels inside the left ventricle belong to no structure.

    Raises
    ------
    InputError
        There are many; the message names labels, volumes, and what to type.
    """
    if not all(set(seg.structures.get(name, ())) & set(seg.present) for name in ("lv", "myo")):
        return seg
    used = {number for name in _BESIDE for number in seg.structures.get(name, ())}
    ventricle = used_box(np.isin(seg.labels, seg.structures["lv"] + seg.structures["myo"]))
    margin = [(part.stop - part.start) // 4 + 1 for part in ventricle]
    box = tuple(slice(max(part.start - n, 0), part.stop + n) for part, n in zip(ventricle, margin))
    labels, spacing, millilitre = np.pad(seg.labels[box], 1), seg.grid.spacing, seg.grid.voxel_volume / 1e3
    cavity, wall = (np.isin(labels, seg.structures[name]) for name in ("lv", "myo"))
    inside = _inside(seg, labels, cavity, wall, [number for number in seg.present if number not in used])
    whole = without_holes(cavity | wall | np.isin(labels, inside), seg.stack_axis)
    few = _FEW * np.count_nonzero(wall)
    if not inside and np.count_nonzero(whole & (labels == 0)) <= few:
        return seg
    deep = beyond_wall(cavity, whole, spacing, seg.stack_axis)
    size = {n: np.count_nonzero(labels == n) for n in inside}
    in_wall = [n for n in inside if np.count_nonzero(deep & (labels == n)) < 0.5 * size[n]]
    found = []
    for name, place, such in (("myo", "wall", "scar is"), ("lv", "cavity", "papillary muscles and thrombi are")):
        own = {n: size[n] * millilitre for n in inside if (n in in_wall) == (name == "myo")}
        words = f"inside the {place} of the left ventricle: {_told(seg, own)}, which neither lv nor myo includes"
        if sum(size[n] for n in own) > few:
            other = _typed(seg, "lv" if name == "myo" else "myo", own)
            raise InputError(f"{words}; give {_typed(seg, name, own)} if that is {place}, as {such}, or {other}")
        found += [Notice.of("left out", words)] if own else []
    bare = np.count_nonzero((labels == 0) & deep)
    if bare > few:
        raise InputError(
            f"{bare * millilitre:.1f} mL inside the cavity have no label, as papillary muscles that are left out: "
            "--fill-papillary makes them part of the cavity"
        )
    return replace(seg, info=noted(seg.info, *found))


def without_holes(body: BoolArray, axis: int) -> BoolArray:
    """A mask with a margin in the slices across an axis, their holes filled."""
    from scipy import ndimage

    outside = [ndimage.label(~plane)[0] for plane in np.moveaxis(body, axis, 0)]
    return np.moveaxis(np.stack([part != part[0, 0] for part in outside]), 0, axis)


def beyond_wall(cavity: BoolArray, body: BoolArray, spacing: FloatArray, axis: int) -> BoolArray:
    """Where a body is deeper below its outline, within slices, than its wall is thick, in the median."""
    from scipy import ndimage

    depth, edge = np.zeros(body.shape), np.zeros_like(cavity)
    for k, plane in enumerate(np.moveaxis(body, axis, 0)):
        np.moveaxis(depth, axis, 0)[k] = ndimage.distance_transform_edt(plane, sampling=np.delete(spacing, axis))
        own = np.moveaxis(cavity, axis, 0)[k]
        np.moveaxis(edge, axis, 0)[k] = own & ~ndimage.binary_erosion(own)
    return np.asarray(body & (depth >= np.median(depth[edge])))


def _inside(
    seg: Segmentation, labels: npt.NDArray[np.integer[Any]], cavity: BoolArray, wall: BoolArray, others: list[int]
) -> list[int]:
    """Which of some labels lie in the wall or in the cavity, by how near and how much they touch them."""
    from scipy import ndimage

    if not others:
        return []
    spacing, count = seg.grid.spacing, count_labels(seg.labels)
    away = np.asarray(ndimage.distance_transform_edt(~cavity, sampling=spacing))
    near = away <= np.percentile(away[wall], 95)
    shares = {n: np.count_nonzero(near & (labels == n)) / count[n] for n in others}
    body = cavity | wall | np.isin(labels, [n for n in others if shares[n] > 0.5])
    found = []
    for n in others:
        alone = np.pad(seg.labels[used_box(seg.labels == n)] == n, 1)
        touching = _area(labels == n, body & (labels != n), spacing) / _area(alone, ~alone, spacing)
        if shares[n] + touching >= _INSIDE:
            found.append(n)
    return found


def _area(one: BoolArray, other: BoolArray, spacing: FloatArray) -> float:
    """Area over which voxels of two masks are neighbours, mm2."""
    total = 0.0
    for axis, size in enumerate(spacing):
        a, b = np.moveaxis(one, axis, 0), np.moveaxis(other, axis, 0)
        both = np.count_nonzero(a[1:] & b[:-1]) + np.count_nonzero(a[:-1] & b[1:])
        total += both * float(np.prod(spacing) / size)
    return total


def _told(seg: Segmentation, volumes: Mapping[int, float]) -> str:
    """Labels, each with its name, where it has one, and volumes."""
    names = {**seg.info.get("segments", {}), **{str(n): name for name, own in seg.structures.items() for n in own}}
    shown = ", ".join(f"{n}{f' {names[str(n)]!r}' if str(n) in names else ''}" for n in volumes)
    sizes = ", ".join(f"{volume:.1f}" for volume in volumes.values())
    return f"label{'s' if len(volumes) > 1 else ''} {shown} ({sizes} mL)"


def _typed(seg: Segmentation, name: str, more: Iterable[int]) -> str:
    """What gives a structure further labels on the command line."""
    names = seg.info.get("segments", {})
    return f"--structure {name}=" + shlex.quote(
        ",".join(names.get(str(n), str(n)) for n in (*seg.structures[name], *more))
    )
