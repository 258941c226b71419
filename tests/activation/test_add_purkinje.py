"""Purkinje fibres lie on the facets of the endocardia, hold together, and every end is a node of the mesh."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

import numpy as np
import pytest
from anatomy_meshes import ellipsoid, grown
from biventricular import biventricular
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from slow_params import slow_but

import femprep as fp
from femprep.activation import growth
from femprep.errors import MissingDependencyError
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FACET_TAGS, PurkinjeNet
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.model.facets import facet_triangles

pytestmark = pytest.mark.skipif(find_spec("fractal_tree") is None, reason="fractal-tree is not installed")


@cache
def wall(kind: str) -> fp.VolumeMesh:
    if kind == "both ventricles":
        return biventricular(6.0)
    if kind == "tetra10":
        return grown(ellipsoid("tetra", size=3, layers=1).mesh)
    return ellipsoid(kind, size=4, layers=2).mesh


@cache
def with_net(kind: str) -> fp.VolumeMesh:
    return fp.add_purkinje(wall(kind), generations=6)


def away(mesh: fp.VolumeMesh, net: PurkinjeNet, tag: int) -> float:
    name = next(name for name, number in FACET_TAGS.items() if number == tag)
    points = net.points[np.unique(net.edges[net.edge_tag == tag])]
    return float(ClosestFinder(mesh.points, facet_triangles(mesh, name))(points).distance.max())


@pytest.mark.parametrize("kind", slow_but(["tetra"], ["tetra", "wedge", "hexahedron", "tetra10", "both ventricles"]))
def test_the_net_fits_the_mesh(kind: str) -> None:
    mesh = with_net(kind)
    net = mesh.purkinje
    assert net is not None
    tags = [mesh.facet_names[name] for name in ("endo", "endo_lv", "endo_rv") if name in mesh.facet_names]
    assert sorted(set(net.edge_tag.tolist())) == sorted(tags)
    for tag in tags:
        assert away(mesh, net, tag) < 1e-9  # the issue's own bound
    # Every end is a point of the mesh, to the last bit, and on the endocardium.
    ends = np.setdiff1d(net.edges[:, 1], net.edges[:, 0])
    assert np.array_equal(ends, net.junctions)
    np.testing.assert_array_equal(net.points[ends], mesh.points[net.mesh_point[ends]])
    endocardial = nodes_of(chosen_rows(mesh.facets, np.isin(mesh.facet_tag, tags)))
    assert np.isin(net.mesh_point[ends], endocardial).all()
    assert len(np.unique(net.mesh_point[ends])) == len(ends)
    # One tree for each endocardium, reached whole from its root.
    n = len(net.points)
    graph = coo_array((np.ones(len(net.edges)), net.edges.T), shape=(n, n))
    assert connected_components(graph, directed=False)[0] == len(tags) == len(net.roots)
    assert np.isfinite(net.arrival).all()
    np.testing.assert_array_equal(net.arrival[net.roots], 0.0)
    assert np.all(net.lengths < 20.0)


@pytest.mark.slow
def test_roots_lie_high_on_the_septum_and_run_down() -> None:
    mesh = with_net("both ventricles")
    axes, net = fp.ventricular_axes(mesh), mesh.purkinje
    assert net is not None
    roots = net.points[net.roots]
    turn = (axes.angle(roots) + 180) % 360 - 180
    assert np.all(np.abs(turn) < 15)
    assert np.all(axes.height(roots) > 0.6 * axes.length)
    # That of the right ventricle is beyond the septum, and both begin to the apex.
    assert axes.radius(roots)[1] > axes.radius(roots)[0]
    for root in net.roots:
        first = net.edges[net.edges[:, 0] == root][0, 1]
        assert (net.points[first] - net.points[root]) @ axes.long_axis < 0


def test_the_same_seed_the_same_net_and_the_callers_numbers_stay() -> None:
    np.random.seed(5)  # noqa: NPY002
    wanted = np.random.random()  # noqa: NPY002
    np.random.seed(5)  # noqa: NPY002
    one = fp.add_purkinje(wall("tetra"), generations=3).purkinje
    assert np.random.random() == wanted  # noqa: NPY002
    two, other = (fp.add_purkinje(wall("tetra"), generations=3, seed=seed).purkinje for seed in (0, 1))
    assert one is not None
    assert two is not None
    assert other is not None
    np.testing.assert_array_equal(one.points, two.points)
    assert len(other.points) != len(one.points) or not np.allclose(other.points, one.points)


def test_a_given_root_is_taken() -> None:
    mesh = wall("tetra")
    at = mesh.points[np.unique(facet_triangles(mesh, "endo"))]
    root = at[np.argmin(np.linalg.norm(at - [20.0, 0.0, 0.0], axis=1))]
    net = fp.add_purkinje(mesh, generations=2, root_lv=tuple(root + 0.1)).purkinje
    assert net is not None
    np.testing.assert_allclose(net.points[net.roots[0]], root, atol=1e-12)


def test_arrival_is_length_over_speed() -> None:
    points = np.array([[0.0, 0, 0], [3.0, 0, 0], [3.0, 4.0, 0], [3.0, 0, 12.0]])
    edges = np.array([[0, 1], [1, 2], [1, 3]])
    net = PurkinjeNet(points, edges, np.full(3, 101), np.array([-1, -1, 7, 9]), speed=2.0)
    np.testing.assert_allclose(net.arrival, [0.0, 1.5, 3.5, 7.5], rtol=1e-15)
    assert net.junctions.tolist() == [2, 3]
    assert net.renumbered(np.arange(10) + 1).mesh_point.tolist() == [-1, -1, 8, 10]
    with pytest.raises(fp.InputError, match="no point of the mesh any more"):
        net.renumbered(np.full(10, -1))
    with pytest.raises(fp.InputError, match="number"):
        PurkinjeNet(points, edges[::-1], np.full(3, 101), np.array([-1, -1, 7, 9]))


def test_what_it_needs() -> None:
    mesh = wall("tetra")
    bare = fp.VolumeMesh(mesh.points, mesh.cells, mesh.region)
    with pytest.raises(fp.InputError, match="facets tagged endo"):
        fp.add_purkinje(bare)
    with pytest.raises(fp.InputError, match="root_rv is given, but the mesh has no endocardium of the rv"):
        fp.add_purkinje(wall("tetra"), root_rv=(0.0, 0.0, 0.0))
    with pytest.raises(fp.OptionError, match="three segments"):
        fp.add_purkinje(mesh, branch_length=2.0)
    # Found by a damaged command line: a millionth of a picometre did not come to an end.
    for given in ({"segment_length": 1e-30}, {"branch_length": 1e30}, {"branch_length": 30.0, "segment_length": 0.1}):
        with pytest.raises(fp.OptionError, match="more than 200"):
            fp.add_purkinje(mesh, **given)


def test_without_the_library_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growth, "find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match=r"femprep\[purkinje\]"):
        fp.add_purkinje(wall("tetra"))


def test_a_mirrored_heart_keeps_its_net() -> None:
    mesh = with_net("tetra")
    twin = fp.flip(mesh)
    assert twin.purkinje is not None
    ends = twin.purkinje.junctions
    np.testing.assert_allclose(twin.purkinje.points[ends], twin.points[twin.purkinje.mesh_point[ends]], atol=1e-12)


@pytest.mark.slow
def test_a_refined_mesh_says_that_it_lost_its_net() -> None:
    fine = fp.refine(with_net("tetra"), optimised=False)
    assert fine.purkinje is None
    assert any("Purkinje" in note["what"] for note in fine.info["notices"])
