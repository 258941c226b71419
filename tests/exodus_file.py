"""Exodus II files of our meshes, written as Cubit and MOOSE do: netCDF's classic kind or HDF5."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
from scipy.io import netcdf_file

import femprep as fp
from femprep.mesh.elements import ELEMENTS

WORDS = {
    "tetra": "TETRA4",
    "tetra10": "TETRA10",
    "wedge": "WEDGE",
    "wedge15": "WEDGE15",
    "hexahedron": "HEX8",
    "hexahedron20": "HEX20",
}
#: Exodus' order of nodes by ours: the vertical edges come before the upper ones.
ORDER = {
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
    "hexahedron20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
}

CORNERS = {
    4: [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    6: [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)],
    8: [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
}


def letters(words: list[str]) -> np.ndarray:
    return np.array([list(word.ljust(33, "\0")) for word in words], dtype="S1")


def variables(mesh: fp.VolumeMesh, sides: Mapping[str, tuple[list[int], list[int]]]) -> dict[str, np.ndarray]:
    """What a file of a mesh holds, a block for each type; of each side set elements and sides, from 1."""
    found = {f"coord{axis}": values for axis, values in zip("xyz", mesh.points.T)}
    blocks = list(mesh.cells.items())
    found["eb_prop1"] = np.arange(60, 60 + len(blocks), dtype=np.int32)
    found["eb_names"] = letters([f"wall_{kind}" for kind, _ in blocks])
    found["eb_status"] = np.ones(len(blocks), dtype=np.int32)
    for i, (kind, rows) in enumerate(blocks, 1):
        found[f"connect{i}"] = (rows[:, ORDER[kind]] if kind in ORDER else rows).astype(np.int32) + 1
    if sides:
        found["ss_prop1"] = np.arange(300, 300 + len(sides), dtype=np.int32)
        found["ss_names"] = letters(list(sides))
        found["ss_status"] = np.ones(len(sides), dtype=np.int32)
    for i, (elements, numbers) in enumerate(sides.values(), 1):
        found[f"elem_ss{i}"], found[f"side_ss{i}"] = np.array(elements, np.int32), np.array(numbers, np.int32)
    return found


def write(path: Path, found: Mapping[str, np.ndarray], kinds: list[str], *, hdf5: bool) -> Path:
    """Write variables, the blocks of which are of the types given."""
    if hdf5:
        with h5py.File(path, "w") as store:
            for name, values in found.items():
                store[name] = values
                if name.startswith("connect"):
                    store[name].attrs["elem_type"] = np.bytes_(WORDS[kinds[int(name[7:]) - 1]])
        return path
    with netcdf_file(path, "w") as file:
        file.api_version = file.version = np.float32(5.22)
        file.floating_point_word_size = np.int32(8)
        file.title, file.file_size = b"femprep", np.int32(1)  # axes apart
        own = {
            "coordx": ("num_nodes",),
            "coordy": ("num_nodes",),
            "coordz": ("num_nodes",),
            **{f"{what}_{part}": (f"num_{long}",) for what, long in BLOCKS for part in ("prop1", "status")},
            **{f"{what}_names": (f"num_{long}", "len_name") for what, long in BLOCKS},
            **{f"connect{i}": (f"num_el_in_blk{i}", f"num_nod_per_el{i}") for i in range(1, 9)},
            **{f"{what}_ss{i}": (f"num_side_ss{i}",) for what in ("elem", "side") for i in range(1, 9)},
            **{f"name_{what}_var": (f"num_{what}_var", "len_name") for what in ("nod", "elem")},
            **{f"vals_nod_var{i}": ("time_step", "num_nodes") for i in range(1, 9)},
            **{f"vals_elem_var{i}eb{k}": ("time_step", f"num_el_in_blk{k}") for i in range(1, 9) for k in range(1, 9)},
            "time_whole": ("time_step",),
        }
        file.createDimension("time_step", None)
        sizes = {"len_name": 33, "num_dim": 3, "num_elem": sum(len(v) for n, v in found.items() if "connect" in n)}
        for name, values in found.items():
            sizes.update({at: size for at, size in zip(own[name], values.shape) if at != "time_step"})
        for at, size in sizes.items():
            file.createDimension(at, size)
        for name, values in found.items():
            variable = file.createVariable(name, "c" if values.dtype.kind == "S" else values.dtype, own[name])
            variable[:] = values
            if name.startswith("connect"):
                variable.elem_type = WORDS[kinds[int(name[7:]) - 1]].encode()
            if name.endswith("prop1"):
                variable.name = b"ID"
    return path


BLOCKS = (("eb", "el_blk"), ("ss", "side_sets"))


def two_of(kind: str) -> fp.VolumeMesh:
    """Two elements of a type, each node at a place of its own, mid-side nodes somewhat out of the middle."""
    element = ELEMENTS[kind]
    corners = np.array(CORNERS[element.corners]) * [1.0, 2.0, 3.0]
    middle = [(corners[a] + corners[b]) / 2 + 0.01 for a, b in element.edges] if element.quadratic else []
    one, n = np.vstack([corners, *middle]), element.nodes
    rows = np.arange(2 * n).reshape(2, n)
    return fp.VolumeMesh(points=np.vstack([one, one + 5.0]), cells={kind: rows}, region=np.full(2, 10))


def two_blocks() -> fp.VolumeMesh:
    """A hexahedron and two tetrahedra apart from it."""
    tets, hexa = two_of("tetra"), two_of("hexahedron")
    return fp.VolumeMesh(
        points=np.vstack([hexa.points, tets.points + 50.0]),
        cells={"hexahedron": hexa.cells["hexahedron"][:1], "tetra": tets.cells["tetra"] + 16},
        region=np.array([10, 11, 11]),
    )


def two_steps() -> tuple[dict[str, np.ndarray], list[str]]:
    """What a file of them holds, with a side set and data at two times, and their types."""
    mesh = two_blocks()
    found, count = variables(mesh, {"epi": ([1, 3], [6, 4])}), len(mesh.points)
    found |= {"time_whole": np.arange(2.0), "name_nod_var": letters(["dispx", "dispy", "dispz", "p"])}
    found |= {f"vals_nod_var{i}": np.full((2, count), 10.0 * i) + np.array([[0.0], [1.0]]) for i in range(1, 5)}
    found |= {"name_elem_var": letters(["fibre_X", "fibre_Y", "fibre_Z", "age"])}
    for i in range(1, 4):
        found |= {f"vals_elem_var{i}eb1": np.full((2, 1), float(i)), f"vals_elem_var{i}eb2": np.full((2, 2), -float(i))}
    found["vals_elem_var4eb1"] = np.ones((2, 1))
    return found, list(mesh.cells)
