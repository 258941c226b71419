"""Fields that a user gave the elements and points are in the files, as other readers see, or a warning names them."""

from __future__ import annotations

import re
import shutil
import subprocess
import warnings
from pathlib import Path, PurePosixPath
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid, with_fibres

import femprep as fp
from femprep.export import FORMATS

DROPPING = ("abaqus", "febio", "gmsh", "opencarp", "opencarp-binary", "medit", "ls-dyna")


def with_fields(mesh: fp.VolumeMesh) -> fp.VolumeMesh:
    numbers = np.random.default_rng(7)
    cell = {"scar": numbers.random(mesh.n_cells), "my drift": numbers.normal(size=(mesh.n_cells, 3))}
    point = {"scar": numbers.normal(size=len(mesh.points)), "load": numbers.normal(size=(len(mesh.points), 3))}
    return mesh.with_data(cell={**cell, "dose": numbers.random((mesh.n_cells, 2))}, point=point)


def written(mesh: fp.VolumeMesh, folder: Path, format: str) -> Path:
    path = folder / PurePosixPath(FORMATS[format].filename).name
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fp.FemprepWarning)
        fp.write_mesh(mesh, path, format=format)
    return path


@pytest.mark.parametrize("format", DROPPING)
def test_a_mesh_without_own_fields_is_written_as_with_them_left_out(format: str, tmp_path: Path) -> None:
    mesh = with_fibres(truncated_ellipsoid("tetra"))
    (tmp_path / "with").mkdir()
    (tmp_path / "without").mkdir()
    one, two = written(with_fields(mesh), tmp_path / "with", format), written(mesh, tmp_path / "without", format)
    kept = {path.name: path.read_bytes() for path in two.parent.iterdir()}
    assert set(kept) <= {path.name for path in one.parent.iterdir()}
    # A field is added to a file, or is a file of its own: nothing else changes.
    for name, content in kept.items():
        longer = (one.parent / name).read_bytes().splitlines()
        lines = iter(longer)
        assert all(line in lines for line in content.splitlines()), name
    # Written over, none of the fields stays beside the mesh.
    written(mesh, one.parent, format)
    assert {path.name: path.read_bytes() for path in one.parent.iterdir()} == kept


@pytest.mark.parametrize("format", DROPPING)
def test_a_field_is_written_or_a_warning_names_it_and_the_format(format: str, tmp_path: Path) -> None:
    mesh = with_fields(truncated_ellipsoid("tetra"))
    holey = mesh.with_data(cell={"holey": np.full(mesh.n_cells, np.nan)}, facet={"load": np.ones(mesh.n_facets)})
    path = tmp_path / PurePosixPath(FORMATS[format].filename).name
    with pytest.warns(fp.FemprepWarning, match=f"{format} files.*holey.*finite.*load") as found:
        fp.write_mesh(holey, path, format=format)
    assert [one.filename for one in found] == [__file__]
    with warnings.catch_warnings(record=True) as found_too:
        warnings.simplefilter("always")
        fp.write_mesh(mesh, path, format=format)
    told = [str(one.message) for one in found_too]
    assert [("scar" in one, "load" in one) for one in told] == ([(True, True)] if format == "ls-dyna" else [])


@pytest.mark.solver
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_takes_a_deck_with_fields(tmp_path: Path) -> None:
    mesh = with_fibres(truncated_ellipsoid("tetra"))
    results = []
    for name, one in (("without", mesh), ("with", with_fields(mesh))):
        fp.write_mesh(one, tmp_path / f"{name}.inp", step="inflation", material="orthotropic")
        subprocess.run(["ccx", "-i", name], cwd=tmp_path, check=True, capture_output=True, timeout=120)
        results.append((tmp_path / f"{name}.dat").read_text())
    assert "displacements" in results[0]
    assert results[0] == results[1]


def test_fields_for_abaqus_are_in_a_file_to_include(tmp_path: Path) -> None:
    mesh = with_fields(truncated_ellipsoid("tetra"))
    assert "*INCLUDE, INPUT=mesh.fields.inp" in written(mesh, tmp_path, "abaqus").read_text()
    text = (tmp_path / "mesh.fields.inp").read_text()
    heads = {"scar": "scar, LOCATION=ELEMENT, TABLE=scalar_table\n, 0.", "load_3": "TYPE=FIELD, VARIABLE=4"}
    for name, values in (("scar", mesh.cell_data["scar"]), ("load_3", mesh.point_data["load"][:, 2])):
        rows = re.search(re.escape(heads[name]) + r"\n([^*]*)", text)
        assert rows
        table = np.array(rows[1].replace(",", " ").split(), float).reshape(-1, 2)
        assert np.array_equal(table[:, 0], 1 + np.arange(len(values)))
        assert np.allclose(table[:, 1], values)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_febio_python_reads_fields(tmp_path: Path) -> None:
    feb_module = pytest.importorskip("febio_python.feb")
    mesh = with_fields(mixed())
    path = written(mesh, tmp_path, "febio")
    feb = feb_module.Feb40(ElementTree.parse(path))
    parts = {part.name: np.arange(*part.ids[[0, -1]] + [0, 1]) for part in feb.get_volume_elements()}
    order = np.concatenate([part.connectivity[:, 0] for part in feb.get_volume_elements()])
    first = np.concatenate([block[:, 0] for block in mesh.cells.values()])
    found: dict[str, dict[int, np.ndarray]] = {}
    for data in feb.get_element_data():
        found.setdefault(data.name, {}).update(zip(parts[data.elem_set].tolist(), np.asarray(data.data)))
    assert set(found) == {"scar", "my_drift", "dose_1", "dose_2"}
    scar = np.array([found["scar"][i] for i in range(mesh.n_cells)])
    # Elements are in another order there: by their first node, and the sorted values of each.
    for node in np.unique(first):
        expected = np.sort(mesh.cell_data["scar"][first == node])
        assert np.allclose(np.sort(scar[order == node]), expected, rtol=1e-6)
    nodal = {data.name: np.asarray(data.data) for data in feb.get_nodal_data()}
    assert np.allclose(nodal["scar_points"], mesh.point_data["scar"], rtol=1e-6)
    assert np.allclose(nodal["load"], mesh.point_data["load"], rtol=1e-6)


def test_gmsh_shows_fields_and_meshio_still_reads_the_mesh(tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    mesh = with_fields(mixed())
    path = written(mesh, tmp_path, "gmsh")
    assert np.array_equal(meshio.read(path).point_data["load"], mesh.point_data["load"])
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        views = {}
        for tag in gmsh.view.getTags():
            kind, _, data, _, width = gmsh.view.getModelData(tag, 0)
            name = gmsh.option.getString(f"View[{gmsh.view.getIndex(tag)}].Name")
            views[name, kind] = [np.asarray(row).reshape(-1, width) for row in data]
    finally:
        gmsh.finalize()
    for name, width in (("scar", 1), ("my drift", 3), ("dose", 2)):
        values = np.asarray(mesh.cell_data[name]).reshape(mesh.n_cells, -1)
        assert all(np.array_equal(at_nodes[:, :width], np.tile(row, (len(at_nodes), 1)))
                   for at_nodes, row in zip(views[name, "ElementNodeData"], values, strict=True))  # fmt: skip
    assert np.array_equal(np.concatenate(views["scar", "NodeData"])[:, 0], mesh.point_data["scar"])


@pytest.mark.parametrize("format", ["opencarp", "opencarp-binary"])
def test_fields_of_opencarp_are_a_file_each(format: str, tmp_path: Path) -> None:
    mesh = with_fields(truncated_ellipsoid("tetra"))
    stem = written(mesh, tmp_path, format).with_suffix("")
    assert np.array_equal(np.loadtxt(f"{stem}.cell_scar.dat"), mesh.cell_data["scar"])
    assert np.array_equal(np.loadtxt(f"{stem}.cell_my_drift_3.dat"), mesh.cell_data["my drift"][:, 2])
    assert np.array_equal(np.loadtxt(f"{stem}.point_load_1.dat"), mesh.point_data["load"][:, 0])


def test_fields_of_medit_are_a_file_each(tmp_path: Path) -> None:
    mesh = with_fields(mixed())
    stem = written(mesh, tmp_path, "medit").with_suffix("")
    # A section for each kind of element: its name, how many rows, and one field that is a vector (2), then the rows.
    text = Path(f"{stem}.cell_my_drift.sol").read_text()
    rows = re.findall(r"SolAt(?:Prisms|Hexahedra)\n\d+\n1 2\n([^S]+?)\n\n", text)
    assert np.array_equal(np.array(" ".join(rows).split(), float).reshape(-1, 3), mesh.cell_data["my drift"])
    assert re.search(r"SolAtHexahedra\n\d+\n2 1 1\n", Path(f"{stem}.cell_dose.sol").read_text())
    text = Path(f"{stem}.point_scar_points.sol").read_text()
    [rows] = re.findall(r"SolAtVertices\n180\n1 1\n([^E]+?)\n\nEnd", text)
    assert np.array_equal(np.array(rows.split(), float), mesh.point_data["scar"])


def test_pydyna_finds_initial_fields(tmp_path: Path) -> None:
    dyna = pytest.importorskip("ansys.dyna.core")
    mesh = with_fields(mixed())
    text = written(mesh, tmp_path, "ls-dyna").read_text()
    deck = dyna.Deck()
    deck.loads(text)
    [card] = [one for one in deck.keywords if type(one).__name__ == "InitialFieldSolid"]
    assert (card.eid, card.nint, card.nhisv) == (1, 8, 6)
    rows = text.partition("*INITIAL_FIELD_SOLID\n")[2].partition("*")[0].splitlines()
    assert len(rows) == sum((points + 1) * n for points, n in ((8, 48), (2, 96)))
    assert np.isclose(float(rows[1][:10]), mesh.cell_data["scar"][0], rtol=1e-7)


def test_fibres_that_are_no_vectors_are_refused_in_every_format(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra").with_data(cell={"fiber": np.ones(576)})
    for format in FORMATS:
        with pytest.raises(fp.InputError, match=re.escape("'fiber' have shape (576,), expected (576, 3)")):
            fp.write_mesh(mesh, tmp_path / PurePosixPath(FORMATS[format].filename).name, format=format)
    assert not list(tmp_path.iterdir())
