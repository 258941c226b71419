"""cardiac_geometries takes our dolfinx folder: mesh, tags, markers, info, and by the example's script the fibres.

It needs dolfinx 0.9 or newer: ``FEMPREP_DOLFINX_PYTHON`` names a Python that has both, where the system's has not.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres
from solver_tools import SYSTEM_PYTHON

from femprep.export import write_format
from femprep.export.deck.split import to_tetrahedra
from femprep.model import VolumeMesh

SCRIPT = Path(__file__).parents[2] / "examples" / "cardiac_geometries_fibres.py"


def python() -> list[str]:
    """The command of a Python that has the library; the test is skipped where there is none."""
    command = shlex.split(os.environ.get("FEMPREP_DOLFINX_PYTHON", SYSTEM_PYTHON))
    try:
        found = run([*command, "-c", "import cardiac_geometries"])
    except OSError:
        found = None
    if found is None or found.returncode:
        pytest.skip(f"{command[0]} has no cardiac_geometries; name a Python that has in FEMPREP_DOLFINX_PYTHON")
    return command


def run(command: list[str]) -> subprocess.CompletedProcess[str]:
    keep = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
    return subprocess.run(command, env={**keep, "OMP_NUM_THREADS": "1"}, capture_output=True, text=True, timeout=600)


def expected(mesh: VolumeMesh) -> dict[str, Any]:
    """Volumes, areas and integrals of the directions, of straight elements, from their tetrahedra and triangles."""
    tets = to_tetrahedra(mesh)
    p, q = tets.points[tets.cells["tetra"]], tets.points[tets.facets["triangle"]]
    volume = np.linalg.det(p[:, 1:] - p[:, :1]) / 6
    area = np.linalg.norm(np.cross(q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]), axis=1) / 2
    return {
        **{name.upper(): volume[tets.region == tag].sum() for name, tag in tets.region_names.items()},
        **{name.upper(): area[tets.facet_tag == tag].sum() for name, tag in tets.facet_names.items()},
        "f0": (volume @ tets.cell_data["fiber"]).tolist(),
        "s0": (volume @ tets.cell_data["sheet"]).tolist(),
    }


@pytest.mark.solver
@pytest.mark.parametrize("saved", [False, True], ids=["ours", "saved-again"])
@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge"])
def test_from_folder_gives_tags_and_fibres(kind: str, saved: bool, tmp_path: Path) -> None:
    command = python()
    mesh = with_fibres(truncated_ellipsoid(kind))
    write_format(mesh, tmp_path, "dolfinx")
    more = [str(tmp_path / "saved")] if saved else []
    result = run([*command, str(SCRIPT), str(tmp_path / "dolfinx"), *more])
    assert result.returncode == 0, result.stdout + result.stderr
    line = next(line for line in result.stdout.splitlines() if line.startswith("RESULT"))
    found, wanted = json.loads(line[7:]), expected(mesh)
    assert set(found) == set(wanted)
    for name, value in wanted.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-11, atol=1e-7, err_msg=name)
