"""Phases of a beating phantom swept with one connectivity: displacements, series files, template, command line."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import jsonschema
import meshio
import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.cli._names import sequence_names
from femprep.phantoms import lv_ellipsoid

#: Cavity and epicardium at rest and contracted; the wall thickens as the cavity shrinks.
PHASES = {
    "ed": {"endo": (25.0, 25.0, 60.0), "epi": (34.0, 34.0, 69.0), "base": 20.0},
    "es": {"endo": (18.0, 18.0, 54.0), "epi": (31.0, 31.0, 66.0), "base": 20.0},
}
SIZES = ["--edge-length", "6", "--vertices", "500", "--preset", "acdc", "--quiet"]
SCHEMAS = Path(__file__).parent.parent / "schemas"


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("phases")
    for name, shape in PHASES.items():
        heart = lv_ellipsoid(**shape)
        fp.write_segmentation(heart.segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped"), folder / f"{name}.nii.gz")
    return [folder / f"{name}.nii.gz" for name in PHASES]


@pytest.fixture(scope="module")
def out(images: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out") / "sequence"
    assert main(["mesh", *map(str, images), "--sequence", "-o", str(out), *SIZES]) == 0
    return out


def cavity(endo: tuple[float, float, float], base: float) -> float:
    a, b, c = endo
    return float(np.pi * a * b * ((base + c) - (base**3 + c**3) / (3.0 * c * c)))


@pytest.mark.slow
def test_each_phase_is_judged_as_in_its_sequence(out: Path) -> None:
    for name, phase in zip(PHASES, json.loads((out / "run.json").read_text())["phases"], strict=True):
        report = fp.check(fp.read_mesh(out / "phases" / name / "mesh.vtu"))
        assert list(report.failures) == phase["failures"]
        assert "the mesh's own" in report.limits_from
        assert "mesher sweep" in report.limits_from


@pytest.mark.slow
def test_phases_share_their_connectivity_and_move_as_the_heart_does(out: Path) -> None:
    ed, es = (fp.read_mesh(out / "phases" / name / "mesh.vtu") for name in PHASES)
    assert np.array_equal(ed.cells["tetra"], es.cells["tetra"])
    moved = es.point_data["displacement"]
    assert np.array_equal(moved, es.points - ed.points)
    assert np.abs(ed.point_data["displacement"]).max() == 0.0
    # On the endocardium every node moves inwards, by the 7 mm between both cavities at the girth.
    count = ed.info["template_vertices"]
    axis = np.array([0.0, 0.0, 1.0])
    across = ed.points[:count] - np.outer(ed.points[:count] @ axis, axis)
    girth = np.linalg.norm(across, axis=1) > 23.0
    inward = -np.einsum("ij,ij->i", moved[:count], across)[girth] / np.linalg.norm(across[girth], axis=1)
    assert inward.mean() == pytest.approx(7.0, abs=0.7)
    assert inward.min() > 4.0


@pytest.mark.slow
def test_the_names_known_before_are_written(out: Path) -> None:
    files = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert set(sequence_names(PHASES, ())) <= files
    assert set(json.loads((out / "run.json").read_text())["files"]) == files


@pytest.mark.slow
def test_the_record_tells_volumes_and_ejection_fraction(out: Path) -> None:
    record = json.loads((out / "run.json").read_text())
    jsonschema.validate(record, json.loads((SCHEMAS / "sequence.json").read_text()))
    assert [phase["name"] for phase in record["phases"]] == list(PHASES)
    assert all(phase["passed"] for phase in record["phases"])
    wanted = 100.0 * (1.0 - cavity(PHASES["es"]["endo"], 20.0) / cavity(PHASES["ed"]["endo"], 20.0))
    assert record["ejection_fraction_percent"] == pytest.approx(wanted, abs=2.0)
    assert record["label_ejection_fraction_percent"] == pytest.approx(wanted, abs=2.0)
    assert (out / "phases" / "ed" / "report.html").is_file()
    assert "2 phases" in (out / "methods.md").read_text()
    assert {"methods.md", "methods.bib", "phases/es/methods.md"} <= set(record["files"])
    for name in PHASES:
        (line,) = [line for line in record["notices"] if line.startswith(f"{name}: the labels end")]
        assert "extrapolated" in line
    (moved,) = [phase for phase in record["phases"] if phase["base_offset_mm"] > 0.0]
    told = f"{moved['name']}: the base plane was moved by {moved['base_offset_mm']:.1f} mm towards the apex"
    assert any(line.startswith(told) for line in record["notices"])


@pytest.mark.slow
def test_the_series_files_hold_every_phase(out: Path) -> None:
    with meshio.xdmf.TimeSeriesReader(out / "sequence.xdmf") as reader:
        reader.read_points_cells()
        steps = [reader.read_data(number) for number in range(reader.num_steps)]
    assert [time for time, _, _ in steps] == [0.0, 1.0]
    assert np.abs(steps[0][1]["displacement"]).max() == 0.0 < np.abs(steps[1][1]["displacement"]).max()
    root = ElementTree.parse(out / "sequence.pvd").getroot()
    files = [item.attrib["file"] for item in root.iter("DataSet")]
    assert [float(item.attrib["timestep"]) for item in root.iter("DataSet")] == [0.0, 1.0]
    assert all((out / file).is_file() for file in files)

    import h5py

    grids = list(ElementTree.parse(out / "sequence.xdmf").getroot().iter("Grid"))
    assert grids[0].attrib["CollectionType"] == "Temporal"
    for phase, grid in zip(PHASES, grids[1:], strict=True):
        mesh = fp.read_mesh(out / "phases" / phase / "mesh.vtu")
        where = {item.attrib["Name"]: item.find("DataItem").text for item in grid.iter("Attribute")}
        with h5py.File(out / "sequence.h5") as store:
            points = store[grid.find("Geometry/DataItem").text.split(":", 1)[1]][:]
            moved = store[where["displacement"].split(":", 1)[1]][:]
            cells = store[grid.find("Topology/DataItem").text.split(":", 1)[1]][:]
        assert np.array_equal(points, mesh.points)
        assert np.array_equal(moved, mesh.point_data["displacement"])
        assert np.array_equal(cells, mesh.cells["tetra"])
    # Cells of all times are stored once.
    assert len({grid.find("Topology/DataItem").text for grid in grids[1:]}) == 1


@pytest.mark.slow
def test_another_heart_on_the_template_has_its_connectivity(out: Path, tmp_path: Path) -> None:
    heart = lv_ellipsoid(endo=(20.0, 23.0, 50.0), epi=(30.0, 33.0, 60.0), base=15.0)
    fp.write_segmentation(heart.segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped"), tmp_path / "other.nii.gz")
    first = out / "phases" / "ed" / "mesh.vtu"
    command = ["mesh", str(tmp_path / "other.nii.gz"), "-o", str(tmp_path / "other"), "--template", str(first), *SIZES]
    assert main(command) in (0, 1)
    mesh = fp.read_mesh(tmp_path / "other" / "mesh.vtu")
    assert np.array_equal(mesh.cells["tetra"], fp.read_mesh(first).cells["tetra"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "add --sequence"),
        (["--sequence", "--mesher", "tetwild"], "unlike the sweep"),
        (["--sequence", "--template", "none.vtu"], "none.vtu"),
    ],
)
def test_what_cannot_be_a_sequence_is_refused(
    images: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert main(["mesh", *map(str, images), "-o", str(tmp_path / "x"), *SIZES, *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


def test_times_have_to_increase(images: list[Path]) -> None:
    phases = [fp.read_segmentation(path, preset="acdc") for path in images]
    with pytest.raises(fp.InputError, match="increase"):
        fp.mesh_sequence(phases, times=[1.0, 1.0])
    with pytest.raises(fp.InputError, match="reference phase 2"):
        fp.mesh_sequence(phases, reference=2)
    with pytest.raises(fp.InputError, match="was not swept"):
        fp.template_of(fp.VolumeMesh(np.eye(4, 3), {"tetra": [[3, 0, 1, 2]]}, [1], {}, []))
