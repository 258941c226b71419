"""A tetrahedral mesh and values at its points in; the mesh with faces along the surface where they are zero out.

The mesh is cut along the surface (:mod:`femprep.mesh.operations.level_cut`); new points of its boundary go onto its
smooth surfaces and planes, and elements are improved with that surface held as the boundary is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femprep.errors import InputError
from femprep.mesh.elements import element_faces
from femprep.mesh.measures.triangles import normals
from femprep.mesh.numbering import none_of, twins
from femprep.mesh.operations.level_cut import LevelCut, cut_along_level
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import border_edges
from femprep.model import BoolArray, FloatArray, IntArray, VolumeMesh, frozen
from femprep.model.products import unit_vectors
from femprep.volume.optimise import POOR, optimise, tet_quality
from femprep.volume.optimise.constraints import Constraints, FacetGroup, Group
from femprep.volume.pericardium import springs_renewed
from femprep.volume.refine.boundary import constraints_of, moved_onto, untagged_faces
from femprep.volume.refine.fields import at_nodes
from femprep.volume.refine.sheets import Sheets, find_sheets, membership, placed


@dataclass(frozen=True)
class Conformed:
    """A mesh cut along a surface.

    Attributes
    ----------
    mesh : VolumeMesh
        Its elements have the regions and data of those they are parts of, its points the data in between.
    inside : (m,) array
        Which elements lie on the positive side.
    parent : (m,) array
        The elements of the mesh before that they are parts of.
    surfaces : tuple of (l, 3) array
        Faces along the surface, after those along the earlier ones.
    """

    mesh: VolumeMesh
    inside: BoolArray
    parent: IntArray
    surfaces: tuple[IntArray, ...]


def conform(
    mesh: VolumeMesh,
    value: FloatArray,
    middle: FloatArray,
    cut: BoolArray,
    earlier: Sequence[IntArray] = (),
    crossing: Callable[[IntArray], FloatArray] | None = None,
) -> Conformed:
    """Cut a mesh along a surface.

    Parameters
    ----------
    mesh : VolumeMesh
        Of linear tetrahedra.
    value : (n,) array
        At its points, positive on one side.
    middle : (m,) array
        In the middle of its elements: the side of those that come to lie with all points on the surface.
    cut : (m,) array
        Elements that the surface runs through; beyond them it ends.
    earlier : sequence of (k, 3) array, optional
        Faces along earlier surfaces, whose points stay on them.
    crossing : callable, optional
        Where between pairs of points the surface lies: see :func:`cut_along_level`.

    Raises
    ------
    InputError
        The mesh has other elements.
    """
    require_tetrahedra(mesh)
    tets, facets = mesh.cells["tetra"], mesh.facets.get("triangle", np.empty((0, 3), dtype=np.int64))
    fixed = untagged_faces("tetra", tets, mesh.region, mesh.facets)
    sheets = find_sheets(mesh)
    on_sheets = np.zeros((len(mesh.points), sheets.count), dtype=np.bool_)
    on_sheets[facets.ravel(), np.repeat(sheets.of_facet, 3)] = True
    faces = [facets, fixed, *earlier]
    still = np.zeros(len(mesh.points), dtype=np.bool_)
    still[np.concatenate(faces[1:])] = True
    found = cut_along_level(mesh.points, tets, np.concatenate(faces), value, cut, on_sheets, still, crossing)
    group = np.repeat(np.arange(len(faces)), [len(block) for block in faces])[found.facet]
    facets, fixed, *before = (found.facets[group == number] for number in range(len(faces)))
    parent = found.facet[group == 0]
    total = found.value[found.cells].sum(axis=1)
    flat = (found.value[found.cells] == 0.0).all(axis=1)
    inside = np.where(flat, middle[found.cell], total) > 0.0
    inside &= cut[found.cell]
    between = _faces_between(found.cells, inside)
    surfaces = (*before, between[none_of(between, np.concatenate([np.empty((0, 3), dtype=np.int64), *before]))])
    points = _improved(mesh, found, sheets, sheets.of_facet[parent], facets, fixed, surfaces)
    fine = replace(
        mesh,
        points=frozen(points),
        cells={"tetra": frozen(found.cells)},
        region=mesh.region[found.cell],
        facets={"triangle": frozen(facets)},
        facet_tag=mesh.facet_tag[parent],
        cell_data={name: values[found.cell] for name, values in mesh.cell_data.items()},
        facet_data={name: values[parent] for name, values in mesh.facet_data.items()},
        point_data={},
        purkinje=None,
    )
    fine = springs_renewed(fine.with_data(point=at_nodes(mesh, found.matrix)))
    return Conformed(fine, inside, found.cell, surfaces)


def require_tetrahedra(mesh: VolumeMesh) -> None:
    """Make sure that a mesh can be cut.

    Raises
    ------
    InputError
        It has other elements than linear tetrahedra.
    """
    if list(mesh.cells) != ["tetra"]:
        kinds = ", ".join(mesh.cells)
        raise InputError(f"elements are cut along outlines where all are tetrahedra of order 1; the mesh has {kinds}")


def _faces_between(cells: IntArray, inside: BoolArray) -> IntArray:
    """Faces between elements on the two sides, ``(k, 3)``."""
    faces = element_faces({"tetra": cells})["triangle"]
    one, two = twins(faces.nodes)
    side, other = inside[faces.element[one]], inside[faces.element[two]]
    return np.asarray(faces.nodes[np.sort(np.where(side, one, two)[side != other])])


def _improved(
    mesh: VolumeMesh,
    cut: LevelCut,
    sheets: Sheets,
    of_facet: IntArray,
    facets: IntArray,
    fixed: IntArray,
    surfaces: Sequence[IntArray],
) -> FloatArray:
    """The points: of the boundary on their sheets, of surfaces inside on those, all where elements are good."""
    points = np.asarray(cut.matrix @ mesh.points)
    on = membership({"triangle": facets}, of_facet, sheets)
    new = np.isin(on.nodes, np.flatnonzero(np.diff(cut.matrix.indptr) > 1))
    places = placed(points[on.nodes], on, sheets, new)
    points, _, _ = moved_onto(points, on.nodes, places, {"tetra": cut.cells})
    bound = constraints_of(len(points), cut.cells, on, sheets)
    points = optimise(points, cut.cells, _with_surfaces(bound, points, fixed, surfaces)).points
    poor = tet_quality(points, cut.cells) < POOR
    if not poor.any():
        return points
    # An outline is known to a pixel: around poor elements it gives way.
    loose = np.unique(cut.cells[poor])
    return optimise(points, cut.cells, _with_surfaces(bound, points, fixed, surfaces, loose)).points


def _with_surfaces(
    bound: Constraints,
    points: FloatArray,
    fixed: IntArray,
    surfaces: Sequence[IntArray],
    loose: IntArray | tuple[int, ...] = (),
) -> Constraints:
    """The boundary's constraints, and surfaces inside.

    Nodes of one surface slide in it, and where it ends on the boundary along its edge; others of it stay. Loose ones
    are held by the boundary alone.
    """
    freedom = bound.freedom.copy()
    count = np.zeros(len(points), dtype=np.int64)
    for faces in surfaces:
        count[np.unique(faces)] += 1
    count[np.asarray(loose, dtype=np.int64)] = 0
    count[fixed] = 2
    groups: list[Group] = []
    for faces in surfaces:
        nodes = np.unique(faces)
        nodes = nodes[count[nodes] == 1]
        inner = nodes[bound.freedom[nodes] == 3]
        ends = border_edges(faces)
        rim = np.intersect1d(nodes[bound.freedom[nodes] == 2], ends)
        freedom[inner], freedom[rim] = 2, 1
        groups.append(FacetGroup(inner, ClosestFinder(points, faces), normals(points, faces)))
        if len(rim):
            along = unit_vectors(points[ends[:, 1]] - points[ends[:, 0]])
            groups.append(FacetGroup(rim, ClosestFinder(points, ends[:, [0, 1, 1]]), along))
    taken = np.concatenate([one.nodes for one in groups])
    rest = np.setdiff1d(np.flatnonzero(count), taken)
    freedom[rest] = 0
    # Nodes of a group all move alike: what moves otherwise now leaves its own.
    other = np.union1d(taken, rest)
    groups += [replace(one, nodes=np.setdiff1d(one.nodes, other)) for one in bound.groups]  # type: ignore[type-var]
    return replace(bound, freedom=freedom, groups=tuple(group for group in groups if len(group.nodes)))
