import numpy as np
import pytest

from femprep.mesh.elements import ELEMENTS
from femprep.mesh.measures.sample_points import CORNER_EDGES, element_samples, family, reference_nodes, shape_gradients

NAMES = sorted(ELEMENTS)
#: Volume of the reference element.
VOLUME = {"tetra": 1 / 6, "wedge": 1.0, "hexahedron": 8.0}
#: Degree of a polynomial every element of the type holds.
DEGREE = {name: 2 if ELEMENTS[name].quadratic else 1 for name in NAMES}


@pytest.mark.parametrize("name", NAMES)
def test_gradients_differentiate_polynomials_of_the_element_degree(name):
    nodes = reference_nodes(name)
    powers = [(i, j, k) for i in range(3) for j in range(3) for k in range(3) if i + j + k <= DEGREE[name]]
    point = np.array([0.21, 0.32, 0.13])
    gradients = shape_gradients(name, point)
    for power in powers:
        values = np.prod(nodes ** np.array(power), axis=1)
        expected = [
            power[k] * np.prod(point ** (np.array(power) - np.eye(3, dtype=int)[k])) if power[k] else 0.0
            for k in range(3)
        ]
        np.testing.assert_allclose(values @ gradients, expected, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_quadrature_gives_the_reference_volume(name):
    table = element_samples(name)
    nodes = reference_nodes(name)
    determinants = [np.linalg.det(nodes.T @ gradient) for gradient in table.gradients]
    assert np.dot(table.weights, determinants) == pytest.approx(VOLUME[family(name)], rel=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_corner_frames_are_the_edges_and_right_handed(name):
    nodes, table = reference_nodes(name), element_samples(name)
    for corner, near in enumerate(CORNER_EDGES[family(name)]):
        edges = nodes.T @ table.frames[corner]
        np.testing.assert_allclose(edges, (nodes[list(near)] - nodes[corner]).T, atol=1e-12)
        assert np.linalg.det(edges) > 0
        assert {frozenset((corner, n)) for n in near} <= {frozenset(edge) for edge in ELEMENTS[name].edges}


@pytest.mark.parametrize("name", NAMES)
def test_scale_makes_every_sample_of_the_straight_element_its_volume(name):
    nodes, table = reference_nodes(name), element_samples(name)
    jacobians = [np.linalg.det(nodes.T @ f) * s for f, s in zip(table.frames, table.scale)]
    np.testing.assert_allclose(jacobians, VOLUME[family(name)], rtol=1e-12)
