import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.mesh.elements import ELEMENTS, FACET_CORNERS, boundary_faces, element_faces, face_parts
from femprep.mesh.least_corner import BlockParts, by_least_corner, distinct_pairs


def slow_boundary(cells):
    """The faces of each type whose sorted corners occur once, by NumPy."""
    for kind, faces in element_faces(cells).items():
        corners = np.sort(faces.nodes[:, : FACET_CORNERS[kind]], axis=1)
        _, number, count = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
        single = count[number.ravel()] == 1
        yield kind, faces.nodes[single], faces.element[single], faces.face[single]


@settings(deadline=None, max_examples=60)
@given(
    st.lists(st.sampled_from(sorted(ELEMENTS)), min_size=1, max_size=4, unique=True),
    st.integers(1, 30),
    st.sampled_from([8, 12, 40]),
    st.integers(0, 2**32),
)
def test_boundary_is_what_sorting_all_faces_finds(names, count, nodes, seed):
    """Any nodes, so that faces are shared by two, three and more elements, and some have a node twice."""
    rng = np.random.default_rng(seed)
    cells = {name: rng.integers(0, nodes, (rng.integers(0, count) + 1, ELEMENTS[name].nodes)) for name in names}
    found = boundary_faces(cells)
    expected = list(slow_boundary(cells))
    assert [kind for kind, *_ in expected] == list(found)
    for kind, *arrays in expected:
        for have, want in zip((found[kind].nodes, found[kind].element, found[kind].face), arrays):
            np.testing.assert_array_equal(have, want)


@pytest.mark.parametrize("count", [100, 5_000])
def test_fan_of_elements_at_one_node_has_its_rim_and_ends(count):
    """All faces at one smallest node: few are compared, many sorted."""
    ring = np.arange(2, count + 2)
    block = np.stack([np.zeros(count, dtype=int), np.ones(count, dtype=int), ring, np.roll(ring, -1)], axis=1)
    faces = boundary_faces({"tetra": block})["triangle"]
    assert len(faces.nodes) == 2 * count
    np.testing.assert_array_equal(np.sort(np.bincount(faces.element)), np.full(count, 2))


def test_no_elements_have_no_boundary():
    found = boundary_faces({"tetra": np.empty((0, 4), dtype=np.int64)})["triangle"]
    assert found.nodes.shape == (0, 3)
    assert len(found.element) == len(found.face) == 0


@settings(deadline=None, max_examples=40)
@given(st.integers(1, 200), st.integers(2, 30), st.integers(1, 500), st.integers(0, 2**32))
def test_chunks_of_any_size_hold_the_same_parts(count, nodes, most, seed):
    cells = {"tetra": np.random.default_rng(seed).integers(0, nodes, (count, 4))}
    (whole,) = by_least_corner(face_parts(cells)["triangle"])
    chunks = list(by_least_corner(face_parts(cells)["triangle"], most))
    np.testing.assert_array_equal(np.concatenate([chunk.number for chunk in chunks]), whole.number)
    np.testing.assert_array_equal(np.concatenate([chunk.least() for chunk in chunks]), whole.least())
    alone = [chunk.unpaired(chunk.before()) for chunk in chunks]
    np.testing.assert_array_equal(np.concatenate(alone), whole.unpaired(whole.before()))
    assert all(len(chunk.number) <= most or len(chunk.nodes) == 1 for chunk in chunks)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 200), st.integers(1, 30), st.integers(0, 2**32))
def test_distinct_pairs_are_those_of_numpy(count, nodes, seed):
    pairs = np.random.default_rng(seed).integers(0, nodes, (count, 2))
    expected = np.unique(np.sort(pairs, axis=1), axis=0)
    np.testing.assert_array_equal(distinct_pairs([BlockParts(pairs, np.array([(0, 1)]))]), expected)


def test_place_before_is_of_the_last_equal_part():
    """Three times the same triangle, and another one."""
    block = np.array([(3, 1, 2), (1, 2, 4), (2, 3, 1), (1, 2, 3)])
    (chunk,) = by_least_corner([BlockParts(block, np.array([(0, 1, 2)]), start=7)])
    np.testing.assert_array_equal(chunk.before(), [-1, -1, 0, 2])
    np.testing.assert_array_equal(chunk.element, [7, 8, 9, 10])
