"""Both ventricles and the whole heart, the whole way: phantoms with closed-form volumes, and real hearts (slow)."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

import femprep as fp
from femprep.anatomy.part import part_of
from femprep.annotation.given import given_facets
from femprep.annotation.shell import shell_of
from femprep.cli import main
from femprep.errors import OptionError
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import is_manifold
from femprep.model import FACET_TAGS, is_blood
from femprep.model.facets import facet_triangles
from femprep.model.stages import Stages
from femprep.options import Options
from femprep.phantoms import biventricular, four_chambers
from femprep.report.volumes import cavity_volume
from femprep.wall.anatomies import ANATOMIES, lay_out

pytestmark = pytest.mark.slow

CHAMBERS = ("lv", "rv", "la", "ra")
COARSE = {"surface": {"vertices": 900}, "volume": {"edge_length": 4.0}}


def regions(mesh: fp.VolumeMesh) -> dict[str, float]:
    """Volume of each region, mm3."""
    volume = element_volumes(mesh.points, mesh.cells["tetra"], "tetra")
    assert volume.min() > 0.0
    return {name: float(volume[mesh.region == tag].sum()) for name, tag in mesh.region_names.items()}


@pytest.fixture(scope="module")
def ventricles():
    phantom = biventricular()
    seg = phantom.segmentation(spacing=(1.4, 1.4, 8.0))
    return phantom, fp.mesh_segmentation(seg, anatomy="biv", **COARSE)


def test_ventricles_have_every_tag_and_region(ventricles):
    _, run = ventricles
    assert set(run.mesh.facet_names) == {"endo_lv", "endo_rv", "epi", "base"}
    assert set(run.mesh.region_names) == {"lv", "rv", "septum"}
    assert run.quality.passed, run.quality.failures
    assert set(run.surfaces) == {"lv", "rv", "epi", "lv_epi"}


def test_volumes_of_ventricles_are_those_of_the_phantom(ventricles):
    phantom, run = ventricles
    height = float(phantom.height(run.wall.planes["base"].point[None])[0])
    for name in ("lv", "rv"):
        assert cavity_volume(run.mesh, f"endo_{name}") == pytest.approx(phantom.volume(name, high=height), rel=0.04)
    found = regions(run.mesh)
    left = phantom.volume("epi", high=height) - phantom.volume("lv", high=height)
    assert found["lv"] + found["septum"] == pytest.approx(left, rel=0.06)
    assert 0.15 < found["septum"] / left < 0.5


def test_the_free_wall_is_as_thick_as_asked(ventricles):
    _, run = ventricles
    triangles = facet_triangles(run.mesh, "endo_rv")
    epi = np.unique(facet_triangles(run.mesh, "epi"))
    away = ClosestFinder(run.mesh.points, triangles)(run.mesh.points[epi]).distance
    # At its sharp edges chords of both surfaces come nearer; never below minimum_thickness.
    least = run.options.wall.minimum_thickness
    assert run.wall.info["thickness"]["minimum_mm"] >= least
    assert away.min() >= least
    assert np.percentile(away[away < 6.0], 50) == pytest.approx(3.0, abs=0.3)


def test_base_points_of_ventricles_lie_in_one_plane(ventricles):
    _, run = ventricles
    base = np.unique(facet_triangles(run.mesh, "base"))
    assert np.abs(run.mesh.planes["base"].signed_distance(run.mesh.points[base])).max() <= 1e-9


def test_ventricles_and_their_blood_by_the_command_line_with_fibres(tmp_path):
    image = tmp_path / "heart.nii.gz"
    fp.write_segmentation(biventricular().segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped"), image)
    out = tmp_path / "out"
    arguments = ["mesh", str(image), "-o", str(out), "--preset", "acdc", "--anatomy", "biv"]
    # Beside the right ventricle's rim the assumed wall leaves the labels by 1.92 pixels; by 2.0 with edges of 4 mm.
    more = ["--edge-length", "3.4", "--vertices", "900", "--rv-wall-thickness", "4", "--fibres", "--apex", "clipped"]
    assert main([*arguments, *more, "--blood-pool", "--quiet"]) == 0
    record = json.loads((out / "run.json").read_text())
    assert [item["name"] for item in record["volumes"]] == ["lv cavity", "rv cavity", "lv wall and septum", "rv wall"]
    mesh = fp.read_mesh(out / "mesh.vtu")
    assert set(mesh.facet_names) == {"endo_lv", "endo_rv", "epi", "base", "apex", "cap_lv", "cap_rv"}
    assert set(mesh.region_names) == {"lv", "rv", "septum", "blood_lv", "blood_rv"}
    found = regions(mesh)
    for name in ("lv", "rv"):
        cavity = fp.read_surface(out / "cavities" / f"{name}.vtp")
        assert found[f"blood_{name}"] == pytest.approx(cavity.volume, rel=1e-9)
    assert record["volumes"][2]["mesh_ml"] == pytest.approx((found["lv"] + found["septum"]) / 1000.0)
    assert any("a wall of 4.0 mm was assumed" in line for line in record["notices"])
    words = (out / "methods.md").read_text()
    assert "cavity of the right ventricle grown by 4 mm" in words
    assert "at the apex in the plane" in words
    assert main(["check", str(out / "mesh.vtu"), "--quiet"]) == 0
    np.testing.assert_allclose(np.linalg.norm(mesh.cell_data["fiber"], axis=1), 1.0, atol=1e-6)


def test_the_sweep_refuses_several_cavities():
    with pytest.raises(OptionError, match="mesher 'sweep' fills the wall of anatomy lv"):
        fp.mesh_segmentation(biventricular().segmentation(), anatomy="biv", volume={"mesher": "sweep"})


@pytest.mark.parametrize(
    ("spacing", "blood"), [((2.0, 2.0, 2.0), True), ((1.4, 1.4, 8.0), False)], ids=["2 mm, with its blood", "stack"]
)
def test_a_whole_heart_has_its_chambers(spacing, blood):
    phantom = four_chambers()
    seg = phantom.segmentation(spacing=spacing)
    wall = {"minimum_thickness": 1.5}
    run = fp.mesh_segmentation(seg, anatomy="whole-heart", wall=wall, blood_pool=blood, **COARSE)
    assert set(run.mesh.facet_names) == {"endo_lv", "endo_rv", "endo_la", "endo_ra", "epi"}
    found = regions(run.mesh)
    assert set(found) == {"lv", "rv", "septum", "la", "ra", *(f"blood_{name}" for name in CHAMBERS if blood)}
    assert run.quality.passed, run.quality.failures
    for name in CHAMBERS:
        volume = cavity_volume(run.mesh, f"endo_{name}")
        assert volume == pytest.approx(phantom.volume(name), rel=0.05)
        if blood:
            assert found[f"blood_{name}"] == pytest.approx(volume, rel=1e-9)
    assert found["lv"] + found["septum"] == pytest.approx(phantom.volume("epi") - phantom.volume("lv"), rel=0.08)
    assert run.wall.info["thickness"]["minimum_mm"] > 1.0
    if blood:
        assert named_right(part_of(run.mesh, ~is_blood(run.mesh.region))[0]) == 1.0


def named_right(mesh: fp.VolumeMesh) -> float:
    """Share of the boundary that is named again as it was, every name taken away."""
    found = fp.annotate(fp.VolumeMesh(mesh.points, mesh.cells, np.ones(mesh.n_cells)), fibres=None).mesh
    shell = shell_of(found)
    return float(shell.area[given_facets(mesh, shell, {}) == found.facet_tag].sum() / shell.area.sum())


def test_blood_wants_closed_cavities():
    seg = four_chambers().segmentation(spacing=(4.0, 4.0, 4.0))
    with pytest.raises(OptionError, match="blood_pool needs closed cavities"):
        fp.mesh_segmentation(seg, anatomy="whole-heart", blood_pool=True, wall={"openings": "labels"})


@pytest.mark.parametrize("name", ["patient041_frame01", "patient021_frame13"])
def test_ventricles_of_real_hearts(name):
    if "FEMPREP_DATA" not in os.environ:
        pytest.skip("FEMPREP_DATA is unset: no real segmentations")
    path = Path(os.environ["FEMPREP_DATA"]) / "acdc" / "training" / name.split("_")[0] / f"{name}_gt.nii.gz"
    seg = fp.read_segmentation(path, preset="acdc")
    run = fp.mesh_segmentation(seg, anatomy="biv", preset="acdc", blood_pool=True, **COARSE)
    # The right ventricle's labels end a slice below the left one's base.
    assert set(run.mesh.facet_names) == {"endo_lv", "endo_rv", "epi", "base", "base_rv", "cap_lv", "cap_rv"}
    assert all(abs(item.difference_percent) < 3.0 for item in run.volumes if "cavity" in item.name)
    found = regions(run.mesh)
    assert set(found) == {"lv", "rv", "septum", "blood_lv", "blood_rv"}
    for name in ("lv", "rv"):
        assert found[f"blood_{name}"] == pytest.approx(cavity_volume(run.mesh, f"endo_{name}"), rel=1e-9)
        assert found[f"blood_{name}"] == pytest.approx(fp.cavity_surface(run.mesh, name).volume, rel=1e-9)
    assert run.quality.validity.untagged_interface_facets == 0
    assert run.quality.validity.misplaced_interface_facets == 0
    assert run.quality.measures["minimum_dihedral"].min >= 10.0


def test_a_rim_keeps_its_vertices_alone():
    # In this heart an edge of a flat cap of the epicardium would cross the left ventricle's rim and put a vertex on it.
    if "FEMPREP_DATA" not in os.environ:
        pytest.skip("FEMPREP_DATA is unset: no real segmentations")
    path = Path(os.environ["FEMPREP_DATA"]) / "acdc" / "training" / "patient051" / "patient051_frame01_gt.nii.gz"
    seg = fp.orient(fp.read_segmentation(path, preset="acdc"))
    options = Options(anatomy="biv", surface={"vertices": 1500})
    parts = ANATOMIES["biv"](seg, lay_out(seg, options, Stages(None)), options, Stages(None))
    wall = fp.build_wall(epi=parts.epi, endo=parts.endo, base=parts.base)
    assert is_manifold(wall.triangles)
    assert triangle_quality(wall.points, wall.triangles).min() >= 0.2
    assert set(wall.facet_tag) == {FACET_TAGS[name] for name in ("endo_lv", "endo_rv", "epi", "base")}
