"""Write the page of what solvers made of our decks: ``python tests/solvers/solver_table.py docs/solved.md``.

CalculiX is taken from the path, FEBio and svMultiPhysics from FEMPREP_FEBIO and FEMPREP_SVMULTIPHYSICS, the real heart
from FEMPREP_DATA; all have to be there, so that no row is left empty. About half an hour.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from built_programs import febio_version, run_febio, run_svmultiphysics
from meshes import mixed, truncated_ellipsoid, with_fibres
from solver_tools import calculix_large, calculix_results, pressure_loads, robin_force, run_calculix

import femprep as fp
from femprep.errors import InputError
from femprep.export import write_mesh
from femprep.export.deck.names import facet_nodes
from femprep.export.deck.springs import pericardial_springs
from femprep.mesh.elements import ELEMENTS
from femprep.model import FACET_TAGS, VolumeMesh
from femprep.options import ExportOptions

KPA = 1e-3
KINDS = (*ELEMENTS, "mixed")
HEAD = """\
# What solvers solved

Made by `tests/solvers/solver_table.py`. The mesh is a small leaning wall between two ellipsoids ({sizes}); the deck an
inflation by 1 kPa with the base held, E = 30 kPa, nu = 0.4, as `--step inflation` writes it. Every mesh has fibres; the
same decks without give the same numbers to 1e-9, as the tests hold, but for the orthotropic one, which needs them.

- *beside CalculiX*: the greatest displacement's relative difference from CalculiX' on the same mesh, in the same law.
  FEBio has large displacements whatever the material, so CalculiX' linear and orthotropic steps have them there too.
- *balance*: reactions of the base plus the pressure on the (deformed) wall, by its size.
- FEBio's elements as it takes them by itself: eight integration points in a ten-node tetrahedron (CalculiX four), six
  in a wedge (two), and a pressure field of their own in neo-Hookean hexahedra and wedges. With CalculiX' integration it
  gives CalculiX' displacements to 1e-6 at every point of tetrahedra of both orders and of hexahedra, which the tests
  ask for. svMultiPhysics integrates quadratic elements otherwise than CalculiX as well; its wedges are refused, as
  it takes the slopes of their shape functions at one point for those at all (displacements a tenth off, on finer meshes
  too), and so are hexahedra of twenty nodes where pressure follows the wall, whose faces it stops on.

"""
REAL = """
## A real heart

ACDC patient007 at end-diastole, the same load, fibres by default; *held* with a pericardium of 0.5 kPa/mm at the apex,
which CalculiX has as springs at points and the others on facets (*balance* with what they press). Meshes: {sizes}.

"""
COLUMNS = ("program", "material", "element", "loads", "solves", "greatest, mm", "beside CalculiX", "balance", "s")


@dataclass(frozen=True)
class Row:
    """What one program made of one deck."""

    displacement: np.ndarray
    reaction: np.ndarray | None
    deformed: bool


def main(page: Path) -> None:
    """Run all decks and write the page."""
    versions: dict[str, str] = {}
    meshes = {kind: with_fibres(mixed() if kind == "mixed" else truncated_ellipsoid(kind)) for kind in KINDS}
    rows = _table(meshes, versions)
    real = real_heart()
    text = HEAD.format(sizes=f"elements: {_sizes(meshes)}")
    text += "| program | version | built by |\n| --- | --- | --- |\n"
    text += "".join(f"| {name} | {versions[name]} | {built} |\n" for name, built in BUILT.items())
    text += f"\n{rows}{REAL.format(sizes=_sizes(real))}{_table(real, versions)}"
    page.write_text(text, encoding="utf-8")


def real_heart() -> dict[str, VolumeMesh]:
    """By name: filled by fTetWild, free and held, and swept with ten-node tetrahedra and with hexahedra."""
    path = Path(os.environ["FEMPREP_DATA"]) / "acdc/training/patient007/patient007_frame01_gt.nii.gz"
    seg = fp.read_segmentation(path, preset="acdc")

    def filled(**changes: dict[str, object]) -> VolumeMesh:
        return fp.add_fibres(fp.add_coordinates(fp.mesh_segmentation(seg, preset="acdc", **changes).mesh))

    tetra = filled(volume={"edge_length": 6.0})
    swept = {"mesher": "sweep", "edge_length": 7.5}
    return {
        "tetra": tetra,
        "tetra, held": fp.add_pericardium(tetra, stiffness=0.5),
        "tetra10, swept": filled(volume={**swept, "order": 2}),
        "hexahedron, swept": filled(volume=swept, sweep={"element": "hexahedron"}),
    }


def _sizes(meshes: dict[str, VolumeMesh]) -> str:
    return ", ".join(f"{kind} {mesh.n_cells}" for kind, mesh in meshes.items())


def _table(meshes: dict[str, VolumeMesh], versions: dict[str, str]) -> str:
    """What each program made of each mesh in each material."""
    rows = []
    for kind, mesh in meshes.items():
        for material in ("linear", "neo-hookean", "orthotropic"):
            beside: dict[bool, float] = {}
            for program, run in PROGRAMS.items():
                rows.append(_row(program, run, mesh, kind, material, beside, versions))
                print(" | ".join(rows[-1]), flush=True)
    order = {name: place for place, name in enumerate(PROGRAMS)}
    rows.sort(key=lambda row: order[row[0]])
    return "".join(f"| {' | '.join(row)} |\n" for row in (COLUMNS, ("---",) * len(COLUMNS), *rows))


def _row(
    program: str,
    run: Callable[[VolumeMesh, Path, str, dict[str, str]], Row],
    mesh: VolumeMesh,
    kind: str,
    material: str,
    beside: dict[bool, float],
    versions: dict[str, str],
) -> tuple[str, ...]:
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        try:
            found = run(mesh, Path(folder), material, versions)
        except InputError as error:
            return (program, material, kind, f"refused by femprep: {error}", *("not written",) * 5)
        seconds = f"{time.perf_counter() - start:.1f}"
        greatest = float(np.linalg.norm(found.displacement, axis=1).max())
        if program == "CalculiX":
            beside[found.deformed] = greatest
        elif found.deformed not in beside:
            _, own = calculix_large(mesh, Path(folder), material=material)
            beside[True] = float(np.linalg.norm(own, axis=1).max())
    off = "itself" if program == "CalculiX" else f"{abs(greatest / beside[found.deformed] - 1):.1e}"
    return (program, material, kind, "yes", "yes", f"{greatest:.6f}", off, _balance(mesh, found, program), seconds)


def _balance(mesh: VolumeMesh, found: Row, program: str) -> str:
    if found.reaction is None:
        return "it writes no reactions"
    at = replace(mesh, points=mesh.points + found.displacement) if found.deformed else mesh
    loads = pressure_loads(at, KPA)
    if program == "CalculiX":  # what presses on held points goes straight into the support there
        loads[facet_nodes(mesh, FACET_TAGS["base"])] = 0.0
    total = loads.sum(axis=0)
    springs = np.zeros(3)
    if "pericardium" in mesh.point_data and program == "CalculiX":
        springs = pericardial_springs(mesh, ExportOptions()).forces(found.displacement).sum(axis=0)
    elif "pericardium" in mesh.point_data:
        springs = robin_force(mesh, found.displacement, np.asarray(mesh.point_data["pericardium"]) * KPA)
    return f"{np.abs(found.reaction + total + springs).max() / np.linalg.norm(total):.1e}"


def _calculix(mesh: VolumeMesh, folder: Path, material: str, versions: dict[str, str]) -> Row:
    versions["CalculiX"] = subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout.split()[-1]
    if material == "neo-hookean":
        reaction, displacement = calculix_large(mesh, folder, material=material)
        return Row(displacement, reaction, True)
    write_mesh(mesh, folder / "lv.inp", step="inflation", material=material)
    result = run_calculix(folder / "lv.inp")
    assert result.returncode == 0, result.stdout
    reaction, displacement = calculix_results(folder / "lv.dat")
    return Row(displacement, reaction, False)


def _febio(mesh: VolumeMesh, folder: Path, material: str, versions: dict[str, str]) -> Row:
    write_mesh(mesh, folder / "lv.feb", step="inflation", material=material)
    said, displacement, reaction = run_febio(folder / "lv.feb")
    versions["FEBio"] = febio_version(said)
    return Row(displacement, reaction.sum(axis=0), True)


def _svmultiphysics(mesh: VolumeMesh, folder: Path, material: str, versions: dict[str, str]) -> Row:
    write_mesh(mesh, folder / "lv", format="svmultiphysics", step="inflation", material=material)
    said, displacement = run_svmultiphysics(folder / "lv")
    named = re.search(r"version[:\s]+(\S+)", said, flags=re.IGNORECASE)
    versions["svMultiPhysics"] = named[1] if named else "sources of July 2026, which name none"
    return Row(displacement, None, material == "neo-hookean")


PROGRAMS = {"CalculiX": _calculix, "FEBio": _febio, "svMultiPhysics": _svmultiphysics}
BUILT = {
    "CalculiX": "Debian, package `calculix-ccx`",
    "FEBio": "us, from its public sources, without Intel's library ([how](how-to/solver-programs.md))",
    "svMultiPhysics": "us, from its public sources, without Trilinos ([how](how-to/solver-programs.md))",
}

if __name__ == "__main__":
    main(Path(sys.argv[1]))
