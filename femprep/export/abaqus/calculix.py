"""A tagged mesh in, its passive inflation by CalculiX out, checked by the reaction of the base.

The deck is the one that femprep writes, so that what is solved is what a user gets. What the base holds must be minus
the pressure on all free nodes: no wrong facet, node number, orientation or unit survives that.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import DiskFullError, MissingDependencyError
from femprep.export.abaqus.loads import pressure_loads
from femprep.export.abaqus.write import write
from femprep.export.deck.names import facet_names, facet_nodes
from femprep.export.deck.springs import pericardial_springs
from femprep.export.inflation import endocardium
from femprep.mesh.topology import enclosed_volume
from femprep.model import FACET_TAGS, FloatArray, IntArray, VolumeMesh
from femprep.model.blocks import chosen_rows
from femprep.model.facets import facet_triangles
from femprep.model.shared_records.solution import LARGE_DEFORMATIONS_LIMIT, MISFIT_LIMIT, SolutionRecord
from femprep.options import ExportOptions
from femprep.volume.room import is_full
from femprep.volume.tetwild.guard import start_watchdog, watch

PROGRAM: Final = "ccx"
#: Seconds by the clock after which CalculiX is ended.
TIME_LIMIT: Final = 1800.0
#: A deck in mm and N has its pressures in MPa.
_MPA_PER_KPA: Final = 1e-3
_NUMBER: Final = r"\s+(-?\d\.\d+E[+-]\d+)"


def require_calculix() -> str:
    """Path of the program.

    Raises
    ------
    MissingDependencyError
        It is not installed.
    """
    found = shutil.which(PROGRAM)
    if found is None:
        raise MissingDependencyError(
            "--solve ccx needs CalculiX, and no program ccx is found; install it (Debian: calculix-ccx), or leave out"
        )
    return found


def inflate(mesh: VolumeMesh, options: ExportOptions | None = None) -> SolutionRecord:
    """Inflate a mesh in CalculiX, in a child process and a folder of its own.

    Parameters
    ----------
    mesh : VolumeMesh
        With facets ``base`` and ``endo`` (or ``endo_lv``...).
    options : ExportOptions, optional
        Material and pressure.

    Returns
    -------
    SolutionRecord
        Also where CalculiX stops: with what it said.

    Raises
    ------
    MissingDependencyError
        CalculiX is not installed.
    DiskFullError
        There is no room for what it writes.
    InputError
        The mesh has no base, no endocardium, or blood pools.
    """
    program = require_calculix()
    chosen = (options or ExportOptions()).model_copy(update={"length_unit": "mm", "step": "inflation"})
    with tempfile.TemporaryDirectory(prefix="femprep-ccx-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        write(mesh, folder, "heart", chosen)
        said = _run(program, folder)
        if said is not None:
            if is_full(folder):
                raise DiskFullError(f"no room was left for CalculiX in {str(folder.parent)!r}; free some space")
            return SolutionRecord(solver="ccx", converged=False, message=said, pressure_kpa=chosen.pressure)
        return _solution(mesh, folder / "heart.dat", chosen)


def _run(program: str, folder: Path) -> str | None:
    """Run CalculiX on ``heart.inp``; what it said last where it failed. It does not outlive this process."""
    one = dict.fromkeys(("OMP_NUM_THREADS", "CCX_NPROC_RESULTS", "CCX_NPROC_EQUATION_SOLVER"), "1")
    watchdog = start_watchdog(str(folder))
    try:
        with (folder / "log.txt").open("wb") as log:
            child = subprocess.Popen(
                [program, "heart"],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env={**os.environ, **one},
            )
            try:
                watch(watchdog, child.pid)
                status = child.wait(timeout=TIME_LIMIT)
            except subprocess.TimeoutExpired:
                return f"it did not finish within {TIME_LIMIT:g} s"
            finally:
                child.kill()
                child.wait()
    finally:
        watchdog.kill()
        watchdog.wait()
        if watchdog.stdin is not None:
            watchdog.stdin.close()
    if status == 0:
        return None
    lines = (folder / "log.txt").read_text(encoding="utf-8", errors="replace").splitlines()
    errors = [line.strip() for line in lines if "*ERROR" in line] or [line.strip() for line in lines if line.strip()]
    return f"exit status {status}" + (f", {' '.join(errors[0].split())[:200]}" if errors else "")


def _solution(mesh: VolumeMesh, dat: Path, options: ExportOptions) -> SolutionRecord:
    """The record of a finished run, from its table of displacements and its total reaction."""
    record = SolutionRecord(solver="ccx", converged=False, pressure_kpa=options.pressure)
    try:
        reaction, displacement = _read(dat)
    except (OSError, ValueError, IndexError):
        return record.model_copy(update={"message": "its table of results cannot be read"})
    if displacement.shape != mesh.points.shape or not np.isfinite(displacement).all():
        return record.model_copy(update={"message": "its displacements are not finite, or not those of all nodes"})
    moved = mesh.points + displacement
    large = options.material == "neo-hookean"
    loads = pressure_loads(moved if large else mesh.points, _pressed(mesh), options.pressure * _MPA_PER_KPA)
    loads[facet_nodes(mesh, FACET_TAGS["base"])] = 0.0  # these go straight into the support
    load = loads.sum(axis=0)
    springs = pericardial_springs(mesh, options)
    held = np.zeros(3) if springs is None else springs.forces(displacement).sum(axis=0)
    x, y, z = reaction.tolist()
    return SolutionRecord(
        solver="ccx",
        converged=True,
        pressure_kpa=options.pressure,
        greatest_displacement_mm=float(np.linalg.norm(displacement, axis=1).max()),
        cavity_rest_ml=_cavities(mesh),
        cavity_ml=_cavities(replace(mesh, points=moved)),
        reaction_n=(x, y, z),
        misfit_limit=LARGE_DEFORMATIONS_LIMIT if large else MISFIT_LIMIT,
        reaction_misfit=float(np.linalg.norm(reaction + held + load)) / max(float(np.linalg.norm(load)), 1e-300),
    )


def _read(dat: Path) -> tuple[FloatArray, FloatArray]:
    """Total reaction ``(3,)`` and displacements ``(n, 3)`` of the last increment."""
    text = dat.read_text(encoding="ascii", errors="replace")
    force = re.findall(rf"total force[^\n]*\n\s*{_NUMBER * 3}", text)[-1]
    rows = re.findall(rf"^\s*\d+{_NUMBER * 3}\s*$", text[text.rindex("displacements") :], re.MULTILINE)
    return np.array(force, dtype=float), np.array(rows, dtype=float).reshape(-1, 3)


def _pressed(mesh: VolumeMesh) -> dict[str, IntArray]:
    """Facets of every endocardium, by type."""
    names = facet_names(mesh)
    tags = [names[name] for name in endocardium(names)]
    return chosen_rows(mesh.facets, np.isin(mesh.facet_tag, tags))


def _cavities(mesh: VolumeMesh) -> float:
    """Volume of all cavities up to the base, mL. Facets of an endocardium look into its cavity: they are turned."""
    names = endocardium(facet_names(mesh))
    return sum(enclosed_volume(mesh.points, facet_triangles(mesh, name)[:, ::-1]) for name in names) / 1000.0
