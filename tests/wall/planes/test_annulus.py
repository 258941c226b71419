"""Views of ellipsoids whose mitral annulus is a known tilted saddle: the ring, the base plane through it, the apex."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.errors import InputError, OptionError
from femprep.model import FACET_TAGS
from femprep.wall.planes.annulus import valve_points

ENDO, EPI = np.array([25.0, 25.0, 60.0]), np.array([34.0, 34.0, 69.0])
UP = np.array([0.0, 0.0, 4.0])
STRUCTURES = {"lv": (3,), "myo": (2,), "rv": (1,), "la": (5,)}


def level(x, y):
    """Height of the valve, mm."""
    return 15.0 + 0.2 * x + 2.5 * (x * x - y * y) / 24.0**2


def label(points):
    """Ventricle below the valve, atrium above, the right ventricle at x > 34."""
    x, y, z = points.T
    cavity, body = (((points / axes) ** 2).sum(axis=1) < 1.0 for axes in (ENDO, EPI))
    below = z < level(x, y)
    right = (~body & below & (x > 0.0) & (x < 60.0) & (np.abs(y) < 25.0) & (z > -40.0)).astype(int)
    return np.where(body, np.where(cavity, np.where(below, 3, 5), np.where(below, 2, 6)), right)


def view(name, degrees, labels=label, structures=STRUCTURES, off=0.0):
    """A view along the long axis, so many mm off it."""
    angle = np.radians(degrees)
    axes = np.column_stack([[np.cos(angle), np.sin(angle), 0.0], [0.0, 0.0, 1.0]])
    index = np.stack(np.meshgrid(np.arange(100), np.arange(110), indexing="ij"), axis=-1).reshape(-1, 2)
    start = axes @ np.array([-70.0, -80.3]) + off * np.cross(*axes.T)
    shown = labels(start + (index * 1.4) @ axes.T).reshape(100, 110)
    return fp.PlaneView(name, shown, structures, start, axes, [1.4, 1.4], 6.0)


@pytest.fixture(scope="module")
def stack():
    grid = fp.Grid((58, 42, 14), [1.8, 1.8, 8.0], [-37.0, -37.0, -58.0], np.eye(3))
    labels = label(grid.to_world(np.argwhere(np.ones(grid.shape, dtype=bool)))).reshape(grid.shape)
    return fp.Segmentation(labels, grid, STRUCTURES)


@pytest.fixture(scope="module")
def truth():
    angle = np.radians(np.arange(0.0, 360.0, 2.0))
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * 23.0
    for _ in range(50):
        wide = 25.0 * np.sqrt(1.0 - (level(*ring.T) / 60.0) ** 2)
        ring *= (wide / np.linalg.norm(ring, axis=1))[:, None]
    return np.column_stack([ring, level(*ring.T)])


THREE = (view("4ch", 3.0), view("2ch", 62.0), view("3ch", -58.0))


def away(ring, truth):
    """Mean distance of points from a closed curve, mm."""
    return float(np.linalg.norm(ring[:, None] - truth[None], axis=2).min(axis=1).mean())


def test_a_ring_is_fitted_to_three_views(stack, truth):
    found = fp.find_annulus(stack.with_views(*THREE))
    assert found.views == ("4ch", "2ch", "3ch")
    assert len(found.points) == 6
    assert away(found.points, truth) < 0.7
    assert away(found.ring, truth) < 1.0
    assert away(truth, found.ring) < 1.0
    normal = np.linalg.svd(truth - truth.mean(axis=0))[2][2]
    assert abs(found.plane.normal @ normal) > np.cos(np.radians(3.0))
    assert found.plane.normal[2] > 0.0


def test_leaflets_without_a_label_and_ragged_labels_matter_little(stack, truth):
    rng = np.random.default_rng(0)

    def ragged(points):
        rough = points + rng.normal(scale=0.5, size=points.shape)
        leaflets = np.abs(rough[:, 2] - level(*rough.T[:2])) < 1.2
        shown = label(rough)
        return np.where(leaflets & np.isin(shown, (3, 5)), 0, shown)

    views = [view(one.name, angle, ragged) for one, angle in zip(THREE, (3.0, 62.0, -58.0))]
    found = fp.find_annulus(stack.with_views(*views))
    assert away(found.points, truth) < 1.5
    assert away(truth, found.ring) < 2.0


def test_without_an_atrium_the_wall_ends_at_the_annulus(stack, truth):
    def ventricles(points):
        shown = label(points)
        return np.where(shown > 3, 0, shown)

    views = [view(name, angle, ventricles) for name, angle in (("4ch", 3.0), ("2ch", 62.0), ("3ch", -58.0))]
    assert [len(valve_points(one, "mitral")) for one in views] == [2, 2, 1]
    (lateral,) = valve_points(views[2], "mitral")
    assert lateral[0] < 0.0, "the end on the side of the right ventricle is the aortic valve's"
    assert away(fp.find_annulus(stack.with_views(*views)).ring, truth) < 1.5


def test_views_that_miss_the_valve_count_for_nothing(stack):
    beside = view("beside", 3.0, off=30.0)
    assert len(valve_points(beside, "mitral")) == 0
    assert fp.find_annulus(stack.with_views(*THREE, beside)).views == ("4ch", "2ch", "3ch")
    for seg in (stack, stack.with_views(beside)):
        with pytest.raises(InputError, match="--long-axis"):
            fp.find_annulus(seg)
    with pytest.raises(InputError, match="tricuspid"):
        fp.find_annulus(stack.with_views(*THREE), "tricuspid")


def test_landmarks_are_taken_before_labels(stack, truth):
    points = truth[::45] + UP
    views = [replace(one, landmarks={"mitral": points[k : k + 2]}) for one, k in zip(THREE, (0, 2))]
    found = fp.find_annulus(stack.with_views(*views))
    assert found.points == pytest.approx(points)
    assert away(found.ring, truth + UP) < 1.0


def test_the_base_is_cut_at_the_annulus(stack, truth):
    seg = stack.with_views(*THREE)
    base = fp.find_base(seg, base="annulus")
    below = base.signed_distance(truth)
    assert 1.5 < below.min() < below.max() < 8.0
    assert [notice.kind for notice in base.notices] == ["moved"]
    assert away(np.array(base.record()["ring_mm"]), truth) < 1.0
    lower = fp.find_base(seg, base="annulus", base_offset=2.0)
    assert float(lower.signed_distance(base.point[None])[0]) == pytest.approx(2.0)
    assert "ring_mm" not in fp.find_base(seg).record(), "views alone do not move the base"
    (*_, assumed) = fp.find_base(stack.with_views(THREE[0]), base="annulus").notices
    assert assumed.kind == "assumed"
    with pytest.raises(InputError, match="--long-axis"):
        fp.find_base(stack, base="annulus")


@pytest.mark.slow
def test_a_wall_ends_below_the_annulus(stack, truth):
    seg = stack.with_views(*THREE)
    run = fp.mesh_segmentation(seg, wall={"base": "annulus"}, volume={"edge_length": 6.0}, fibres=None)
    base = run.mesh.planes["base"]
    rim = run.mesh.points[np.unique(run.mesh.facets["triangle"][run.mesh.facet_tag == FACET_TAGS["base"]])]
    assert np.abs(base.signed_distance(rim)).max() < 1e-6
    assert base.signed_distance(truth).min() > 1.5
    assert away(np.array(run.wall.info["planes"]["base"]["ring_mm"]), truth) < 1.5


def test_the_annulus_is_asked_for_by_name(tmp_path, capsys):
    assert fp.WallOptions(base="annulus").base == "annulus"
    assert main(["mesh", "map.nii", "-o", str(tmp_path / "out"), "--base", "ring"]) == 2
    assert "annulus" in capsys.readouterr().err


def test_surfaces_have_no_views():
    endo = fp.Surface(*(np.array(x) for x in _box()))
    with pytest.raises(OptionError, match="long-axis"):
        fp.prepare_surfaces({"lv": endo, "epi": endo}, options=fp.WallOptions(base="annulus"))


def _box():
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T * 50.0
    from scipy.spatial import ConvexHull

    return corners, ConvexHull(corners).simplices


def test_the_apex_is_not_extrapolated_where_a_view_shows_it(stack):
    seg = stack.with_views(THREE[0])
    for one, shown in ((stack, False), (seg, True)):
        heart = one.object("lv", "myo")
        apex = fp.extend_apex(one, heart).info["apex"]
        assert (apex["extrapolated_mm"] == 0.0) is shown
        assert apex.get("views", []) == ["4ch"] * shown


def test_surfaces_close_at_the_apex_that_views_show(stack):
    held = np.flatnonzero((stack.labels == 3).any(axis=(0, 1)))
    labels = stack.labels.copy()
    labels[:, :, : held[1]] = 0
    stack = replace(stack, labels=labels)
    seg = stack.with_views(*THREE)
    for parts, deep in ((("lv",), 60.0), (("lv", "myo"), 69.0)):
        tips = []
        for one in (stack, seg):
            obj = one.object(*parts)
            boundary = fp.extend_apex(one, obj) if "myo" in parts else None
            tips.append(-fp.fit_surface(obj, boundary=boundary, vertices=1500).points[:, 2].min())
        alone, with_views = (abs(tip - deep) for tip in tips)
        assert with_views < 0.7 < 2.0 < alone
