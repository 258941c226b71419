"""Meshes whose names were taken away get them back; what is not told is asked for."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from anatomy_meshes import clipped_ellipsoid, ellipsoid
from biventricular import biventricular
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.annotation.given import given_facets
from femprep.annotation.shell import shell_of
from femprep.cli import main
from femprep.mesh.measures.volume_elements import all_volumes
from femprep.mesh.operations.turned import turned_cells
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh
from femprep.phantoms import lv_ellipsoid


def bare(mesh: VolumeMesh, **changes: object) -> VolumeMesh:
    """Points and elements alone."""
    return replace(VolumeMesh(mesh.points, mesh.cells, np.ones(mesh.n_cells)), **changes)  # type: ignore[arg-type]


def right(truth: VolumeMesh, found: fp.Annotation) -> float:
    """Share of the boundary's area that is named as in the mesh the names were taken from."""
    shell = shell_of(found.mesh)
    tag = given_facets(replace(truth, points=found.mesh.points), shell, {})
    return float(shell.area[tag == found.mesh.facet_tag].sum() / shell.area.sum())


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge", "hexahedron"])
def test_a_wall_cut_flat_at_both_ends_is_named_whole(kind: str) -> None:
    truth = truncated_ellipsoid(kind)
    assert right(truth, fp.annotate(bare(truth), fibres=None)) == 1.0


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron", "mixed"])
def test_a_closed_apex_is_named_whole_with_segments_and_fibres(kind: str) -> None:
    truth = ellipsoid(kind).mesh
    found = fp.annotate(bare(truth))
    assert right(truth, found) == 1.0
    assert sorted(np.unique(found.mesh.cell_data["aha"])) == list(range(1, 18))
    np.testing.assert_allclose(np.linalg.norm(found.mesh.cell_data["fiber"], axis=1), 1.0, rtol=1e-9)
    assert [attempt.way for attempt in found.attempts if attempt.taken] == ["flat pieces"]


@pytest.mark.slow
@pytest.mark.parametrize("element", ["tetra", "hexahedron"])
def test_a_coarse_swept_wall_is_named_whole_though_its_apex_is_all_but_flat(element: str) -> None:
    seg = lv_ellipsoid().segmentation(spacing=(2.0, 2.0, 8.0), apex="uncapped")
    options = {"volume": {"mesher": "sweep", "edge_length": 6.0}, "sweep": {"element": element}}
    truth = fp.mesh_segmentation(seg, surface={"vertices": 300}, **options).mesh
    found = fp.annotate(bare(truth), fibres=None)
    assert right(truth, found) == 1.0
    assert set(found.mesh.facet_names) == {"endo", "epi", "base"}


@pytest.mark.slow
def test_both_ventricles_are_told_apart_with_their_regions() -> None:
    truth = biventricular()
    found = fp.annotate(bare(truth), fibres=None)
    assert right(truth, found) == 1.0
    assert set(found.mesh.region_names) == {"lv", "rv", "septum"}
    assert found.names["endo_lv"].sure > 0.9


def test_a_base_that_is_not_flat_is_told_by_its_creases() -> None:
    truth = ellipsoid("tetra").mesh
    x, y, z = truth.points.T
    bent = np.column_stack([x, y, z + np.where(z > -30.0, 5e-3 * (x**2 - y**2) * (z + 30.0) / 45.0, 0.0)])
    found = fp.annotate(bare(truth, points=bent), fibres=None)
    assert right(truth, found) > 0.999
    assert any(attempt.taken and attempt.way.startswith("creases") for attempt in found.attempts)


@pytest.mark.parametrize(("factor", "unit"), [(1.0, "mm"), (1e-3, "m"), (1e3, "um")])
def test_the_unit_is_guessed_from_the_size_and_said(factor: float, unit: str) -> None:
    truth = ellipsoid("wedge").mesh
    found = fp.annotate(bare(truth, points=truth.points * factor), fibres=None)
    assert found.unit == unit
    np.testing.assert_allclose(found.mesh.points, truth.points, atol=1e-9)
    assert any(f"taken to be in {unit}" in notice["what"] for notice in found.mesh.info["notices"])


def test_a_size_that_fits_two_units_is_asked_about_and_the_unit_answers() -> None:
    truth = ellipsoid("wedge").mesh
    small = bare(truth, points=truth.points * 0.1)
    with pytest.raises(fp.InputError, match=r"--unit mm \(.* or --unit cm \("):
        fp.annotate(small)
    np.testing.assert_allclose(fp.annotate(small, fibres=None, unit="cm").mesh.points, truth.points, atol=1e-9)


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_elements_listed_the_other_way_round_are_turned(kind: str) -> None:
    truth = ellipsoid(kind).mesh
    cells = {name: turned_cells(name, block) for name, block in truth.cells.items()}
    found = fp.annotate(VolumeMesh(truth.points, cells, np.ones(truth.n_cells)), fibres=None)
    assert found.quality.validity.inverted_elements == 0
    assert right(truth, found) == 1.0


def test_two_ends_of_the_same_size_are_asked_about_and_one_line_answers() -> None:
    truth = clipped_ellipsoid(base=30.0, apex=-30.0).mesh
    with pytest.raises(fp.InputError, match=r"at = \{ base = \["):
        fp.annotate(bare(truth))
    found = fp.annotate(bare(truth), at={"base": (0.0, 0.0, 30.0)}, fibres=None)
    assert right(truth, found) == 1.0
    turned = fp.annotate(bare(truth), at={"base": (0.0, 0.0, -30.0)}, fibres=None)
    shell = shell_of(turned.mesh)
    assert np.all(shell.centre[turned.mesh.facet_tag == FACET_TAGS["base"], 2] < -29.9)


def test_two_equal_cavities_are_asked_about() -> None:
    truth = twin()
    with pytest.raises(fp.InputError, match=r"endo_lv = \["):
        fp.annotate(truth)
    found = fp.annotate(truth, at={"endo_lv": (-20.0, 0.0, 0.0)}, fibres=None)
    shell = shell_of(found.mesh)
    assert np.all(shell.centre[found.mesh.facet_tag == FACET_TAGS["endo_lv"], 0] < 0)
    assert np.all(shell.centre[found.mesh.facet_tag == FACET_TAGS["endo_rv"], 0] > 0)


def test_a_place_nowhere_near_is_refused() -> None:
    with pytest.raises(fp.OptionError, match=r"--at epi lies at 1e\+300, 0, 0 mm, nowhere near"):
        fp.annotate(twin(), at={"epi": (1e300, 0.0, 0.0)}, fibres=None)


def twin() -> VolumeMesh:
    """A block with two equal closed cavities, of hexahedra."""
    count = np.array([20, 10, 10])
    number = np.arange(np.prod(count + 1)).reshape(count + 1)
    index = np.stack(np.meshgrid(*[np.arange(n) for n in count], indexing="ij"), axis=-1).reshape(-1, 3)
    middle = (index + 0.5 - count / 2) * 4.0
    hollow = np.abs(np.abs(middle) - [20.0, 0.0, 0.0]).max(axis=1) < 9.0
    low = index[~hollow]
    steps = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.column_stack([number[tuple((low + step).T)] for step in steps])
    points = np.stack(np.meshgrid(*[np.arange(n + 1) for n in count], indexing="ij"), axis=-1).reshape(-1, 3)
    used, cells = np.unique(cells, return_inverse=True)
    cells = cells.reshape(-1, 8)
    return VolumeMesh((points[used] - count / 2) * 4.0, {"hexahedron": cells}, np.ones(len(cells)))


def test_a_base_plane_is_given_where_the_mesh_shows_none() -> None:
    truth = ellipsoid("tetra").mesh
    found = fp.annotate(bare(truth), base=(0.0, 0.0, 15.0, 0.0, 0.0, 1.0), fibres=None)
    assert right(truth, found) == 1.0
    assert found.attempts[0].way == "base plane"


def test_names_of_the_file_and_names_given_for_it_go_before_geometry(tmp_path: Path) -> None:
    truth = ellipsoid("tetra").mesh
    tag = np.select([truth.facet_tag == FACET_TAGS[name] for name in ("endo", "epi", "base")], [7, 8, 9])
    theirs = meshio.Mesh(
        truth.points,
        [("tetra", truth.cells["tetra"]), ("triangle", truth.facets["triangle"])],
        cell_data={"material": [np.full(truth.n_cells, 3), tag]},
    )
    theirs.write(tmp_path / "theirs.vtu")
    read = fp.read_mesh(tmp_path / "theirs.vtu")
    found = fp.annotate(read, names={"7": "endo", "8": "epi", "9": "base", "3": "lv"}, fibres=None)
    assert right(truth, found) == 1.0
    assert found.attempts[0].way == "names"
    swapped = fp.annotate(read, names={"7": "epi"}, fibres=None)
    assert np.all(swapped.mesh.facet_tag[truth.facet_tag == FACET_TAGS["endo"]] == FACET_TAGS["epi"])


def test_names_given_in_the_place_of_those_of_the_file_are_told() -> None:
    mesh = ellipsoid("tetra").mesh
    found = fp.annotate(mesh, names={"endo": "epi", "102": "endo"}, fibres=None).mesh
    assert np.all(found.facet_tag[mesh.facet_tag == FACET_TAGS["endo"]] == FACET_TAGS["epi"])
    assert any(
        notice["what"].endswith("not the file's own: endo is epi, epi is endo") for notice in found.info["notices"]
    )
    same = fp.annotate(mesh, names={"endo": "endo"}, fibres=None).mesh
    assert not any("names given" in notice["what"] for notice in same.info.get("notices", ()))


def test_names_of_nothing_in_the_file_are_refused() -> None:
    with pytest.raises(fp.OptionError, match=r"no facets or regions 'nothere'; its names are endo, epi, base, lv$"):
        fp.annotate(ellipsoid("tetra").mesh, names={"nothere": "epi"})


def test_a_unit_that_makes_no_heart_is_refused() -> None:
    with pytest.raises(fp.InputError, match=r"the mesh measures .* in the unit 'm' given, which is no heart's size"):
        fp.annotate(ellipsoid("tetra").mesh, unit="m")


def test_directions_of_the_file_stay_beside_ours() -> None:
    mesh = ellipsoid("tetra").mesh
    theirs = {name: np.tile(axis, (mesh.n_cells, 1)) for name, axis in zip(("fiber", "sheet", "normal"), np.eye(3))}
    found = fp.annotate(mesh.with_data(cell=theirs)).mesh.cell_data
    for name, values in theirs.items():
        np.testing.assert_array_equal(found[f"file_{name}"], values)
        assert not np.array_equal(found[name], values)


def test_regions_of_the_file_are_named_by_where_they_lie() -> None:
    truth = biventricular()
    named = fp.annotate(bare(truth), fibres=None).mesh
    number = {REGION_TAGS["lv"]: 40, REGION_TAGS["rv"]: 77, REGION_TAGS["septum"]: 12}
    theirs = np.vectorize(number.get)(named.region)
    found = fp.annotate(bare(truth, region=theirs), fibres=None)
    np.testing.assert_array_equal(found.mesh.region, named.region)


def test_a_bit_that_hangs_on_nothing_is_named_as_what_is_nearest() -> None:
    truth = biventricular()
    loose = truth.points.max(axis=0) + np.array([[2.0, 0, 0], [6.0, 0, 0], [2.0, 4.0, 0], [2.0, 0, 4.0]])
    last = len(truth.points) + np.arange(4)[None]
    cells = {"tetra": np.concatenate([truth.cells["tetra"], last])}
    points = np.concatenate([truth.points, loose])
    found = fp.annotate(VolumeMesh(points, cells, np.ones(truth.n_cells + 1)), fibres=None)
    assert set(found.mesh.facet_names) == {"endo_lv", "endo_rv", "epi", "base"}
    assert any(notice["what"].startswith("4 facets that border on nothing") for notice in found.mesh.info["notices"])


def test_a_solid_block_is_refused_with_every_way_that_was_tried() -> None:
    from anatomy_meshes import slab

    with pytest.raises(fp.InputError, match="flat pieces"):
        fp.annotate(bare(slab("hexahedron", size=(40.0, 40.0, 60.0)).mesh))


def test_the_command_writes_the_folder_with_every_attempt(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = ellipsoid("hexahedron").mesh
    meshio.Mesh(truth.points / 10.0, [("hexahedron", truth.cells["hexahedron"])]).write(tmp_path / "paper.vtk")
    out = tmp_path / "named"
    status = main(["annotate", str(tmp_path / "paper.vtk"), "-o", str(out), "--format", "abaqus", "--unit", "cm"])
    assert status == 0, capsys.readouterr().err
    record = json.loads((out / "run.json").read_text())
    assert {one["name"]: one["sure"] for one in record["facets"]} == {"endo": 1.0, "epi": 1.0, "base": 1.0}
    assert [one["name"] for one in record["regions"]] == ["lv"]
    assert record["regions"][0]["amount"] == pytest.approx(all_volumes(truth.points, truth.cells).sum(), abs=0.01)
    assert [one["way"] for one in record["attempts"]] == ["closed sheets", "atrium", "flat pieces"]
    assert record["source_unit"] == "cm"
    assert "*SURFACE" in (out / "mesh.inp").read_text().upper()
    assert "flat piece" in (out / "report.html").read_text()
    again = fp.read_mesh(out / "mesh.vtu")
    assert "fiber" in again.cell_data
    assert set(again.facet_names) == {"endo", "epi", "base"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--base", "1,2,3"], "--base"),
        (["--at", "endo=1,2"], "--at"),
        (["--at", "heart=1,2,3"], "heart"),
        (["--name", "4"], "--name"),
        (["--name", "4=heart"], "heart"),
    ],
)
def test_wrong_options_are_told_in_one_line(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth = ellipsoid("hexahedron").mesh
    meshio.Mesh(truth.points, [("hexahedron", truth.cells["hexahedron"])]).write(tmp_path / "paper.vtk")
    assert main(["annotate", str(tmp_path / "paper.vtk"), "-o", str(tmp_path / "out"), *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.strip().count("\n") == 0
    assert not (tmp_path / "out").exists()


def test_a_mesh_in_a_plane_is_refused() -> None:
    mesh = truncated_ellipsoid("tetra", heights=3, around=8, layers=1)
    with pytest.raises(fp.InputError, match="all points of the mesh lie in a plane"):
        fp.annotate(bare(replace(mesh, points=mesh.points * [1.0, 1.0, 0.0])))


def test_elements_without_volume_are_named_and_fail_the_check() -> None:
    """A piece of two facets on a line has no hull: another way reads the boundary."""
    mesh = truncated_ellipsoid("tetra", heights=3, around=8, layers=1)
    cells = np.array(mesh.cells["tetra"])
    cells[:5, 3] = cells[:5, 2]
    found = fp.annotate(bare(replace(mesh, cells={"tetra": cells})))
    assert not found.quality.passed


def test_a_cavity_whose_rims_are_no_rings_is_left_out_and_told(tmp_path: Path) -> None:
    """Every second element: the facets that look inward hang together by nodes alone."""
    mesh = truncated_ellipsoid("tetra", heights=3, around=8, layers=1)
    found = fp.annotate(bare(VolumeMesh(mesh.points, {"tetra": mesh.cells["tetra"][::2]}, np.ones(mesh.n_cells // 2))))
    manifest = fp.write_annotation(found, tmp_path / "out")
    assert any("cavity lv is left out" in line and "touches itself" in line for line in manifest.notices)
