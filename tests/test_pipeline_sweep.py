"""``femprep mesh --mesher sweep`` on a phantom: sound, flat, and the same bytes each time."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import femprep as fp
from femprep.cli import main
from femprep.phantoms import lv_ellipsoid


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("heart") / "heart.nii.gz"
    fp.write_segmentation(lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped"), path)
    return path


def mesh(image: Path, out: Path, *arguments: str) -> Path:
    sizes = ["--edge-length", "4", "--vertices", "700"]
    assert main(["mesh", str(image), "-o", str(out), "--preset", "acdc", "--mesher", "sweep", *sizes, *arguments]) == 0
    return out


@pytest.mark.slow
def test_the_same_bytes_twice(image: Path, tmp_path: Path) -> None:
    one, two = (mesh(image, tmp_path / name, "--quiet", "--format", "abaqus") for name in ("one", "two"))
    for file in ("mesh.vtu", "facets.vtp", "wall.vtp", "mesh.inp", "quality.json", "surfaces/epi.vtp"):
        assert (one / file).read_bytes() == (two / file).read_bytes(), file
    assert json.loads((one / "run.json").read_text())["deterministic"] is True


@pytest.mark.slow
@pytest.mark.parametrize("element", ["tetra", "wedge", "hexahedron"])
def test_elements(image: Path, tmp_path: Path, element: str) -> None:
    out = mesh(image, tmp_path / "out", "--quiet", "--element", element, "--layers", "3", "--fibres")
    report = json.loads((out / "quality.json").read_text())
    assert list(report["cells"]) == [element]
    assert report["validity"]["inverted_elements"] == 0
    assert report["validity"]["untagged_boundary_facets"] == 0
    assert set(report["facet_tags"]) == {"endo", "epi", "base"}
    assert report["facet_tags"]["base"]["off_plane"] < 1e-9
    assert report["elements_through_wall"]["min"] == 3
    cavity = json.loads((out / "run.json").read_text())["volumes"][0]
    assert abs(cavity["difference_percent"]) < 3.0
    assert "fiber" in fp.read_mesh(out / "mesh.vtu").cell_data


@pytest.mark.slow
def test_one_verdict(image: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What ``mesh`` passes by the limits of the sweep, ``check`` passes: moved, and converted, too."""
    out = mesh(image, tmp_path / "out", "--quiet", "--layers", "4")
    report = json.loads((out / "quality.json").read_text())
    assert report["passed"]
    assert 0.75 < report["measures"]["mean_ratio"]["mean"] < 0.82
    moved = (out / "mesh.vtu").rename(tmp_path / "moved.vtu")
    for name in ("moved.vtu", "deck.inp", "mesh.msh"):
        if name != "moved.vtu":
            assert main(["convert", str(moved), str(tmp_path / name), "--quiet"]) == 0
        capsys.readouterr()
        assert main(["check", str(tmp_path / name)]) == 0, name
        assert "the mesh's own" in capsys.readouterr().out
    assert main(["check", str(moved), "--purpose", "implicit", "--mean-of-mean-ratio", "0.82", "--quiet"]) == 1
