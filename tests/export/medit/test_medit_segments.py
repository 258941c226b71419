"""AHA segments of a Medit file: a scalar for each element in a ``.sol``, block by block as the ``.mesh`` has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid

from femprep.export import write_mesh

SECTIONS = {"tetra": "SolAtTetrahedra", "wedge": "SolAtPrisms", "hexahedron": "SolAtHexahedra"}


@pytest.mark.parametrize("kind", ["tetra", "mixed"])
def test_segments_lie_beside_the_mesh(kind: str, tmp_path: Path) -> None:
    mesh = mixed() if kind == "mixed" else truncated_ellipsoid(kind)
    segments = np.arange(mesh.n_cells, dtype=np.int32) % 17 + 1
    written = write_mesh(mesh.with_data(cell={"aha": segments}), tmp_path / "lv.mesh")
    assert {path.name for path in written} == {"lv.mesh", "lv.aha.sol"}
    words = (tmp_path / "lv.aha.sol").read_text().split()
    assert words[:4] == ["MeshVersionFormatted", "2", "Dimension", "3"]
    assert words[-1] == "End"
    found = []
    for name, block in mesh.cells.items():
        at = words.index(SECTIONS[name])
        assert words[at + 1 : at + 4] == [str(len(block)), "1", "1"]  # one field, a scalar
        found += words[at + 4 : at + 4 + len(block)]
    assert len(words) == 5 + mesh.n_cells + 4 * len(mesh.cells)
    assert np.array_equal(np.array(found, dtype=int), segments)


def test_no_segments_no_file(tmp_path: Path) -> None:
    assert [path.name for path in write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.mesh")] == ["lv.mesh"]
