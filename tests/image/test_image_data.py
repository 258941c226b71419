"""Real segmentations: ACDC against its table, oblique affines against known surfaces and ITK."""

from __future__ import annotations

import csv
import logging

import numpy as np
import pytest

from femprep.errors import InputError
from femprep.image import boundary_points, isotropic, read_segmentation, topology

pytestmark = pytest.mark.data

STRUCTURES = {"LV": ("lv",), "MYO": ("myo",), "RV": ("rv",), "EPI": ("lv", "myo")}
RODERO = {"lv": 1, "myo": 2, "rv": 3, "la": 5, "ra": 7}


def rows(data):
    with open(data / "acdc" / "cases.csv", newline="") as file:
        table = list(csv.DictReader(file))
    return [row for row in table if (data / "acdc" / row["file"]).exists()]


@pytest.mark.parametrize("step", [10, pytest.param(1, marks=pytest.mark.slow)], ids=["every tenth", "all"])
def test_acdc_agrees_with_its_table(data, step):
    """Voxel sizes, volumes, pieces and tunnels of all structures, slice zig-zag."""
    table = rows(data)
    assert len(table) == 200
    for row in table[::step]:
        seg = read_segmentation(data / "acdc" / row["file"], preset="acdc")
        np.testing.assert_allclose(seg.grid.spacing, [float(row[k]) for k in ("sx", "sy", "sz")], atol=6e-4)
        assert seg.info["spacing_source"] == "pixdim", row["id"]
        assert len(seg.info["notices"]) == 1
        assert len(seg.slices("lv", "myo", "rv")) == int(row["seg_slices"]), row["id"]
        assert seg.slices("lv", "myo").zigzag.max() == pytest.approx(float(row["zigzag_max_mm"]), abs=0.0501)
        for name, parts in STRUCTURES.items():
            mask = seg.mask(*parts)
            if name != "EPI":
                volume = np.count_nonzero(mask) * seg.grid.voxel_volume / 1e3
                assert volume == pytest.approx(float(row[f"{name}_mL"]), abs=0.0501), row["id"]
            found = topology(mask)
            expected = int(row[f"{name}_c26"]), int(row[f"{name}_tun"])
            assert (found.pieces, found.tunnels) == expected, (row["id"], name)


@pytest.mark.slow
def test_every_acdc_map_gives_both_objects(data, caplog):
    caplog.set_level(logging.ERROR)
    for row in rows(data):
        seg = read_segmentation(data / "acdc" / row["file"], preset="acdc")
        for parts in (("lv",), ("lv", "myo")):
            obj = seg.object(*parts)
            found = topology(obj.mask)
            assert (found.pieces, found.voids) == (1, 0), row["id"]
            assert found.tunnels == obj.report["tunnels"]
            assert len(boundary_points(obj)) > 300


def test_strict_refuses_the_awkward_ones(data):
    folder = data / "acdc" / "training"
    twelve = read_segmentation(folder / "patient012" / "patient012_frame13_gt.nii.gz", preset="acdc")
    with pytest.raises(InputError, match="13 tunnels"):
        twelve.object("rv", policy="strict")
    # Three of them lie beside tips one pixel wide, which are left out.
    assert twelve.object("rv").report["tunnels"] == 10
    clean = read_segmentation(folder / "patient007" / "patient007_frame01_gt.nii.gz", preset="acdc")
    assert clean.object("lv", policy="strict").report["removed_voxels"] == 0


@pytest.mark.parametrize(
    "name",
    [
        "pig/ep_pig_E774_SAX_ED_phase00_slices6-19_label.nii.gz",
        "pig/ep_pig_E774_SAX_ES_phase11_slices6-19_label.nii.gz",
        "rodero01/rodero01_sax_vent_1.5x1.5x10_label.nii.gz",
        "rodero01/rodero01_sax_4ch_1.4x1.4x8_label.nii.gz",
        "rodero01/rodero01_4ch_1.0mm_label.nii.gz",
    ],
)
def test_voxels_lie_where_itk_puts_them(data, name):
    sitk = pytest.importorskip("SimpleITK")
    seg = read_segmentation(data / name, {"lv": 1})
    truth = sitk.ReadImage(str(data / name))
    for index in ((0, 0, 0), tuple(n - 1 for n in seg.grid.shape), (3, 50, 7)):
        np.testing.assert_allclose(
            seg.grid.to_world([index])[0], truth.TransformIndexToPhysicalPoint(index), rtol=0, atol=1e-9
        )
    assert seg.info["spacing_source"] == "header"
    assert seg.info["notices"] == []


@pytest.mark.parametrize("chamber", ["lv", "rv", "la", "ra"])
def test_oblique_stack_and_upright_map_lie_on_the_true_surface(data, chamber):
    """Boundary points of the 1 mm map and of the oblique short-axis stack, against the surface both were made from."""
    pyvista = pytest.importorskip("pyvista")
    truth = pyvista.read(data / "rodero01" / f"true_{chamber}_cavity_ras.vtp")
    truth.points = np.asarray(truth.points) * [-1.0, -1.0, 1.0]
    for name, mean in (("4ch_1.0mm", 0.4), ("sax_4ch_1.4x1.4x8", 1.2)):
        obj = read_segmentation(data / "rodero01" / f"rodero01_{name}_label.nii.gz", RODERO).object(chamber)
        points = pyvista.PolyData(np.array(boundary_points(obj).points))
        distance = points.compute_implicit_distance(truth)["implicit_distance"]
        assert np.abs(distance).mean() < mean
        assert abs(distance.mean()) < 0.15
        assert obj.volume == pytest.approx(truth.volume, rel=0.01)


def test_resampled_stack_stays_with_the_upright_map(data):
    """The stack's voxels and isotropic ones made of them, both looked up at the voxels of the 1 mm map: Dice."""
    fine = read_segmentation(data / "rodero01" / "rodero01_4ch_1.0mm_label.nii.gz", RODERO)
    stack = read_segmentation(data / "rodero01" / "rodero01_sax_4ch_1.4x1.4x8_label.nii.gz", RODERO).object("lv")
    upright = fine.object("lv")
    truth = upright.mask
    points = upright.grid.to_world(np.argwhere(np.ones(truth.shape, dtype=bool)))
    dice = []
    for obj in (stack, isotropic(stack, 1.0)):
        index = np.rint(obj.grid.to_index(points)).astype(int)
        within = np.all((index >= 0) & (index < obj.mask.shape), axis=1)
        found = within.copy()
        found[within] = obj.mask[tuple(index[within].T)]
        dice.append(2.0 * np.count_nonzero(found & truth.ravel()) / (found.sum() + truth.sum()))
    assert dice[1] > 0.96
    assert dice[1] > dice[0]


def test_messy_pig_stack_is_repaired_with_a_report(data):
    seg = read_segmentation(data / "pig" / "ep_pig_E774_SAX_ED_phase00_all20_messy_label.nii.gz", {"lv": 1, "myo": 2})
    for parts in (("lv",), ("lv", "myo")):
        obj = seg.object(*parts)
        found = topology(obj.mask)
        assert (found.pieces, found.voids) == (1, 0)
        assert obj.voxels == obj.report["voxels"]
        assert obj.report["voxels"] == (
            obj.report["voxels_labelled"] - obj.report["removed_voxels"] + obj.report["filled_voxels"]
        )
