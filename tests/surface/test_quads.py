"""Quadrilateral surfaces of every object by the same call: closed, sound, even, written and read back."""

from __future__ import annotations

import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.image import write_segmentation
from femprep.mesh.measures.triangles import quad_quality
from femprep.phantoms import atrium, biventricular, lv_ellipsoid
from femprep.surface import surface_quality
from femprep.template import cubed_template

SPACING = (1.44, 1.44, 8.0)
OBJECTS = {
    "lv": (lv_ellipsoid(), ("lv",)),
    "epi": (lv_ellipsoid(), ("lv", "myo")),
    "rv": (biventricular(), ("rv",)),
    "la": (atrium(), ("la",)),
}


@pytest.mark.slow
@pytest.mark.parametrize("method", ["paper", "even", "smooth"])
@pytest.mark.parametrize("name", OBJECTS)
def test_every_object_is_meshed_with_quadrilaterals(name, method):
    phantom, structures = OBJECTS[name]
    obj = phantom.segmentation(SPACING).object(*structures)
    surface = fp.fit_surface(obj, cells="quad", vertices=600, method=method)
    assert surface.cells.shape == (600, 4)
    assert len(surface.points) == 602
    quality = surface_quality(surface)
    assert quality.sound
    assert quality.cell_type == "quad"
    assert quality.quad_q.mean > 0.75
    assert quality.scaled_jacobian.mean > 0.8
    assert quality.scaled_jacobian.min > 0.05
    np.testing.assert_allclose(surface.shape(surface.directions), surface.points, atol=1e-6)
    assert surface.volume == pytest.approx(fp.fit_surface(obj, vertices=600, method=method).volume, rel=0.02)


@pytest.mark.slow
def test_moving_vertices_makes_quadrilaterals_better():
    obj = biventricular().segmentation(SPACING).object("rv")
    paper, even = (
        surface_quality(fp.fit_surface(obj, cells="quad", vertices=600, method=method)) for method in ("paper", "even")
    )
    assert even.quad_q.mean > paper.quad_q.mean
    assert even.scaled_jacobian.min >= 0.2


@pytest.mark.parametrize(("asked", "made"), [(12, 8), (20, 26), (600, 602), (1500, 1538), (20000, 20186)])
def test_the_cubed_sphere_nearest_to_a_number_of_vertices(asked, made):
    template = cubed_template(asked)
    assert len(template.directions) == made
    assert len(template.cells) == made - 2


def test_quad_quality_by_hand():
    square = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], dtype=float)
    corner = np.array([[0, 1, 2, 3]])
    assert quad_quality(square, corner) == pytest.approx(1.0)
    assert quad_quality(square * [3, 1, 1], corner) == pytest.approx(2 * 3 / (1 + 9))
    half = np.radians(30.0)
    rhombus = np.array([[0, 0, 0], [1, 0, 0], [1 + np.cos(half), np.sin(half), 0], [np.cos(half), np.sin(half), 0]])
    assert quad_quality(rhombus, corner) == pytest.approx(np.sin(half))
    arrow = np.array([[0, 0, 0], [1, 0, 0], [0.1, 0.1, 0], [0, 1, 0]])
    assert quad_quality(arrow, corner) == pytest.approx(0.0)


@pytest.mark.slow
def test_the_command_line_writes_quadrilaterals_that_are_read_back(tmp_path):
    seg = lv_ellipsoid().segmentation(SPACING)
    write_segmentation(seg, tmp_path / "heart.nii.gz")
    call = ["surface", str(tmp_path / "heart.nii.gz"), "--preset", "acdc", "--object", "lv=lv", "--vertices", "300"]
    assert main([*call, "--cells", "quad", "--quiet", "-o", str(tmp_path / "out")]) == 0
    read = fp.read_surface(tmp_path / "out" / "surfaces" / "lv.vtp")
    assert read.cells.shape[1] == 4
    direct = fp.fit_surface(fp.orient(seg).object("lv"), cells="quad", vertices=300)
    np.testing.assert_array_equal(read.cells, direct.cells)
    # NIfTI's affine is in single precision; how far vertices slide until they are even depends on it a little more.
    np.testing.assert_allclose(read.points, direct.points, atol=1e-2)
    assert surface_quality(read).sound


@pytest.mark.slow
def test_quadrilaterals_of_real_hearts(data):
    for number, frame in (("007", "01"), ("021", "13"), ("084", "01")):
        path = data / "acdc" / "training" / f"patient{number}" / f"patient{number}_frame{frame}_gt.nii.gz"
        seg = fp.orient(fp.read_segmentation(path, preset="acdc"))
        for structures in (("lv",), ("lv", "myo")):
            quality = surface_quality(fp.fit_surface(seg.object(*structures), cells="quad", method="even"))
            assert quality.sound, (number, structures)
            assert quality.scaled_jacobian.min > 0.2, (number, structures)
            assert quality.quad_q.mean > 0.9, (number, structures)
