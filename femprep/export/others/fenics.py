"""A mesh of legacy FEniCS in HDF5 in; a volume mesh with its regions, facets and fields out."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np

from femprep.errors import InputError
from femprep.export.deck.names import Numbers
from femprep.export.turned import outward_facets, turned_tetrahedra
from femprep.export.xdmf.grids import markers_of
from femprep.export.xdmf.tagged import places
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.model.notice import Notice, noted

#: Our types of elements and facets, by FEniCS' names.
_KINDS: Final = {"tetrahedron": "tetra", "hexahedron": "hexahedron", "triangle": "triangle", "quadrilateral": "quad"}
#: Our names of directions, by how those of pulse and cardiac_geometries begin.
_AXES: Final = {"fib": "fiber", "f0": "fiber", "sheet_n": "normal", "n0": "normal", "sheet": "sheet", "s0": "sheet"}
#: How far from 1 the lengths of directions may be; at an apex some are 0.
_UNIT: Final = 1e-2


def read(path: Path) -> VolumeMesh:
    """Read what DOLFIN's ``HDF5File`` has written: a mesh, functions of its cells and facets, and fields.

    Names of tags stand with them, as pulse writes them, or in ``markers.json``. A field becomes data of elements: the
    mean over each, of unit vectors the mean direction.

    Raises
    ------
    InputError
        There is no mesh of tetrahedra or hexahedra.
    """
    with h5py.File(path, "r") as store:
        groups: list[h5py.Group] = [store]
        store.visititems(lambda _, found: groups.append(found) if isinstance(found, h5py.Group) else None)
        whole = next((one for one in groups if _kind(one) in ("tetra", "hexahedron") and "values" not in one), None)
        if whole is None:
            raise InputError("holds no VTKHDF data set and no mesh of legacy FEniCS; of an XDMF mesh give the .xdmf")
        points, kind, cells = whole["coordinates"][:], _kind(whole), whole["topology"][:].astype(np.int64)
        named = markers_of(path)
        numbers, left_out = Numbers(), []
        region, aha = np.zeros(len(cells), dtype=np.int32), np.zeros(len(cells), dtype=np.int32)
        facets: dict[str, IntArray] = {}
        facet_tag: np.ndarray = np.empty(0, dtype=np.int32)
        for group in (one for one in groups if "values" in one and "topology" in one):
            own, rows, tags = _kind(group), group["topology"][:].astype(np.int64), group["values"][:].astype(np.int64)
            names = {int(tag): name[12:] for name, tag in group.attrs.items() if name.startswith("marker_name_")}
            names = names or {tag: name for name, tag, dim in named if dim == 3 - (own != kind)}
            set_ = (tags > 0) & (tags < 2**31)  # FEniCS' number of what has none is the largest there is
            if own == kind and not names and set(range(1, 17)) <= {*tags.tolist()} <= set(range(18)):
                aha[places(cells, rows, group.name)] = tags
            elif own == kind:
                region[places(cells, rows, group.name)] = np.where(set_, numbers.of_tags(tags, names, facet=False), 0)
            elif own in ("triangle", "quad") and np.array_equal(group["coordinates"], points):
                facets, facet_tag = {own: rows[set_]}, numbers.of_tags(tags[set_], names, facet=True)
            elif set_.any():
                left_out.append(group.name)
        order = np.argsort(whole["cell_indices"][:]) if "cell_indices" in whole else np.arange(len(cells))
        data: dict[str, np.ndarray] = {name: _means(group, order) for name, group in _fields(groups)}
    data |= {"aha": aha} if aha.any() else {}
    told = [Notice.of("left out", f"functions {', '.join(left_out)} of the file are left out")] if left_out else []
    mesh = turned_tetrahedra(
        VolumeMesh(
            points=points,
            cells={kind: cells},
            region=region,
            facets=facets,
            facet_tag=facet_tag.astype(np.int32),
            cell_data=data,
            info=noted({"source": {"region": "functions", "facet_tag": "functions"}, **numbers.info}, *told),
        )
    )
    return outward_facets(mesh)


def _kind(group: h5py.Group) -> str:
    """Our type of what a group lists; an empty text where it lists nothing."""
    listed = group.get("topology")
    word = listed.attrs.get("celltype", b"") if isinstance(listed, h5py.Dataset) and "coordinates" in group else b""
    return _KINDS.get(word.decode() if isinstance(word, bytes) else str(word), "")


def _fields(groups: list[h5py.Group]) -> list[tuple[str, h5py.Group]]:
    """Fields by our names: pulse lists fibre, sheet and normal in this order."""
    listed = [str(np.bytes_(one.attrs["names"]).decode()).split(":") for one in groups if "names" in one.attrs]
    ordered = {name: axis for names in listed for name, axis in zip(names, ("fiber", "sheet", "normal"))}
    found = []
    for group in groups:
        if "vector_0" in group and "cell_dofs" in group:
            name = group.name.rsplit("/", 1)[-1]
            found.append((ordered.get(name) or next((a for w, a in _AXES.items() if name.startswith(w)), name), group))
    return found


def _means(group: h5py.Group, order: IntArray) -> FloatArray:
    """Mean of a field over each element."""
    width = 3 if "dim=3" in str(group.attrs.get("signature", "")) else 1
    values: Any = group["vector_0"][:].ravel()[group["cell_dofs"][:]].reshape(len(order), width, -1)
    at = np.empty_like(values)
    at[order[group["cells"][:].astype(np.int64)]] = values
    if width == 1:
        return np.asarray(at.mean(axis=(1, 2)))
    if np.median(np.abs(np.linalg.norm(at, axis=1) - 1.0)) > _UNIT:
        return np.asarray(at.mean(axis=2))
    axis = np.linalg.eigh(at @ at.transpose(0, 2, 1))[1][:, :, 2]
    return np.asarray(axis * np.where((axis * at.sum(axis=2)).sum(axis=1) < 0.0, -1.0, 1.0)[:, None])
