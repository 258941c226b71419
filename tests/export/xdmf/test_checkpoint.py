"""Fibres where cardiac_geometries and fenicsx-pulse look for them: in HDF5, and in ADIOS2's BP4."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres

import femprep as fp
from femprep.export.deck.split import to_tetrahedra
from femprep.export.xdmf.bp4 import bp4
from femprep.model import VolumeMesh

#: Corners between which basix has the middle node of each edge, and the number of its cell.
EDGES = {"tetra10": [(2, 3), (1, 3), (1, 2), (0, 3), (0, 2), (0, 1)], "triangle6": [(1, 2), (0, 2), (0, 1)]}
CELL = {"tetra": 3, "tetra10": 3, "wedge": 3, "hexahedron": 5}


def written(mesh: VolumeMesh, folder: Path, **options: str) -> Path:
    fp.export.write_format(mesh, folder, "dolfinx", **options)
    return folder / "dolfinx"


def solid(kind: str) -> VolumeMesh:
    mesh = with_fibres(truncated_ellipsoid(kind))
    return mesh.with_data(cell={"normal": np.cross(mesh.cell_data["fiber"], mesh.cell_data["sheet"])})


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge", "hexahedron"])
def test_hdf5_file_is_a_checkpoint_of_mesh_tags_and_fibres(kind: str, tmp_path: Path) -> None:
    """After the HDF5 back-end of io4dolfinx 1.5: nothing of the readers is needed here."""
    mesh = solid(kind)
    folder = written(mesh, tmp_path, length_unit="m")
    mesh = to_tetrahedra(mesh) if kind == "wedge" else mesh
    (name, cells), (facet_name, facets) = next(iter(mesh.cells.items())), next(iter(mesh.facets.items()))
    for what in ("markers", "info", "microstructure"):
        assert (folder / f"{what}.json").read_text() == (folder / f"{what}_mesh.json").read_text()
    element = [1, CELL[kind], 0, 1]
    found = json.loads((folder / "microstructure.json").read_text())
    assert found == {"f0": element, "s0": element, "n0": element}
    with h5py.File(folder / "mesh.h5") as store:
        own = store["mesh"]
        assert own.attrs["timestamps"].tolist() == [0.0]
        assert own.attrs["CellType"] == ("hexahedron" if kind == "hexahedron" else "tetrahedron")
        assert (own.attrs["Degree"], own.attrs["LagrangeVariant"]) == (2 if kind == "tetra10" else 1, 2)
        points = own["0/Points"][()]
        np.testing.assert_allclose(points, mesh.points / 1000, rtol=1e-15)
        in_order(name, own["Topology"][()], cells, points)
        for label, dimension, block, values, of in (
            ("Cell tags", 3, cells, mesh.region, name),
            ("Facet tags", 2, facets, mesh.facet_tag, facet_name),
        ):
            tag = own[f"tags/{label}"]
            assert tag.attrs["dim"] == dimension
            in_order(of, tag["Topology"][()], block, points)
            assert np.array_equal(tag["Values"][()], values)
        for label, data in (("f0", "fiber"), ("s0", "sheet"), ("n0", "normal")):
            function = own[f"functions/{label}"]
            assert function.attrs["timestamps"].tolist() == [0.0]
            array, dofs, begin = (function[part][()] for part in ("0/array", "dofmap", "dofmap_offsets"))
            for cell in (0, mesh.n_cells - 1):
                assert array[dofs[begin[cell] : begin[cell + 1]]].tolist() == mesh.cell_data[data][cell].tolist()
            assert (len(begin), begin[-1], len(array)) == (mesh.n_cells + 1, 3 * mesh.n_cells, 3 * mesh.n_cells)


def in_order(kind: str, found: np.ndarray, ours: np.ndarray, points: np.ndarray) -> None:
    """Every row names the same nodes, in the order of basix."""
    assert found.dtype == np.int64
    assert np.array_equal(np.sort(found, axis=1), np.sort(ours, axis=1))
    x = points[found]
    if kind in EDGES:
        corners = x.shape[1] - len(EDGES[kind])
        for column, (a, b) in enumerate(EDGES[kind], start=corners):
            np.testing.assert_allclose(x[:, column], (x[:, a] + x[:, b]) / 2, atol=1e-15)
    elif kind in ("hexahedron", "quad"):  # a tensor product: opposite edges run one way
        assert (np.einsum("ij,ij->i", x[:, 1] - x[:, 0], x[:, 3] - x[:, 2]) > 0).all()
        assert (np.einsum("ij,ij->i", x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]) > 0).all()
    else:
        assert np.array_equal(found, ours)


def test_bp4_is_what_adios2_writes(tmp_path: Path) -> None:
    adios2 = pytest.importorskip("adios2")
    values = np.random.default_rng(0).normal(size=333)
    arrays = {"f0_dofmap": np.arange(600), "f0_values": values, "f0_time": np.zeros(1)}
    stream = adios2.Adios().declare_io("group")
    stream.set_engine("BP4")
    file = stream.open(str(tmp_path / "theirs.bp"), adios2.bindings.Mode.Write)
    file.begin_step()
    for name, array in arrays.items():
        variable = stream.define_variable(name, array, array.shape, [0], array.shape)
        file.put(variable, array, adios2.bindings.Mode.Sync)
    file.end_step()
    file.close()
    for name, content in bp4(arrays).items():
        theirs = (tmp_path / "theirs.bp" / name).read_bytes()
        assert len(content) == len(theirs)
        differ = {at for at, (a, b) in enumerate(zip(content, theirs)) if a != b}
        assert differ <= {10, 12, 14, 32, 33, 34, *(range(112, 120) if name == "md.idx" else ())}  # version, time


@pytest.mark.parametrize("kind", ["tetra", "wedge"])
def test_adios2_reads_the_fibres(kind: str, tmp_path: Path) -> None:
    adios2 = pytest.importorskip("adios2")
    mesh = solid(kind)
    folder = written(mesh, tmp_path)
    tets = to_tetrahedra(mesh)
    with adios2.FileReader(str(folder / "microstructure.bp")) as file:
        for label, data in (("f0", "fiber"), ("s0", "sheet"), ("n0", "normal")):
            values, dofs, begin, when = (
                file.read(f"{label}_{part}") for part in ("values", "dofmap", "XDofmap", "time")
            )
            assert np.array_equal(values[dofs].reshape(-1, 3), tets.cell_data[data])
            assert np.array_equal(begin, np.arange(0, 3 * tets.n_cells + 1, 3))
            assert when.tolist() == [0.0]


def test_earlier_fibres_do_not_stay_beside_another_mesh(tmp_path: Path) -> None:
    mesh = with_fibres(truncated_ellipsoid("tetra"))
    fp.write_mesh(mesh, tmp_path / "mesh.xdmf", format="dolfinx")
    files = {path.name: path.read_bytes() for path in (tmp_path / "microstructure.bp").iterdir()}
    assert set(files) == {"data.0", "md.0", "md.idx"}
    fp.write_mesh(mesh, tmp_path / "mesh.xdmf", format="dolfinx")
    assert {path.name: path.read_bytes() for path in (tmp_path / "microstructure.bp").iterdir()} == files
    fp.write_mesh(truncated_ellipsoid("tetra"), tmp_path / "mesh.xdmf", format="dolfinx")
    assert not (tmp_path / "microstructure.bp").exists()
    assert json.loads((tmp_path / "microstructure.json").read_text()) == {}
