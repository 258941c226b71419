"""Small tagged volume meshes of every element type, for tests: an LV-like truncated ellipsoid, cut at base and apex."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femprep.mesh.elements import ELEMENTS, boundary_faces
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh

#: Semi-axes (across, along) of the endocardium and the epicardium, and the heights of base and apex plane, mm.
ENDO_AXES, EPI_AXES = (22.0, 55.0), (32.0, 65.0)
BASE_HEIGHT, APEX_HEIGHT = 12.0, -42.0


def truncated_ellipsoid(
    kind: str = "tetra",
    *,
    heights: int = 4,
    around: int = 12,
    layers: int = 2,
    curved: bool = False,
    lean: float = 0.2,
) -> VolumeMesh:
    """An LV-like wall between two ellipsoids, flat at base and apex, with regions ``lv`` and ``septum``.

    ``kind`` is any volume element type; ``curved`` bends the edges of quadratic elements to the ellipsoids; ``lean``
    shears the wall along x.
    """
    height, angle, depth = np.meshgrid(
        np.linspace(0, 1, heights + 1), np.arange(around) / around, np.linspace(0, 1, layers + 1), indexing="ij"
    )
    points = wall_points(np.column_stack([height.ravel(), angle.ravel(), depth.ravel()]))
    number = np.arange(len(points)).reshape(height.shape)
    following = np.roll(number, -1, axis=1)
    lower, upper = number[:-1], number[1:]
    lower_next, upper_next = following[:-1], following[1:]
    # The face 0-1-2-3 lies at one depth and runs counter-clockwise seen from the next depth outwards.
    corners = [lower, lower_next, upper_next, upper]
    inner = [c[:, :, :-1].ravel() for c in corners]
    outer = [c[:, :, 1:].ravel() for c in corners]
    hexahedra = np.column_stack(inner + outer)
    angle_index = np.tile(np.repeat(np.arange(around), layers), heights)
    region = np.where(angle_index < around // 3, REGION_TAGS["septum"], REGION_TAGS["lv"])
    if kind.startswith("hexahedron"):
        cells, linear = hexahedra, "hexahedron"
    else:
        wedges = np.stack([hexahedra[:, [0, 1, 2, 4, 5, 6]], hexahedra[:, [0, 2, 3, 4, 6, 7]]], axis=1).reshape(-1, 6)
        cells, linear, region = wedges, "wedge", np.repeat(region, 2)
        if kind.startswith("tetra"):
            cells, linear, region = wedges_to_tets(wedges), "tetra", np.repeat(region, 3)
    mesh = tag_boundary(VolumeMesh(points, {linear: cells}, region))
    if ELEMENTS[kind].quadratic:
        mesh = tag_boundary(quadratic(mesh, curved=curved))
    return leaning(mesh, lean)


def leaning(mesh: VolumeMesh, lean: float) -> VolumeMesh:
    """The mesh sheared along x in proportion to its height; base and apex stay flat, volumes stay."""
    return replace(mesh, points=mesh.points + lean * mesh.points[:, [2]] * [1.0, 0.0, 0.0])


def wall_points(coordinates: np.ndarray) -> np.ndarray:
    """Points ``(n, 3)`` for (height, angle, depth), each from 0 to 1; the angle is a fraction of the turn.

    Steps of the angle are uneven, the cross-section is no circle and the layers between base and apex are wavy, so
    that nothing cancels by symmetry.
    """
    height, angle, depth = coordinates.T
    across = ENDO_AXES[0] + depth * (EPI_AXES[0] - ENDO_AXES[0])
    along = ENDO_AXES[1] + depth * (EPI_AXES[1] - ENDO_AXES[1])
    turn = 2 * np.pi * angle + 0.3 * np.sin(2 * np.pi * angle)
    z = APEX_HEIGHT + height * (BASE_HEIGHT - APEX_HEIGHT) + 2.0 * np.sin(np.pi * height) * np.cos(turn + 0.7)
    radius = across * np.sqrt(1 - (z / along) ** 2) * (1 + 0.1 * np.cos(turn))
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z])


def wedges_to_tets(wedges: np.ndarray) -> np.ndarray:
    """Three tets of each wedge; every quadrilateral is cut through its smallest node number, so neighbours agree."""
    turns = np.array([[0, 1, 2, 3, 4, 5], [1, 2, 0, 4, 5, 3], [2, 0, 1, 5, 3, 4], [3, 5, 4, 0, 2, 1]])
    turns = np.vstack([turns, [[4, 3, 5, 1, 0, 2], [5, 4, 3, 2, 1, 0]]])
    nodes = np.take_along_axis(wedges, turns[np.argmin(wedges, axis=1)], axis=1)
    first = np.minimum(nodes[:, 1], nodes[:, 5]) < np.minimum(nodes[:, 2], nodes[:, 4])
    one, other = [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]], [[0, 1, 2, 4], [0, 4, 2, 5], [0, 4, 5, 3]]
    return np.where(first[:, None, None], nodes[:, one], nodes[:, other]).reshape(-1, 4)


def quadratic(mesh: VolumeMesh, *, curved: bool = False) -> VolumeMesh:
    """The mesh with a node in the middle of each edge (or, curved, at the middle height and depth of the wall)."""
    edges = np.concatenate(
        [block[:, np.array(ELEMENTS[kind].edges)].reshape(-1, 2) for kind, block in mesh.cells.items()]
    )
    unique, inverse = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    middle = mesh.points[unique].mean(axis=1)
    if curved:
        radius = np.hypot(*mesh.points[unique][..., :2].transpose(2, 0, 1)).mean(axis=1)
        middle[:, :2] *= (radius / np.hypot(middle[:, 0], middle[:, 1]))[:, None]
    numbers = inverse.ravel() + len(mesh.points)
    cells, first = {}, 0
    grown = {"tetra": "tetra10", "wedge": "wedge15", "hexahedron": "hexahedron20"}
    for kind, block in mesh.cells.items():
        count = len(ELEMENTS[kind].edges)
        rows = numbers[first : first + count * len(block)].reshape(len(block), count)
        cells[grown[kind]] = np.hstack([block, rows])
        first += count * len(block)
    return VolumeMesh(np.vstack([mesh.points, middle]), cells, mesh.region)


def tag_boundary(mesh: VolumeMesh) -> VolumeMesh:
    """The mesh with every boundary facet tagged ``endo``, ``epi``, ``base`` or ``apex`` by where its corners lie."""
    facets, tags = {}, []
    for kind, faces in boundary_faces(mesh.cells).items():
        corners = mesh.points[faces.nodes[:, : 3 if kind.startswith("triangle") else 4]]
        centre = corners.mean(axis=1)
        level = np.ptp(corners[..., 2], axis=1) < 1e-9
        outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        side = np.where((outward[:, :2] * centre[:, :2]).sum(axis=1) > 0, FACET_TAGS["epi"], FACET_TAGS["endo"])
        end = np.where(centre[:, 2] > 0, FACET_TAGS["base"], FACET_TAGS["apex"])
        facets[kind] = faces.nodes
        tags.append(np.where(level, end, side))
    return replace(mesh, facets=facets, facet_tag=np.concatenate(tags))


def with_fibres(mesh: VolumeMesh) -> VolumeMesh:
    """The mesh with orthonormal ``fiber`` and ``sheet`` per element: 60 degrees off the circumference."""
    centre = np.concatenate([mesh.points[b[:, : ELEMENTS[k].corners]].mean(axis=1) for k, b in mesh.cells.items()])
    radial = np.column_stack([centre[:, :2], np.zeros(len(centre))])
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    round_ = np.cross([0.0, 0.0, 1.0], radial)
    fiber = np.cos(np.pi / 3) * round_ + np.sin(np.pi / 3) * np.array([0.0, 0.0, 1.0])
    return mesh.with_data(cell={"fiber": fiber, "sheet": radial})


def mixed() -> VolumeMesh:
    """Hexahedra near the apex and wedges near the base, in one conforming mesh of two blocks."""
    hexes = truncated_ellipsoid("hexahedron", lean=0.0)
    block = hexes.cells["hexahedron"]
    half = len(block) // 2
    upper = block[half:]
    wedges = np.stack([upper[:, [0, 1, 2, 4, 5, 6]], upper[:, [0, 2, 3, 4, 6, 7]]], axis=1).reshape(-1, 6)
    region = np.concatenate([hexes.region[:half], np.repeat(hexes.region[half:], 2)])
    return leaning(tag_boundary(VolumeMesh(hexes.points, {"hexahedron": block[:half], "wedge": wedges}, region)), 0.2)
