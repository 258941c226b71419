import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.errors import InputError
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.measures.sample_points import IDEAL, family, reference_nodes
from femprep.mesh.measures.volume_elements import MEASURES, centroids, element_measures, element_volumes

NAMES = sorted(ELEMENTS)
VTK = {"tetra": 10, "wedge": 13, "hexahedron": 12}


def ideal_nodes(name: str) -> np.ndarray:
    """Nodes of the ideal element: regular tetrahedron, prism with square sides, cube, edge length 1."""
    nodes = reference_nodes(name)
    if family(name) == "hexahedron":
        return nodes / 2.0
    if family(name) == "wedge":
        nodes = nodes * np.array([1.0, 1.0, 0.5])
    return nodes @ IDEAL[family(name)].T


def measure(nodes: np.ndarray, name: str) -> dict[str, float]:
    return {k: float(v[0]) for k, v in element_measures(nodes, np.arange(len(nodes))[None], name).items()}


def distorted(name: str, count: int, size: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Randomly sheared elements with moved nodes."""
    rng = np.random.default_rng(seed)
    ideal = ideal_nodes(name)
    shears = np.eye(3) + rng.uniform(-0.4, 0.4, (count, 3, 3))
    nodes = np.einsum("ckl,nl->cnk", shears, ideal) + rng.uniform(-size, size, (count, len(ideal), 3))
    return nodes.reshape(-1, 3), np.arange(count * len(ideal)).reshape(count, -1)


@pytest.mark.parametrize("name", NAMES)
def test_ideal_element_scores_one(name):
    found = measure(ideal_nodes(name), name)
    for key in ("scaled_jacobian", "mean_ratio", "relative_jacobian", "edge_ratio"):
        assert found[key] == pytest.approx(1.0, abs=1e-12), key
    angles = {"tetra": (np.degrees(np.arccos(1 / 3)),) * 2, "wedge": (60.0, 90.0), "hexahedron": (90.0, 90.0)}
    assert (found["minimum_dihedral"], found["maximum_dihedral"]) == pytest.approx(angles[family(name)], abs=1e-10)
    if family(name) == "tetra":
        assert found["radius_ratio"] == pytest.approx(1.0, abs=1e-12)
        assert found["aspect_ratio"] == pytest.approx(1.0, abs=1e-12)


def test_corner_tetrahedron_by_hand():
    found = measure(np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float), "tetra")
    assert found["volume"] == pytest.approx(1 / 6)
    assert found["mean_ratio"] == pytest.approx(12 * 0.5 ** (2 / 3) / 9)
    # At a far corner: determinant 1, edges 1, sqrt 2, sqrt 2.
    assert found["scaled_jacobian"] == pytest.approx(np.sqrt(2) / 2)
    inscribed, circumscribed = 1 / (3 + np.sqrt(3)), np.sqrt(3) / 2
    assert found["radius_ratio"] == pytest.approx(3 * inscribed / circumscribed)
    assert found["aspect_ratio"] == pytest.approx(np.sqrt(2) / (2 * np.sqrt(6) * inscribed))
    assert found["minimum_dihedral"] == pytest.approx(np.degrees(np.arccos(1 / np.sqrt(3))))
    assert found["maximum_dihedral"] == pytest.approx(90.0)
    assert (found["shortest_edge"], found["longest_edge"]) == pytest.approx((1.0, np.sqrt(2)))


@pytest.mark.parametrize("height", [0.3, 0.1, 0.01])
def test_sliver_by_hand(height):
    """Four points near a square of diagonal 2, two opposite edges ``height`` apart: the classic sliver."""
    nodes = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, height), (0, -1, height)])[[0, 2, 1, 3]].astype(float)
    nodes = nodes if measure(nodes, "tetra")["volume"] > 0 else nodes[[1, 0, 2, 3]]
    found = measure(nodes, "tetra")
    assert found["volume"] == pytest.approx(2 * height / 3)
    squares = 2 * 4 + 4 * (2 + height**2)
    assert found["mean_ratio"] == pytest.approx(12 * (2 * height) ** (2 / 3) / squares)
    # At the long edges both faces rise by ``height`` over 1, on either side.
    assert found["maximum_dihedral"] == pytest.approx(180 - 2 * np.degrees(np.arctan(height)), abs=1e-9)


@pytest.mark.parametrize("name", ["tetra", "wedge", "hexahedron"])
def test_agrees_with_verdict(name):
    pyvista = pytest.importorskip("pyvista")
    points, cells = distorted(name, 400, 0.12)
    found = element_measures(points, cells, name)
    keep = found["volume"] > 0
    assert keep.sum() > 350
    grid = pyvista.UnstructuredGrid({VTK[name]: cells[keep]}, points)
    names = {"volume": "volume", "scaled_jacobian": "scaled_jacobian"}
    if name == "tetra":
        names["aspect_ratio"] = "aspect_ratio"
        names["radius_ratio"] = "radius_ratio"
    for mine, theirs in names.items():
        value = np.asarray(grid.cell_quality(theirs)[theirs])
        value = 1 / value if mine == "radius_ratio" else value
        np.testing.assert_allclose(found[mine][keep], value, rtol=1e-9, atol=1e-12, err_msg=mine)


def test_dihedral_angles_by_projection():
    """The angle at an edge is that between the two other corners seen along it."""
    points, cells = distorted("tetra", 200, 0.2, seed=3)
    found = element_measures(points, cells, "tetra")
    x = points[cells]
    angles = []
    for a, b in ELEMENTS["tetra"].edges:
        c, d = (k for k in range(4) if k not in (a, b))
        along = x[:, b] - x[:, a]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        flat = [v - (v * along).sum(1, keepdims=True) * along for v in (x[:, c] - x[:, a], x[:, d] - x[:, a])]
        cosine = (flat[0] * flat[1]).sum(1) / np.linalg.norm(flat[0], axis=1) / np.linalg.norm(flat[1], axis=1)
        angles.append(np.degrees(np.arccos(cosine)))
    keep = found["volume"] > 0
    np.testing.assert_allclose(found["minimum_dihedral"][keep], np.min(angles, axis=0)[keep], atol=1e-6)
    np.testing.assert_allclose(found["maximum_dihedral"][keep], np.max(angles, axis=0)[keep], atol=1e-6)


@settings(deadline=None, max_examples=30)
@given(st.sampled_from(NAMES), st.integers(0, 10**6), st.floats(0.01, 100.0))
def test_measures_do_not_change_with_place_turn_or_size(name, seed, size):
    points, cells = distorted(name, 1, 0.05, seed)
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    first = element_measures(points, cells, name)
    second = element_measures(size * points @ turn.T + rng.normal(size=3), cells, name)
    scales = {"volume": size**3, "shortest_edge": size, "longest_edge": size, "characteristic_length": size}
    for key, value in first.items():
        np.testing.assert_allclose(second[key], scales.get(key, 1.0) * value, rtol=1e-6, atol=1e-7, err_msg=key)


@pytest.mark.parametrize("name", NAMES)
def test_characteristic_length_of_ideal_elements(name):
    """Height of the regular tetrahedron; volume by largest face of prism (a square) and cube; half for order 2."""
    straight = {"tetra": np.sqrt(2.0 / 3.0), "wedge": np.sqrt(3.0) / 4.0, "hexahedron": 1.0}[family(name)]
    expected = straight * (0.5 if ELEMENTS[name].quadratic else 1.0)
    assert measure(ideal_nodes(name), name)["characteristic_length"] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_mirrored_element_is_negative_in_every_signed_measure(name):
    found = measure(ideal_nodes(name) * np.array([-1.0, 1.0, 1.0]), name)
    for key in ("volume", "scaled_jacobian", "mean_ratio", "relative_jacobian", "minimum_dihedral"):
        assert found[key] < 0, key
    assert set(found) <= set(MEASURES)


@pytest.mark.parametrize("name", [n for n in NAMES if ELEMENTS[n].quadratic])
def test_straight_quadratic_element_measures_as_the_linear_one(name):
    points, _ = distorted(family(name), 1, 0.05, seed=5)
    corners = ELEMENTS[name].corners
    nodes = np.concatenate([points, [(points[a] + points[b]) / 2 for a, b in ELEMENTS[name].edges]])
    linear, quadratic = measure(points, family(name)), measure(nodes, name)
    assert len(points) == corners
    for key in ("volume", "minimum_dihedral", "maximum_dihedral", "edge_ratio"):
        assert quadratic[key] == pytest.approx(linear[key], rel=1e-10), key
    if family(name) == "tetra":
        for key in ("scaled_jacobian", "mean_ratio", "relative_jacobian", "radius_ratio"):
            assert quadratic[key] == pytest.approx(linear[key], rel=1e-10), key


@pytest.mark.parametrize("name", [n for n in NAMES if ELEMENTS[n].quadratic])
def test_curved_element_volume_and_folded_one(name):
    """Bending by z += c x^2 keeps every volume; pulling a mid-side node onto a corner folds the element."""
    nodes = ideal_nodes(name)
    bent = nodes.copy()
    bent[:, 2] += 0.15 * bent[:, 0] ** 2
    assert measure(bent, name)["volume"] == pytest.approx(measure(nodes, name)["volume"], rel=1e-12)
    a, b = ELEMENTS[name].edges[0]
    for share, sign in ((0.7, 1), (0.8, -1)):
        # A mid-side node beyond three quarters of its edge makes the Jacobian negative at the near corner.
        nodes[ELEMENTS[name].corners] = nodes[a] + share * (nodes[b] - nodes[a])
        assert np.sign(measure(nodes, name)["relative_jacobian"]) == sign


def test_blocks_larger_than_a_chunk_and_empty_ones():
    points, cells = distorted("tetra", 300, 0.1)
    many = np.tile(cells, (400, 1))
    found = element_measures(points, many, "tetra")["mean_ratio"]
    assert len(found) == 120_000
    np.testing.assert_array_equal(found[:300], found[-300:])
    assert len(element_measures(points, cells[:0], "tetra")["volume"]) == 0
    np.testing.assert_array_equal(
        element_volumes(points, cells, "tetra"), element_measures(points, cells, "tetra")["volume"]
    )
    np.testing.assert_allclose(centroids(points, cells, "tetra"), points.reshape(-1, 4, 3).mean(axis=1))


def test_unknown_type_and_wrong_width_are_refused():
    with pytest.raises(InputError, match=r"'pyramid' is not known; known are"):
        element_measures(np.zeros((5, 3)), np.arange(5)[None], "pyramid")
    with pytest.raises(InputError, match=r"wedge elements have shape \(1, 5\), expected \(m, 6\)"):
        element_measures(np.zeros((5, 3)), np.arange(5)[None], "wedge")
