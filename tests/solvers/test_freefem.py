"""FreeFEM reads the Medit file with its tags and fibres and agrees with CalculiX."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres
from solver_tools import calculix_results, require_program, run_calculix

from femprep.export import write_mesh

pytestmark = pytest.mark.solver


def test_freefem_reads_tags_and_fibres_and_finds_the_displacement(tmp_path: Path) -> None:
    program = require_program("FreeFem++")
    mesh = with_fibres(truncated_ellipsoid("tetra"))
    write_mesh(mesh, tmp_path / "lv.mesh")
    shutil.copy(Path(__file__).parent / "inflation.edp", tmp_path)
    result = subprocess.run(
        [program, "-nw", "-v", "0", "inflation.edp"], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert result.returncode == 0, result.stdout[-3000:] + result.stderr
    lines = [line.split() for line in result.stdout.splitlines() if line.strip()]
    found = {
        tuple(words[:2]): np.array(words[2:], dtype=float) for words in lines if words[0] in {"volume", "area", "fibre"}
    }
    assert [int(n) for n in next(words for words in lines if words[0] == "elements")[1::2]] == [
        mesh.n_cells,
        len(mesh.points),
    ]

    p = mesh.points[mesh.cells["tetra"]]
    volume = np.linalg.det(p[:, 1:] - p[:, :1]) / 6
    q = mesh.points[mesh.facets["triangle"]]
    area = np.linalg.norm(np.cross(q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]), axis=1) / 2
    fiber = np.asarray(mesh.cell_data["fiber"])
    for tag in mesh.region_names.values():
        chosen = mesh.region == tag
        assert found["volume", str(tag)] == pytest.approx(volume[chosen].sum(), rel=1e-10)
        np.testing.assert_allclose(found["fibre", str(tag)], volume[chosen] @ fiber[chosen], rtol=1e-9, atol=1e-6)
    for tag in mesh.facet_names.values():
        assert found["area", str(tag)] == pytest.approx(area[mesh.facet_tag == tag].sum(), rel=1e-10)

    write_mesh(mesh, tmp_path / "lv.inp", step="inflation")
    assert run_calculix(tmp_path / "lv.inp").returncode == 0
    _, displacement = calculix_results(tmp_path / "lv.dat")
    greatest = float(next(words[1] for words in lines if words[0] == "greatest"))
    assert greatest == pytest.approx(np.linalg.norm(displacement, axis=1).max(), rel=1e-6)
