"""A mesh and what it is to fill in, an error where it does not: inverted elements, volumes, its boundary."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.errors import StageError
from femprep.mesh.elements import boundary_faces
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.topology import edge_table, pinched_vertices
from femprep.model import REGION_TAGS, FloatArray, IntArray, TagArray, VolumeMesh, Wall
from femprep.volume.blood import Filling, kind_of

#: Largest relative difference between the volumes of mesh and wall.
VOLUME_LIMIT: Final = 0.02


def check_volumes(points: FloatArray, cells: IntArray, wall: Wall) -> None:
    """Make sure that no element is inverted and that they fill the wall, nothing else."""
    volumes = element_volumes(points, cells, "tetra")
    if (volumes <= 0).any():
        raise StageError(f"the mesher gave {int((volumes <= 0).sum())} inverted elements; choose another edge_length")
    difference = float(volumes.sum() / wall.volume - 1.0)
    if abs(difference) > 2.0 * VOLUME_LIMIT:
        raise StageError(
            f"the mesher made {volumes.sum():.4g} mm3 of a wall of {wall.volume:.4g} mm3"
            + ("; it filled a cavity" if difference > 0 else "; it lost part of it")
            + "; choose a smaller edge_length or envelope"
        )


def check_boundary(facets: IntArray, wall: Wall) -> None:
    """Make sure that the boundary facets bound the same kind of body as the wall."""
    table = edge_table(facets)
    if (table.count != 2).any() or (table.forward != 1).any() or len(pinched_vertices(facets, table)):
        raise StageError("the boundary of the mesh is no closed 2-manifold; choose a smaller edge_length or envelope")
    (shells, euler), (expected, wanted) = kind_of(facets, table), kind_of(wall.triangles)
    if (shells, euler) != (expected, wanted):
        raise StageError(
            f"the boundary of the mesh has {shells} shell(s) and Euler characteristic {euler}, the wall's {expected} "
            f"and {wanted}; choose a smaller edge_length or envelope"
        )


def check_positive(points: FloatArray, cells: IntArray, volumes: FloatArray) -> None:
    """Make sure that putting points in place inverted no element."""
    inverted = volumes <= 0
    if inverted.any():
        worst = points[cells[np.argmin(volumes)]].mean(axis=0)
        raise StageError(
            f"{int(inverted.sum())} elements are inverted once points lie on the planes, the worst near "
            f"x y z = {' '.join(f'{v:.1f}' for v in worst)}; choose a smaller edge_length or envelope"
        )


def filled(volumes: FloatArray, region: TagArray, filling: Filling) -> dict[str, Any]:
    """Volumes of wall and blood, for the record.

    Raises
    ------
    StageError
        One differs too much from what was to be filled.
    """
    found = {name: float(volumes[region == REGION_TAGS[name]].sum()) for name in filling.volumes}
    difference = {name: found[name] / wanted - 1.0 for name, wanted in filling.volumes.items()}
    for name, value in difference.items():
        if abs(value) > VOLUME_LIMIT:
            what = "wall" if name == "lv" else name
            raise StageError(
                f"the mesh has {found[name]:.4g} mm3 of {what}, {filling.volumes[name]:.4g} mm3 are to be filled: a "
                f"difference of {100 * value:.2f} %, more than {100 * VOLUME_LIMIT:g} %; "
                "choose a smaller edge_length or envelope"
            )
    return {
        "volume_mm3": found.pop("lv"),
        "volume_difference_to_wall": difference["lv"],
        **({"blood_mm3": found} if found else {}),
    }


def require_sound(mesh: VolumeMesh, filling: Filling) -> None:
    """Make sure that a mesh fills what is to be filled, with no element inverted, and bounds it.

    Raises
    ------
    StageError
        It does not.
    """
    cells = mesh.cells["tetra"]
    volumes = element_volumes(mesh.points, cells, "tetra")
    check_positive(mesh.points, cells, volumes)
    filled(volumes, mesh.region, filling)
    check_boundary(boundary_faces(mesh.cells)["triangle"].nodes, filling.outer)
