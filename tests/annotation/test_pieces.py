"""A file of several surfaces, as modellers publish them: which is the epicardium, which a cavity."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista
import trimesh
from own_shapes import cup
from surface_shapes import sphere

import femprep as fp
from femprep.annotation.pieces import read_piece
from femprep.errors import InputError
from femprep.model import Surface


def polydata(surface: Surface) -> pyvista.PolyData:
    return pyvista.PolyData.from_regular_faces(surface.points, surface.triangles)


def together(*surfaces: Surface) -> pyvista.PolyData:
    return pyvista.merge([polydata(one) for one in surfaces], merge_points=False)


@pytest.mark.parametrize("kind", ["vtp", "vtu", "stl", "vtm"])
def test_pieces_are_named_by_their_position(kind: str, tmp_path: Path) -> None:
    lv, epi = cup("lv"), cup("epi")
    path = tmp_path / f"heart.{kind}"
    if kind == "stl":  # of two solids
        parts = [trimesh.Trimesh(one.points, one.triangles, process=False) for one in (lv, epi)]
        path.write_text("\n".join(trimesh.exchange.stl.export_stl_ascii(part) for part in parts))
    elif kind == "vtm":
        pyvista.MultiBlock({"a": polydata(lv), "b": polydata(epi)}).save(path)
    elif kind == "vtu":
        together(lv, epi).cast_to_unstructured_grid().save(path)
    else:
        together(lv, epi).save(path)
    found = fp.read_surfaces(path)
    assert set(found) == {"lv", "epi"}
    for name, own in (("lv", lv), ("epi", epi)):
        assert len(found[name].cells) == len(own.triangles)
        assert np.allclose(np.ptp(found[name].points, axis=0), np.ptp(own.points, axis=0), atol=1e-4)


def test_the_thicker_and_rounder_of_two_cavities_is_the_left_one(tmp_path: Path) -> None:
    left, right = sphere(18.0, (20.0, 0.0, 0.0), 3), sphere(15.0, (-24.0, 0.0, 0.0), 3)
    flat = Surface(right.points * [0.7, 1.5, 1.5] - [2.0, 0.0, 0.0], right.cells)
    epi = sphere(40.0, (4.0, 0.0, 0.0), 4)
    wide = Surface(epi.points * [1.15, 1.0, 1.0], epi.cells)
    together(left, wide, flat).save(tmp_path / "biv.vtp")
    found = fp.read_surfaces(tmp_path / "biv.vtp")
    assert found["lv"].points.mean(axis=0)[0] > 0 > found["rv"].points.mean(axis=0)[0]


def test_the_closed_boundary_of_a_wall_is_parted_into_its_sides(tmp_path: Path) -> None:
    lv, epi = cup("lv"), cup("epi")
    solid = trimesh.boolean.difference([_solid(epi), _solid(lv, 0.01)])
    solid.export(tmp_path / "wall.ply")
    found = fp.read_surfaces(tmp_path / "wall.ply")
    assert set(found) == {"lv", "epi"}
    for name, own in (("lv", lv), ("epi", epi)):
        assert np.allclose(np.ptp(found[name].points, axis=0), np.ptp(own.points, axis=0), atol=0.1)
    assert fp.prepare_surfaces(found).base is not None


def _solid(surface: Surface, up: float = 0.0) -> trimesh.Trimesh:
    from femprep.mesh.topology import closed_by_fans

    points, cells = closed_by_fans(surface.points, surface.triangles)
    return trimesh.Trimesh(points + np.array([0.0, 0.0, up]), cells, process=False)


def test_surfaces_beside_each_other_are_refused_with_the_choices(tmp_path: Path) -> None:
    path = tmp_path / "both.vtp"
    together(sphere(30.0), sphere(20.0, (80.0, 0.0, 0.0))).save(path)
    with pytest.raises(InputError, match=r"both\.vtp#1.*both\.vtp#2"):
        fp.read_surfaces(path)
    assert read_piece(f"{path}#2").points.mean(axis=0)[0] == pytest.approx(80.0)
    with pytest.raises(InputError, match="2 pieces"):
        read_piece(f"{path}#3")


def test_one_open_surface_has_no_wall(tmp_path: Path) -> None:
    polydata(cup("lv")).save(tmp_path / "lv.vtp")
    with pytest.raises(InputError, match="open"):
        fp.read_surfaces(tmp_path / "lv.vtp")
