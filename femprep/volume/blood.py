"""A wall and its blood pools in: whose each element of their mesh is, and the facets between them, out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femprep.errors import StageError
from femprep.mesh.elements import boundary_faces, element_faces, near_others
from femprep.mesh.measures.volume_elements import centroids, element_volumes
from femprep.mesh.numbering import twins
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import EdgeTable, edge_table, euler_characteristic, pieces, volume
from femprep.model import (
    FACET_TAGS,
    REGION_TAGS,
    BloodPools,
    FloatArray,
    IntArray,
    Plane,
    TagArray,
    Wall,
    endo_tags,
    is_blood,
    tag_name,
)


class Filling:
    """What a mesh fills: a wall, and the blood in its cavities where there is any.

    Parameters
    ----------
    wall : Wall
    blood : BloodPools, optional
        Of this wall.

    Attributes
    ----------
    outer : Wall
        Outer boundary of all that is filled, closed; caps have the tag of the plane they lie in.
    sheets : Wall
        All tagged triangles, those between wall and blood once.
    triangles : (m, 3) array
        Those the mesher keeps: outer surface and cavities, each wound outward. Over the points of ``outer``.
    """

    def __init__(self, wall: Wall, blood: BloodPools | None = None) -> None:
        self.wall = self.outer = self.sheets = wall
        self.triangles = wall.triangles
        self.cavities: Mapping[str, IntArray] = {}
        self.caps: Mapping[str, Plane] = {}
        if blood is not None:
            self.cavities, self.caps = blood.cavities, blood.caps
            self.outer = Wall(
                blood.points, blood.outer, blood.outer_tag, np.full(len(blood.points), -1), wall.planes, wall.info
            )
            inner = np.isin(wall.facet_tag, endo_tags())
            self.sheets = Wall(
                blood.points,
                np.concatenate([blood.outer, wall.triangles[inner]]),
                np.concatenate([blood.outer_tag, wall.facet_tag[inner]]),
                self.outer.template,
                wall.planes,
            )
            self.triangles = np.concatenate([blood.outer, *blood.cavities.values()])

    @property
    def volumes(self) -> dict[str, float]:
        """Volume of each region, mm3: the wall's by the name ``lv``, as long as nothing divides it."""
        cavities = {f"blood_{name}": volume(self.outer.points, cells) for name, cells in self.cavities.items()}
        return {"lv": self.wall.volume, **cavities}

    def regions(self, points: FloatArray, cells: IntArray) -> TagArray:
        """Region of each tetrahedron ``(n,)`` by where its centre lies; 0 for one outside."""
        region = np.full(len(cells), REGION_TAGS["lv"], dtype=np.int32)
        if not self.cavities:
            return region
        centre = centroids(points, cells, "tetra")
        at = self.outer.points
        for name, surface in self.cavities.items():
            region[ClosestFinder(at, surface).signed(centre) < 0.0] = REGION_TAGS[f"blood_{name}"]
        region[ClosestFinder(at, self.outer.triangles).signed(centre) > 0.0] = 0
        return region

    def tags(self, merged: TagArray, facets: TaggedFacets, region: TagArray) -> TagArray:
        """Facet tags with the caps told apart from the planes they lie in."""
        tag = merged.copy()
        planes = [FACET_TAGS[name] for name in self.wall.planes]
        for name in self.cavities:
            blood = region[facets.element] == REGION_TAGS[f"blood_{name}"]
            tag[blood & np.isin(merged, planes)] = FACET_TAGS[f"cap_{name}"]
        return tag

    def interface_tags(self, interface: TagArray) -> TagArray:
        """Tag of the endocardium that faces the blood of each region."""
        tag = np.zeros(len(interface), dtype=np.int32)
        for name in self.cavities:
            several = f"endo_{name}" if FACET_TAGS[f"endo_{name}"] in self.wall.facet_tag else "endo"
            tag[interface == REGION_TAGS[f"blood_{name}"]] = FACET_TAGS[several]
        return tag


@dataclass(frozen=True)
class TaggedFacets:
    """Facets of a mesh of wall and blood.

    Attributes
    ----------
    nodes : (f, 3) array
        Boundary facets, wound outward, then those between wall and blood, wound out of the wall.
    element : (f,) array
        The element each is a face of; between wall and blood that of the wall.
    interface : (f,) array
        Region of the blood on the other side, 0 for a boundary facet.
    """

    nodes: IntArray
    element: IntArray
    interface: TagArray


def find_facets(cells: IntArray, region: TagArray) -> TaggedFacets:
    """Boundary facets of tetrahedra ``(n, 4)``, and those between elements of wall and blood.

    Raises
    ------
    StageError
        The blood of two cavities touches.
    """
    outer = boundary_faces({"tetra": cells})["triangle"]
    blood = is_blood(region)
    if not blood.any():
        return TaggedFacets(outer.nodes, outer.element, np.zeros(len(outer.nodes), dtype=np.int32))
    near = near_others(cells, region)
    faces = element_faces({"tetra": cells[near]})["triangle"]
    one, two = twins(faces.nodes)
    sides = region[near[np.stack([faces.element[one], faces.element[two]], axis=1)]]
    kind = is_blood(sides)
    touching = kind.all(axis=1) & (sides[:, 0] != sides[:, 1])
    if touching.any():
        names = " and ".join(tag_name(int(t)) for t in np.sort(sides[np.argmax(touching)]))
        raise StageError(f"{names} touch in {int(touching.sum())} facets; choose a smaller edge_length or envelope")
    between = kind.sum(axis=1) == 1
    wall_side = np.where(kind[between, 0], two[between], one[between])
    return TaggedFacets(
        np.concatenate([outer.nodes, faces.nodes[wall_side]]),
        np.concatenate([outer.element, near[faces.element[wall_side]]]),
        np.concatenate([np.zeros(len(outer.nodes), np.int32), sides[between].max(axis=1)]).astype(np.int32),
    )


def check_cavities(points: FloatArray, cells: IntArray, region: TagArray, filling: Filling, limit: float) -> None:
    """Make sure that each region has the volume and the boundary of the body it fills.

    Raises
    ------
    StageError
        One differs by more than ``limit`` (relative) in volume, or in shells, holes or handles.
    """
    for name, wanted in filling.volumes.items():
        own = region == REGION_TAGS[name]
        found = float(element_volumes(points, cells[own], "tetra").sum()) if own.any() else 0.0
        if abs(found / wanted - 1.0) > limit:
            raise StageError(
                f"region {name!r} of the mesh has {found:.4g} mm3, the body it fills {wanted:.4g} mm3; "
                "choose a smaller edge_length or envelope"
            )
        surface = filling.wall.triangles if name == "lv" else filling.cavities[name.removeprefix("blood_")]
        facets = boundary_faces({"tetra": cells[own]})["triangle"].nodes
        table = edge_table(facets)
        if (table.count != 2).any() or kind_of(facets, table) != kind_of(surface):
            raise StageError(
                f"the boundary of region {name!r} is not that of the body it fills: shells and Euler characteristic "
                f"{kind_of(facets, table)} for {kind_of(surface)}; choose a smaller edge_length or envelope"
            )


def kind_of(facets: IntArray, table: EdgeTable | None = None) -> tuple[int, int]:
    """Number of shells of a surface, and its Euler characteristic."""
    return int(pieces(facets, table).max()) + 1, euler_characteristic(facets, table)
