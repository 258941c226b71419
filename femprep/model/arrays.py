"""Arrays of the nouns: their types, and read-only copies whose shape is checked."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError, quoted

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
TagArray = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]

#: Kinds of types that are real numbers, and bytes of those of fractions that programs of others know.
_NUMBERS, _PRECISIONS = "biuf", (4, 8)
#: Fractions from here on are not known to the unit.
_MOST = 2.0**53
#: Coordinates from here on, 1000 km in micrometres, are no numbers of a heart: their squares may overflow.
FARTHEST = 1e12


def frozen(array: Any) -> Any:
    """The array, read-only from now on: who made it hands it on for good, and it need not be copied."""
    array.setflags(write=False)
    return array


def _kept(array: npt.ArrayLike, dtype: npt.DTypeLike | None) -> Any:
    """Contiguous read-only copy of an array; the array itself where it is one already, so that copies share theirs.

    A view is copied, whoever may write into what it is a view of; a view of bytes, as arrays are that come out of a
    pickle, cannot be written into.
    """
    base = getattr(array, "base", None)
    while isinstance(base, np.ndarray):
        base = base.base
    if (
        isinstance(array, np.ndarray)
        and (array.base is None or (isinstance(base, bytes) and array.flags.aligned))
        and not array.flags.writeable
        and array.flags.c_contiguous
        and (dtype is None or array.dtype == dtype)
    ):
        return array
    return frozen(np.array(array, dtype=dtype, order="C", copy=True))


def array_of(values: Any, what: str) -> Any:
    """Numbers as an array.

    Raises
    ------
    InputError
        Its rows differ in length, or it holds no real numbers.
    """
    try:
        given = np.asarray(values)
    except (TypeError, ValueError):
        raise InputError(f"{what} is no array: its rows differ in length") from None
    if given.dtype.kind not in _NUMBERS and (given.size or given.dtype.kind == "O"):
        raise InputError(f"{what} holds no real numbers but {given.dtype}")
    return given


def floats(values: Any, what: str) -> FloatArray:
    """Real numbers as floating point ones; else refused as by :func:`array_of`."""
    return np.asarray(array_of(values, what), dtype=np.float64)


def readonly(array: npt.ArrayLike, dtype: npt.DTypeLike, shape: tuple[int | None, ...], what: str) -> Any:
    """Contiguous read-only array of the same values, with its shape checked (``None`` is any length).

    Raises
    ------
    InputError
        It has another shape, holds no real numbers, or a fraction where whole ones are asked for.
    """
    given = array_of(array, what)
    if np.dtype(dtype).kind == "i":
        if given.dtype.kind == "f":
            given = integers(given, what)
        _require_room(given, np.dtype(dtype), what)
    result = _kept(given, dtype)
    if result.ndim != len(shape) or any(s is not None and s != n for s, n in zip(shape, result.shape)):
        raise InputError(f"{what} has shape {result.shape}, expected {shape}")
    return result


def _require_room(values: Any, dtype: np.dtype[Any], what: str) -> None:
    """Whole numbers fit into a type of fewer bytes: others would become smaller ones."""
    if values.dtype.itemsize < dtype.itemsize or values.dtype == dtype or values.dtype.kind == "b" or not values.size:
        return
    most = np.iinfo(dtype).max
    if values.max() > most or values.min() < -most - 1:
        wrong = values.max() if values.max() > most else values.min()
        raise InputError(f"{what} holds {wrong}, beyond whole numbers of {8 * dtype.itemsize} bits")


def integers(values: Any, what: str) -> IntArray:
    """Numbers as integers.

    Raises
    ------
    InputError
        They are no numbers, or one of them is a fraction, infinite, NaN or beyond 64 bits.
    """
    given = array_of(values, what)
    if given.dtype.kind == "f":
        given = given.astype(np.float64)
        wrong = np.flatnonzero(~(np.abs(given) < _MOST) | (given != np.round(given)))
        if wrong.size:
            raise InputError(f"{what} holds {given.flat[wrong[0]]:g}, expected whole numbers")
    else:
        _require_room(given, np.dtype(np.int64), what)
    return np.array(given, dtype=np.int64)


def readonly_table(values: Mapping[str, Any], length: int, what: str) -> Mapping[str, Any]:
    """Named arrays that all have ``length`` rows, read-only; half and extended precision becomes double.

    Raises
    ------
    InputError
        One has other rows, or holds no real numbers; or they have no names.
    """
    out = {}
    for name, value in mapping(values, what).items():
        kind = array_of(value, f"{what} {name!r}").dtype
        array = _kept(value, np.float64 if kind.kind == "f" and kind.itemsize not in _PRECISIONS else None)
        if array.ndim == 0 or array.shape[0] != length:
            raise InputError(f"{what} {name!r} has shape {array.shape}, expected {length} rows")
        out[name] = array
    return MappingProxyType(out)


def mapping(values: Any, what: str, kind: type = object) -> Mapping[str, Any]:
    """Things of one kind by name, read-only.

    Raises
    ------
    InputError
        It is no mapping, a name is no string, or one of them is of another kind.
    """
    if not isinstance(values, Mapping):
        raise InputError(f"{what} is {quoted(values)}, expected a mapping by names")
    for name, value in values.items():
        if not isinstance(name, str):
            raise InputError(f"{what} has the name {name!r}, expected a string")
        if not isinstance(value, kind):
            raise InputError(f"{what} {name!r} is {quoted(value)}, expected a {kind.__name__}")
    return MappingProxyType(dict(values))


def require_points(numbers: IntArray, count: int, what: str) -> None:
    """Refuse numbers of points, from 0, that are none of so many points.

    Raises
    ------
    InputError
    """
    if numbers.size and ((least := numbers.min()) < 0 or numbers.max() >= count):
        wrong = least if least < 0 else numbers.max()
        raise InputError(f"{what} name point {wrong}, but there are {count} points, counted from 0")
