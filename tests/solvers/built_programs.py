"""Programs that no package has, run where a variable of the environment names them: FEBio and svMultiPhysics."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

FEBIO, SVMULTIPHYSICS = "FEMPREP_FEBIO", "FEMPREP_SVMULTIPHYSICS"

#: FEBio's own integration, written out beside each type; tests ask for CalculiX' where the two differ.
_LOG = """<logfile>
<node_data data="ux;uy;uz;Rx;Ry;Rz" file="nodes.txt" delim=","/>
</logfile>
</Output>"""


def require_built(variable: str) -> str:
    """Path of the program a variable names; the test is skipped where it names none."""
    named = os.environ.get(variable)
    if not named:
        pytest.skip(f"{variable} names no program; docs/how-to/solver-programs.md says how to build it")
    assert Path(named).is_file(), f"{variable} names {named!r}, which is no file"
    return named


def _run(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    # Open MPI runs as root only where told so twice.
    environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, errors="replace", timeout=900
    )


def run_febio(deck: Path) -> tuple[str, np.ndarray, np.ndarray]:
    """What FEBio says of a deck, displacements and reactions ``(n, 3)`` of the last step; the deck prints them too."""
    deck.write_text(deck.read_text().replace("</Output>", _LOG))
    result = _run([require_built(FEBIO), "-i", deck.name], deck.parent)
    said = result.stdout + result.stderr
    assert "N O R M A L   T E R M I N A T I O N" in said, said[-3000:]
    assert result.returncode == 0, said[-3000:]
    block = (deck.parent / "nodes.txt").read_text().split("*Data")[-1].split("\n", 1)[1]
    table = np.array([line.split(",") for line in block.split("\n") if line.strip()], dtype=float)
    assert np.array_equal(table[:, 0], np.arange(1, len(table) + 1))
    return said, table[:, 1:4], table[:, 4:7]


def febio_version(said: str) -> str:
    """The version in what FEBio says first."""
    found = re.search(r"version\s+(\d+\.\d+\.\d+)", said, flags=re.IGNORECASE)
    assert found, said[:1000]
    return found[1]


def run_svmultiphysics(folder: Path, processes: int = 1) -> tuple[str, np.ndarray]:
    """What svMultiPhysics says of ``inflation.xml`` in a folder, and the displacements ``(n, 3)`` of the last step."""
    import meshio

    program = require_built(SVMULTIPHYSICS)
    result = _run([program, "inflation.xml"], folder)
    said = result.stdout + result.stderr
    assert result.returncode == 0, said[-3000:]
    files = sorted(folder.glob(f"{processes}-procs/result_*.vtu"))
    assert files, said[-3000:]
    found = meshio.read(files[-1])
    order = np.argsort(found.point_data["GlobalNodeID"].ravel()) if "GlobalNodeID" in found.point_data else slice(None)
    return said, found.point_data["Displacement"][order]
