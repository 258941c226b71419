"""cardiac_geometries takes our dolfinx folder as it is: mesh, tags, markers, info and fibres.

It needs dolfinx 0.9 or newer: ``FEMPREP_DOLFINX_PYTHON`` names a Python that has both, where the system's has not.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres
from solver_tools import dolfinx_python, run_dolfinx_python

from femprep.export import write_format
from femprep.export.deck.split import to_tetrahedra
from femprep.model import VolumeMesh

SCRIPT = Path(__file__).parent / "cardiac_geometries_read.py"
#: How each is read, and what must be there for it.
READERS = {"folder": "import adios2, cardiac_geometries", "file": "import io4dolfinx, cardiac_geometries"}


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
@pytest.mark.parametrize("how", READERS)
@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge"])
def test_it_gives_tags_and_fibres(kind: str, how: str, tmp_path: Path) -> None:
    command = dolfinx_python(READERS[how])
    mesh = with_fibres(truncated_ellipsoid(kind))
    write_format(mesh, tmp_path, "dolfinx")
    result = run_dolfinx_python([*command, str(SCRIPT), str(tmp_path / "dolfinx"), how])
    assert result.returncode == 0, result.stdout + result.stderr
    line = next(line for line in result.stdout.splitlines() if line.startswith("RESULT"))
    found, wanted = json.loads(line[7:]), expected(mesh)
    assert set(found) == set(wanted)
    for name, value in wanted.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-11, atol=1e-7, err_msg=name)
