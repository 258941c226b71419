"""Bull's eyes of a mesh: which fields there are, what is taken of them, what the page of a run shows."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from anatomy_meshes import ellipsoid
from meshes import mixed

from femprep.anatomy import VentricularAxes, add_aha, segment_means
from femprep.cli import main
from femprep.errors import InputError
from femprep.export import write_mesh
from femprep.mesh.measures.volume_elements import element_measures
from femprep.model import VolumeMesh
from femprep.report.pictures.bullseyes import draw, element_field, report_bulls_eyes, segment_values

AXES = VentricularAxes([0.0, 0, -65], [0.0, 0, 15], [-1.0, 0, 0], False)


@pytest.fixture(scope="module")
def mesh() -> VolumeMesh:
    return add_aha(ellipsoid("tetra", size=4, layers=3).mesh, axes=AXES)


def test_statistics_of_the_segments(mesh: VolumeMesh) -> None:
    values = element_field(mesh, "mean_ratio")
    assert np.array_equal(values, element_measures(mesh.points, mesh.cells["tetra"], "tetra")["mean_ratio"])
    mean, least, largest = (segment_values(mesh, values, s) for s in ("mean", "least", "largest"))
    assert np.array_equal(mean, segment_means(mesh, values))
    for k in (1, 9, 17):
        own = values[np.asarray(mesh.cell_data["aha"]) == k]
        assert (least[k - 1], largest[k - 1]) == (own.min(), own.max())


def test_fields_of_a_mesh_of_wedges_and_hexahedra_are_those_both_have() -> None:
    both = mixed()
    assert len(element_field(both, "mean_ratio")) == both.n_cells
    with pytest.raises(InputError, match="no field 'radius_ratio'; choose from thickness, volume, scaled_jacobian"):
        element_field(both, "radius_ratio")  # of tetrahedra alone


def test_cell_data_are_a_field_where_they_are_numbers(mesh: VolumeMesh) -> None:
    more = mesh.with_data(cell={"stress": np.arange(float(mesh.n_cells)), "fiber": np.ones((mesh.n_cells, 3))})
    assert np.array_equal(element_field(more, "stress"), np.arange(float(mesh.n_cells)))
    with pytest.raises(InputError, match="one number per element"):
        element_field(more, "fiber")


def test_a_page_shows_thickness_and_quality_where_there_are_segments(mesh: VolumeMesh) -> None:
    labels = [ElementTree.fromstring(picture).get("aria-label") for picture in report_bulls_eyes(mesh)]
    assert labels == ["wall thickness, mm", "mean ratio, mean", "smallest dihedral angle"]
    assert report_bulls_eyes(mixed()) == []
    with pytest.raises(InputError, match="no AHA segments; mesh with --fibres"):
        draw(mixed(), "thickness")


def test_command_writes_one_file_or_one_line(
    mesh: VolumeMesh, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_mesh(mesh, tmp_path / "lv.vtu")
    out = tmp_path / "thick.svg"
    assert main(["bullseye", str(tmp_path / "lv.vtu"), str(out)]) == 0
    assert capsys.readouterr().out.strip() == str(out)
    assert out.read_text().strip() == draw(mesh, "thickness")
    arguments = ["--field", "minimum_dihedral", "--statistic", "least", "--label", "angle", "-q"]
    assert main(["bullseye", str(tmp_path / "lv.vtu"), str(out), *arguments]) == 0
    assert ElementTree.parse(out).getroot().get("aria-label") == "angle"
    for bad, words in (
        (["b.svg", "--field", "nothing"], "no field 'nothing'; choose from thickness"),
        (["b.png"], "written as .svg"),
        (["none/b.svg"], "cannot be written"),
    ):
        assert main(["bullseye", str(tmp_path / "lv.vtu"), str(tmp_path / bad[0]), *bad[1:]]) == 2
        said = capsys.readouterr().err
        assert words in said
        assert said.count("\n") == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["lv.vtu", "thick.svg"]
