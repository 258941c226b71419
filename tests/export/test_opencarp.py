"""openCARP's files: bath and tissue, ventricular coordinates under the names its scripts read, a beat to start from."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from biventricular import biventricular
from meshes import truncated_ellipsoid, with_fibres
from same_mesh import assert_same
from scipy.spatial import cKDTree

from femprep.anatomy import add_coordinates
from femprep.errors import FileError
from femprep.export import read_mesh, write_mesh
from femprep.export.deck.names import facet_nodes, region_nodes
from femprep.export.opencarp.uvc import OUTSIDE
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh

TAG = REGION_TAGS | FACET_TAGS


def with_blood(mesh: VolumeMesh) -> VolumeMesh:
    """The mesh with every third element blood, its directions those of the axes, as ``on_wall`` leaves them."""
    blood = np.arange(mesh.n_cells) % 3 == 0
    mesh = replace(mesh, region=np.where(blood, TAG["blood_lv"], mesh.region))
    frame = {"fiber": [1.0, 0.0, 0.0], "sheet": [0.0, 1.0, 0.0]}
    data = {
        name: np.where(blood[:, None], frame[name], mesh.cell_data[name]) for name in frame if name in mesh.cell_data
    }
    return mesh.with_data(cell=data)


def with_septum(mesh: VolumeMesh) -> VolumeMesh:
    """The mesh with regions as real ones have them: septum where both endocardia are nearer than the epicardium."""
    centres = mesh.points[mesh.cells["tetra"]].mean(axis=1)
    left, right, out = (
        cKDTree(mesh.points[facet_nodes(mesh, TAG[name])]).query(centres)[0] for name in ("endo_lv", "endo_rv", "epi")
    )
    region = np.where(left < right, TAG["lv"], TAG["rv"])
    return replace(mesh, region=np.where(np.maximum(left, right) < out, TAG["septum"], region))


@pytest.mark.parametrize("fibres", [False, True])
def test_blood_is_bath_and_comes_back(fibres: bool, tmp_path: Path) -> None:
    mesh = with_blood(with_fibres(truncated_ellipsoid("tetra")) if fibres else truncated_ellipsoid("tetra"))
    write_mesh(mesh, tmp_path / "lv.pts")
    axes = np.loadtxt(tmp_path / "lv.lon", skiprows=1)
    blood = mesh.region == TAG["blood_lv"]
    assert not axes[blood].any()
    if fibres:
        assert np.array_equal(axes[~blood, :3], mesh.cell_data["fiber"][~blood])
    else:
        assert (axes[~blood] == [1.0, 0.0, 0.0]).all()
    back = read_mesh(tmp_path / "lv.pts")
    assert_same(back, mesh, tolerance=1e-13, data=("fiber", "sheet") if fibres else ())
    assert ("fiber" in back.cell_data) == fibres
    # A solver that knows no bath takes what came back.
    write_mesh(back, tmp_path / "lv.inp")


def test_ventricular_coordinates_of_a_left_ventricle(tmp_path: Path) -> None:
    mesh = add_coordinates(truncated_ellipsoid("tetra10"))
    uvc, points = _uvc(mesh, tmp_path)
    assert len(points) < len(mesh.points)  # without mid-side nodes
    assert np.array_equal(uvc["z"], mesh.point_data["apicobasal"][points])
    assert np.array_equal(uvc["rho"], mesh.point_data["transmural"][points])
    assert set(uvc["ven"]) == {-1}
    np.testing.assert_allclose(np.cos(uvc["phi"]), mesh.point_data["rotational_cos"][points], atol=1e-12)
    np.testing.assert_allclose(np.sin(uvc["phi"]), mesh.point_data["rotational_sin"][points], atol=1e-12)
    assert uvc["phi"].min() < -np.pi / 2
    assert uvc["phi"].max() > np.pi / 2


def test_the_septum_is_the_left_ventricles(tmp_path: Path) -> None:
    mesh = with_septum(add_coordinates(biventricular()))
    uvc, points = _uvc(mesh, tmp_path)
    assert len(points) == len(mesh.points)
    inner = np.setdiff1d(region_nodes(mesh, TAG["septum"]), region_nodes(mesh, TAG["lv"]))
    assert set(uvc["ven"][inner]) == {-1}
    left, right, out = (facet_nodes(mesh, TAG[name]) for name in ("endo_lv", "endo_rv", "epi"))
    free = np.setdiff1d(right, inner)
    assert set(uvc["ven"][free]) == {1}
    assert uvc["rho"][free] == pytest.approx(0.0, abs=1e-9)
    far = np.intersect1d(right, inner)
    assert len(far) > 10
    assert uvc["rho"][far] == pytest.approx(1.0, abs=1e-9)
    assert uvc["rho"][left] == pytest.approx(0.0, abs=1e-9)
    assert uvc["rho"][np.setdiff1d(out, np.union1d(left, right))] == pytest.approx(1.0, abs=1e-9)
    # The same four numbers name one point.
    rows = np.column_stack([np.round(uvc[name], 9) for name in uvc])
    assert len(np.unique(rows, axis=0)) > 0.99 * len(rows)


def test_points_of_blood_alone_have_no_coordinates(tmp_path: Path) -> None:
    mesh = add_coordinates(truncated_ellipsoid("tetra"))
    mesh = replace(mesh, region=np.where(np.arange(mesh.n_cells) < 200, TAG["blood_lv"], TAG["lv"]))
    uvc, _ = _uvc(mesh, tmp_path)
    alone = np.ones(len(mesh.points), dtype=bool)
    alone[region_nodes(mesh, TAG["lv"])] = False
    assert alone.any()
    for values in uvc.values():
        assert np.array_equal(values == OUTSIDE, alone)


def _uvc(mesh: VolumeMesh, folder: Path) -> tuple[dict[str, np.ndarray], np.ndarray]:
    write_mesh(mesh, folder / "lv.pts")
    points = np.loadtxt(folder / "lv.pts", skiprows=1) / 1000
    found = [int(np.argmin(np.abs(mesh.points - point).sum(axis=1))) for point in points]
    uvc = {name: np.loadtxt(folder / f"lv.uvc_{name}.dat") for name in ("z", "rho", "phi", "ven")}
    assert all(values.shape == (len(points),) for values in uvc.values())
    return uvc, np.array(found)


def test_no_coordinates_no_files(tmp_path: Path) -> None:
    write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.pts")
    assert not list(tmp_path.glob("*uvc*"))


# -------------------------------------------------------------------------------------- the parameter file


def par(mesh: VolumeMesh, folder: Path) -> dict[str, str]:
    """Names and values of a parameter file, each name once."""
    write_mesh(mesh, folder / "my heart.pts")
    text = re.sub(r"#.*", "", (folder / "my heart.par").read_text("utf-8"))
    pairs = [[part.strip() for part in line.split("=")] for line in text.splitlines() if line.strip()]
    assert all(len(pair) == 2 and pair[1] for pair in pairs)
    assert len({name for name, _ in pairs}) == len(pairs)
    return {name: value.strip('"') for name, value in pairs}


def tags(values: dict[str, str], of: str) -> list[int]:
    found = [int(values[f"{of}.ID[{i}]"]) for i in range(int(values[f"{of}.num_IDs"]))]
    assert sum(name.startswith(f"{of}.ID") for name in values) == len(found)
    return found


def test_every_tag_has_its_place_in_the_parameter_file(tmp_path: Path) -> None:
    mesh = with_blood(with_fibres(truncated_ellipsoid("tetra")))
    region = np.array(mesh.region)
    region[np.flatnonzero(region != TAG["blood_lv"])[:40]] = TAG["aorta"]
    values = par(replace(mesh, region=region), tmp_path)
    assert values["meshname"] == "my heart"
    wall, blood = [TAG["lv"], TAG["septum"]], [TAG["blood_lv"]]
    assert tags(values, "phys_region[0]") == tags(values, "imp_region[0]") == wall
    assert tags(values, "phys_region[1]") == [*wall, TAG["aorta"], *blood]
    assert tags(values, "gregion[0]") == [*wall, TAG["aorta"]]
    assert tags(values, "gregion[1]") == blood
    for name in ("phys_regions", "imp_regions", "gregions"):
        kinds = {key.split(".")[0] for key in values if key.startswith(name.removesuffix("s") + "[")}
        assert len(kinds) == int(values[f"num_{name}"])
    assert float(values["gregion[0].g_il"]) > float(values["gregion[0].g_it"]) == float(values["gregion[0].g_in"])


def test_the_stimulus_is_a_file_that_is_there(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    values = par(mesh, tmp_path)
    assert values["num_stim"] == "1"
    head, kind, *nodes = (tmp_path / values["stim[0].elec.vtx_file"]).read_text().split()
    assert (int(head), kind) == (len(nodes), "extra")
    assert [int(n) for n in nodes] == facet_nodes(mesh, TAG["endo"]).tolist()
    # Without fibres nothing tells along from across.
    assert values["gregion[0].g_il"] == values["gregion[0].g_it"] == values["gregion[0].g_in"]
    assert values["num_gregions"] == "1"


@pytest.mark.parametrize(
    ("ending", "old", "new", "words"),
    [
        (".pts", r"\n(\S+ \S+ \S+)\n", r"\n\1 \1\n", "expected three numbers"),
        (".aha.dat", r"^\S+\n", "", "95 segments for 96 elements"),
    ],
)
def test_rows_of_others_sizes_are_refused(ending: str, old: str, new: str, words: str, tmp_path: Path) -> None:
    """Six numbers in a row were two points, segments of another mesh none."""
    mesh = truncated_ellipsoid("hexahedron")
    write_mesh(mesh.with_data(cell={"aha": np.full(mesh.n_cells, 3, dtype=np.int32)}), tmp_path / "lv.pts")
    file = tmp_path / f"lv{ending}"
    file.write_text(re.sub(old, new, file.read_text(), count=1))
    with pytest.raises(FileError, match=words):
        read_mesh(tmp_path / "lv.pts")
