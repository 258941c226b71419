"""Meshes of legacy FEniCS in HDF5, as DOLFIN's ``HDF5File`` lays them out."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.errors import FileError


def written(path: Path, order: np.ndarray | None = None) -> fp.VolumeMesh:
    """A mesh with tagged facets and a fibre field of one value at each corner, half of its facets listed inward."""
    mesh = truncated_ellipsoid("tetra", heights=3, around=8, layers=1)
    cells = mesh.cells["tetra"]
    rows = np.arange(len(cells)) if order is None else order
    direction = np.zeros((len(cells), 3, 4))
    direction[np.arange(len(cells)), np.arange(len(cells)) % 3] = 1.0
    with h5py.File(path, "w") as store:
        for name, listed, kind in (("mesh", cells[rows], "tetrahedron"), ("mesh/facets", None, "triangle")):
            group = store.create_group(name)
            group["coordinates"] = mesh.points
            group["topology"] = np.sort(mesh.facets["triangle"], axis=1) if listed is None else listed
            group["topology"].attrs["celltype"] = np.bytes_(kind)
        store["mesh/cell_indices"] = rows
        store["mesh/facets/values"] = mesh.facet_tag.astype(np.uint64)
        store["mesh/facets"].attrs.update({f"marker_name_{name}": tag for name, tag in mesh.facet_names.items()})
        field = store.create_group("fiber")
        field.attrs["signature"] = np.bytes_("VectorElement(FiniteElement('DG', tetrahedron, 1), dim=3)")
        field["vector_0"] = direction.ravel()
        field["cell_dofs"] = np.arange(direction.size)
        field["x_cell_dofs"] = np.arange(0, direction.size + 1, 12)
        field["cells"] = np.arange(len(cells))
    return mesh


@pytest.mark.parametrize("turned", [False, True])
def test_mesh_facets_and_fibres(turned: bool, tmp_path: Path) -> None:
    count = truncated_ellipsoid("tetra", heights=3, around=8, layers=1).n_cells
    order = np.random.default_rng(0).permutation(count) if turned else np.arange(count)
    mesh = written(tmp_path / "a.h5", order)
    read = fp.read_mesh(tmp_path / "a.h5")
    assert read.facet_names == mesh.facet_names
    assert np.bincount(read.facet_tag).tolist() == np.bincount(mesh.facet_tag).tolist()
    assert not any("wound" in failure for failure in fp.check(read).failures)
    assert np.array_equal(np.abs(read.cell_data["fiber"]).argmax(axis=1), order % 3)


def test_other_hdf5_is_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as store:
        store["points"] = np.zeros((3, 3))
    with pytest.raises(FileError, match="FEniCS"):
        fp.read_mesh(tmp_path / "a.h5")
