"""Structured walls with known coordinates: a slab, and a truncated thick ellipsoid closed at the apex."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from meshes import quadratic, wedges_to_tets

from femprep.mesh.elements import ELEMENTS, boundary_faces
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh


@dataclass(frozen=True)
class Wall:
    """A mesh with the true coordinates of its points: depth 0 to 1, polar angle from the apex and azimuth, radians."""

    mesh: VolumeMesh
    depth: np.ndarray
    polar: np.ndarray
    azimuth: np.ndarray


def slab(kind: str = "tetra", cells: tuple[int, int, int] = (4, 5, 6), size=(10.0, 20.0, 30.0)) -> Wall:
    """A box: endocardium at x = 0, epicardium at x = size[0], apex at z = 0, base at z = size[2]."""
    axes = [np.linspace(0, length, count + 1) for length, count in zip(size, cells)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    number = np.arange(len(points)).reshape(x.shape)
    near, far = number[:-1], number[1:]
    ring = [(slice(None, -1), slice(None, -1)), (slice(1, None), slice(None, -1)), (slice(1, None), slice(1, None))]
    ring.append((slice(None, -1), slice(1, None)))
    hexes = np.column_stack([side[(slice(None), *at)].ravel() for side in (near, far) for at in ring])

    def tag(centre: np.ndarray) -> np.ndarray:
        out = np.zeros(len(centre), dtype=int)
        for axis, value, name in ((2, 0.0, "apex"), (2, size[2], "base"), (0, 0.0, "endo"), (0, size[0], "epi")):
            out[np.abs(centre[:, axis] - value) < 1e-9] = FACET_TAGS[name]
        return out

    mesh = _tagged(points, _split(hexes, kind, cells[1] * cells[2]), tag)
    depth = mesh.points[:, 0] / size[0]
    return Wall(mesh, depth, mesh.points[:, 2] / size[2], np.zeros(len(mesh.points)))


def ellipsoid(
    kind: str = "tetra",
    *,
    size: int = 4,
    layers: int = 3,
    endo: tuple[float, float] = (25.0, 55.0),
    epi: tuple[float, float] = (35.0, 65.0),
    base: float = 15.0,
) -> Wall:
    """A wall between two ellipsoids of revolution (semi-axes across and along z), apex down, cut flat at z = base.

    ``size`` is the number of quadrilaterals along an edge of the square patch at the apex; around it lie as many rings
    as keep the elements about as long as wide.
    """
    disc, quads = _disc(size, 3 * size)
    radius, azimuth = np.hypot(*disc.T), np.arctan2(disc[:, 1], disc[:, 0])
    points, depth, polar = [], [], []
    for t in np.linspace(0.0, 1.0, layers + 1):
        a, b = (1 - t) * np.array(endo) + t * np.array(epi)
        theta = radius * np.arccos(-base / b)
        across = a * np.sin(theta)
        points.append(np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), -b * np.cos(theta)]))
        points[-1][radius == 1.0, 2] = base
        depth.append(np.full(len(disc), t))
        polar.append(theta)
    n = len(disc)
    below = quads[:, [0, 3, 2, 1]]  # apex down: seen from outside the disc turns the other way
    hexes = np.concatenate([np.hstack([below + k * n, below + (k + 1) * n]) for k in range(layers)])
    number = {name: np.concatenate(value) for name, value in (("depth", depth), ("polar", polar))}
    at_depth = np.repeat(np.arange(layers + 1), n)

    def tag_by_nodes(nodes: np.ndarray) -> np.ndarray:
        out = np.full(len(nodes), FACET_TAGS["base"])
        out[(at_depth[nodes] == 0).all(axis=1)] = FACET_TAGS["endo"]
        out[(at_depth[nodes] == layers).all(axis=1)] = FACET_TAGS["epi"]
        return out

    mesh = _tagged(np.concatenate(points), _split(hexes, kind, len(quads)), None, tag_by_nodes)
    return Wall(mesh, number["depth"], number["polar"], np.tile(azimuth, layers + 1))


def clipped_ellipsoid(
    *, heights: int = 10, around: int = 40, layers: int = 4, base: float = 15.0, apex: float = -42.0
) -> Wall:
    """The default ellipsoid of :func:`ellipsoid`, of hexahedra, cut flat at the apex too."""
    turn = 2 * np.pi * np.arange(around) / around
    t, z, v = np.meshgrid(np.linspace(0, 1, layers + 1), np.linspace(apex, base, heights + 1), turn, indexing="ij")
    a, b = 25 + 10 * t, 55 + 10 * t
    radius = a * np.sqrt(1 - (z / b) ** 2)
    points = np.column_stack([(radius * np.cos(v)).ravel(), (radius * np.sin(v)).ravel(), z.ravel()])
    number = np.arange(len(points)).reshape(t.shape)
    following = np.roll(number, -1, axis=2)
    ring = [number[:, :-1], following[:, :-1], following[:, 1:], number[:, 1:]]
    hexes = np.column_stack([c[side].ravel() for side in (slice(None, -1), slice(1, None)) for c in ring])

    def tag(nodes: np.ndarray) -> np.ndarray:
        out = np.full(len(nodes), FACET_TAGS["base"])
        for values, at, name in ((t, 0.0, "endo"), (t, 1.0, "epi"), (z, apex, "apex")):
            out[(values.ravel()[nodes] == at).all(axis=1)] = FACET_TAGS[name]
        return out

    mesh = _tagged(points, {"hexahedron": hexes}, None, tag)
    return Wall(mesh, t.ravel(), np.arccos(-z / b).ravel(), v.ravel())


def _disc(size: int, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit disc of quadrilaterals: a square patch with rings around it; counter-clockwise."""
    half = size / (size + 2.0 * rings) * 1.2
    side = np.linspace(-1, 1, size + 1)
    x, y = np.meshgrid(side, side, indexing="ij")
    bulge = 1 - 0.2 * (x**2 + y**2) / 2
    patch = half * np.column_stack([(x * bulge).ravel(), (y * bulge).ravel()])
    number = np.arange(len(patch)).reshape(size + 1, size + 1)
    corners = (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    quads = [np.column_stack([corner.ravel() for corner in corners])]
    ring = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    inner = patch[ring]
    angle = np.arctan2(inner[:, 1], inner[:, 0])
    outer = np.column_stack([np.cos(angle), np.sin(angle)])
    points = [patch]
    for k in range(1, rings + 1):
        s = k / rings
        points.append((1 - s) * inner + s * outer)
        following = len(patch) + (k - 1) * len(inner) + np.arange(len(inner))
        quads.append(np.column_stack([ring, following, np.roll(following, -1), np.roll(ring, -1)]))
        ring = following
    points[-1] /= np.hypot(*points[-1].T)[:, None]
    disc = np.concatenate(points)
    edge = len(disc) - len(inner)
    radius = np.hypot(*disc.T)
    radius[edge:] = 1.0
    disc[edge:] = outer
    return disc, np.concatenate(quads)


def _split(hexes: np.ndarray, kind: str, columns: int) -> dict[str, np.ndarray]:
    if kind.startswith("hexahedron"):
        return {"hexahedron": hexes}
    wedges = np.stack([hexes[:, [0, 1, 2, 4, 5, 6]], hexes[:, [0, 2, 3, 4, 6, 7]]], axis=1).reshape(-1, 6)
    if kind.startswith("wedge"):
        return {"wedge": wedges}
    if kind == "mixed":
        first = np.arange(len(hexes)) % columns < columns // 2  # whole columns through the wall, so that faces conform
        return {"hexahedron": hexes[first], "wedge": wedges[np.repeat(~first, 2)]}
    return {"tetra": wedges_to_tets(wedges)}


def _tagged(points, cells, tag_by_centre=None, tag_by_nodes=None) -> VolumeMesh:
    count = sum(len(block) for block in cells.values())
    mesh = VolumeMesh(points, cells, np.full(count, REGION_TAGS["lv"]))
    facets, tags = {}, []
    for kind, faces in boundary_faces(mesh.cells).items():
        tag = tag_by_centre(points[faces.nodes].mean(axis=1)) if tag_by_centre else tag_by_nodes(faces.nodes)
        facets[kind] = faces.nodes[tag > 0]
        tags.append(tag[tag > 0])
    return replace(mesh, facets=facets, facet_tag=np.concatenate(tags))


def grown(mesh: VolumeMesh) -> VolumeMesh:
    """The mesh with straight-edged quadratic elements and facets."""
    big = quadratic(mesh)
    old = {}
    first = 0
    for nodes in mesh.facets.values():
        for row, tag in zip(nodes, mesh.facet_tag[first : first + len(nodes)]):
            old[tuple(sorted(row))] = tag
        first += len(nodes)
    facets, tags = {}, []
    for kind, faces in boundary_faces(big.cells).items():
        corners = 3 if kind.startswith("triangle") else 4
        tag = np.array([old.get(tuple(sorted(row[:corners])), 0) for row in faces.nodes])
        facets[kind] = faces.nodes[tag > 0]
        tags.append(tag[tag > 0])
    assert all(ELEMENTS[kind].quadratic for kind in big.cells)
    return replace(big, facets=facets, facet_tag=np.concatenate(tags))


def open_valves(mesh: VolumeMesh, centres: dict[tuple[str, str], np.ndarray], axis: int = 0) -> VolumeMesh:
    """The mesh with parts of its base as rings of valves: of each ventricle one on either side of its centre.

    ``centres`` has the ventricle's centre by (name below it, name above it); a facet belongs to the nearest one. What
    lies between the two along the axis, 35 degrees of the ring, stays base.
    """
    middle = np.concatenate([mesh.points[block].mean(axis=1) for block in mesh.facets.values()])
    tag, base = mesh.facet_tag.copy(), mesh.facet_tag == FACET_TAGS["base"]
    away = np.stack([np.hypot(*(middle - at)[:, :2].T) for at in centres.values()])
    for number, (names, at) in enumerate(centres.items()):
        own = base & (away.argmin(axis=0) == number)
        share = (middle - at)[:, axis] / np.maximum(away[number], 1e-9)
        for name, beyond in zip(names, (share < -0.3, share > 0.3)):
            tag[own & beyond] = FACET_TAGS[name]
    return replace(mesh, facet_tag=tag)
