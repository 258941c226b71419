"""The bull's eye as SVG: every segment at its place, the colours in order, gaps grey; and the wall's thickness."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest
from anatomy_meshes import clipped_ellipsoid, ellipsoid, slab
from biventricular import biventricular

from femprep.anatomy import add_aha, bulls_eye, bulls_eye_svg, wall_thickness
from femprep.anatomy.axes.ventricular_axes import VentricularAxes
from femprep.errors import InputError, OptionError
from femprep.mesh.elements import ELEMENTS
from femprep.model import VolumeMesh

SVG = "{http://www.w3.org/2000/svg}"
AXES = VentricularAxes([0.0, 0, -65], [0.0, 0, 15], [-1.0, 0, 0], False)


def centres(mesh: VolumeMesh) -> np.ndarray:
    return np.concatenate([mesh.points[b[:, : ELEMENTS[k].corners]].mean(axis=1) for k, b in mesh.cells.items()])


def test_each_number_stands_in_its_segment_and_the_segment_bears_its_name():
    root = ElementTree.fromstring(bulls_eye_svg(np.arange(1.0, 18.0), text="{:.0f}", label="a < b"))
    paths = root.findall(f"{SVG}path")
    assert [path.findtext(f"{SVG}title", "").split()[0] for path in paths] == [str(k) for k in range(1, 18)]
    assert paths[13].findtext(f"{SVG}title") == "14 apical septal"
    at = {
        t.text: (float(t.get("x", "nan")), float(t.get("y", "nan")))
        for t in root.findall(f"{SVG}text")
        if t.get("x") and t.get("dy")
    }
    assert at["1"] == pytest.approx((0.0, -3.5))  # anterior at the top: y points down
    assert at["4"] == pytest.approx((0.0, 3.5))
    assert at["2"][0] < 0 < at["6"][0]  # the septum on the left
    assert at["14"] == pytest.approx((-1.5, 0.0))
    assert root.get("aria-label") == "a < b"
    for path in paths[:16]:  # each outline lies around its number
        numbers = np.array(re.findall(r"(-?\d+\.\d{4}) (-?\d+\.\d{4})", path.get("d", "")), dtype=float)
        assert len(numbers) == 4
        k = path.findtext(f"{SVG}title", "").split()[0]
        radius = np.hypot(*np.array(at[k])) if k in at else np.nan
        assert np.hypot(*numbers.T).min() < radius < np.hypot(*numbers.T).max()


def test_colours_run_from_the_least_to_the_largest_and_a_gap_is_grey():
    values = np.arange(17.0)
    values[4] = np.nan
    root = ElementTree.fromstring(bulls_eye_svg(values))
    fill = [path.get("fill") for path in root.findall(f"{SVG}path")]
    assert (fill[0], fill[16], fill[4]) == ("#440154", "#fde725", "#d3d3d3")  # both ends of viridis
    assert len(set(fill)) == 17
    assert [t.text for t in root.findall(f"{SVG}text")].count("-") == 1
    same = ElementTree.fromstring(bulls_eye_svg(np.full(17, 3.0)))
    assert len({path.get("fill") for path in same.findall(f"{SVG}path")}) == 1
    with pytest.raises(InputError, match="17 values"):
        bulls_eye_svg(np.ones(16))


def test_a_field_of_a_mesh_is_drawn_by_its_means():
    mesh = add_aha(clipped_ellipsoid().mesh, axes=AXES)
    root = ElementTree.fromstring(bulls_eye_svg(mesh.cell_data["aha"], mesh, text="{:.0f}"))
    words = [t.text for t in root.findall(f"{SVG}text")]
    assert {str(k) for k in range(1, 17)} <= set(words)
    assert "-" in words  # clipped: no seventeenth


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_thickness_of_a_slab_is_its_width(kind):
    assert wall_thickness(slab(kind).mesh) == pytest.approx(10.0, abs=1e-9)


def test_thickness_of_a_spherical_shell_is_that_of_its_radii():
    mesh = ellipsoid("hexahedron", size=10, layers=3, endo=(40.0, 40.0), epi=(50.0, 50.0), base=0.0).mesh
    edge = 50.0 * np.pi / 2 / 30  # along a meridian; the facets lie off the sphere by its square over 8 R
    below = centres(mesh)[:, 2] < -5.0
    assert np.abs(wall_thickness(mesh)[below] - 10.0).max() < edge**2 / 40.0


def test_thickness_needs_two_surfaces():
    mesh = slab("tetra").mesh
    tag = np.where(np.isin(mesh.facet_tag, [mesh.facet_names["endo"]]), mesh.facet_names["base"], mesh.facet_tag)
    bare = VolumeMesh(mesh.points, mesh.cells, mesh.region, mesh.facets, tag)
    with pytest.raises(InputError, match=r"thickness needs facets tagged endo .* the mesh has"):
        wall_thickness(bare)


def test_thickness_of_both_ventricles_goes_across_each_wall():
    mesh = biventricular(5.0)
    thick, centre = wall_thickness(mesh), centres(mesh)
    low = (centre[:, 2] < 0.0) & (centre[:, 2] > -25.0)
    lateral = low & (centre[:, 0] > 24.0) & (np.abs(centre[:, 1]) < 10.0)  # LV free wall, 10 mm
    septum = low & (centre[:, 0] < -22.0) & (centre[:, 0] > -32.0) & (np.abs(centre[:, 1]) < 6.0)  # 10 mm
    right = low & (centre[:, 0] < -50.0) & (np.abs(centre[:, 1]) < 6.0)  # RV free wall, 5 mm
    for part, width in ((lateral, 10.0), (septum, 10.0), (right, 5.0)):
        assert np.count_nonzero(part) > 5
        assert np.median(thick[part]) == pytest.approx(width, abs=0.8)


@pytest.mark.parametrize(("given", "line"), [
    ({"width": 0}, "width is 0, expected a number at least 1"),
    ({"limits": 5}, "limits is 5, expected the smallest and the largest value"),
    ({"limits": (2.0, 1.0)}, r"limits is \(2.0, 1.0\), expected"),
    ({"limits": (0.0, np.nan)}, "limits is"),
    ({"limits": np.ones((3, 3))}, "limits is"),
    ({"text": "{:d}"}, r"text is '\{:d\}', expected the format of a number"),
    ({"text": "{x}"}, "text is"),
])  # fmt: skip
def test_a_picture_of_no_size_limits_or_format_is_refused(given, line):
    with pytest.raises(OptionError, match=line):
        bulls_eye_svg(np.arange(17.0), **given)


def test_words_are_no_values():
    with pytest.raises(InputError, match="values of a bull's eye holds no real numbers but"):
        bulls_eye_svg(["a"] * 17)


def test_a_map_of_colours_that_is_none_is_refused():
    pytest.importorskip("matplotlib")
    with pytest.raises(
        OptionError, match=r"cmap is 'virids', which is no colour map of matplotlib; did you mean 'viri"
    ):
        bulls_eye(np.arange(17.0), cmap="virids")
