"""Grid: index to world and back, the stack's axis, windows."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from femprep.errors import InputError
from femprep.image import Grid


def oblique(seed: int = 0, mirrored: bool = False) -> Grid:
    direction = Rotation.random(random_state=seed).as_matrix()
    if mirrored:
        direction = direction * np.array([1.0, 1.0, -1.0])
    return Grid((5, 7, 4), (1.4, 1.3, 8.0), (10.0, -20.0, 30.0), direction)


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 10**6), mirrored=st.booleans(), index=st.lists(st.floats(-100, 100), min_size=3, max_size=3))
def test_world_and_index_are_inverse(seed, mirrored, index):
    grid = oblique(seed, mirrored)
    np.testing.assert_allclose(grid.to_index(grid.to_world([index])), [index], atol=1e-10)
    assert grid.right_handed is not mirrored


def test_world_positions_by_hand():
    # i runs along -y, j along +x, k along +z.
    grid = Grid((3, 3, 3), (2.0, 3.0, 5.0), (1.0, 1.0, 1.0), [[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(
        grid.to_world([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.5]]),
        [[1, 1, 1], [1, -1, 1], [4, 1, 1], [1, 1, 3.5]],
    )


def test_stack_axis_is_the_coarsest_and_the_last_of_equals():
    def axis(*spacing):
        return Grid((2, 2, 2), spacing, np.zeros(3), np.eye(3)).stack_axis

    assert axis(1.4, 1.4, 8.0) == 2
    assert axis(8.0, 1.4, 1.4) == 0
    assert axis(1.0, 1.0, 1.0) == 2
    # Single precision must not decide.
    assert axis(0.8203003, 0.8202999, 0.8202998) == 2


def test_window_keeps_voxels_where_they_are():
    grid = oblique()
    window = grid.window((-2, 3, 1), (9, 9, 9))
    np.testing.assert_allclose(window.to_world([[4, 1, 2]]), grid.to_world([[2, 4, 3]]), atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shape": (0, 2, 2)}, "shape"),
        ({"spacing": (1.0, 0.0, 1.0)}, "voxel sizes"),
        ({"spacing": (1.0, np.nan, 1.0)}, "voxel sizes"),
        ({"origin": (np.inf, 0.0, 0.0)}, "origin"),
        ({"origin": (0.0, -1e300, 0.0)}, "farther than 1e\\+07 mm"),
        ({"direction": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}, "not orthonormal"),
        ({"direction": np.full((3, 3), np.nan)}, "not orthonormal"),
    ],
)
def test_impossible_grids_are_refused(change, message):
    good = {"shape": (2, 2, 2), "spacing": (1, 1, 1), "origin": (0, 0, 0), "direction": np.eye(3)}
    with pytest.raises(InputError, match=message):
        Grid(**{**good, **change})


def test_arrays_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        oblique().origin[0] = 1.0


def test_values_of_the_voxels_places_lie_in():
    grid = Grid((2, 3, 4), (1.5, 1.5, 8.0), (5.0, 0.0, 0.0), np.eye(3))
    values = np.arange(1, 25, dtype=np.uint8).reshape(2, 3, 4)
    voxels = np.argwhere(values)
    places = grid.to_index(grid.to_world(voxels + 0.4))
    np.testing.assert_array_equal(grid.values_at(values, places), values.ravel())
    beyond = np.array([[-0.6, 0, 0], [0, 2.6, 0], [0, 0, 3.6], [1.4, 2.4, 3.4]])
    found = grid.values_at(values, beyond)
    assert found.tolist() == [0, 0, 0, 24]
    assert found.dtype == values.dtype
