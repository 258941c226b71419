"""Meshes that no random damage comes to, each by name: points and elements of all kinds, arrays that disagree."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fuzz.common import Made
from fuzz.sources import Sources
from meshes import truncated_ellipsoid

from femprep.model import VolumeMesh

Odd = Callable[[Sources, Path], Made]
Arrays = tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]
#: Commands that read a mesh, and what each is given beside it.
READERS: dict[str, tuple[list[str], str]] = {
    "check": ([], ""),
    "convert": (["out.inp"], "out.inp"),
    "annotate": (["-o", "out"], "out"),
    "refine": (["-o", "out.vtu"], "out.vtu"),
}


def _tetra() -> VolumeMesh:
    return truncated_ellipsoid("tetra", heights=3, around=8, layers=1)


def _of(change: Callable[[VolumeMesh], Arrays], command: str, ending: str = ".vtu") -> Odd:
    """Points, cells and cell data written as they are."""

    def made(sources: Sources, folder: Path) -> Made:
        import meshio

        points, cells, data = change(_tetra())
        path = folder / f"mesh{ending}"
        lists = {name: [np.split(one, np.cumsum([len(c) for c in cells.values()])[:-1])[i] for i in range(len(cells))]
                 for name, one in data.items()}  # fmt: skip
        meshio.write(path, meshio.Mesh(points, list(cells.items()), cell_data=lists))
        words, out = READERS[command]
        return Made("", [command, str(path), *words, "-q"], out)

    return made


def _points(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[VolumeMesh], Arrays]:
    return lambda m: (change(np.array(m.points)), {"tetra": np.array(m.cells["tetra"])}, {})


def _cells(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[VolumeMesh], Arrays]:
    return lambda m: (np.array(m.points), {"tetra": change(np.array(m.cells["tetra"]))}, {})


def _tags(make: Callable[[int], np.ndarray]) -> Callable[[VolumeMesh], Arrays]:
    return lambda m: (np.array(m.points), {"tetra": np.array(m.cells["tetra"])}, {"region": make(m.n_cells)})


def _with(array: np.ndarray, where: object, value: object) -> np.ndarray:
    array[where] = value
    return array


_CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [0.5, 0.5, 2]]
)


def _mixed(mesh: VolumeMesh) -> Arrays:
    top = np.array([[4, 5, 6, 7, 8]])
    return 30.0 * _CUBE, {"hexahedron": np.arange(8)[None], "pyramid": top}, {}


def _pyramids(mesh: VolumeMesh) -> Arrays:
    return 30.0 * _CUBE, {"pyramid": np.array([[4, 5, 6, 7, 8]])}, {}


def _quadratic(kind: str, count: int) -> Callable[[VolumeMesh], Arrays]:
    def made(mesh: VolumeMesh) -> Arrays:
        return np.random.default_rng(1).normal(size=(count, 3)), {kind: np.arange(count)[None]}, {}

    return made


SHAPES: dict[str, Callable[[VolumeMesh], Arrays]] = {
    "a point that is not a number": _points(lambda p: _with(p, 3, np.nan)),
    "a point at infinity": _points(lambda p: _with(p, 3, np.inf)),
    "all points one": _points(np.zeros_like),
    "all points in a plane": _points(lambda p: p * [1, 1, 0]),
    "points of 1e11 mm": _points(lambda p: p * 1e10),
    "points of 1e-12 mm": _points(lambda p: p * 1e-13),
    "points of 1e-200 mm": _points(lambda p: p * 1e-200),
    "a thousand points unused": _points(lambda p: np.concatenate([p, np.ones((1000, 3))])),
    "points twice": lambda m: (
        np.repeat(m.points, 2, axis=0), {"tetra": 2 * np.array(m.cells["tetra"]) + np.arange(4) % 2}, {}
    ),
    "elements apart": lambda m: (
        m.points[m.cells["tetra"]].reshape(-1, 3), {"tetra": np.arange(4 * m.n_cells).reshape(-1, 4)}, {}
    ),
    "elements twice": _cells(lambda c: np.concatenate([c, c])),
    "elements of no volume": _cells(lambda c: _with(c, (slice(5), 3), c[:5, 2])),
    "elements of one point": _cells(lambda c: _with(c, slice(5), 7)),
    "all elements inverted": _cells(lambda c: c[:, ::-1]),
    "half of the elements inverted": _cells(lambda c: np.where(np.arange(len(c))[:, None] % 2, c, c[:, ::-1])),
    "one element": _cells(lambda c: c[:1]),
    "two elements at a point": _cells(lambda c: c[[0, -1]]),
    "no elements": _cells(lambda c: c[:0]),
    "every other element": _cells(lambda c: c[::2]),
    "triangles alone": lambda m: (np.array(m.points), {"triangle": np.array(m.cells["tetra"])[:, :3]}, {}),
    "lines alone": lambda m: (np.array(m.points), {"line": np.array(m.cells["tetra"])[:, :2]}, {}),
    "vertices alone": lambda m: (np.array(m.points), {"vertex": np.array(m.cells["tetra"])[:, :1]}, {}),
    "a plane mesh": lambda m: (np.array(m.points) * [1, 1, 0], {"quad": np.array(m.cells["tetra"])}, {}),
    "hexahedron and pyramid": _mixed,
    "pyramids": _pyramids,
    "a hexahedron of 20 nodes at random": _quadratic("hexahedron20", 20),
    "a hexahedron of 27 nodes at random": _quadratic("hexahedron27", 27),
    "a wedge of 15 nodes at random": _quadratic("wedge15", 15),
    "a tetrahedron of 10 nodes at random": _quadratic("tetra10", 10),
    "regions that are not a number": _tags(lambda n: np.full(n, np.nan)),
    "regions of halves": _tags(lambda n: np.arange(n) / 2.0),
    "negative regions": _tags(lambda n: -np.arange(n) - 1),
    "a region each": _tags(np.arange),
    "regions of 2^62": _tags(lambda n: np.full(n, 2**62)),
    "regions of three columns": _tags(lambda n: np.ones((n, 3))),
}  # fmt: skip


def _hdf5(change: Callable[[Any], None]) -> Odd:
    """The MED file of the mesh, changed inside."""

    def made(sources: Sources, folder: Path) -> Made:
        import h5py

        import femprep as fp

        path = folder / "mesh.med"
        fp.write_mesh(_tetra(), path)
        with h5py.File(path, "r+") as file:
            change(file)
        return Made("", ["convert", str(path), "out.vtu", "-q"], "out.vtu")

    return made


def _datasets(file: Any, end: str) -> list[str]:
    found: list[str] = []
    file.visit(lambda name: found.append(name) if name.endswith(end) and hasattr(file[name], "dtype") else None)
    return found


def _replaced(end: str, make: Callable[[np.ndarray], np.ndarray]) -> Callable[[Any], None]:
    def change(file: Any) -> None:
        for name in _datasets(file, end):
            old, kept = file[name][()], dict(file[name].attrs)
            del file[name]
            file[name] = make(old)
            file[name].attrs.update(kept)

    return change


HDF5: dict[str, Odd] = {
    "MED: half of the coordinates": _hdf5(_replaced("COO", lambda a: a[: len(a) // 2])),
    "MED: coordinates of words": _hdf5(_replaced("COO", lambda a: np.full(len(a), b"x"))),
    "MED: coordinates not a number": _hdf5(_replaced("COO", lambda a: a * np.nan)),
    "MED: corners beyond all": _hdf5(_replaced("NOD", lambda a: a + 2**40)),
    "MED: negative corners": _hdf5(_replaced("NOD", lambda a: -a)),
    "MED: corners of halves": _hdf5(_replaced("NOD", lambda a: a + 0.5)),
    "MED: one family fewer": _hdf5(_replaced("FAM", lambda a: a[:-1])),
    "MED: no such family": _hdf5(_replaced("FAM", lambda a: a * 0 - 77)),
    "MED: nothing in it": _hdf5(lambda file: [file.__delitem__(name) for name in list(file)] and None),
    "MED: no families": _hdf5(lambda file: file.__delitem__("FAS")),
    "MED: no mesh": _hdf5(lambda file: file.__delitem__("ENS_MAA")),
}

MESHES: dict[str, Odd] = {
    **{f"{command}: {name}": _of(change, command) for name, change in SHAPES.items() for command in READERS},
    **HDF5,
}
