"""Meshes of wall and blood: conforming regions, a tagged interface, caps, exact volumes, every format."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from analytic_walls import cut_ellipsoid_volume

import femprep as fp
from femprep.errors import InputError, OptionError, StageError
from femprep.export import FORMATS
from femprep.mesh.elements import boundary_faces, match_facets
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.topology import edge_table, volume
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh
from femprep.model.facets import facet_triangles
from femprep.pipeline import mesh_segmentation
from femprep.volume.blood import Filling, check_cavities, find_facets

HEIGHT = 10.0


@pytest.fixture(scope="module")
def filled(coarse_wall) -> VolumeMesh:
    return fp.tetrahedralize(
        coarse_wall, blood=fp.fill_cavities(coarse_wall), edge_length=6.0, mean_ratio=0.82, retries=0
    )


def region_volume(mesh: VolumeMesh, name: str) -> float:
    own = mesh.cells["tetra"][mesh.region == REGION_TAGS[name]]
    return float(element_volumes(mesh.points, own, "tetra").sum())


@pytest.mark.slow
def test_it_has_the_regions_and_tags_and_passes_the_check(filled):
    assert set(filled.region_names) == {"lv", "blood_lv"}
    assert set(filled.facet_names) == {"endo", "epi", "base", "cap_lv"}
    report = fp.check(filled, mean_of_mean_ratio=0.8)
    assert report.passed, report.failures
    assert report.validity.interface_facets == int((filled.facet_tag == FACET_TAGS["endo"]).sum())
    assert report.facet_tags["cap_lv"].off_plane <= 1e-9


@pytest.mark.slow
def test_volumes_are_those_of_wall_and_cavity(filled, coarse_wall):
    assert region_volume(filled, "blood_lv") == pytest.approx(
        cut_ellipsoid_volume((22.0, 22.0, 42.0), HEIGHT), rel=0.03
    )
    assert region_volume(filled, "lv") == pytest.approx(coarse_wall.volume, rel=0.01)


@pytest.mark.slow
def test_the_closed_surface_of_the_cavity_has_the_volume_of_the_blood(filled):
    surface = fp.cavity_surface(filled)
    assert surface.volume == pytest.approx(region_volume(filled, "blood_lv"), rel=1e-10)
    assert surface.info["cap_triangles"] == int((filled.facet_tag == FACET_TAGS["cap_lv"]).sum())


@pytest.mark.slow
def test_every_endocardial_facet_lies_between_one_element_of_the_wall_and_one_of_blood(filled):
    endo = facet_triangles(filled, "endo")
    for name, turn in (("lv", slice(None)), ("blood_lv", slice(None, None, -1))):
        block = filled.cells["tetra"][filled.region == REGION_TAGS[name]]
        element, _ = match_facets({"tetra": block}, {"triangle": endo[:, turn]})
        assert (element >= 0).all()
        outside = boundary_faces({"tetra": block})["triangle"].nodes
        table = edge_table(outside)
        assert set(table.count) == {2}
    a, b, c = (filled.points[endo[:, i]] for i in range(3))
    assert ((np.cross(b - a, c - a) * (a * [1, 1, 0])).sum(axis=1) < 1e-9).mean() > 0.95  # wound into the cavity


@pytest.mark.slow
def test_the_check_tells_an_interface_without_tags_and_facets_inside_the_wall(filled):
    endo = filled.facet_tag == FACET_TAGS["endo"]
    bare = replace(filled, facets={"triangle": filled.facets["triangle"][~endo]}, facet_tag=filled.facet_tag[~endo])
    report = fp.check(bare)
    assert report.validity.untagged_interface_facets == int(endo.sum())
    assert any("between wall and blood without a tag" in line for line in report.failures)
    turned = filled.facets["triangle"].copy()
    turned[np.flatnonzero(endo)[:3]] = turned[np.flatnonzero(endo)[:3], ::-1]
    report = fp.check(replace(filled, facets={"triangle": turned}))
    assert report.validity.misplaced_interface_facets == 3
    assert fp.check(replace(filled, region=np.ones(filled.n_cells, dtype=int))).validity.interface_facets == endo.sum()


@pytest.mark.slow
def test_elements_through_the_wall_are_counted_in_the_wall(filled, coarse_mesh):
    through, alone = (fp.check(mesh).elements_through_wall for mesh in (filled, coarse_mesh))
    assert through.max == pytest.approx(alone.max, abs=2)


@pytest.mark.slow
def test_quadratic_elements_keep_the_interface(coarse_wall):
    mesh = fp.tetrahedralize(
        coarse_wall, blood=fp.fill_cavities(coarse_wall), edge_length=7.0, quality="fast", order=2, mean_ratio=0.7
    )
    report = fp.check(mesh)
    assert report.validity.inverted_elements == 0
    assert report.validity.untagged_interface_facets == 0
    assert report.validity.misplaced_interface_facets == 0
    assert report.facet_tags["cap_lv"].off_plane <= 1e-9


FILES = {
    "vtu": "lv.vtu",
    "abaqus": "lv.inp",
    "gmsh": "lv.msh",
    "gmsh41": "lv.msh",
    "dolfinx": "mesh.xdmf",
    "fenics": "mesh.xdmf",
    "med": "lv.med",
    "medit": "lv.mesh",
    "febio": "lv.feb",
    "opencarp": "lv.pts",
    "opencarp-binary": "lv.bpts",
    "svmultiphysics": "lv",
    "ls-dyna": "lv.k",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(FORMATS))
def test_formats_keep_regions_and_interface(filled, tmp_path, name):
    fp.write_mesh(filled, tmp_path / FILES[name], format=name)
    back = fp.read_mesh(tmp_path / FILES[name])
    assert back.region_names == filled.region_names
    assert back.facet_names == filled.facet_names
    assert np.bincount(back.region).tolist() == np.bincount(filled.region).tolist()
    assert np.bincount(back.facet_tag).tolist() == np.bincount(filled.facet_tag).tolist()
    sound = fp.check(back).validity
    assert sound.untagged_interface_facets == sound.misplaced_interface_facets == sound.stray_facets == 0


@pytest.mark.slow
def test_a_deck_with_a_step_is_refused(filled, tmp_path):
    with pytest.raises(InputError, match="this mesh has blood pools"):
        fp.write_mesh(filled, tmp_path / "mesh.inp", step="inflation")


@pytest.mark.slow
def test_fibres_go_to_the_wall(filled):
    with pytest.raises(InputError, match="the mesh has blood pools"):
        fp.add_fibres(filled)
    with pytest.raises(InputError, match="the mesh has blood pools"):
        fp.add_aha(filled)
    mesh = fp.on_wall(filled, lambda wall: fp.add_fibres(fp.add_aha(wall)))
    blood = mesh.region == REGION_TAGS["blood_lv"]
    frame = np.stack([mesh.cell_data[name] for name in ("fiber", "sheet", "normal")], axis=1)
    np.testing.assert_allclose(
        np.einsum("nij,nkj->nik", frame, frame), np.tile(np.eye(3), (len(frame), 1, 1)), atol=1e-9
    )
    assert not mesh.cell_data["aha"][blood].any()
    assert mesh.cell_data["aha"][~blood].min() >= 1
    assert not mesh.facet_data["aha"][mesh.facet_tag == FACET_TAGS["cap_lv"]].any()


def test_the_sweep_and_steps_are_refused():
    with pytest.raises(OptionError, match=r"mesher 'sweep' fills the wall alone.*--mesher tetwild"):
        mesh_segmentation(None, blood_pool=True, volume={"mesher": "sweep"})
    with pytest.raises(OptionError, match="step 'inflation' is for a wall alone"):
        mesh_segmentation(None, blood_pool=True, export={"step": "inflation"})


@pytest.mark.slow
def test_regions_that_are_not_their_bodies_are_told(filled, coarse_wall):
    filling = Filling(coarse_wall, fp.fill_cavities(coarse_wall))
    cells, region = filled.cells["tetra"], np.array(filled.region)
    check_cavities(filled.points, cells, region, filling, 0.02)
    # An element amid the blood: one at the endocardium would only move that.
    amid = ~np.isin(cells, np.unique(cells[region == REGION_TAGS["lv"]])).any(axis=1)
    region[np.flatnonzero(amid)[:1]] = REGION_TAGS["lv"]
    with pytest.raises(StageError, match="the boundary of region"):
        check_cavities(filled.points, cells, region, filling, 0.02)
    region[region == REGION_TAGS["blood_lv"]] = REGION_TAGS["lv"]
    with pytest.raises(StageError, match="region 'lv' of the mesh has"):
        check_cavities(filled.points, cells, region, filling, 0.02)


def test_blood_of_two_cavities_that_touches_is_told():
    cells = np.array([[0, 1, 2, 3], [1, 2, 3, 4], [0, 1, 2, 5]])
    region = np.array([REGION_TAGS[name] for name in ("blood_lv", "blood_rv", "lv")], dtype=np.int32)
    with pytest.raises(StageError, match="blood_lv and blood_rv touch in 1 facets"):
        find_facets(cells, region)


def test_the_outer_surface_encloses_both(coarse_wall):
    filling = Filling(coarse_wall, fp.fill_cavities(coarse_wall))
    assert sum(filling.volumes.values()) == pytest.approx(
        volume(filling.outer.points, filling.outer.triangles), rel=1e-9
    )
