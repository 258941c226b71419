from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
from wall_shapes import shifted_end, stack

from femprep.image import Grid, Segmentation
from femprep.model import FACET_TAGS, Plane, Surface, VolumeMesh
from femprep.options import CheckOptions
from femprep.surface import fit_surface
from femprep.volume import check
from femprep.volume.quality.fidelity import judge_fidelity, mesh_fidelity, surface_fidelity, with_fidelity
from femprep.wall.chambers.openings import Opening
from femprep.wall.outlines import Outline

PIXEL = 1.5


def rings(radius=20.0, slices=6) -> Segmentation:
    """Even rings: a cavity of one radius in a wall of 8 mm."""
    return stack(["o"] * slices, radii=np.full(slices, radius))


def tube(seg: Segmentation, radius: float, first: float, last: float, beside=0.0, planes=None) -> VolumeMesh:
    """A mesh of one element whose endocardium is a tube between two slices (in slice numbers) of a stack."""
    around, up = 180, 40
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(around)], axis=1) * radius + [beside, 0.0, 0.0]
    centre = seg.grid.to_world(np.array([[31.5, 31.5, 0.0]]))[0]
    height = np.linspace(first, last, up) * seg.grid.spacing[2]
    points = centre + (ring[None] + height[:, None, None] * [0.0, 0.0, 1.0]).reshape(-1, 3)
    number = np.arange(around * up).reshape(up, around)
    a, b = number[:-1].ravel(), np.roll(number, -1, axis=1)[:-1].ravel()
    c, d = np.roll(number, -1, axis=1)[1:].ravel(), number[1:].ravel()
    facets = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return VolumeMesh(
        points,
        {"tetra": np.array([[0, 1, around, 2 * around + 5]])},
        np.array([1]),
        {"triangle": facets},
        np.full(len(facets), FACET_TAGS["endo"]),
        planes=planes or {},
    )


def measured(seg, mesh, limit=None):
    found = mesh_fidelity(mesh, [Outline("endo", seg.object("lv"))], seg.grid, limit)
    return found.records[0], found


def test_a_tube_on_the_outlines_lies_on_them_within_half_a_pixel():
    seg = rings()
    record, _ = measured(seg, tube(seg, 20.0, -0.5, 5.5))
    assert [one.slice for one in record.slices] == [0, 1, 2, 3, 4, 5]
    # What is left are the steps of the pixels.
    assert record.mean_pixels < 0.3
    assert record.greatest_pixels < 0.75
    assert record.pixel_mm == PIXEL


@pytest.mark.parametrize("off", [2.0, 4.5, -3.0])
def test_a_tube_of_another_radius_is_off_by_the_difference(off):
    seg = rings()
    record, _ = measured(seg, tube(seg, 20.0 + off, -0.5, 5.5))
    for one in record.slices:
        assert one.mean_mm == pytest.approx(abs(off), abs=0.25 * PIXEL)
        assert one.greatest_mm == pytest.approx(abs(off), abs=0.75 * PIXEL)
        assert one.greatest_pixels == pytest.approx(one.greatest_mm / PIXEL)


def test_the_place_and_the_points_of_the_worst_are_told():
    seg = rings()
    mesh = tube(seg, 20.0, -0.5, 5.5, beside=6.0)
    record, found = measured(seg, mesh, limit=2.0)
    worst = max(record.slices, key=lambda one: one.greatest_mm)
    assert worst.greatest_mm == pytest.approx(6.0, abs=0.75 * PIXEL)
    centre = seg.grid.to_world(np.array([[31.5, 31.5, 0.0]]))[0]
    assert abs(worst.at_mm[0] - centre[0]) > 18.0
    assert abs(worst.at_mm[1] - centre[1]) < 6.0
    # The points listed are those on the two sides that the shift is across, where the circles are apart.
    off = (found.off["endo"] - centre)[:, :2]
    assert len(off) > 100
    assert (np.abs(np.hypot(*off.T) - np.hypot(*(off - [6.0, 0.0]).T)) > 1.0).all()


def test_what_lies_beyond_the_base_does_not_count():
    seg = rings()
    plane = Plane(seg.grid.to_world(np.array([[31.5, 31.5, 3.0]]))[0], np.array([0.0, 0.0, 1.0]))
    record, _ = measured(seg, tube(seg, 20.0, -0.5, 3.0, planes={"base": plane}))
    # The base lies in slice 3: its rim is measured, the slices above are not.
    assert [one.slice for one in record.slices] == [0, 1, 2, 3]
    assert not any(one.missed for one in record.slices)
    assert record.greatest_pixels < 0.75


def test_a_slice_that_the_surface_does_not_reach_is_told_with_its_distance():
    seg = rings()
    record, _ = measured(seg, tube(seg, 20.0, -0.5, 4.0 - 1e-3))
    missed = [one for one in record.slices if one.missed]
    assert [one.slice for one in missed] == [4, 5]
    assert missed[1].mean_mm == pytest.approx(8.0, abs=0.2)


@pytest.mark.slow
def test_where_a_neighbour_joins_the_outline_is_none_of_the_facets():
    """Facets are measured where nothing else is near, from the outline to them alone."""
    seg = rings()
    labels = seg.labels.copy()
    labels[: 32 - 18] = np.where(labels[: 32 - 18] == 0, 1, labels[: 32 - 18])
    joined = Segmentation(labels, seg.grid, seg.structures)
    mesh = tube(joined, 28.0, -0.5, 5.5)
    alone = Outline("endo", joined.object("lv", "myo"), (fit_surface(joined.object("rv"), vertices=500),), 6.0)
    # A dent that follows the neighbour is no fault; one on the free side is.
    low = mesh.points[:, 0].min()
    for side, bound in ((mesh.points[:, 0] < low + 6.0, (0.0, 1.0)), (mesh.points[:, 0] > low + 50.0, (2.0, 9.0))):
        points = mesh.points.copy()
        points[side, 0] += np.sign(low + 28.0 - points[side, 0]) * 5.0
        dented = VolumeMesh(points, mesh.cells, mesh.region, mesh.facets, mesh.facet_tag)
        record = mesh_fidelity(dented, [alone], joined.grid).records[0]
        assert bound[0] <= record.greatest_pixels <= bound[1]


def test_where_an_opening_was_cut_the_outline_is_none_of_the_facets():
    """A window in the side of a tube is off by up to its radius, unless the mesh has the ring of an opening there."""
    seg = rings()
    mesh = tube(seg, 20.0, -0.5, 5.5)
    side = mesh.points.mean(axis=0) + np.array([20.0, 0.0, 0.0])
    triangles = mesh.facets["triangle"]
    centre = mesh.points[triangles].mean(axis=1)
    left = triangles[np.linalg.norm(centre - side, axis=1) > 8.0]
    ring = triangles[np.abs(np.linalg.norm(centre - side, axis=1) - 8.0) < 1.0]
    endo = np.full(len(left), FACET_TAGS["endo"])
    aortic = Opening("aortic", "lv", None, Plane(side, np.array([1.0, 0.0, 0.0])), 9.0)
    outline = Outline("endo", seg.object("lv"), openings=(aortic,))
    closed = VolumeMesh(mesh.points, mesh.cells, mesh.region, {"triangle": left}, endo)
    tags = np.concatenate([endo, np.full(len(ring), FACET_TAGS["aortic"])])
    opened = VolumeMesh(mesh.points, mesh.cells, mesh.region, {"triangle": np.concatenate([left, ring])}, tags)
    assert mesh_fidelity(closed, [outline], seg.grid).records[0].greatest_mm > 6.0
    assert mesh_fidelity(opened, [outline], seg.grid).records[0].greatest_mm < 1.0
    # A hole where no opening is told stays a fault.
    elsewhere = replace(aortic, plane=Plane(side - [40.0, 0.0, 0.0], np.array([-1.0, 0.0, 0.0])))
    wrong = replace(outline, openings=(elsewhere,))
    assert mesh_fidelity(opened, [wrong], seg.grid).records[0].greatest_mm > 6.0


def test_a_vein_left_closed_is_measured_where_another_was_cut():
    """Both windows of a tube are off the labels; the ring of a cut lies around one of them alone."""
    seg = rings()
    mesh = tube(seg, 20.0, -0.5, 5.5)
    triangles = mesh.facets["triangle"]
    centre, middle = mesh.points[triangles].mean(axis=1), mesh.points.mean(axis=0)
    left, veins, ring = np.ones(len(triangles), dtype=bool), [], []
    for side in (1.0, -1.0):
        normal = np.array([side, 0.0, 0.0])
        far = np.linalg.norm(centre - middle - 20.0 * normal, axis=1)
        left &= far > 8.0
        ring.append(triangles[np.abs(far - 8.0) < 1.0])
        veins.append(Opening("veins", "la", None, Plane(middle + 20.0 * normal, normal), 9.0))
    outline = Outline("endo", seg.object("lv"), openings=tuple(veins))

    def greatest(*cut):
        facets = np.concatenate([triangles[left], *cut])
        tags = np.full(len(facets), FACET_TAGS["veins"])
        tags[: left.sum()] = FACET_TAGS["endo"]
        opened = VolumeMesh(mesh.points, mesh.cells, mesh.region, {"triangle": facets}, tags)
        return mesh_fidelity(opened, [outline], seg.grid).records[0].greatest_mm

    assert greatest(*ring) < 1.0
    assert greatest(ring[0]) > 6.0
    assert greatest(ring[1]) > 6.0


def test_a_neighbour_that_rounds_off_below_its_last_slice_is_near_there_too():
    """Half way to the next slice a chamber ends, and the wall around it reaches that slice."""
    seg = rings()
    mesh = tube(seg, 28.0, -0.5, 5.5)
    body = seg.object("lv", "myo")
    tip = mesh.points.mean(axis=0) + np.array([28.0, 0.0, 0.0])
    ball = pv.Sphere(radius=10.0, center=tip).triangulate()
    neighbour = Surface(np.asarray(ball.points, float), ball.faces.reshape(-1, 4)[:, 1:].astype(np.int64), "rv")
    points = mesh.points.copy()
    points[np.linalg.norm(points - tip, axis=1) < 14.0, 0] += 5.0
    bulged = VolumeMesh(points, mesh.cells, mesh.region, mesh.facets, mesh.facet_tag)
    found = [
        mesh_fidelity(bulged, [Outline("endo", body, beside, 6.0)], seg.grid).records[0].greatest_pixels
        for beside in ((), (neighbour,))
    ]
    assert found[0] > 2.0 > found[1]


def test_closed_surfaces_are_measured_likewise():
    seg = shifted_end(10.0)
    outlines = [Outline("lv", seg.object("lv"))]
    fitted = {"lv": fit_surface(outlines[0].obj)}
    record = surface_fidelity(fitted, outlines, seg.grid).records[0]
    assert record.greatest_pixels < 1.5
    moved = {"lv": Surface(fitted["lv"].points + np.array([7.5, 0.0, 0.0]), fitted["lv"].triangles, "lv")}
    assert surface_fidelity(moved, outlines, seg.grid).records[0].greatest_pixels == pytest.approx(5.0, abs=1.0)


def test_beyond_a_limit_the_report_fails_with_what_and_where_and_what_helps():
    seg = rings()
    mesh = tube(seg, 24.5, -0.5, 5.5)
    found = mesh_fidelity(mesh, [Outline("endo", seg.object("lv"))], seg.grid)
    options = CheckOptions()
    held = judge_fidelity(found.records, options)
    verdicts, failures = held.limits, held.failures
    assert [v.passed for v in verdicts] == [False, False]
    assert "endo against the labels of lv: 3." in failures[1]
    assert "in slice" in failures[1]
    assert "also in slices" in failures[1]
    plain = check(mesh)
    report = with_fidelity(plain, found, ["move them back"])
    assert report.failures == (*plain.failures, *failures, "move them back")
    assert not report.passed
    assert report.fidelity == found.records
    # Limits can be left out, and help is for those who need it.
    wide = judge_fidelity(found.records, CheckOptions(mean_label_distance=None, maximum_label_distance=4.0))
    assert wide.limits == [verdicts[1].model_copy(update={"limit": 4.0, "passed": True})]
    assert wide.failures == []


def test_in_cubic_voxels_distances_are_those_in_space():
    centres = np.stack(np.meshgrid(*(np.arange(48.0) - 23.5,) * 3, indexing="ij"), axis=-1)
    inside = np.linalg.norm(centres, axis=-1) < 20.0
    grid = Grid((48, 48, 48), (1.0, 1.0, 1.0), (-23.5, -23.5, -23.5), np.eye(3))
    outlines = [Outline("lv", Segmentation(inside.astype(np.uint8), grid, {"lv": (1,)}).object("lv"))]

    def greatest(radius: float, beside: float = 0.0) -> float:
        ball = pv.Sphere(radius=radius, theta_resolution=120, phi_resolution=120).triangulate()
        triangles = ball.faces.reshape(-1, 4)[:, 1:].astype(np.int64)
        surface = Surface(np.asarray(ball.points, float) + np.array([beside, 0.0, 0.0]), triangles, "lv")
        return surface_fidelity({"lv": surface}, outlines, grid).records[0].greatest_mm

    # In the first slices, nearly parallel to it, the smaller ball lies 3 mm and more within the outline.
    assert greatest(19.0) == pytest.approx(1.0, abs=0.8)
    assert greatest(21.0) == pytest.approx(1.0, abs=0.8)
    assert greatest(20.0, 5.0) == pytest.approx(5.0, abs=0.8)
