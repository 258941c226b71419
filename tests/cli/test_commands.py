"""``femprep check`` and ``femprep compare`` on files, with their exit statuses."""

from __future__ import annotations

import json
import re
from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

import femprep as fp
from femprep.cli import main
from femprep.phantoms import lv_ellipsoid

CUBE = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
#: The cube as four tetrahedra at its corners and a regular one between them.
FIVE = [[0, 4, 2, 1], [4, 6, 2, 7], [1, 4, 7, 5], [1, 2, 3, 7], [1, 2, 7, 4]]


def write_tetrahedra(path: Path, cells: list[list[int]]) -> Path:
    meshio.write(path, meshio.Mesh(CUBE, [("tetra", np.array(cells))]))
    return path


def sphere(path: Path, radius: float) -> Path:
    from femprep.template import charge_template

    template = charge_template(300)
    fp.write_surface(fp.Surface(radius * template.directions, template.cells), path)
    return path


def test_check_passes_a_sound_mesh_of_anyone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(write_tetrahedra(tmp_path / "cube.vtu", FIVE)), "--json"]) in (0, 1)
    record = json.loads(capsys.readouterr().out)
    assert record["volume"] == pytest.approx(1.0)
    assert record["validity"]["inverted_elements"] == 0
    assert record["validity"]["untagged_boundary_facets"] is None


def test_check_fails_an_inverted_element(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_tetrahedra(tmp_path / "bad.vtu", [[0, 4, 2, 1], [4, 6, 2, 7], [1, 4, 5, 7]])
    assert main(["check", str(path)]) == 1
    assert "inverted" in capsys.readouterr().out


def test_check_judges_by_purpose(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A cube of 1 mm is sound for mechanics and three times too coarse for waves of excitation."""
    path = str(write_tetrahedra(tmp_path / "cube.vtu", FIVE))
    assert main(["check", path, "--purpose", "implicit", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["options"]["purpose"] == "implicit"
    assert {"minimum_relative_jacobian", "maximum_volume_ratio"} <= {item["name"] for item in record["limits"]}
    assert main(["check", path, "--purpose", "electrophysiology"]) == 1
    assert "mean edge length by the space constant" in capsys.readouterr().out
    assert main(["check", path, "--purpose", "electrophysiology", "--space-constant", "2"]) == 0
    capsys.readouterr()
    assert main(["check", path, "--minimum-dihedral", "56"]) == 1
    assert "smallest dihedral angle in degrees is 54.74" in capsys.readouterr().out
    assert main(["check", path, "--purpose", "art"]) == 2
    assert "option --purpose is 'art'" in capsys.readouterr().err


def test_check_shows_histograms_and_the_worst_elements(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_tetrahedra(tmp_path / "cube.vtu", FIVE)
    page = tmp_path / "cube.html"
    assert main(["check", str(path), "--worst", "2", "--html", str(page)]) == 0
    text = capsys.readouterr().out
    # Four tetrahedra at corners and the regular one in the middle: two bins, one four times as high.
    ratio = next(line for line in text.splitlines() if line.startswith("mean ratio"))
    assert "█" in ratio
    assert "▂" in ratio
    assert "stable time step" in text
    found = [line.split() for line in text.splitlines() if line.startswith("minimum dihedral") and "tetra" in line]
    assert len(found) == 2
    # The centroid of a corner's tetrahedron lies a quarter of the way along each edge.
    assert all(set(line[-3:]) <= {"0.2", "0.8"} for line in found)
    html = page.read_text(encoding="utf-8")
    assert html.count("<svg") == 4
    assert "Worst elements" in html
    assert "No defects found" in html
    assert main(["check", str(path), "--html", str(tmp_path / "none" / "cube.html")]) == 2
    assert "cannot be written" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["check", "none.vtu"], ["compare", "none.vtp", "none.vtp"]])
def test_missing_file(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(command) == 2
    assert "none.vt" in capsys.readouterr().err


def test_compare_measures_concentric_spheres(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = sphere(tmp_path / "a.vtp", 20.0), sphere(tmp_path / "b.vtp", 23.0)
    assert main(["compare", str(a), str(b), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["distance"]["mean"] == pytest.approx(3.0, abs=0.05)
    assert record["volume"]["difference_percent"] == pytest.approx(100 * ((20 / 23) ** 3 - 1), abs=0.01)
    assert record["a"]["q"]["mean"] > 0.98
    assert main(["compare", str(a), str(b), "--vertices", "5"]) == 2
    assert "--vertices is for a label map" in capsys.readouterr().err
    assert main(["compare", str(a), str(a)]) == 0
    same = re.search(r"^distance: mean (\S+) mm, .*\n", capsys.readouterr().out, flags=re.MULTILINE)
    assert same is not None
    assert float(same[1]) < 1e-12


@pytest.mark.slow
def test_compare_puts_every_method_beside_the_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    heart = lv_ellipsoid()
    seg = heart.segmentation((2.0, 2.0, 8.0))
    fp.write_segmentation(seg, tmp_path / "heart.nii.gz")
    lv = f"lv={seg.structures['lv'][0]}"
    ball = trimesh.creation.icosphere(subdivisions=4)
    points = heart.exact_surface("lv", np.asarray(ball.vertices))
    fp.write_surface(fp.Surface(points, ball.faces), tmp_path / "truth.vtp")
    given = [str(tmp_path / "heart.nii.gz"), str(tmp_path / "truth.vtp"), "--structure", lv, "--vertices", "400"]
    assert main(["compare", *given, "--json"]) == 0
    found = {row["method"]: row for row in json.loads(capsys.readouterr().out)}
    assert {"marching cubes", "surface nets", "femprep, paper", "femprep, even", "femprep, smooth"} <= set(found)
    fitted = {name: row for name, row in found.items() if row["failure"] is None}
    assert all(row["seconds"] > 0.0 and row["triangles"] > 0 and row["in_slice"] < 2.0 for row in fitted.values())
    assert found["femprep, smooth"]["sound"]
    best = min(row["mean"] for name, row in fitted.items() if not name.startswith("femprep"))
    assert found["femprep, smooth"]["mean"] < best
    assert main(["compare", given[0]]) == 2
    assert main(["compare", given[1]]) == 2
    assert "second surface" in capsys.readouterr().err
