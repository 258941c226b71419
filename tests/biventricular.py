"""A tetrahedral mesh of both ventricles, made with gmsh: cut ellipsoids, the RV leaning to the front at its base."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from femprep.mesh.elements import boundary_faces
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh

BASE = 10.0
#: Semi-axes, centre and lean (turn about x, degrees) of the four ellipsoids.
LV_ENDO = ((22.0, 22.0, 52.0), (0.0, 0.0, 0.0), 0.0)
LV_EPI = ((32.0, 32.0, 62.0), (0.0, 0.0, 0.0), 0.0)
RV_ENDO = ((30.0, 32.0, 50.0), (-26.0, 0.0, 4.0), 18.0)
RV_EPI = ((35.0, 37.0, 55.0), (-26.0, 0.0, 4.0), 18.0)


def level(points: np.ndarray, body) -> np.ndarray:
    """Below 1 inside an ellipsoid, 1 on it."""
    axes, centre, lean = body
    a = np.radians(lean)
    turn = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    local = (points - centre) @ turn
    return np.sqrt(((local / axes) ** 2).sum(axis=1))


@cache
def biventricular(edge: float = 4.0) -> VolumeMesh:
    """The mesh, with facets ``endo_lv``, ``endo_rv``, ``epi`` and ``base``; anatomical, not mirrored."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Verbosity", 1)
        gmsh.option.setNumber("General.NumThreads", 1)
        occ = gmsh.model.occ

        def body(spec) -> tuple[int, int]:
            axes, centre, lean = spec
            tag = (3, occ.addSphere(0, 0, 0, 1))
            occ.dilate([tag], 0, 0, 0, *axes)
            occ.rotate([tag], 0, 0, 0, 1, 0, 0, np.radians(lean))
            occ.translate([tag], *centre)
            return tag

        outside, _ = occ.fuse([body(LV_EPI)], [body(RV_EPI)])
        cavity, _ = occ.cut([body(RV_ENDO)], [body(LV_EPI)])
        wall, _ = occ.cut(outside, [body(LV_ENDO), *cavity])
        box = (3, occ.addBox(-200, -200, BASE, 400, 400, 400))
        occ.cut(wall, [box])
        occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMin", edge)
        gmsh.option.setNumber("Mesh.MeshSizeMax", edge)
        gmsh.model.mesh.generate(3)
        numbers, flat, _ = gmsh.model.mesh.getNodes()
        kinds, _, nodes = gmsh.model.mesh.getElements(3)
        cells = np.asarray(nodes[list(kinds).index(4)], dtype=np.int64).reshape(-1, 4)
        points = np.asarray(flat).reshape(-1, 3)
        order = np.zeros(int(max(numbers)) + 1, dtype=np.int64)
        order[np.asarray(numbers, dtype=np.int64)] = np.arange(len(numbers))
    finally:
        gmsh.finalize()
    used, cells = np.unique(order[cells], return_inverse=True)
    cells, points = cells.reshape(-1, 4), points[used]
    faces = boundary_faces({"tetra": cells})["triangle"].nodes
    corner = points[faces]
    flat_face = (np.abs(corner[..., 2] - BASE) < 1e-6).all(axis=1)

    def on(spec) -> np.ndarray:
        return np.abs(level(corner.reshape(-1, 3), spec) - 1).reshape(-1, 3).max(axis=1) < 1e-4

    inside = (level(corner.reshape(-1, 3), RV_ENDO).reshape(-1, 3) < 1 + 1e-4).all(axis=1)
    tag = np.select(
        [flat_face, on(LV_ENDO), on(RV_ENDO) | (on(LV_EPI) & inside)],
        [FACET_TAGS["base"], FACET_TAGS["endo_lv"], FACET_TAGS["endo_rv"]],
        default=FACET_TAGS["epi"],
    )
    region = np.full(len(cells), REGION_TAGS["lv"])
    return VolumeMesh(points, {"tetra": cells}, region, {"triangle": faces}, tag)
