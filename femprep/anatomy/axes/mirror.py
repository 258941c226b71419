"""VolumeMesh or Segmentation in, its mirror image out: mends a heart that was stored mirrored."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import numpy.typing as npt

from femprep.anatomy.axes.ventricular_axes import VentricularAxes
from femprep.errors import InputError
from femprep.mesh.operations.turned import turned_cells, turned_facets
from femprep.model import FloatArray, Plane, VolumeMesh

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

#: Data that are vectors and mirrored with the heart.
_VECTORS = ("fiber", "sheet", "normal", "pericardium_normal")


@overload
def flip(heart: VolumeMesh, *, plane: Plane | None = None) -> VolumeMesh: ...
@overload
def flip(heart: Segmentation, *, plane: Plane | None = None) -> Segmentation: ...
def flip(heart: VolumeMesh | Segmentation, *, plane: Plane | None = None) -> VolumeMesh | Segmentation:
    """Mirror a heart, for one that was stored mirrored (see ``ventricular_axes(...).mirrored``).

    Parameters
    ----------
    heart : VolumeMesh or Segmentation
        A label map is mirrored in its own box, across its first in-plane axis: its grid stays. A mesh is mirrored
        across a plane; its elements and facets are turned so that they stay positive, and its fibres go with it.
    plane : Plane, optional
        For a mesh; by default the sagittal plane through the middle of its points.

    Returns
    -------
    VolumeMesh or Segmentation
        With ``info["flipped"]``.

    Examples
    --------
    >>> mirrored = fp.flip(mesh)
    >>> fp.check(mirrored).validity.inverted_elements
    0
    """
    if isinstance(heart, VolumeMesh):
        return _flip_mesh(heart, plane)
    if plane is not None:
        raise InputError("a label map is mirrored in its own grid; a plane can be given for a mesh only")
    axis = next(a for a in range(3) if a != heart.stack_axis)
    labels = np.flip(heart.labels, axis=axis)
    offsets = heart.grid.offsets
    grid = (
        heart.grid if offsets is None else replace(heart.grid, offsets=offsets * np.where(np.arange(3) == axis, -1, 1))
    )
    flipped = not heart.info.get("flipped", False)
    across = heart.grid.direction[:, axis]
    middle = heart.grid.origin + 0.5 * (heart.grid.shape[axis] - 1) * heart.grid.spacing[axis] * across
    mirror = np.eye(3) - 2.0 * np.outer(across, across)
    views = [view.moved(mirror, middle - mirror @ middle) for view in heart.views]
    info = {**heart.info, "flipped": flipped}
    return replace(heart, labels=labels, grid=grid, frame=None, info=info, views=tuple(views))


def _flip_mesh(mesh: VolumeMesh, plane: Plane | None) -> VolumeMesh:
    middle = (mesh.points.min(axis=0) + mesh.points.max(axis=0)) / 2
    plane = plane or Plane(middle, np.array([1.0, 0.0, 0.0]))

    def direction(v: npt.ArrayLike) -> FloatArray:
        v = np.asarray(v, dtype=float)
        return v - 2 * (v @ plane.normal)[..., None] * plane.normal

    def point(x: npt.ArrayLike) -> FloatArray:
        return plane.point + direction(np.asarray(x, dtype=float) - plane.point)

    def data(values: Any) -> dict[str, Any]:
        return {k: direction(v) if k in _VECTORS else v for k, v in values.items()}

    info = {**mesh.info, "flipped": not mesh.info.get("flipped", False)}
    if info.get("axes"):
        axes = VentricularAxes.from_record(info["axes"])
        info["axes"] = replace(
            axes,
            apex=point(axes.apex),
            base=point(axes.base),
            septal=direction(axes.septal),
            mirrored=None if axes.mirrored is None else not axes.mirrored,
            insertions={name: point(at) for name, at in axes.insertions.items()},
        ).record()
    return replace(
        mesh,
        points=point(mesh.points),
        cells={name: turned_cells(name, block) for name, block in mesh.cells.items()},
        facets={name: turned_facets(name, block) for name, block in mesh.facets.items()},
        cell_data=data(mesh.cell_data),
        point_data=data(mesh.point_data),
        facet_data=data(mesh.facet_data),
        planes={k: Plane(point(p.point), direction(p.normal), p.source) for k, p in mesh.planes.items()},
        info=info,
        purkinje=mesh.purkinje and replace(mesh.purkinje, points=point(mesh.purkinje.points)),
    )
