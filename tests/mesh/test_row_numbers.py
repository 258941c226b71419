import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.mesh.numbering import none_of, row_numbers, twins


@settings(deadline=None)
@given(st.integers(0, 50), st.integers(1, 5), st.sampled_from([1, 3, 1000, 2**40]), st.integers(0, 2**32))
def test_rows_are_numbered_as_numpy_does(count, width, largest, seed):
    rng = np.random.default_rng(seed)
    pool = rng.integers(-1, largest, (max(count // 2, 1), width))
    rows = pool[rng.integers(0, len(pool), count)] if count else pool[:0]
    expected = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    np.testing.assert_array_equal(row_numbers(rows), expected)


@pytest.mark.parametrize("size", [2**21 - 1, 2**31])
def test_numbers_too_large_to_pack_are_still_told_apart(size):
    rows = np.array([(size, size, size, 0), (size, size, size, 1), (0, size, size, size), (size, size, size, 0)])
    np.testing.assert_array_equal(row_numbers(rows), [1, 2, 0, 1])


@pytest.mark.parametrize(("width", "largest"), [(2, 4_000), (3, 900), (4, 30_000)])
def test_many_rows_are_numbered_as_numpy_does(width, largest):
    """Enough of them to be sorted in buckets."""
    rng = np.random.default_rng(width)
    pool = rng.integers(-5, largest, (15_000, width))
    rows = pool[rng.integers(0, len(pool), 50_000)]
    expected = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    np.testing.assert_array_equal(row_numbers(rows), expected)


def test_many_rows_with_one_first_number_are_numbered_too():
    rows = np.stack([np.zeros(30_000, dtype=np.int64), np.arange(30_000)[::-1] // 2], axis=1)
    np.testing.assert_array_equal(row_numbers(rows), rows[:, 1])


def test_rows_of_the_same_numbers_are_found_in_any_order():
    rows = np.array([(3, 1, 2), (0, 1, 2), (2, 3, 1), (4, 4, 5), (1, 0, 2)])
    assert [own.tolist() for own in twins(rows)] == [[1, 0], [4, 2]]
    assert none_of(rows, np.array([(2, 1, 3), (5, 4, 4)])).tolist() == [False, True, False, False, True]
    assert none_of(rows, np.empty((0, 3), dtype=np.int64)).all()
