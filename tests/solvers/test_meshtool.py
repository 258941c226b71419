"""MeshTool, of openCARP's authors, reads our openCARP files: the same mesh, the same wall, and goes on with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid, with_fibres

from femprep.export import write_mesh
from femprep.export.deck.names import facet_nodes
from femprep.export.opencarp.write import CARP_TYPES
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.model import REGION_TAGS, VolumeMesh

meshtool = pytest.importorskip("pymeshtool", reason="pymeshtool is not installed, or has no wheel here")

KINDS = ["tetra", "tetra10", "wedge", "hexahedron", "mixed"]
NUMBERS = {"tetra": 0, "hexahedron": 1, "wedge": 4}
#: MeshTool holds fibres in single precision.
SINGLE = 1e-7


def mesh_of(kind: str, *, fibres: bool = True, blood: bool = False) -> VolumeMesh:
    mesh = mixed() if kind == "mixed" else truncated_ellipsoid(kind)
    mesh = with_fibres(mesh) if fibres else mesh
    if blood:  # what lies in the left half; where it lies is nothing to MeshTool
        centres = np.concatenate([mesh.points[block].mean(axis=1) for block in mesh.cells.values()])
        mesh = replace(mesh, region=np.where(centres[:, 0] < 0, REGION_TAGS["blood_lv"], mesh.region))
    return mesh


def read(mesh: VolumeMesh, folder: Path) -> Any:
    write_mesh(mesh, folder / "lv.pts")
    meshtool.set_num_par_threads(1)
    return meshtool.Mesh(str(folder / "lv"))


@pytest.mark.parametrize("kind", KINDS)
def test_binary_files_are_those_that_it_writes_itself(kind: str, tmp_path: Path) -> None:
    mesh = mesh_of(kind)
    text = read(mesh, tmp_path)
    write_mesh(mesh, tmp_path / "binary.bpts")
    binary = meshtool.Mesh(str(tmp_path / "binary"), format="carp_bin")
    np.testing.assert_allclose(binary.points, text.points, rtol=SINGLE, atol=0)
    assert all(np.array_equal(one, other) for one, other in zip(binary.elements, text.elements, strict=True))
    assert np.array_equal(binary.element_tags, text.element_tags)
    np.testing.assert_allclose(binary.fibers, text.fibers, rtol=0, atol=SINGLE)
    text.save(str(tmp_path / "theirs"), format="carp_bin")
    for ending in (".bpts", ".belem", ".blon"):
        ours, theirs = ((tmp_path / f"{stem}{ending}").read_bytes() for stem in ("binary", "theirs"))
        assert ours[1024:] == theirs[1024:], ending
        assert ours[:1024].split(b"\0")[0].split() == theirs[:1024].split(b"\0")[0].split(), ending


def corners(mesh: VolumeMesh) -> np.ndarray:
    """Numbers of the points that are corners, in order: those that the files hold."""
    return np.unique(np.concatenate([b[:, : ELEMENTS[k].corners].ravel() for k, b in mesh.cells.items()]))


@pytest.mark.parametrize("kind", KINDS)
def test_points_elements_tags_and_fibres_are_ours(kind: str, tmp_path: Path) -> None:
    mesh = mesh_of(kind)
    found = read(mesh, tmp_path)
    used = corners(mesh)
    np.testing.assert_allclose(found.points, mesh.points[used] * 1000, rtol=1e-15, atol=1e-12)
    assert np.array_equal(found.element_tags, mesh.region)
    assert found.num_fibers == 2
    np.testing.assert_allclose(found.fibers[:, 0], mesh.cell_data["fiber"], rtol=0, atol=SINGLE)
    np.testing.assert_allclose(found.fibers[:, 1], mesh.cell_data["sheet"], rtol=0, atol=SINGLE)
    count, _, nodes, types = found.elements
    wanted, numbers = [], []
    for name, block in mesh.cells.items():
        linear = {4: "tetra", 6: "wedge", 8: "hexahedron"}[ELEMENTS[name].corners]
        wanted.append(block[:, list(CARP_TYPES[linear][1])].ravel())
        numbers += [NUMBERS[linear]] * len(block)
        assert (count[len(numbers) - len(block) : len(numbers)] == ELEMENTS[name].corners).all()
    assert np.array_equal(used[nodes], np.concatenate(wanted))
    assert types.tolist() == numbers


@pytest.mark.parametrize("kind", KINDS)
def test_the_surface_it_finds_is_that_of_our_tags(kind: str, tmp_path: Path) -> None:
    mesh = mesh_of(kind)
    found = read(mesh, tmp_path)
    used = corners(mesh)
    written = set()
    for name, tag in mesh.facet_names.items():
        (surface,) = found.extract_surface(setops=str(tmp_path / f"lv.{name}"), reindex_nodes=False)
        assert len(surface) == np.sum(mesh.facet_tag == tag)
        written |= _facets(surface)
        nodes, domain = meshtool.load_vtx(str(tmp_path / f"lv.{name}.vtx"))
        assert domain == "extra"
        assert np.array_equal(np.sort(used[nodes]), facet_nodes(mesh, tag, corners=True))
    (surface,) = found.extract_surface(reindex_nodes=False)
    assert _facets(surface) == written  # and wound alike


def _facets(surface: Any) -> set[tuple[int, ...]]:
    count, start, nodes, _ = surface.elements
    return {_turned(nodes[at : at + n].tolist()) for at, n in zip(start, count)}


def _turned(nodes: list[int]) -> tuple[int, ...]:
    """A facet from its smallest node on, its winding kept."""
    at = nodes.index(min(nodes))
    return tuple(nodes[at:] + nodes[:at])


@pytest.mark.parametrize("fibres", [False, True])
@pytest.mark.parametrize("kind", ["tetra", "mixed"])
def test_its_myocardium_is_the_wall(kind: str, fibres: bool, tmp_path: Path) -> None:
    mesh = mesh_of(kind, fibres=fibres, blood=True)
    wall = np.flatnonzero(mesh.region != REGION_TAGS["blood_lv"])
    assert 0 < len(wall) < mesh.n_cells
    part, mapping = read(mesh, tmp_path).extract_myocard(return_mapping=True)
    assert np.array_equal(np.sort(mapping.element_map), wall)
    assert set(part.element_tags) == set(mesh.region[wall])


@pytest.mark.parametrize("fibres", [False, True])
def test_a_wall_alone_is_all_myocardium(fibres: bool, tmp_path: Path) -> None:
    found = read(mesh_of("tetra", fibres=fibres), tmp_path)
    assert found.extract_myocard() is None  # as it is where the whole mesh is
    first = found.fibers.reshape(len(found), -1, 3)[:, 0]
    assert np.linalg.norm(first, axis=1) == pytest.approx(1.0, abs=1e-6)


def test_it_refines_the_mesh_and_its_quality_is_sound(tmp_path: Path) -> None:
    mesh = mesh_of("tetra")
    found = read(mesh, tmp_path)
    quality = found.query_quality()
    assert quality.shape == (mesh.n_cells,)
    assert 0 <= quality.min() < quality.max() < 1  # 0 is the regular tetrahedron, 1 and more flat or inverted
    fine = found.refine_uniformly(1)
    assert len(fine) == 8 * mesh.n_cells
    assert fine.query_quality().max() < 1
    volumes = element_volumes(np.asarray(fine.points) / 1000, fine.elements[2].reshape(-1, 4), "tetra")
    assert volumes.min() > 0
    own = element_volumes(mesh.points, mesh.cells["tetra"], "tetra")
    for tag in (REGION_TAGS["lv"], REGION_TAGS["septum"]):
        wanted = own[mesh.region == tag].sum()
        assert volumes[fine.element_tags == tag].sum() == pytest.approx(wanted, rel=1e-12)
