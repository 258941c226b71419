"""Fibres as dolfinx' checkpoints hold them, where ``cardiac_geometries`` and fenicsx-pulse look for them.

A checkpoint names each degree of freedom of a function cell by cell, in the order in which the mesh's file has the
cells: ``adios4dolfinx`` and ``io4dolfinx`` find through it whatever order dolfinx gives them. Ours are functions of
degree 0, a vector per element.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from femprep.export.xdmf.bp4 import bp4
from femprep.model import FloatArray, IntArray, VolumeMesh

if TYPE_CHECKING:
    import h5py

#: Names of the directions there, and here.
DIRECTIONS: Final[Mapping[str, str]] = {"f0": "fiber", "s0": "sheet", "n0": "normal"}
#: The folder of ADIOS2's that the readers look for beside ``mesh.xdmf``.
FIBRES: Final = "microstructure.bp"
#: Basix' cell name and number, and its order of nodes in ours (VTK's).
_CELLS: Final[Mapping[str, tuple[str, int, tuple[int, ...]]]] = {
    "tetra": ("tetrahedron", 3, (0, 1, 2, 3)),
    "tetra10": ("tetrahedron", 3, (0, 1, 2, 3, 9, 8, 5, 7, 6, 4)),
    "hexahedron": ("hexahedron", 5, (0, 1, 3, 2, 4, 5, 7, 6)),
    "triangle": ("triangle", 2, (0, 1, 2)),
    "triangle6": ("triangle", 2, (0, 1, 2, 4, 5, 3)),
    "quad": ("quadrilateral", 4, (0, 1, 3, 2)),
}
#: Basix' numbers: Lagrange elements, with warped points where their degree is greater than 2.
_LAGRANGE, _WARPED = 1, 2


def elements(mesh: VolumeMesh) -> dict[str, list[int]]:
    """Family, cell, degree and discontinuity of each direction the mesh has, as ``microstructure.json`` says them."""
    cell = _CELLS[next(iter(mesh.cells))][1]
    return {name: [_LAGRANGE, cell, 0, 1] for name in _directions(mesh)}


def write_into(store: h5py.File, mesh: VolumeMesh) -> None:
    """Make the HDF5 file of an XDMF document a checkpoint too, of mesh, tags and fibres.

    ``cardiac_geometries.Geometry.from_file`` reads it with ``io4dolfinx.set_default_backend("h5py")``, without ADIOS2.
    What the document holds already is linked, not written again, where dolfinx has our order of nodes.
    """
    (kind, cells), group = next(iter(mesh.cells.items())), store.create_group("mesh")
    name, _, order = _CELLS[kind]
    degree = 2 if kind == "tetra10" else 1
    group.attrs.update({"CellType": name, "Degree": degree, "LagrangeVariant": _WARPED, "timestamps": np.zeros(1)})
    group["0/Points"] = store["Mesh/geometry"]
    _nodes(group, store["cells/topology"], cells, order)
    tags = [("Cell tags", "cell_tags", kind, cells, 3)]
    tags += [("Facet tags", "facet_tags", *facets, 2) for facets in mesh.facets.items()]
    for label, where, of, nodes, dimension in tags:
        tag = group.create_group(f"tags/{label}")
        tag.attrs.update({"CellType": _CELLS[of][0], "dim": dimension})
        _nodes(tag, store[f"{where}/topology"], nodes, _CELLS[of][2])
        tag["Values"] = store[f"{where}/values"]
    for label, arrays in _functions(mesh).items():
        function = group.create_group(f"functions/{label}")
        function.attrs["timestamps"] = arrays["time"]
        for title, key in (("dofmap", "dofmap"), ("dofmap_offsets", "XDofmap"), ("0/array", "values")):
            function.create_dataset(title, data=arrays[key], track_times=False)


def write_fibres(folder: Path, mesh: VolumeMesh) -> None:
    """Write the directions a mesh has as ``microstructure.bp``, the file of ADIOS2's that the readers open unasked."""
    functions = _functions(mesh)
    if functions:
        (folder / FIBRES).mkdir()
        arrays = {f"{name}_{part}": values for name, parts in functions.items() for part, values in parts.items()}
        for file, content in bp4(arrays).items():
            (folder / FIBRES / file).write_bytes(content)


def _directions(mesh: VolumeMesh) -> dict[str, FloatArray]:
    found = {name: np.asarray(mesh.cell_data[own]) for name, own in DIRECTIONS.items() if own in mesh.cell_data}
    return {name: values.astype(np.float64) for name, values in found.items() if values.shape == (mesh.n_cells, 3)}


def _functions(mesh: VolumeMesh) -> dict[str, dict[str, FloatArray | IntArray]]:
    """Of each direction what a checkpoint says: degrees of freedom cell by cell, where each cell's begin, values."""
    count = 3 * mesh.n_cells
    shared: dict[str, FloatArray | IntArray] = {
        "dofmap": np.arange(count),
        "XDofmap": np.arange(0, count + 1, 3),
        "time": np.zeros(1),
    }
    return {name: {**shared, "values": values.ravel()} for name, values in _directions(mesh).items()}


def _nodes(group: h5py.Group, written: h5py.Dataset, nodes: IntArray, order: tuple[int, ...]) -> None:
    if order == tuple(range(len(order))):
        group["Topology"] = written
    else:
        group.create_dataset("Topology", data=np.asarray(nodes)[:, order], track_times=False)
