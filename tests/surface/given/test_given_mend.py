"""What is mended in anyone's surface is told with its place; what is not is refused in one line with the place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import own_shapes as shapes
import pytest
from surface_shapes import sphere

from femprep.errors import InputError
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import is_closed, is_consistently_wound, pinched_vertices
from femprep.model import Surface
from femprep.surface.given.mend import mended


def _told(surface: Surface) -> str:
    return "; ".join(one["what"] for one in surface.info.get("notices", ()))


def test_a_sound_surface_stays_as_it_is() -> None:
    given = shapes.closed("lv")
    found = mended(given)
    assert found.volume == pytest.approx(given.volume, rel=1e-12)
    assert len(found.cells) == len(given.cells)
    assert not _told(found)


def test_corners_of_a_soup_are_merged() -> None:
    given = shapes.closed("lv")
    found = mended(shapes.soup(given))
    assert len(found.points) == len(given.points)
    assert is_closed(found.cells)
    assert "corners of surface lv that lay on others were merged" in _told(found)


@pytest.mark.parametrize("rows", [slice(None), slice(5, 6), slice(0, 300)])
def test_windings_are_turned_outward(rows: slice) -> None:
    given = shapes.closed("lv")
    found = mended(shapes.flipped(given, rows))
    assert is_consistently_wound(found.cells)
    assert found.volume == pytest.approx(given.volume, rel=1e-12)
    assert "wound inward, and turned" in _told(found)


def test_a_tiny_hole_is_filled_and_told_with_place_and_size() -> None:
    given = shapes.closed("lv", 1500)
    torn = replace(given, cells=np.delete(given.triangles, [700], axis=0))
    found = mended(torn)
    assert is_closed(found.cells)
    assert found.volume == pytest.approx(given.volume, rel=1e-6)
    notice = found.info["notices"][0]
    assert "hole of" in notice["what"]
    assert np.linalg.norm(given.points[given.triangles[700]].mean(axis=0) - notice["place"]) < 0.01
    assert 1.0 < notice["amount"] < 6.0


def test_a_crack_between_halves_of_another_precision_is_closed() -> None:
    given = shapes.soup(shapes.closed("lv"))
    points = given.points.copy()
    points[:600] += 3e-5
    found = mended(replace(given, points=points))
    assert is_closed(found.cells)


def test_specks_are_left_out_and_pieces_refused() -> None:
    given = shapes.closed("lv")
    for size, wanted in ((0.02, None), (0.5, r"is in 2 pieces, of \d+ mm2 about \(.*\) and of")):
        more = replace(
            given,
            points=np.concatenate([given.points, 100.0 + size * given.points]),
            cells=np.concatenate([given.triangles, given.triangles + len(given.points)]),
        )
        if wanted is None:
            assert "specks" in _told(mended(more))
        else:
            with pytest.raises(InputError, match=wanted):
                mended(more)


def test_what_crosses_itself_is_refused_with_its_place() -> None:
    given = shapes.closed("lv")
    points = given.points.copy()
    points[10] = -points[10]
    with pytest.raises(InputError, match=r"surface 'lv' crosses itself: \d+ pairs of triangles, the first at \("):
        mended(replace(given, points=points))


def test_what_branches_has_handles_or_one_side_is_refused() -> None:
    given = shapes.closed("lv")
    a, b, _ = given.triangles[0]
    fin = replace(
        given,
        points=np.vstack([given.points, 2.0 * given.points[a]]),
        cells=np.vstack([given.triangles, [a, b, len(given.points)]]),
    )
    with pytest.raises(InputError, match=r"branches: 1 edges have more than two triangles, the first at"):
        mended(fin)
    with pytest.raises(InputError, match="1 handles or tunnels"):
        mended(_torus())
    with pytest.raises(InputError, match="one side only"):
        mended(_band())


def test_points_that_are_not_finite_are_named() -> None:
    given = shapes.closed("lv")
    points = given.points.copy()
    points[7, 1] = np.nan
    with pytest.raises(InputError, match="vertex 7 is"):
        mended(replace(given, points=points))


def _torus() -> Surface:
    n = 24
    u, v = np.meshgrid(*(2.0 * np.pi * np.arange(n) / n,) * 2, indexing="ij")
    ring = 30.0 + 10.0 * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), 10.0 * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    a, b = i * n + j, (i + 1) % n * n + j
    c, d = (i + 1) % n * n + (j + 1) % n, i * n + (j + 1) % n
    cells = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    return Surface(points, cells, name="lv")


def _band() -> Surface:
    n = 40
    angle = 2.0 * np.pi * np.arange(n) / n
    sides = []
    for off in (-10.0, 10.0):
        radius = 40.0 + off * np.cos(0.5 * angle)
        sides.append(np.stack([radius * np.cos(angle), radius * np.sin(angle), off * np.sin(0.5 * angle)], axis=1))
    points = np.concatenate(sides)
    cells = []
    for k in range(n):
        a, b = k, n + k
        c, d = (k + 1, n + k + 1) if k + 1 < n else (n, 0)
        cells += [[a, c, b], [b, c, d]]
    return Surface(points, np.array(cells), name="lv")


def test_corners_of_one_triangle_in_which_a_surface_touches_itself_are_all_parted() -> None:
    given = shapes.closed("lv", 200)
    torn = given.triangles[np.random.default_rng(0).random(len(given.triangles)) > 0.1]
    pinched = pinched_vertices(torn)
    assert np.isin(torn, pinched).sum(axis=1).max() > 1
    found = mended(replace(given, cells=torn))
    assert len(pinched_vertices(found.triangles)) == 0
    assert "13 corners in which it touched itself parted" in _told(found)  # the others were on a speck
    near = np.linalg.norm(found.points[:, None] - given.points[None], axis=2).min(axis=1)
    assert near.max() < 0.05


def test_a_fold_is_smoothed_where_asked_and_refused_where_that_moves_it_far(monkeypatch: pytest.MonkeyPatch) -> None:
    ball = sphere(30.0, subdivisions=4)
    points, near = ball.points.copy(), np.linalg.norm(ball.points - ball.points[ball.points[:, 2].argmax()], axis=1)
    points[near < 4.0] -= [0.0, 0.0, 6.0]
    points[near < 2.5] += [9.0, 0.0, 5.4]
    folded = Surface(points, ball.cells, name="lv")
    assert len(self_intersections(points, ball.cells))
    sound = mended(folded, repair=True)
    assert not len(self_intersections(sound.points, sound.triangles))
    assert any("crossed" in notice["what"] for notice in sound.info["notices"])
    monkeypatch.setattr("femprep.surface.given.uncross.FARTHEST", 0.1)
    with pytest.raises(InputError, match="fold"):
        mended(folded, repair=True)
