"""Arrays of the nouns: real numbers, whole ones where points or tags are meant, in types that others know."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import truncated_ellipsoid

from femprep.errors import InputError
from femprep.model import VolumeMesh
from femprep.model.arrays import integers

MESH = truncated_ellipsoid("tetra")


@pytest.mark.parametrize("kind", ["e", "f", "d", "g", "?", "i1", "u8"])
def test_numbers_of_every_width_are_held_in_types_that_files_know(kind: str) -> None:
    values = np.arange(MESH.n_cells).astype(kind)
    found = MESH.with_data(cell={"own": values}).cell_data["own"]
    np.testing.assert_array_equal(found, values)
    assert found.dtype == (np.float64 if kind in "eg" else values.dtype)


@pytest.mark.parametrize("kind", ["D", "S3", "U3", "O", [("a", "f8"), ("b", "i4")]])
def test_what_is_no_real_number_is_refused(kind: object) -> None:
    values = np.zeros(MESH.n_cells, dtype=kind)  # type: ignore[call-overload]
    with pytest.raises(InputError, match="cell data 'own' holds no real numbers but"):
        MESH.with_data(cell={"own": values})
    with pytest.raises(InputError, match="points holds no real numbers but"):
        VolumeMesh(np.zeros((4, 3), dtype=kind), {"tetra": [[0, 1, 2, 3]]}, [60])  # type: ignore[call-overload]


@pytest.mark.parametrize("wrong", [1.5, np.nan, np.inf, 2.0**60])
@pytest.mark.parametrize("kind", ["e", "d", "g"])
def test_fractions_are_no_numbers_of_points(wrong: float, kind: str) -> None:
    """They were cut to whole ones: an element of other points."""
    with np.errstate(over="ignore"):
        rows = np.array([[0.0, 1.0, 2.0, wrong]]).astype(kind)
    with pytest.raises(InputError, match=r"cells 'tetra' holds .*, expected whole numbers"):
        VolumeMesh(np.zeros((4, 3)), {"tetra": rows}, [60])
    whole = np.array([[0.0, 1.0, 2.0, 3.0]]).astype(kind)
    assert VolumeMesh(np.zeros((4, 3)), {"tetra": whole}, [60]).cells["tetra"].tolist() == [[0, 1, 2, 3]]


def test_numbers_without_a_sign_do_not_become_negative() -> None:
    values = np.array([7, 2**63 - 1], dtype=np.uint64)
    assert integers(values, "a list").tolist() == [7, 2**63 - 1]
    with pytest.raises(InputError, match=f"a list holds {2**63}, beyond whole numbers of 64 bits"):
        integers(values + np.uint64(1), "a list")


def test_words_are_no_integers() -> None:
    with pytest.raises(InputError, match="a list holds no real numbers but <U1"):
        integers(np.array(["a"]), "a list")


@pytest.mark.parametrize("wrong", [2**31, -(2**31) - 1, 2**62])
def test_tags_beyond_their_bits_are_refused(wrong: int) -> None:
    """They became others."""
    with pytest.raises(InputError, match=f"region holds {wrong}, beyond whole numbers of 32 bits"):
        VolumeMesh(np.zeros((4, 3)), {"tetra": [[0, 1, 2, 3]]}, [wrong])
    with pytest.raises(InputError, match="beyond whole numbers of 64 bits"):
        VolumeMesh(np.zeros((4, 3)), {"tetra": np.array([[0, 1, 2, 2**63]], dtype=np.uint64)}, [60])
    assert VolumeMesh(np.zeros((4, 3)), {"tetra": [[0, 1, 2, 3]]}, [2**31 - 1]).region.tolist() == [2**31 - 1]


def test_rows_of_different_lengths_are_refused() -> None:
    with pytest.raises(InputError, match="points is no array: its rows differ in length"):
        VolumeMesh([[0, 0, 0], [1, 1]], MESH.cells, MESH.region)
    with pytest.raises(InputError, match="cells 'tetra' is no array: its rows differ in length"):
        VolumeMesh(MESH.points, {"tetra": [[0, 1, 2, 3], [0, 1, 2]]}, [1, 1])
    with pytest.raises(InputError, match="cell data 'a' is no array: its rows differ in length"):
        MESH.with_data(cell={"a": [[1], [2, 3]]})
