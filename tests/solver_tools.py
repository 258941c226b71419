"""What the solver tests share: finding and running the programs, and the loads a pressure must give."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from femprep.export import write_mesh
from femprep.mesh.elements import FACET_CORNERS
from femprep.model import FACET_TAGS, VolumeMesh

#: The Python that Debian's dolfinx and dolfin packages belong to.
SYSTEM_PYTHON = "/usr/bin/python3"


def require_program(name: str) -> str:
    """Path of a program; the test is skipped where it is not installed."""
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


def require_system_module(name: str) -> None:
    """Skip the test where the system's Python has no such module."""
    if not Path(SYSTEM_PYTHON).exists() or _system([SYSTEM_PYTHON, "-c", f"import {name}"], Path("/")).returncode:
        pytest.skip(f"the system's Python has no {name}")


def run_system_python(script: Path, folder: Path, *arguments: str) -> str:
    """Output of a script run by the system's Python, free of this environment."""
    result = _system([SYSTEM_PYTHON, str(script), *arguments], folder)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def _system(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    keep = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
    environment = {**keep, "PATH": "/usr/bin:/bin", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=600)


def dolfinx_python(needs: str) -> list[str]:
    """The command of the Python that FEMPREP_DOLFINX_PYTHON names, the system's otherwise; skip where it lacks some."""
    command = shlex.split(os.environ.get("FEMPREP_DOLFINX_PYTHON", SYSTEM_PYTHON))
    try:
        there = run_dolfinx_python([*command, "-c", needs]).returncode == 0
    except OSError:
        there = False
    if not there:
        pytest.skip(f"{command[0]} fails at {needs!r}; name a Python that does not in FEMPREP_DOLFINX_PYTHON")
    return command


def run_dolfinx_python(command: list[str], limit: float = 600) -> subprocess.CompletedProcess[str]:
    """Run that Python, free of this environment."""
    keep = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
    # Debian's ADIOS2 takes its library with MPI, which the readers need, by this alone.
    keep |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "ADIOS2_ALWAYS_USE_MPI": "1"}
    return subprocess.run(command, env=keep, capture_output=True, text=True, timeout=limit)


def run_calculix(deck: Path) -> subprocess.CompletedProcess[str]:
    """Run CalculiX on a deck, in the deck's folder."""
    program = require_program("ccx")
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "CCX_NPROC_RESULTS": "1", "CCX_NPROC_EQUATION_SOLVER": "1"}
    command = [program, deck.stem]
    return subprocess.run(command, cwd=deck.parent, env=environment, capture_output=True, text=True, timeout=600)


def calculix_results(dat: Path) -> tuple[np.ndarray, np.ndarray]:
    """Total reaction ``(3,)`` and displacements ``(n, 3)`` of the last increment in a ``.dat`` file."""
    text = dat.read_text()
    number = r"-?\d\.\d+E[+-]\d+"
    totals = re.findall(rf"total force \(fx,fy,fz\)[^\n]*\n\s*({number})\s+({number})\s+({number})", text)
    block = text[text.rindex("displacements") :]
    rows = re.findall(rf"^\s*(\d+)\s+({number})\s+({number})\s+({number})\s*$", block, flags=re.MULTILINE)
    table = np.array(rows, dtype=float)
    assert np.array_equal(table[:, 0], np.arange(1, len(table) + 1))
    return np.array(totals[-1], dtype=float), table[:, 1:]


def pressure_loads(mesh: VolumeMesh, pressure: float, tag: int = FACET_TAGS["endo"]) -> np.ndarray:
    """Nodal forces ``(n, 3)`` of a pressure on the facets of a tag: minus the integral of p N n over them.

    Of a plane linear triangle that is p A n / 3 at each corner. Written from the shape functions, not from the code
    under test.
    """
    loads = np.zeros((len(mesh.points), 3))
    first = 0
    for kind, block in mesh.facets.items():
        chosen = block[mesh.facet_tag[first : first + len(block)] == tag]
        first += len(block)
        for weight, values, slopes in _rule(kind):
            tangents = np.einsum("fnx,nd->fdx", mesh.points[chosen], slopes)
            normal = np.cross(tangents[:, 0], tangents[:, 1])
            force = -pressure * weight * normal[:, None, :] * values[None, :, None]
            np.add.at(loads, chosen.ravel(), force.reshape(-1, 3))
    return loads


def robin_force(mesh: VolumeMesh, displacement: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Force ``(3,)`` on an epicardium with stiffnesses at its points, against what it moves along its moved normal."""
    force = np.zeros(3)
    first = 0
    for kind, block in mesh.facets.items():
        chosen = block[mesh.facet_tag[first : first + len(block)] == FACET_TAGS["epi"]]
        first += len(block)
        for weight, values, slopes in _rule(kind):
            tangents = np.einsum("fnx,nd->fdx", (mesh.points + displacement)[chosen], slopes)
            area = np.cross(tangents[:, 0], tangents[:, 1])
            normal = area / np.linalg.norm(area, axis=1, keepdims=True)
            along = np.sum(normal * np.einsum("fnx,n->fx", displacement[chosen], values), axis=1)
            force -= weight * ((stiffness[chosen] @ values) * along) @ area
    return force


def _rule(kind: str) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Weight, shape functions and their slopes at the points of a rule that is exact enough for a facet."""
    if FACET_CORNERS[kind] == 3:
        # Degree 2, as CalculiX has on six-node facets: exact where they are plane, its own choice where they are not.
        spots = [(1 / 6, x, y) for x, y in ((1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3))]
    else:
        nodes, weights = np.polynomial.legendre.leggauss(3)
        spots = [(wx * wy, x, y) for x, wx in zip(nodes, weights) for y, wy in zip(nodes, weights)]
    functions = {"triangle": _triangle, "triangle6": _triangle6, "quad": _quad, "quad8": _quad8}[kind]
    step = 1e-6
    out = []
    for weight, x, y in spots:
        # The functions are polynomials of degree 2 or 3: central differences are exact but for rounding.
        slopes = [(functions(x + dx, y + dy) - functions(x - dx, y - dy)) / (2 * step)
                  for dx, dy in ((step, 0.0), (0.0, step))]  # fmt: skip
        out.append((weight, functions(x, y), np.column_stack(slopes)))
    return out


def _triangle(x: float, y: float) -> np.ndarray:
    return np.array([1 - x - y, x, y])


def _triangle6(x: float, y: float) -> np.ndarray:
    z = 1 - x - y
    return np.array([z * (2 * z - 1), x * (2 * x - 1), y * (2 * y - 1), 4 * z * x, 4 * x * y, 4 * y * z])


def _quad(x: float, y: float) -> np.ndarray:
    return np.array([(1 - x) * (1 - y), (1 + x) * (1 - y), (1 + x) * (1 + y), (1 - x) * (1 + y)]) / 4


def _quad8(x: float, y: float) -> np.ndarray:
    corners = [(1 + i * x) * (1 + j * y) * (i * x + j * y - 1) / 4 for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    along_x = [(1 - x**2) * (1 + j * y) / 2 for j in (-1, 1)]
    along_y = [(1 - y**2) * (1 + i * x) / 2 for i in (1, -1)]
    return np.array([*corners, along_x[0], along_y[0], along_x[1], along_y[1]])


def calculix_large(mesh: VolumeMesh, folder: Path, **changes: object) -> tuple[np.ndarray, np.ndarray]:
    """Reaction and displacements of our inflation by CalculiX, with large displacements whatever the material.

    A second step at constant load follows: CalculiX takes the pressure on the wall as it was one iteration before, and
    stops where that changes little; holding the load lets the two come together.
    """
    large = "*STEP, NLGEOM=YES, INC=100\n*STATIC\n0.1, 1., 0.001, 0.1\n"
    deck = folder / "large.inp"
    write_mesh(mesh, deck, step="inflation", **changes)
    text = deck.read_text().replace("*STEP\n*STATIC\n", large)
    text += f"{large}*NODE PRINT, NSET=base, TOTALS=ONLY\nRF\n*NODE PRINT, NSET=NALL\nU\n*END STEP\n"
    deck.write_text(text)
    result = run_calculix(deck)
    assert result.returncode == 0, result.stdout[-2000:]
    return calculix_results(deck.with_suffix(".dat"))
