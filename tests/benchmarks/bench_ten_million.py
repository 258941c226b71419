"""A left ventricle of ten million tetrahedra, the whole way: seconds and peak memory of each stage, files read back.

    FEMPREP_DATA=... python tests/benchmarks/bench_ten_million.py                 0.54 mm: ten million or more
    FEMPREP_DATA=... python tests/benchmarks/bench_ten_million.py --edge 1.2      a million

Coordinates, AHA segments and fibres are added, ``.vtu`` and openCARP's files written, quality judged and the page made,
as ``femprep mesh --fibres`` does. Then VTK and MeshTool (``pip install pymeshtool``, left out where it is missing) read
the files in processes of their own, and what they find is compared with the mesh: numbers, tags, nodes, fibres.
Seconds are of the processor, fTetWild's own process included, and by the clock beside them; memory is the high-water
mark of the process. A first small run, which is not counted, compiles the kernels.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from bench_stages import peak_memory

import femprep as fp
from femprep.report import output

#: Parts of the stage ``write`` that are timed by themselves, by their names in ``femprep.report.output``.
PARTS = {
    "shown": "what the page shows",
    "_write_vtk": "write .vtu and surfaces",
    "write_format": "write openCARP, as text and binary",
    "_content": "page's content",
    "_write_manifest": "hashes",
}


FORMATS = ("opencarp", "opencarp-binary")


class Table:
    """Rows of seconds and memory: a progress callable for stages, and a wrapper for functions."""

    def __init__(self) -> None:
        self._start: dict[str, tuple[float, float]] = {}

    def __call__(self, stage: str, fraction: float) -> None:
        if fraction == 0.0 and stage not in self._start:
            self._begin(stage)
        elif fraction == 1.0 and stage in self._start:
            self._end(stage)

    def timed(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **keywords: Any) -> Any:
            self._begin(name)
            try:
                return function(*args, **keywords)
            finally:
                self._end(name)

        return call

    def _begin(self, name: str) -> None:
        Path("/proc/self/clear_refs").write_text("5")  # resets the high-water mark
        self._start[name] = (processor(), time.perf_counter())

    def _end(self, name: str) -> None:
        used, clock = self._start.pop(name)
        row(name, processor() - used, time.perf_counter() - clock, peak_memory() / 1000.0)


def processor() -> float:
    """Seconds of the processor of this process and of those that it waited for."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def row(name: str, seconds: float, clock: float, gigabytes: float) -> None:
    print(f"| {name} | {seconds:.1f} | {clock:.1f} | {gigabytes:.2f} |", flush=True)


def make(image: Path, edge: float, folder: Path) -> None:
    """Mesh and write; keep beside it what readers are to find."""

    def run(length: float, out: Path, table: Any) -> fp.VolumeMesh:
        table("read", 0.0)
        seg = fp.read_segmentation(image, preset="acdc")
        table("read", 1.0)
        volume = {"edge_length": length, "memory_limit": 24.0}
        made = fp.mesh_segmentation(seg, preset="acdc", volume=volume, fibres={}, formats=FORMATS, progress=table)
        fp.write_run(made, out, source=image, progress=table)
        return made.mesh

    run(3.0, folder / "small", lambda stage, fraction: None)
    table, start = Table(), processor()
    for name, title in PARTS.items():
        setattr(output, name, table.timed(title, getattr(output, name)))
    print("| | processor, s | clock, s | peak, GB |\n|---|---|---|---|")
    mesh = run(edge, folder / "out", table)
    print(f"\n{processor() - start:.0f} processor seconds in all; {mesh!r}")
    for name, value in sorted(size_of(folder / "out").items(), key=lambda item: -item[1])[:6]:
        print(f"{name}: {value:.1f} MB")
    np.savez(
        folder / "wanted.npz",
        points=mesh.points,
        tetra=mesh.cells["tetra"],
        region=mesh.region,
        fiber=mesh.cell_data["fiber"],
        facets=[mesh.n_facets],
    )


def size_of(folder: Path) -> dict[str, float]:
    """Megabytes of each file."""
    return {str(file.relative_to(folder)): file.stat().st_size / 1e6 for file in folder.rglob("*") if file.is_file()}


def read_vtk(folder: Path) -> None:
    """Read ``mesh.vtu`` by VTK alone and compare."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(folder / "out" / "mesh.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    wanted = np.load(folder / "wanted.npz")
    data = grid.GetCellData()
    compare("points", vtk_to_numpy(grid.GetPoints().GetData()), wanted["points"])
    compare("nodes", vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4), wanted["tetra"])
    compare("tags", vtk_to_numpy(data.GetArray("region")), wanted["region"])
    compare("fibres", vtk_to_numpy(data.GetArray("fiber")), wanted["fiber"])
    facets = grid.GetFieldData().GetArray("facets_triangle").GetNumberOfTuples()
    compare("number of facets", np.array([facets]), wanted["facets"])


def read_meshtool(folder: Path) -> None:
    """Read openCARP's files by MeshTool and compare."""
    import pymeshtool as meshtool

    found = meshtool.Mesh(str(folder / "out" / "opencarp" / "mesh"))
    wanted = np.load(folder / "wanted.npz")
    compare("points", np.asarray(found.points), wanted["points"] * 1000.0, 1e-9)
    compare("nodes", np.asarray(found.elements[2]).reshape(-1, 4), wanted["tetra"])
    compare("tags", np.asarray(found.element_tags), wanted["region"])
    compare("fibres", np.asarray(found.fibers)[:, 0], wanted["fiber"], 1e-6)  # in single precision there


def compare(what: str, found: Any, wanted: Any, tolerance: float = 0.0) -> None:
    """Say whether arrays agree; end with status 1 where they do not."""
    same = found.shape == wanted.shape
    worst = float(np.abs(found - wanted).max()) if same else float("nan")
    print(f"  {what}: {wanted.shape}, greatest difference {worst:.3g}")
    if not worst <= tolerance:
        sys.exit(f"{what} are not those of the mesh: {found.shape} for {wanted.shape}, {worst:.3g} apart")


#: Who reads: the module it needs, and the function.
READERS = {"vtk": ("vtkmodules", read_vtk), "meshtool": ("pymeshtool", read_meshtool)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", default="patient007_frame01", help="frame of the ACDC training data")
    parser.add_argument("--edge", type=float, default=0.54, help="edge length, mm")
    parser.add_argument("--folder", type=Path, help="keep the files here")
    parser.add_argument("--child", choices=["make", *READERS], help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child == "make":
        data = Path(os.environ["FEMPREP_DATA"]) / "acdc" / "training" / given.case[:10]
        make(data / f"{given.case}_gt.nii.gz", given.edge, given.folder)
        return
    if given.child:
        READERS[given.child][1](given.folder)
        return
    with tempfile.TemporaryDirectory() as temporary:
        folder = given.folder or Path(temporary)
        folder.mkdir(exist_ok=True)
        for name in ("make", *READERS):
            module = READERS[name][0] if name in READERS else "femprep"
            if find_spec(module) is None:
                print(f"left out: {name}, as {module} is not installed")
                continue
            print("made:\n" if name == "make" else f"read by {name}:", flush=True)
            command = [sys.executable, __file__, "--child", name, "--folder", str(folder)]
            command += ["--edge", str(given.edge), "--case", given.case]
            start = time.perf_counter()
            done = subprocess.run(command)
            print(f"  {time.perf_counter() - start:.1f} s by the clock, exit status {done.returncode}")
            if done.returncode:
                sys.exit(1)


if __name__ == "__main__":
    main()
