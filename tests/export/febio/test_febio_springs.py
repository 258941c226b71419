"""Springs of the pericardium in an FEBio deck: both sides of each facet, with the stiffness at its nodes."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from meshes import APEX_HEIGHT, BASE_HEIGHT, mixed, truncated_ellipsoid

import femprep as fp
from femprep.mesh.elements import ELEMENTS
from femprep.model import FACET_TAGS


def held(kind: str) -> fp.VolumeMesh:
    mesh = mixed() if kind == "mixed" else truncated_ellipsoid(kind)
    height = (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)
    return fp.add_pericardium(mesh.with_data(point={"apicobasal": height}), stiffness=2.0)


@pytest.mark.parametrize("kind", [*ELEMENTS, "mixed"])
def test_both_sides_hold_the_stiffness_at_their_nodes(kind: str, tmp_path: Path) -> None:
    mesh = held(kind)
    fp.write_mesh(mesh, tmp_path / "lv.feb", step="inflation", length_unit="cm")
    root = ElementTree.parse(tmp_path / "lv.feb").getroot()
    loads = [load for load in root.iterfind("Loads/surface_load") if load.get("type") == "pressure Robin BC"]
    assert [load.get("surface") for load in loads] == ["epi", "pericardium_inward"]
    nodes = {}
    for load in loads:
        facets = root.findall(f"Mesh/Surface[@name='{load.get('surface')}']/*")
        nodes[load.get("surface")] = [[int(n) - 1 for n in (facet.text or "").split(",")] for facet in facets]
        assert load.find("spring_eps").get("type") == "map"  # type: ignore[union-attr]
        name = load.findtext("spring_eps")
        rows = root.findall(f"MeshData/SurfaceData[@name='{name}']/face")
        assert [int(row.get("lid", "0")) for row in rows] == list(range(1, len(facets) + 1))
        for row, own in zip(rows, nodes[load.get("surface")]):
            found = np.array((row.text or "").split(","), dtype=float)[: len(own)]
            # 1 kPa/mm is 1e4 dyn/cm2 for each tenth of a centimetre.
            np.testing.assert_allclose(found, 1e5 * np.asarray(mesh.point_data["pericardium"])[own], rtol=1e-12)
    assert len(nodes["epi"]) == np.count_nonzero(mesh.facet_tag == FACET_TAGS["epi"])
    for one, other in zip(nodes["epi"], nodes["pericardium_inward"]):
        corners = {3: 3, 6: 3, 4: 4, 8: 4}[len(one)]
        assert one[0] == other[0]
        assert one[1:corners] == other[1:corners][::-1]
        assert one[corners:] == other[corners:][::-1]


def test_the_inner_side_is_no_tag(tmp_path: Path) -> None:
    mesh = held("tetra")
    fp.write_mesh(mesh, tmp_path / "lv.feb")
    assert fp.read_mesh(tmp_path / "lv.feb").facet_names == mesh.facet_names


def test_without_a_pericardium_there_is_no_such_load(tmp_path: Path) -> None:
    fp.write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.feb", step="inflation")
    assert "Robin" not in (tmp_path / "lv.feb").read_text()
