"""Springs of the pericardium in a keyword file, as PyDyna reads them: direction, factor, node, and the basal ring."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from meshes import APEX_HEIGHT, BASE_HEIGHT, truncated_ellipsoid

import femprep as fp
from femprep.export.deck.springs import pericardial_springs
from femprep.options import ExportOptions


@pytest.mark.slow
@pytest.mark.parametrize("unit", ["mm", "cm"])
def test_pydyna_reads_springs_and_ring(unit: str, tmp_path: Path) -> None:
    dyna = pytest.importorskip("ansys.dyna.core")
    mesh = truncated_ellipsoid("tetra")
    height = (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)
    mesh = fp.add_pericardium(mesh.with_data(point={"apicobasal": height}), stiffness=0.5)
    fp.write_mesh(mesh, tmp_path / "lv.k", length_unit=unit)
    deck = dyna.Deck()
    deck.loads((tmp_path / "lv.k").read_text())
    assert not deck.string_keywords
    by_title = {entry.get_title(): entry for entry in deck.keywords}
    elements, ways = by_title["*ELEMENT_DISCRETE"].elements, by_title["*DEFINE_SD_ORIENTATION"].vectors
    wanted = pericardial_springs(mesh, ExportOptions(length_unit=unit))
    assert wanted is not None
    assert np.array_equal(elements["n1"].to_numpy(dtype=int), wanted.node + 1)
    assert (elements["n2"].to_numpy(dtype=int) == 0).all()  # the ground
    assert np.array_equal(elements["eid"].to_numpy(dtype=int), mesh.n_cells + 1 + np.arange(len(wanted.node)))
    material = by_title["*MAT_SPRING_ELASTIC"]
    np.testing.assert_allclose(
        elements["s"].to_numpy(dtype=float) * material.k, wanted.stiffness, rtol=1e-12, atol=1e-13
    )
    at = dict(zip(ways["vid"].to_numpy(dtype=int), ways[["xt", "yt", "zt"]].to_numpy(dtype=float)))
    found = np.array([at[number] for number in elements["vid"].to_numpy(dtype=int)])
    np.testing.assert_allclose(found, wanted.normal, atol=1e-7)
    parts = next(entry.parts for entry in deck.get_kwds_by_type("PART") if "pericardium" in str(entry.parts["heading"]))
    row = parts[parts["pid"].astype(int) == int(elements["pid"].iloc[0])]
    assert int(row["secid"].iloc[0]) == by_title["*SECTION_DISCRETE"].secid
    assert int(row["mid"].iloc[0]) == material.mid
    ring = next(e for e in deck.get_kwds_by_type("SET") if getattr(e, "title", "") == "basal_ring")
    assert sorted(int(n) - 1 for n in ring.nodes) == np.flatnonzero(mesh.point_data["basal_ring"]).tolist()
    assert fp.read_mesh(tmp_path / "lv.k").n_cells == mesh.n_cells


def test_without_a_pericardium_there_are_none(tmp_path: Path) -> None:
    fp.write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.k")
    assert "DISCRETE" not in (tmp_path / "lv.k").read_text()
