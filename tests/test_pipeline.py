"""The whole way on a phantom with voxels of 1.4 x 1.4 x 8 mm, and on real hearts: what the folder holds is checked."""

from __future__ import annotations

import json
import re
from pathlib import Path

import jsonschema
import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

import femprep as fp
from femprep.cli import main
from femprep.cli._names import mesh_names
from femprep.cli.schema import schema_texts
from femprep.mesh.elements import boundary_faces
from femprep.phantoms import lv_ellipsoid
from femprep.report.volumes import cavity_volume

SCHEMAS = Path(__file__).parent.parent / "schemas"
FORMATS = ("abaqus", "dolfinx", "gmsh")


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("heart") / "heart.nii.gz"
    fp.write_segmentation(lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped"), path)
    return path


@pytest.fixture(scope="module")
def folder(image: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the command line makes of the phantom."""
    out = tmp_path_factory.mktemp("run") / "out"
    formats = [word for name in FORMATS for word in ("--format", name)]
    arguments = ["mesh", str(image), "-o", str(out), "--preset", "acdc", "--edge-length", "6", "--vertices", "500"]
    assert main([*arguments, "--quiet", *formats]) == 0
    return out


def test_folder_is_what_the_manifest_lists(folder: Path) -> None:
    manifest = json.loads((folder / "run.json").read_text())
    files = sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    assert files == manifest["files"]
    assert {"mesh.vtu", "facets.vtp", "wall.vtp", "surfaces/lv.vtp", "surfaces/epi.vtp", "report.html"} <= set(files)
    assert {"mesh.inp", "mesh.msh", "dolfinx/mesh.xdmf"} <= set(files)
    assert set(mesh_names(FORMATS)) <= set(files)
    assert set(manifest["sha256"]) == set(files) - {"run.json"}
    assert [path.name for path in folder.parent.iterdir()] == ["out"]


@pytest.mark.parametrize("name", ["run.json", "quality.json"])
def test_records_follow_their_schemas(folder: Path, name: str) -> None:
    schema = json.loads((SCHEMAS / name).read_text())
    kind = jsonschema.validators.validator_for(schema)
    kind.check_schema(schema)
    assert list(kind(schema).iter_errors(json.loads((folder / name).read_text()))) == []


def test_schemas_are_those_of_the_code() -> None:
    for name, text in schema_texts().items():
        assert (SCHEMAS / name).read_text() == text, f"run `femprep schema schemas`: {name} is out of date"


def test_record_says_units_input_options_and_stages(folder: Path, image: Path) -> None:
    manifest = json.loads((folder / "run.json").read_text())
    assert (manifest["length_unit"], manifest["coordinates"]) == ("mm", "LPS")
    assert manifest["input"]["path"] == image.name
    assert len(manifest["input"]["sha256"]) == 64
    assert manifest["options"]["volume"]["edge_length"] == 6.0
    assert manifest["deterministic"] is False
    assert [stage["name"] for stage in manifest["stages"]][-2:] == ["quality", "write"]
    (line,) = [line for line in manifest["notices"] if "extrapolated" in line]
    assert f"{manifest['details']['wall']['apex']['extrapolated_mm']:.1f} mm beyond the cavity" in line
    assert "near (" in line


def test_a_folder_holds_the_words_for_a_paper_and_their_references(folder: Path) -> None:
    words, references = (folder / "methods.md").read_text(), (folder / "methods.bib").read_text()
    assert {"methods.md", "methods.bib"} <= set(json.loads((folder / "run.json").read_text())["files"])
    assert "500 vertices each" in words
    assert "tetrahedra of 6 mm by fTetWild [@hu2020]" in words
    assert "@article{hu2020," in references
    assert "doi 10.1145/3386569.3392385" in (folder / "report.html").read_text()


def test_the_walls_volume_is_judged_beside_that_of_the_labels(folder: Path) -> None:
    quality, manifest = (json.loads((folder / name).read_text()) for name in ("quality.json", "run.json"))
    (verdict,) = [limit for limit in quality["limits"] if limit["name"] == "wall_volume_difference"]
    wall = manifest["volumes"][1]
    inside = wall["mesh_ml"] - wall["extrapolated_ml"]
    assert verdict["value"] == pytest.approx(abs(100.0 * (inside / wall["segmentation_ml"] - 1.0)))
    assert wall["extrapolated_ml"] > 1.0
    assert verdict["passed"]


def test_mesh_is_sound(folder: Path) -> None:
    mesh = fp.read_mesh(folder / "mesh.vtu")
    facets = meshio_facets(folder / "facets.vtp")
    boundary = boundary_faces(mesh.cells)["triangle"]
    assert len(facets) == len(boundary.nodes)
    assert {tuple(sorted(row)) for row in facets.tolist()} == {tuple(sorted(row)) for row in boundary.nodes.tolist()}
    report = fp.check(fp.read_mesh(folder / "mesh.msh"))
    assert report.passed, report.failures
    assert report.validity.inverted_elements == 0
    assert report.validity.untagged_boundary_facets == 0
    assert set(report.facet_tags) == {"endo", "epi", "base"}
    assert report.measures["minimum_dihedral"].min >= 10.0
    assert report.measures["mean_ratio"].mean >= 0.82


def test_every_file_of_the_run_is_judged_as_the_run(folder: Path) -> None:
    judged = json.loads((folder / "quality.json").read_text())
    for file in ("mesh.vtu", "mesh.inp", "mesh.msh", "dolfinx/mesh.xdmf"):
        report = fp.check(fp.read_mesh(folder / file))
        assert report.options.model_dump(mode="json") == judged["options"], file
        assert list(report.failures) == judged["failures"], file
        assert "the mesh's own" in report.limits_from, file


def meshio_facets(path: Path) -> np.ndarray:
    """Facets in the numbers of the volume mesh (the file counts from 1), read by VTK."""
    import pyvista as pv

    facets = pv.read(path)
    return np.asarray(facets.point_data["GlobalNodeID"] - 1)[facets.faces.reshape(-1, 4)[:, 1:]]


def test_volumes_are_those_of_the_phantom(folder: Path) -> None:
    manifest = json.loads((folder / "run.json").read_text())
    cavity, _ = manifest["volumes"]
    assert abs(cavity["difference_percent"]) < 3.0
    mesh = fp.read_mesh(folder / "mesh.msh")
    assert_allclose(cavity_volume(mesh) / 1000.0, cavity["mesh_ml"], rtol=1e-9)


def test_base_is_flat(folder: Path) -> None:
    mesh = fp.read_mesh(folder / "mesh.msh")
    plane = json.loads((folder / "run.json").read_text())["details"]["wall"]["planes"]["base"]
    triangles = mesh.facets["triangle"][mesh.facet_tag == fp.FACET_TAGS["base"]]
    height = (mesh.points[np.unique(triangles)] - plane["point_mm"]) @ np.array(plane["normal"])
    assert np.abs(height).max() < 1e-9


def test_deck_of_abaqus_holds_every_tag(folder: Path) -> None:
    text = (folder / "mesh.inp").read_text()
    for name in ("endo", "epi", "base"):
        assert f"*SURFACE, NAME={name.upper()}" in text.upper()
        assert f"*NSET, NSET={name.upper()}" in text.upper()
    assert len(meshio.read(folder / "mesh.msh").cells_dict["tetra"]) == fp.read_mesh(folder / "mesh.inp").n_cells


def test_page_shows_slices_and_needs_no_network(folder: Path) -> None:
    page = (folder / "report.html").read_text()
    assert page.count("<svg") >= 8
    loads = r"""(?:src|href)\s*=\s*["']?\s*(?:https?:)?//|url\(\s*["']?\s*(?:https?:)?//|@import"""
    assert not re.search(loads, page)
    assert "Every check passed" in page


def test_the_same_from_python(image: Path, folder: Path) -> None:
    seg = fp.read_segmentation(image, preset="acdc")
    run = fp.fit_surfaces(seg, {"lv": ("lv",)}, fp.Options(surface={"vertices": 500}))
    other = fp.read_surface(folder / "surfaces" / "lv.vtp")
    assert_allclose(run.surfaces["lv"].points, other.points, atol=1e-12)


def test_surface_command(image: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ["surface", str(image), "-o", str(out), "--structure", "lv=3", "--vertices", "300", "--quiet"]
    assert main(arguments) == 0
    surface = fp.read_surface(out / "surfaces" / "lv.vtp")
    assert (len(surface.points), len(surface.cells)) == (300, 596)
    exact = lv_ellipsoid()
    assert json.loads((out / "run.json").read_text())["deterministic"] is True
    assert surface.volume < 1.2 * exact.volume("lv")


def test_json_is_one_record(image: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    arguments = ["surface", str(image), "-o", str(out), "--structure", "lv=3", "--vertices", "1000", "--json"]
    assert main(arguments) == 0
    assert json.loads(capsys.readouterr().out)["input"]["structures"] == {"lv": [3]}


@pytest.mark.slow
def test_a_left_ventricle_that_the_mesher_cannot_fill_is_swept(
    image: Path, tmp_path: Path, monkeypatch, capsys
) -> None:
    from femprep.volume import runs

    def crash(*_, **__):
        raise fp.errors.StageError("the mesher was ended by SIGSEGV")

    monkeypatch.setattr(runs, "run_tetwild", crash)
    out = tmp_path / "out"
    arguments = ["mesh", str(image), "-o", str(out), "--preset", "acdc", "--edge-length", "6", "--vertices", "500"]
    assert main([*arguments, "--format", "abaqus"]) == 0
    said = capsys.readouterr()
    assert "swept instead" in " ".join((said.out + said.err).split())
    manifest = json.loads((out / "run.json").read_text())
    volume = manifest["details"]["volume"]
    assert (volume["mesher"], volume["instead_of"]) == ("sweep", "tetwild")
    assert [run["status"] for run in volume["attempts"]] == ["crashed"] * 3
    (line,) = [line for line in manifest["notices"] if "swept instead" in line]
    assert "SIGSEGV" in line
    mesh = fp.read_mesh(out / "mesh.vtu")
    assert set(mesh.facet_names) == {"endo", "epi", "base"}
    assert set(mesh.cells) == {"tetra"}
    assert json.loads((out / "quality.json").read_text())["validity"]["inverted_elements"] == 0
    assert "layers of tetrahedra" in (out / "methods.md").read_text()
    with pytest.raises(fp.errors.StageError, match="SIGSEGV"):
        seg = fp.read_segmentation(image, preset="acdc")
        fp.mesh_segmentation(seg, blood_pool=True, surface={"vertices": 500}, volume={"edge_length": 6.0})
