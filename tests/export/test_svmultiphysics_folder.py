"""What svMultiPhysics asks of a folder beyond its mesh: numbers of 32 bits, caps over nodes of the mesh, springs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from meshes import APEX_HEIGHT, BASE_HEIGHT, truncated_ellipsoid, with_fibres
from vtkmodules.util.numpy_support import vtk_to_numpy

import femprep as fp
from femprep.export.vtk.xml import arrays_of
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.topology import is_closed, is_consistently_wound, volume
from femprep.mesh.vtk.reading import load
from femprep.model import FACET_TAGS
from femprep.model.facets import facet_triangles


def held(kind: str) -> fp.VolumeMesh:
    mesh = with_fibres(truncated_ellipsoid(kind))
    height = (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)
    return fp.add_pericardium(mesh.with_data(point={"apicobasal": height}), stiffness=2.0)


@pytest.mark.parametrize("kind", list(ELEMENTS))
def test_cap_and_endocardium_are_the_cavity(kind: str, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(kind)
    fp.write_mesh(mesh, tmp_path / "lv", format="svmultiphysics")
    cap = load(tmp_path / "lv" / "caps" / "lv.vtp")
    number = arrays_of(cap.GetPointData())["GlobalNodeID"] - 1
    points = vtk_to_numpy(cap.GetPoints().GetData())
    np.testing.assert_array_equal(points, mesh.points[number])
    triangles = number[vtk_to_numpy(cap.GetPolys().GetConnectivityArray()).reshape(-1, 3)]
    endo = facet_triangles(mesh, "endo")
    whole = np.concatenate([endo, triangles])
    assert is_closed(whole)
    assert is_consistently_wound(whole)
    # Both look out of the wall, into the cavity.
    assert -volume(mesh.points, whole) == pytest.approx(fp.cavity_surface(mesh).volume, rel=1e-12)
    assert set(number) <= set(endo.ravel())
    corner = mesh.points[triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    np.testing.assert_allclose(arrays_of(cap.GetCellData())["Normals"], across, atol=1e-12)


def test_numbers_have_32_bits(tmp_path: Path) -> None:
    """svMultiPhysics says of others that there are none."""
    fp.write_mesh(held("tetra"), tmp_path / "lv", format="svmultiphysics")
    files = sorted((tmp_path / "lv").rglob("*.vt[up]"))
    assert len(files) == 9
    for path in files:
        found = load(path)
        for data in (found.GetPointData(), found.GetCellData()):
            for name, values in arrays_of(data).items():
                if name.endswith("ID"):
                    assert values.dtype == np.int32, (path.name, name)


@pytest.mark.parametrize(("unit", "scale"), [("mm", 1e-3), ("cm", 1e5), ("m", 1e6)])
def test_springs_in_the_units_of_the_deck(unit: str, scale: float, tmp_path: Path) -> None:
    mesh = held("tetra")
    fp.write_mesh(mesh, tmp_path / "lv", format="svmultiphysics", step="inflation", length_unit=unit)
    found = arrays_of(load(tmp_path / "lv" / "pericardium.vtp").GetPointData())
    stiffness = np.asarray(mesh.point_data["pericardium"])[found["GlobalNodeID"] - 1]
    np.testing.assert_allclose(found["Stiffness"], stiffness * scale, rtol=1e-12)
    assert found["Stiffness"].max() == pytest.approx(2.0 * scale, rel=1e-4)
    assert not found["Damping"].any()
    root = ElementTree.parse(tmp_path / "lv" / "inflation.xml").getroot()
    robin = [bc for bc in root.iter("Add_BC") if (bc.findtext("Type") or "").strip() == "Robin"]
    assert [bc.get("name") for bc in robin] == ["epi"]


def test_a_mesh_without_them_leaves_nothing_of_an_earlier_one(tmp_path: Path) -> None:
    fp.write_mesh(held("tetra"), tmp_path / "lv", format="svmultiphysics", step="inflation")
    (tmp_path / "lv" / "solver.xml").write_text("mine")
    plain = truncated_ellipsoid("tetra")
    bare = fp.VolumeMesh(
        plain.points, plain.cells, plain.region, plain.facets, np.full(plain.n_facets, FACET_TAGS["epi"])
    )
    fp.write_mesh(bare, tmp_path / "lv", format="svmultiphysics")
    left = {path.relative_to(tmp_path / "lv").as_posix() for path in (tmp_path / "lv").rglob("*") if path.is_file()}
    assert left == {"mesh-complete.mesh.vtu", "mesh-surfaces/epi.vtp", "solver.xml"}


@pytest.mark.parametrize(("kind", "unit"), [("tetra10", "mm"), ("tetra10", "cm"), ("hexahedron", "mm")])
def test_curved_elements_far_from_the_origin_are_written_near_it_and_read_back(
    kind: str, unit: str, tmp_path: Path
) -> None:
    mesh = truncated_ellipsoid(kind)
    mesh = replace(mesh, points=mesh.points + np.array([200.0, 300.0, -100.0]))
    fp.write_mesh(
        mesh, tmp_path / "lv", format="svmultiphysics", step="inflation", material="neo-hookean", length_unit=unit
    )
    scale = {"mm": 1.0, "cm": 0.1}[unit]
    points = load(tmp_path / "lv" / "mesh-complete.mesh.vtu").GetPoints().GetData()
    assert np.abs(vtk_to_numpy(points)).max() < 80.0 * scale
    np.testing.assert_allclose(fp.read_mesh(tmp_path / "lv").points, mesh.points, atol=1e-10)
    assert "coordinates are from" in (tmp_path / "lv" / "inflation.xml").read_text()
    # Without a pressure that follows, coordinates stay.
    fp.write_mesh(mesh, tmp_path / "plain", format="svmultiphysics", step="inflation")
    np.testing.assert_array_equal(fp.read_mesh(tmp_path / "plain").points, mesh.points)
