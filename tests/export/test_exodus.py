"""Exodus II files: blocks, side sets, node order and data as VTK's reader has them; damaged ones."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import pyvista as pv
from exodus_file import letters, two_blocks, two_of, two_steps, variables, write
from notices import reported
from vtkmodules.vtkIOExodus import vtkExodusIIReader

import femprep as fp
from femprep.errors import FileError
from femprep.mesh.elements import ELEMENTS
from femprep.model.blocks import chosen_rows


def by_vtk(path: Path) -> pv.MultiBlock:
    reader = vtkExodusIIReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    for i in range(reader.GetNumberOfObjects(vtkExodusIIReader.SIDE_SET)):
        reader.SetObjectStatus(vtkExodusIIReader.SIDE_SET, i, 1)
    reader.Update()
    return pv.wrap(reader.GetOutput())


@pytest.mark.parametrize("hdf5", [False, True], ids=["classic", "hdf5"])
@pytest.mark.parametrize("kind", ELEMENTS)
def test_each_type_and_each_of_its_sides(tmp_path: Path, kind: str, hdf5: bool) -> None:
    mesh, element = two_of(kind), ELEMENTS[kind]
    sides = {f"side {i}": ([2], [i]) for i in range(1, len(element.faces) + 1)}
    path = write(tmp_path / "a.exo", variables(mesh, sides), [kind], hdf5=hdf5)
    found = fp.read_mesh(path)
    np.testing.assert_array_equal(found.cells[kind], mesh.cells[kind])
    np.testing.assert_array_equal(found.points, mesh.points)
    names = found.info["tag_names"]
    assert names == {f"wall_{kind}": 60, **{name: 300 + i for i, name in enumerate(sides)}}
    assert found.region.tolist() == [60, 60]
    assert len(found.facet_tag) == len(sides)
    if hdf5:  # without netCDF's dimensions, which VTK wants
        return
    blocks = by_vtk(path)
    grid = blocks[0][0]
    np.testing.assert_allclose(grid.points[grid.cell_connectivity], mesh.points[mesh.cells[kind].ravel()])
    for i, name in enumerate(sides):
        side = blocks["Side Sets"][i]
        assert side.n_cells == 1
        (rows,) = [rows for rows in chosen_rows(found.facets, found.facet_tag == names[name]).values() if len(rows)]
        # As a set of places: where a side begins is left to the program.
        assert places(side.points) == places(found.points[rows[0]])


def places(points: np.ndarray) -> set[tuple[float, ...]]:
    """Places of points, of which VTK keeps single precision."""
    return {tuple(point) for point in np.round(points.astype(np.float64), 4).tolist()}


@pytest.mark.parametrize("hdf5", [False, True], ids=["classic", "hdf5"])
def test_data_of_the_first_step_are_read(tmp_path: Path, hdf5: bool) -> None:
    mesh = two_blocks()
    count = len(mesh.points)
    path = write(tmp_path / "a.e", *two_steps(), hdf5=hdf5)
    read = fp.read_mesh(path)
    assert read.point_data["disp"].tolist() == [[10.0, 20.0, 30.0]] * count
    assert read.point_data["p"].tolist() == [40.0] * count
    np.testing.assert_array_equal(read.cell_data["fibre"], [[1, 2, 3], [-1, -2, -3], [-1, -2, -3]])
    assert set(read.cell_data) == {"fibre"}
    assert reported(read) == [
        "age is left out: 2 elements of 3 have none",
        "of 2 steps in time the first is read",
    ]
    assert read.region.tolist() == [60, 61, 61]
    assert {kind: rows.tolist() for kind, rows in read.facets.items()} == {
        "quad": [[4, 5, 6, 7]],
        "triangle": [[20, 22, 21]],
    }
    assert set(read.facet_tag.tolist()) == {102}  # ours of that name


def test_shells_are_facets_and_unknown_elements_are_told(tmp_path: Path) -> None:
    mesh = two_of("tetra")
    found = variables(mesh, {})
    found |= {"eb_prop1": np.array([10, 7, 8], dtype=np.int32), "eb_names": letters(["wall", "", "springs"])}
    found |= {"connect2": np.array([[1, 2, 3]], dtype=np.int32), "connect3": np.array([[1, 2]], dtype=np.int32)}
    found["eb_status"] = np.ones(3, dtype=np.int32)
    path = tmp_path / "a.exo"
    with h5py.File(write(path, found, ["tetra"] * 3, hdf5=True), "a") as store:
        store["connect2"].attrs["elem_type"], store["connect3"].attrs["elem_type"] = "SHELL3", "BEAM"
    read = fp.read_mesh(path)
    assert read.facets["triangle"].tolist() == [[0, 1, 2]]
    assert read.facet_tag.tolist() == [7]
    assert read.info["source"]["left_out"] == ["BEAM"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"elem_ss1": np.array([3], np.int32)}, "side set 1 names an element that is not there"),
        ({"side_ss1": np.array([5], np.int32)}, "side set 1 names a side that a tetra has not"),
        ({"side_ss1": np.array([1, 2], np.int32)}, "side set 1 lists other elements than sides"),
        ({"coordz": np.zeros(3)}, "coordinates of 3 axes, or of different lengths"),
        ({"ss_prop1": np.empty(0, np.int32)}, "it has a elem_ss1, and 0 numbers in ss_prop1"),
        ({"eb_prop1": np.array([-4], np.int32)}, "eb_prop1 are no numbers that tags can have"),
        ({"connect1": np.zeros((2, 4))}, "connect1 is no list of elements"),
        ({"connect1": np.full((2, 4), 99, np.int32)}, "node 98 .from 0. is used, but there are 8 nodes"),
        ({"name_nod_var": letters(["p"]), "vals_nod_var1": np.zeros((1, 5))}, "variable 1 of nodes has"),
        ({"name_elem_var": letters(["p"]), "vals_elem_var1eb1": np.zeros((1, 5))}, "p has .5,. values"),
    ],
)
def test_what_does_not_fit_together_is_refused(tmp_path: Path, change: dict[str, np.ndarray], words: str) -> None:
    found = {**variables(two_of("tetra"), {"epi": ([1], [1])}), **change}
    with pytest.raises(FileError, match=words):
        fp.read_mesh(write(tmp_path / "a.exo", found, ["tetra"], hdf5=True))


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.exo").write_bytes(b"CDF\x05" + bytes(40))
    with pytest.raises(FileError, match="neither HDF5 nor netCDF"):
        fp.read_mesh(tmp_path / "a.exo")


@pytest.mark.parametrize("hdf5", [False, True], ids=["classic", "hdf5"])
def test_a_file_that_is_cut_short_is_refused(tmp_path: Path, hdf5: bool) -> None:
    path = write(tmp_path / "a.exo", variables(two_of("tetra10"), {}), ["tetra10"], hdf5=hdf5)
    whole = path.read_bytes()
    for size in range(4, len(whole) - 8, 97):
        path.write_bytes(whole[:size])
        with pytest.raises(FileError):
            fp.read_mesh(path)


def test_numbers_of_extended_precision_are_read_and_written(tmp_path: Path) -> None:
    """VTK has no type for them, and their bytes hold what was in the memory."""
    found, kinds = two_steps()
    found |= {f"vals_elem_var{i}eb1": found[f"vals_elem_var{i}eb1"].astype(np.longdouble) for i in (1, 2, 3)}
    mesh = fp.read_mesh(write(tmp_path / "a.exo", found, kinds, hdf5=True))
    assert mesh.cell_data["fibre"].dtype == np.float64
    back = fp.read_mesh(fp.write_mesh(mesh, tmp_path / "a.vtu")[0])
    np.testing.assert_array_equal(back.cell_data["fibre"], mesh.cell_data["fibre"])


@pytest.mark.parametrize("name", ["coordx", "vals_elem_var1eb1", "vals_nod_var4", "elem_ss1"])
@pytest.mark.parametrize("kind", ["D", "S3"])
def test_variables_that_are_no_real_numbers_are_refused(tmp_path: Path, name: str, kind: str) -> None:
    found, kinds = two_steps()
    found[name] = found[name].astype(kind)
    with pytest.raises(FileError, match=r"a\.exo"):
        fp.read_mesh(write(tmp_path / "a.exo", found, kinds, hdf5=True))


def test_sets_of_nodes_are_told(tmp_path: Path) -> None:
    found = variables(two_of("tetra"), {"side": ([1], [1])})
    found |= {"ns_prop1": np.array([7, 8], np.int32), "ns_names": letters(["", "rim"])}
    found |= {"node_ns1": np.array([1], np.int32), "node_ns2": np.array([1, 2], np.int32)}
    mesh = fp.read_mesh(write(tmp_path / "a.exo", found, ["tetra"], hdf5=True))
    assert reported(mesh) == ["sets of nodes 7, rim of the file are left out"]
