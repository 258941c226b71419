"""A tagged mesh in, its passive inflation by CalculiX out: fields, and a record checked by the reaction of the base.

The deck is the one that femprep writes, so that what is solved is what a user gets. What the base holds must be minus
the pressure on all free nodes: no wrong facet, node number, orientation or unit survives that.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import DiskFullError, MissingDependencyError
from femprep.export.abaqus.loads import pressure_loads
from femprep.export.abaqus.write import write
from femprep.export.content import content_of
from femprep.export.deck.names import facet_names, facet_nodes, held
from femprep.export.deck.springs import pericardial_springs
from femprep.export.inflation import cavity_of, pressures, require
from femprep.export.vtu.strain import principal_strains
from femprep.mesh.measures.volume_elements import all_volumes, element_measures
from femprep.mesh.topology import enclosed_volume
from femprep.model import FloatArray, VolumeMesh
from femprep.model.blocks import chosen_rows
from femprep.model.facets import facet_triangles
from femprep.model.shared_records.solution import (
    LARGE_DEFORMATIONS_LIMIT,
    MISFIT_LIMIT,
    STRAIN_LIMITS,
    InflatedCavity,
    SolutionRecord,
)
from femprep.options import ExportOptions
from femprep.volume.room import is_full
from femprep.volume.tetwild.guard import start_watchdog, watch

PROGRAM: Final = "ccx"
#: Seconds by the clock after which CalculiX is ended.
TIME_LIMIT: Final = 1800.0
#: A deck in mm and N has its pressures in MPa.
_MPA_PER_KPA: Final = 1e-3
_NUMBER: Final = r"\s+(-?\d\.\d+E[+-]\d+)"
#: What is asked for besides the deck's own tables: strains and stresses in global axes, at the end alone.
_TABLES: Final = "*EL PRINT, ELSET=EALL, GLOBAL=YES, FREQUENCY=1000\nE, S\n*END STEP\n"
#: Share of the wall's volume whose strain the judged one is not below.
_HIGHEST: Final = 0.01


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


def inflate(mesh: VolumeMesh, options: ExportOptions | None = None) -> tuple[SolutionRecord, VolumeMesh | None]:
    """Inflate a mesh in CalculiX, in a child process and a folder of its own.

    Parameters
    ----------
    mesh : VolumeMesh
        With facets ``base`` and ``endo`` (or ``endo_lv``...).
    options : ExportOptions, optional
        Material and pressure.

    Returns
    -------
    record : SolutionRecord
        Also where CalculiX stops: with what it said.
    inflated : VolumeMesh or None
        The mesh as it was, with ``displacement`` (mm) at its points, and in its elements ``strain`` (Green-Lagrange,
        of linear materials the small one) and ``stress`` (Cauchy, kPa), nine components each, and ``principal_strain``
        (stretch less 1), the largest by its size. None where nothing was solved.

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
    require(content_of(mesh), chosen)
    record = SolutionRecord(
        material=chosen.material,
        cavities=_cavities(mesh, chosen),
        strain_limit=STRAIN_LIMITS[chosen.material],
        misfit_limit=LARGE_DEFORMATIONS_LIMIT if chosen.material == "neo-hookean" else MISFIT_LIMIT,
    )
    with tempfile.TemporaryDirectory(prefix="femprep-ccx-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        write(mesh, folder, "heart", chosen)
        deck = folder / "heart.inp"
        deck.write_text(deck.read_text("ascii").replace("*END STEP\n", _TABLES), "ascii")
        said = _run(program, folder)
        if said is not None:
            if is_full(folder):
                raise DiskFullError(f"no room was left for CalculiX in {str(folder.parent)!r}; free some space")
            return record.model_copy(update={"message": said}), None
        return _solution(mesh, folder / "heart.dat", chosen, record)


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
    state = folder / "heart.sta"
    rows = [line.split() for line in state.read_text("ascii", "replace").splitlines()] if state.exists() else []
    done = [float(row[4]) for row in rows if len(row) == 7 and row[0].isdigit() and row[2].isdigit()]
    lines = (folder / "log.txt").read_text(encoding="utf-8", errors="replace").splitlines()
    errors = [line.strip() for line in lines if "*ERROR" in line] or [line.strip() for line in lines if line.strip()]
    ended = f"exit status {status}" + (f", {' '.join(errors[0].split())[:200]}" if errors else "")
    if not done:
        return ended
    return f"it came to {100 * done[-1]:.0f} % of it ({ended}); lower --pressure below that, or raise --young-modulus"


def _solution(
    mesh: VolumeMesh, dat: Path, options: ExportOptions, record: SolutionRecord
) -> tuple[SolutionRecord, VolumeMesh | None]:
    """The record and the fields of a finished run, from its tables."""
    try:
        reaction, displacement, fields = _read(dat, len(held(facet_names(mesh))))
        moved = mesh.points + displacement
        if len(fields["stress"]) != mesh.n_cells or not np.isfinite(moved).all():
            raise ValueError
    except (OSError, ValueError, IndexError):
        said = "its tables of results cannot be read, are not finite, or not those of all nodes and elements"
        return record.model_copy(update={"message": said}), None
    load = _load(moved if options.material == "neo-hookean" else mesh.points, mesh, options)
    springs = pericardial_springs(mesh, options)
    sprung = np.zeros(3) if springs is None else springs.forces(displacement).sum(axis=0)
    largest, volume = principal_strains(mesh, displacement), all_volumes(mesh.points, mesh.cells)
    order = np.argsort(largest)
    highest = np.searchsorted(np.cumsum(volume[order]), (1 - _HIGHEST) * volume.sum())
    least = [element_measures(moved, block, name)["relative_jacobian"] for name, block in mesh.cells.items()]
    found = {
        "converged": True,
        "cavities": _cavities(mesh, options, moved),
        "greatest_displacement_mm": float(np.linalg.norm(displacement, axis=1).max()),
        "strain": float(largest[order[highest]]),
        "greatest_strain": float(largest.max()),
        "inverted_elements": int(np.sum(np.concatenate(least) <= 0)),
        "reaction_n": tuple(reaction.tolist()),
        "reaction_misfit": float(np.linalg.norm(reaction + sprung + load)) / max(float(np.linalg.norm(load)), 1e-300),
    }
    fields["principal_strain"] = largest
    return record.model_copy(update=found), mesh.with_data(point={"displacement": displacement}, cell=fields)


def _read(dat: Path, supports: int) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
    """Reaction of all supports, N, displacements ``(n, 3)``, mm, strain, stress ``(n_cells, 9)``, kPa, at the end."""
    text = dat.read_text(encoding="ascii", errors="replace")
    forces = re.findall(rf"total force[^\n]*time  0\.1000000E\+01\n\s*{_NUMBER * 3}", text)[-supports:]
    parts = re.split(r"^ (displacements|strains|stresses) .*$", text, flags=re.MULTILINE)
    blocks = {name: np.loadtxt(part.splitlines()) for name, part in dict(zip(parts[1::2], parts[2::2])).items()}
    means = {"strain": _means(blocks["strains"]), "stress": _means(blocks["stresses"]) / _MPA_PER_KPA}
    return np.array(forces, dtype=float).sum(axis=0), blocks["displacements"][:, 1:], means


def _means(table: FloatArray) -> FloatArray:
    """Mean of each element, nine components, of rows ``element, point, xx, yy, zz, xy, xz, yz``."""
    element = table[:, 0].astype(np.int64) - 1
    six = [np.bincount(element, column) / np.bincount(element) for column in table[:, 2:].T]
    return np.stack([six[i] for i in (0, 3, 4, 3, 1, 5, 4, 5, 2)], axis=1)


def _load(points: FloatArray, mesh: VolumeMesh, options: ExportOptions) -> FloatArray:
    """Force of the pressures on all nodes that the base does not hold ``(3,)``, N."""
    names = facet_names(mesh)
    load = np.zeros(3)
    for name, pressure in pressures(names, options).items():
        pressed = chosen_rows(mesh.facets, mesh.facet_tag == names[name])
        forces = pressure_loads(points, pressed, pressure * _MPA_PER_KPA)
        for base in held(names):  # these go straight into the support
            forces[facet_nodes(mesh, names[base])] = 0.0
        load += forces.sum(axis=0)
    return load


def _cavities(mesh: VolumeMesh, options: ExportOptions, moved: FloatArray | None = None) -> tuple[InflatedCavity, ...]:
    """Every cavity with its pressure and its volume up to the base, mL; also with the points moved, where given."""
    found = []
    for name, pressure in pressures(facet_names(mesh), options).items():
        wall = facet_triangles(mesh, name)[:, ::-1]  # facets look into the cavity: they are turned
        rest, inflated = (None if x is None else enclosed_volume(x, wall) / 1000 for x in (mesh.points, moved))
        found.append(InflatedCavity(name=cavity_of(name), pressure_kpa=pressure, rest_ml=rest, inflated_ml=inflated))
    return tuple(found)
