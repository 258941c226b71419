"""A mesh with ventricular coordinates in, the parts of its wall in which each point has coordinates of its own out.

One point of a left ventricle has one depth, height and angle. With both ventricles the right half of the septum and the
free wall of the right ventricle share theirs, so that there are three parts:

===== =====================================================================
0     the left ventricle with the left half of the septum, a whole turn
1     the free wall of the right ventricle
2     the right half of the septum
===== =====================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from femprep.anatomy.aha import rv_free_wall
from femprep.anatomy.laplace.fem import LinearElements
from femprep.anatomy.laplace.fields import WallFields
from femprep.anatomy.part import part_of
from femprep.errors import InputError
from femprep.mesh.measures.weighted import weighted_percentile
from femprep.mesh.operations.element_tets import mesh_tets
from femprep.model import BoolArray, FloatArray, IntArray, VolumeMesh, is_blood

#: Point data that coordinates are.
COORDINATES: Final = ("transmural", "apicobasal", "rotational_cos", "rotational_sin")
#: Names of the parts.
PARTS: Final = ("left ventricle", "free wall of the right ventricle", "right half of the septum")


def require_coordinates(mesh: VolumeMesh, what: str = "the mesh") -> None:
    """Make sure that a mesh has ventricular coordinates at its points.

    Raises
    ------
    InputError
        They are missing.
    """
    missing = [name for name in COORDINATES if name not in mesh.point_data]
    if missing:
        raise InputError(
            f"{what} has no point data {', '.join(missing)}; add the ventricular coordinates (femprep mesh --fibres, "
            "femprep annotate, or add_coordinates)"
        )


@dataclass(frozen=True, eq=False)
class WallPart:
    """One part of a wall.

    Attributes
    ----------
    number : int
        0, 1 or 2, see above.
    mesh : VolumeMesh
        Its elements alone.
    cells, points : (k,) arrays
        Which elements and points of the whole mesh they are.
    depth, height, cosine, sine : (k,) arrays
        Coordinates of its points. The depth runs from the part's own endocardium outward, and on beyond 1 where an
        element reaches over into another part.
    """

    number: int
    mesh: VolumeMesh
    cells: IntArray
    points: IntArray
    depth: FloatArray
    height: FloatArray
    cosine: FloatArray
    sine: FloatArray

    @cached_property
    def space(self) -> LinearElements:
        """Linear elements on it."""
        return LinearElements(self.mesh)

    @cached_property
    def tets(self) -> tuple[IntArray, IntArray]:
        """The tetrahedra its elements are made of ``(m, 4)``, and the element of the part each belongs to."""
        return mesh_tets(self.mesh.cells)

    @cached_property
    def gradients(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gradients at the elements ``(k, 3)`` of depth, height and angle (radians), 1/mm."""
        space = self.space
        depth, height, c, s = (
            space.gradient(values[space.nodes]) for values in (self.depth, self.height, self.cosine, self.sine)
        )
        cosine, sine = (space.to_cells(values[space.nodes])[:, None] for values in (self.cosine, self.sine))
        return depth, height, (cosine * s - sine * c) / np.maximum(cosine**2 + sine**2, 1e-12)

    @cached_property
    def sizes(self) -> tuple[float, float, float]:
        """Thickness of the wall, length of its meridian and radius round the axis at mid-wall, mm: medians."""
        weight = self.space.volume
        thickness, length, radius = (
            1.0 / max(weighted_percentile(np.linalg.norm(gradient, axis=1), weight, 50.0), 1e-9)
            for gradient in self.gradients
        )
        return thickness, length, radius


def wall_parts(mesh: VolumeMesh, what: str = "the mesh") -> list[WallPart]:
    """The parts of a wall; blood pools are in none of them.

    Raises
    ------
    InputError
        Coordinates are missing, or the facets that tell the septum from the free wall.
    """
    require_coordinates(mesh, what)
    tissue = ~is_blood(mesh.region)
    whole, cells, points, _ = part_of(mesh, tissue)
    side = cell_parts(whole)
    data = whole.point_data
    right = np.asarray(data.get("transventricular", np.zeros(len(whole.points)))) > 0.5
    across = np.where(right, -1.0, 1.0) * (1.0 - np.asarray(data["transmural"], dtype=float))
    found = []
    for number in range(len(PARTS)):
        mask = side == number
        if not mask.any():
            continue
        part, own, nodes, _ = (
            (whole, np.arange(whole.n_cells), np.arange(len(whole.points)), 0) if mask.all() else (part_of(whole, mask))
        )
        depth = 1.0 - (across if number == 0 else -across)[nodes]
        rest = (np.asarray(data[name], dtype=float)[nodes] for name in COORDINATES[1:])
        found.append(WallPart(number, part, cells[own], points[nodes], depth, *rest))
    return found


def cell_parts(mesh: VolumeMesh) -> IntArray:
    """Number of the part each element of a wall without blood is in, ``(n_cells,)``."""
    if "transventricular" not in mesh.point_data:
        return np.zeros(mesh.n_cells, dtype=np.int64)
    fields = WallFields(mesh)
    right: BoolArray = fields.space.to_cells(fields.side) < 0
    return np.where(right, np.where(rv_free_wall(fields), 1, 2), 0)


def depth_chart(part: WallPart, sizes: tuple[float, float, float]) -> FloatArray:
    """Places of a part's points ``(k, 3)`` as a polar map with depth: the apex in the middle, the base outside.

    One chart without a seam: the angle's jump is none there. In millimetres, roughly, of a wall of such sizes.
    """
    thickness, length, _ = sizes
    out = part.height * length
    return np.column_stack([out * part.cosine, out * part.sine, part.depth * thickness])


def slice_chart(part: WallPart, along: FloatArray, sizes: tuple[float, float, float]) -> FloatArray:
    """Places of a part's points ``(k, 3)`` as a ring with a height across slices: depth outward, the angle round.

    ``along`` is the place of each point across the slices, mm. Points above each other there have the same depth and
    angle.
    """
    thickness, _, radius = sizes
    out = radius + thickness * (part.depth - 0.5)
    return np.column_stack([out * part.cosine, out * part.sine, along])
