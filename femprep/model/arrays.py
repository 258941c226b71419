"""Arrays of the nouns: their types, and read-only copies whose shape is checked."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
TagArray = npt.NDArray[np.int32]
BoolArray = npt.NDArray[np.bool_]


def frozen(array: Any) -> Any:
    """The array, read-only from now on: who made it hands it on for good, and it need not be copied."""
    array.setflags(write=False)
    return array


def _kept(array: npt.ArrayLike, dtype: npt.DTypeLike | None) -> Any:
    """Contiguous read-only copy of an array; the array itself where it is one already, so that copies share theirs.

    A view is copied, whoever may write into what it is a view of.
    """
    if (
        isinstance(array, np.ndarray)
        and array.base is None
        and not array.flags.writeable
        and array.flags.c_contiguous
        and (dtype is None or array.dtype == dtype)
    ):
        return array
    return frozen(np.array(array, dtype=dtype, order="C", copy=True))


def readonly(array: npt.ArrayLike, dtype: npt.DTypeLike, shape: tuple[int | None, ...], what: str) -> Any:
    """Contiguous read-only array of the same values, with its shape checked (``None`` is any length)."""
    result = _kept(array, dtype)
    if result.ndim != len(shape) or any(s is not None and s != n for s, n in zip(shape, result.shape)):
        raise InputError(f"{what} has shape {result.shape}, expected {shape}")
    return result


def readonly_table(values: Mapping[str, Any], length: int, what: str) -> Mapping[str, Any]:
    """Named arrays that all have ``length`` rows, read-only."""
    out = {}
    for name, value in values.items():
        array = _kept(value, None)
        if array.ndim == 0 or array.shape[0] != length:
            raise InputError(f"{what} {name!r} has shape {array.shape}, expected {length} rows")
        out[name] = array
    return MappingProxyType(out)
