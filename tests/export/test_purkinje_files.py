"""Purkinje fibres come back from every format that holds them, and others say that they left them out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres

import femprep as fp
from femprep.export import FORMATS, read_mesh, write_mesh
from femprep.export.deck.names import facet_nodes
from femprep.export.losses import losses
from femprep.export.purkinje import HOLDS
from femprep.model import FACET_TAGS, PurkinjeNet

#: How exactly coordinates come back: micrometres are multiplied and divided, or in single precision; LS-DYNA has
#: sixteen characters.
TOLERANCE = {"vtu": 0.0, "opencarp": 1e-13, "opencarp-binary": 4e-6, "ls-dyna": 1e-9}
FILES = {"vtu": "lv.vtu", "opencarp": "lv.pts", "opencarp-binary": "lv.bpts", "ls-dyna": "lv.k"}


def with_net(kind: str) -> fp.VolumeMesh:
    """A net of two arms from above the rim of the endocardium to nodes on it; its own points need not be numbered."""
    mesh = with_fibres(truncated_ellipsoid(kind))
    ends = facet_nodes(mesh, FACET_TAGS["endo"], corners=True)[[3, 20, 31]]
    a, b, c = mesh.points[ends]
    middle = (a + b + c) / 3
    points = np.stack([c, a, middle + np.array([0.1, 0.2, 0.3]), middle, b])
    edges = np.array([[3, 2], [2, 1], [2, 4], [4, 0]])
    number = np.array([ends[2], ends[0], -1, -1, ends[1]])
    net = PurkinjeNet.numbered(points, edges, np.full(4, FACET_TAGS["endo"], np.int32), number, speed=3.25)
    return replace(mesh, purkinje=net)


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron", "tetra10"])
@pytest.mark.parametrize("name", HOLDS)
def test_round_trip(name: str, kind: str, tmp_path: Path) -> None:
    mesh = with_net(kind)
    write_mesh(mesh, tmp_path / FILES[name], format=name)
    back = read_mesh(tmp_path / FILES[name])
    one, two = mesh.purkinje, back.purkinje
    assert one is not None
    assert two is not None
    np.testing.assert_array_equal(one.edges, two.edges)
    np.testing.assert_array_equal(one.edge_tag, two.edge_tag)
    np.testing.assert_allclose(one.points, two.points, rtol=0, atol=TOLERANCE[name])
    assert one.speed == two.speed
    ends = two.junctions
    np.testing.assert_array_equal(ends, one.junctions)
    np.testing.assert_allclose(back.points[two.mesh_point[ends]], two.points[ends], rtol=0, atol=TOLERANCE[name])
    assert back.n_cells == mesh.n_cells
    if kind != "tetra10" or not name.startswith("opencarp"):  # which drops mid-side nodes, and numbers the others anew
        np.testing.assert_array_equal(one.mesh_point, two.mesh_point)
        assert len(back.points) == len(mesh.points)


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in HOLDS])
def test_the_others_write_and_say_so(name: str, tmp_path: Path) -> None:
    mesh = with_net("tetra")
    fp.export.write_format(mesh, tmp_path, name)
    assert any("Purkinje" in note.what for note in losses(mesh, name))
    assert not any("Purkinje" in note.what for note in losses(replace(mesh, purkinje=None), name))


def test_units_scale_beams(tmp_path: Path) -> None:
    mesh = with_net("tetra")
    write_mesh(mesh, tmp_path / "lv.k", length_unit="m")
    text = (tmp_path / "lv.k").read_text()
    assert "*PART\npurkinje_endo\n" in text
    assert text.count("*ELEMENT_BEAM\n") == 1
    back = read_mesh(tmp_path / "lv.k").purkinje
    assert back is not None
    np.testing.assert_allclose(back.points, mesh.purkinje.points, atol=1e-6)  # type: ignore[union-attr]


@pytest.mark.slow
def test_pydyna_reads_the_beams(tmp_path: Path) -> None:
    keywords = pytest.importorskip("ansys.dyna.core")
    mesh = with_net("tetra")
    write_mesh(mesh, tmp_path / "lv.k")
    deck = keywords.Deck()
    deck.loads((tmp_path / "lv.k").read_text())
    beams = next(deck.get_kwds_by_full_type("ELEMENT", "BEAM")).elements
    assert len(beams) == 4
    labels = set(range(1, len(mesh.points) + 3))
    assert set(beams["n1"]) | set(beams["n2"]) <= labels
    section = next(deck.get_kwds_by_full_type("SECTION", "BEAM"))
    assert section.elform == 3


def test_opencarp_stimulates_junctions_as_the_beat_comes(tmp_path: Path) -> None:
    mesh = with_net("tetra")
    net = mesh.purkinje
    assert net is not None
    write_mesh(mesh, tmp_path / "lv.pts")
    text = (tmp_path / "lv.par").read_text()
    nodes, count = [], int(text.split("num_stim = ")[1].split()[0])
    for i in range(count):
        start = float(text.split(f"stim[{i}].ptcl.start = ")[1].split()[0])
        file = text.split(f'stim[{i}].elec.vtx_file = "')[1].split('"')[0]
        own = [int(line) for line in (tmp_path / file).read_text().splitlines()[2:]]
        at = [net.arrival[np.flatnonzero(net.mesh_point == node)[0]] for node in own]
        assert all(start <= time < start + 2.0 for time in at)
        nodes += own
    assert sorted(nodes) == sorted(net.mesh_point[net.junctions].tolist())


def test_fibres_of_another_mesh_are_left_alone(tmp_path: Path) -> None:
    write_mesh(with_net("tetra"), tmp_path / "lv.pts")
    other = with_fibres(truncated_ellipsoid("tetra"))
    write_mesh(replace(other, points=other.points + 1.0), tmp_path / "lv.pts")
    assert read_mesh(tmp_path / "lv.pts").purkinje is None


def test_lines_for_paraview(tmp_path: Path) -> None:
    import pyvista

    mesh = with_net("tetra")
    lines = pyvista.read(fp.write_purkinje(mesh, tmp_path / "purkinje.vtp"))
    assert (lines.n_lines, lines.n_points) == (4, 5)
    np.testing.assert_array_equal(np.sort(lines["GlobalNodeID"])[2:] - 1, np.sort(mesh.purkinje.mesh_point)[2:])  # type: ignore[union-attr]
    np.testing.assert_array_equal(lines["activation"], mesh.purkinje.arrival)  # type: ignore[union-attr]
    with pytest.raises(fp.InputError, match="no Purkinje fibres"):
        fp.write_purkinje(replace(mesh, purkinje=None), tmp_path / "none.vtp")
