"""Nouns hold what their readers, writers and stages can take, and nothing else."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp

POINTS = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
CLOSED = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
MESH = truncated_ellipsoid("hexahedron")


@pytest.mark.parametrize(("rows", "named"), [([[0, 1, 9]], 9), ([[0, 1, -1]], -1), ([[0, 1, 2, 4]], 4)])
def test_cells_of_a_surface_name_its_points(rows: list[list[int]], named: int) -> None:
    with pytest.raises(fp.InputError, match=f"cells of surface 'lv' name point {named}, but there are 4 points"):
        fp.Surface(POINTS, rows, name="lv")


@pytest.mark.parametrize("named", [4, -1])
def test_cells_of_other_nouns_name_their_points_too(named: int) -> None:
    told = f"name point {named}, but there are 4 points, counted from 0"
    wrong = [*CLOSED[1:], [0, 2, named]]
    with pytest.raises(fp.InputError, match=f"cells 'tetra' {told}"):
        fp.VolumeMesh(POINTS, {"tetra": [[0, 1, 2, named]]}, [1])
    with pytest.raises(fp.InputError, match=f"triangles {told}"):
        fp.Wall(POINTS, wrong, [101] * 4, [-1] * 4)
    with pytest.raises(fp.InputError, match=f"triangles of 'outer' {told}"):
        fp.BloodPools(POINTS, wrong, [101] * 4, {})
    with pytest.raises(fp.InputError, match=f"triangles of 'lv' {told}"):
        fp.BloodPools(POINTS, CLOSED, [101] * 4, {"lv": wrong})
    with pytest.raises(fp.InputError, match=f"edges of a Purkinje net {told}"):
        fp.PurkinjeNet(POINTS, [[0, 1], [1, 2], [2, named]], [111] * 3, [-1] * 4)


@pytest.mark.parametrize(("change", "line"), [
    ({"cells": {"tetrahedron": [[0, 1, 2, 3]]}}, "element type 'tetrahedron' is not known; known are tetra, tetra10,"),
    ({"cells": {4: [[0, 1, 2, 3]]}}, "cells has the name 4, expected a string"),
    ({"cells": {"tetra": [[0, 1, 2]]}}, "a tetra has 3 nodes, expected 4"),
    ({"cells": None}, "cells is None, expected a mapping by names"),
    ({"cells": [("tetra", [[0, 1, 2, 3]])]}, "cells is [('tetra', [[0, 1, 2, 3]])], expected a mapping by names"),
    ({"facets": {"tri": [[0, 1, 2]]}, "facet_tag": [101]}, "facet type 'tri' is not known; known are triangle, quad,"),
    ({"facets": {"line": [[0, 1]]}, "facet_tag": [101]}, "facet type 'line' is not known"),
    ({"cell_data": None}, "cell data is None, expected a mapping by names"),
    ({"cell_data": {1: [1.0]}}, "cell data has the name 1, expected a string"),
    ({"point_data": [1]}, "point data is [1], expected a mapping by names"),
    ({"planes": {"base": (0, 0, 1)}}, "planes 'base' is (0, 0, 1), expected a Plane"),
    ({"info": "abc"}, "info is 'abc', expected a mapping by names"),
    ({"purkinje": "net"}, "purkinje is 'net', expected a PurkinjeNet"),
])  # fmt: skip
def test_a_mesh_holds_nothing_that_breaks_later(change: dict[str, Any], line: str) -> None:
    given = {"points": POINTS, "cells": {"tetra": [[0, 1, 2, 3]]}, "region": [1], **change}
    with pytest.raises(fp.InputError, match=re.escape(line)):
        fp.VolumeMesh(**given)


def test_an_info_of_what_no_file_holds_is_refused_where_it_is_written(tmp_path) -> None:
    with pytest.raises(fp.InputError, match=r"info holds \{1\}, which is no JSON"):
        fp.write_mesh(replace(MESH, info={"own": {1}}), tmp_path / "a.vtu")
    assert list(tmp_path.iterdir()) == []
    fp.write_mesh(replace(MESH, info={"own": np.arange(3), "one": np.float32(1)}), tmp_path / "a.vtu")
    assert fp.read_mesh(tmp_path / "a.vtu").info["own"] == [0, 1, 2]


@pytest.mark.parametrize("name", ["a.vtu", "a.med", "a.inp", "a.msh"])
def test_a_mesh_without_elements_is_not_written(tmp_path, name: str) -> None:
    empty = fp.VolumeMesh(POINTS, {}, [])
    for use in (lambda: fp.write_mesh(empty, tmp_path / name), empty.to_meshio, lambda: fp.annotate(empty)):
        with pytest.raises(fp.InputError, match="the mesh has no volume elements"):
            use()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("point", [[np.nan, 0, 0], [np.inf, 0, 0]])
def test_a_plane_lies_somewhere(point: list[float]) -> None:
    with pytest.raises(fp.InputError, match=r"plane point \[.*\] lies nowhere; give finite numbers"):
        fp.Plane(point, [0, 0, 1])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("normal", "line"), [
    ([1e300, 1e300, 0], "has no direction"),
    ([1e-300, 0, 0], "has no direction"),
    ("abc", "plane normal holds no real numbers but <U3"),
])  # fmt: skip
def test_a_plane_has_a_direction(normal: Any, line: str) -> None:
    with pytest.raises(fp.InputError, match=line):
        fp.Plane([0, 0, 0], normal)


@pytest.mark.parametrize(("points", "line"), [
    ([[1, 2]], r"points have shape \(1, 2\), expected \(n, 3\)"),
    ("abc", "points holds no real numbers but"),
])  # fmt: skip
def test_distances_from_a_plane_are_those_of_points(points: Any, line: str) -> None:
    with pytest.raises(fp.InputError, match=line):
        fp.Plane([0, 0, 0], [0, 0, 1]).signed_distance(points)


@pytest.mark.parametrize("far", [1e300, 1e12, np.inf, -np.inf, np.nan])
def test_a_surface_lies_near_enough_for_its_lengths_to_be_numbers(far: float) -> None:
    with pytest.raises(fp.InputError, match=r"surface 'lv': vertex 1 is \[.*\], expected coordinates in mm"):
        fp.Surface([POINTS[0], [far, 0, 0], *POINTS[2:]], CLOSED, name="lv")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [0.0, 1e-300])
def test_a_surface_without_area_is_not_fitted(size: float) -> None:
    with pytest.raises(fp.InputError, match="surface 'lv' has no area: its corners lie in one place or on a line"):
        fp.fit_surface(fp.Surface(size * np.array(POINTS), CLOSED, name="lv"))


def test_a_surface_without_cells_is_refused_by_what_measures_or_matches_it() -> None:
    full, none = fp.Surface(POINTS, CLOSED, name="epi"), fp.Surface(np.empty((0, 3)), np.empty((0, 3)), name="lv")
    for use in (
        lambda: fp.surface_quality(none),
        lambda: fp.prepare_surfaces({"lv": none, "epi": full}),
        lambda: fp.match_surfaces(endo=none, epi=full, base=fp.Plane([0, 0, 0], [0, 0, 1])),
    ):
        with pytest.raises(fp.InputError, match="surface 'lv' has no triangles"):
            use()


def test_an_image_lies_on_a_grid() -> None:
    labels = np.ones((5, 5, 5), dtype=np.uint8)
    for use in (
        lambda: fp.Segmentation(labels, None, {"lv": 1}),
        lambda: fp.LabelObject(labels > 0, None),
        lambda: fp.IntensityImage(labels, None),
    ):
        with pytest.raises(fp.InputError, match="the grid is None, expected a Grid"):
            use()
    for shape in ("abc", (5.5, 5, 5)):
        with pytest.raises(fp.InputError, match="grid shape holds"):
            fp.Grid(shape, (1, 1, 1), (0, 0, 0), np.eye(3))


@pytest.mark.parametrize(("structures", "line"), [
    (None, "structures is None, expected a mapping by names"),
    ({"lv": 1.5}, "structure 'lv' holds 1.5, expected whole numbers"),
    ({1: (1,)}, "structures has the name 1, expected a string"),
])  # fmt: skip
def test_structures_are_whole_numbers_by_name(structures: Any, line: str) -> None:
    grid = fp.Grid((5, 5, 5), (1, 1, 1), (0, 0, 0), np.eye(3))
    with pytest.raises(fp.InputError, match=line):
        fp.Segmentation(np.ones(grid.shape, dtype=np.uint8), grid, structures)


@pytest.mark.parametrize("record", [{}, None, {"apex": [0, 0, 0], "top": 1}])
def test_a_record_of_axes_holds_them(record: Any) -> None:
    with pytest.raises(fp.InputError, match=r"axes: .* is no record of axes; give what record\(\) makes"):
        fp.VentricularAxes.from_record(record)
    with pytest.raises(fp.InputError, match=r"axes insertions is \[1\], expected a mapping by names"):
        fp.VentricularAxes((0, 0, -50), (0, 0, 20), (-1, 0, 0), insertions=[1])
