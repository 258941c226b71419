"""Hearts of others' making, cut and meshed by Gmsh's CAD: each names its facets itself, and they get the same back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest
from slow_params import slow_but

import femprep as fp
from femprep.annotation.given import given_facets
from femprep.annotation.shell import shell_of
from femprep.model import FACET_TAGS, VolumeMesh

gmsh = pytest.importorskip("gmsh")

Solid = list[tuple[int, int]]


@pytest.fixture
def cad() -> Iterator[None]:
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    yield
    gmsh.finalize()


def ball(radii: tuple[float, float, float], x: float = 0.0) -> Solid:
    solid = [(3, gmsh.model.occ.addSphere(0, 0, 0, 1))]
    gmsh.model.occ.dilate(solid, 0, 0, 0, *radii)
    gmsh.model.occ.translate(solid, x, 0, 0)
    return solid


def above(x: float = -200.0, z: float = 0.0, degrees: float = 0.0) -> Solid:
    """What lies beyond x and above z, tilted about the line where both begin, or the middle."""
    box = [(3, gmsh.model.occ.addBox(x, -200, z, 400, 400, 400))]
    gmsh.model.occ.rotate(box, max(x, 0.0), 0, z, 0, 1, 0, radians(degrees))
    return box


def without(solid: Solid, *others: Solid) -> Solid:
    for other in others:
        solid = gmsh.model.occ.cut(solid, other)[0]
    return solid


LEFT, LEFT_INNER = (33.0, 33.0, 70.0), (23.0, 23.0, 60.0)
RIGHT, RIGHT_INNER = (36.0, 30.0, 62.0), (32.0, 26.0, 58.0)


def ventricles(side: float, *cuts: Solid) -> Solid:
    whole = gmsh.model.occ.fuse(ball(LEFT), ball(RIGHT, side))[0]
    right = without(ball(RIGHT_INNER, side), ball(LEFT))
    return without(whole, right, ball(LEFT_INNER), *cuts)


def within(points: np.ndarray, radii: tuple[float, float, float], x: float = 0.0) -> np.ndarray:
    """How far points lie beyond an ellipsoid, 1 on it."""
    return np.asarray(np.linalg.norm((points - [x, 0.0, 0.0]) / radii, axis=1))


def meshed(path: Path, size: float, names: Callable[[np.ndarray], str], order: int = 1) -> VolumeMesh:
    """The mesh of what stands, each CAD face named by the middles of its facets."""
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.ElementOrder", order)
    gmsh.model.mesh.generate(3)
    volumes = gmsh.model.getEntities(3)
    faces: dict[str, list[int]] = {}
    for _, face in gmsh.model.getBoundary(volumes, oriented=False):
        own = gmsh.model.mesh.getBarycenters(gmsh.model.mesh.getElementType("Triangle", order), face, False, True)
        own = np.array(own).reshape(-1, 3)
        faces.setdefault(names(own), []).append(face)
    for number, (name, own) in enumerate(faces.items(), 1):
        gmsh.model.addPhysicalGroup(2, own, number, name)
    gmsh.model.addPhysicalGroup(3, [volume for _, volume in volumes], 9, "muscle")
    gmsh.write(str(path))
    return fp.read_mesh(path)


def name_of_ventricles(side: float) -> Callable[[np.ndarray], str]:
    def name(points: np.ndarray) -> str:
        def on(*surface: object) -> bool:
            return bool(np.median(np.abs(within(points, *surface) - 1.0)) < 0.04)  # type: ignore[arg-type]

        if on(LEFT_INNER):
            return "endo_lv"
        if on(RIGHT_INNER, side) or (on(LEFT) and np.median(within(points, RIGHT_INNER, side)) < 1.0):
            return "endo_rv"
        return "epi" if on(LEFT) or on(RIGHT, side) else "base"

    return name


def right(truth: VolumeMesh, found: fp.Annotation) -> float:
    shell = shell_of(found.mesh)
    tag = given_facets(replace(truth, points=found.mesh.points), shell, {})
    assert (tag > 0).all()
    return float(shell.area[tag == found.mesh.facet_tag].sum() / shell.area.sum())


def bare(mesh: VolumeMesh, factor: float = 1.0) -> VolumeMesh:
    return VolumeMesh(mesh.points * factor, mesh.cells, np.ones(mesh.n_cells))


CUTS = {
    "flat": lambda side: [above()],
    "leaning": lambda side: [above(degrees=15.0)],
    "each ventricle by a plane of its own": lambda side: [above(), above(28.0, degrees=20.0)],
    "two planes that meet within the left one": lambda side: [above(), above(20.0, degrees=25.0)],
    "a step between them": lambda side: [above(), above(36.0, -12.0)],
}


@pytest.mark.parametrize("cut", slow_but(["a step between them"], CUTS))
def test_both_ventricles_are_named_however_their_base_is_cut(cut: str, cad: None, tmp_path: Path) -> None:
    ventricles(22.0, *CUTS[cut](22.0))
    truth = meshed(tmp_path / "theirs.msh", 6.0, name_of_ventricles(22.0))
    found = fp.annotate(bare(truth), fibres=None)
    assert right(truth, found) == 1.0
    assert set(found.mesh.region_names) == {"lv", "rv", "septum"}


@pytest.mark.slow
def test_a_mirrored_heart_in_centimetres_of_ten_node_elements_is_named(cad: None, tmp_path: Path) -> None:
    ventricles(-22.0, above())
    truth = meshed(tmp_path / "theirs.msh", 10.0, name_of_ventricles(-22.0), order=2)
    found = fp.annotate(bare(truth, 0.1), unit="cm")
    assert found.unit == "cm"
    assert right(truth, found) == 1.0
    assert "fiber" in found.mesh.cell_data


@pytest.mark.slow
def test_holes_through_a_closed_top_are_valves_and_no_vessels(cad: None, tmp_path: Path) -> None:
    outer, inner = (34.0, 34.0, 60.0), (25.0, 25.0, 50.0)
    holes = [[(3, gmsh.model.occ.addCylinder(x, 0, 0, x, 0, 100, radius))] for x, radius in ((9.0, 12.0), (-15.0, 8.0))]
    without(ball(outer), ball(inner), *holes)

    def name(points: np.ndarray) -> str:
        on = {"epi": outer, "endo": inner}
        return next((own for own, radii in on.items() if np.median(np.abs(within(points, radii) - 1)) < 0.04), "base")

    truth = meshed(tmp_path / "theirs.msh", 5.0, name)
    found = fp.annotate(bare(truth), fibres=None)
    assert set(found.mesh.facet_names) == {"endo", "epi", "mitral", "aortic"}
    wide = {one.name: one.area for one in found.openings}
    assert wide["mitral"] > wide["aortic"]
    shell = shell_of(found.mesh)
    tag = given_facets(truth, shell, {})
    for surface in ("endo", "epi"):
        own = tag == truth.facet_names[surface]
        assert shell.area[own & (found.mesh.facet_tag == tag)].sum() > 0.9 * shell.area[own].sum()


WAYS = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)]


@pytest.mark.parametrize(("count", "wide"), slow_but([(3, 12.0)], [(5, 7.0), (3, 12.0)]))
def test_one_atrium_alone_is_no_ventricle(cad: None, tmp_path: Path, count: int, wide: float) -> None:
    middle = (0.0, 0.0, 0.0)
    veins = [[(3, gmsh.model.occ.addCylinder(*middle, *(60 * x for x in way), wide))] for way in WAYS[:count]]
    without(ball((30.0, 30.0, 30.0)), ball((26.0, 26.0, 26.0)), *veins)
    theirs = meshed(tmp_path / "theirs.msh", 5.0, lambda points: "wall")
    if count == 3:
        with pytest.raises(fp.InputError, match="right-atrium"):
            fp.annotate(bare(theirs))
    found = fp.annotate(bare(theirs), anatomy="left-atrium", fibres=None)
    assert set(found.mesh.facet_names) == {"endo_la", "epi", "mitral", "veins"}
    assert len(found.openings) == count


def test_bricks_that_end_in_terraces_are_named() -> None:
    step = 3.0
    grid = np.stack(np.meshgrid(*[np.arange(-n, m) for n, m in ((12, 12), (12, 12), (25, 2))], indexing="ij"), axis=-1)
    at = (grid.reshape(-1, 3) + 0.5) * step
    inner, outer = (within(at, radii) < 1.0 for radii in (LEFT_INNER, LEFT))
    low = grid.reshape(-1, 3)[outer & ~inner]
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    points, cells = np.unique((low[:, None] + corners).reshape(-1, 3), axis=0, return_inverse=True)
    found = fp.annotate(VolumeMesh(points * step, {"hexahedron": cells.reshape(-1, 8)}, np.ones(len(low))), fibres=None)
    shell = shell_of(found.mesh)
    ahead = shell.centre + 0.5 * step * shell.normal
    cavity = (within(ahead, LEFT_INNER) < 1.0) & (ahead[:, 2] < points[:, 2].max() * step)
    want = np.where(cavity, FACET_TAGS["endo"], FACET_TAGS["epi"])
    want[ahead[:, 2] > points[:, 2].max() * step] = FACET_TAGS["base"]
    np.testing.assert_array_equal(found.mesh.facet_tag, want)
