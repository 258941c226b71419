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


def readonly(array: npt.ArrayLike, dtype: npt.DTypeLike, shape: tuple[int | None, ...], what: str) -> Any:
    """Contiguous read-only copy of an array, with its shape checked (``None`` is any length)."""
    result = np.array(array, dtype=dtype, order="C", copy=True)
    if result.ndim != len(shape) or any(s is not None and s != n for s, n in zip(shape, result.shape)):
        raise InputError(f"{what} has shape {result.shape}, expected {shape}")
    result.setflags(write=False)
    return result


def readonly_table(values: Mapping[str, Any], length: int, what: str) -> Mapping[str, Any]:
    """Read-only copy of named arrays that all have ``length`` rows."""
    out = {}
    for name, value in values.items():
        array = np.array(value, order="C", copy=True)
        if array.ndim == 0 or array.shape[0] != length:
            raise InputError(f"{what} {name!r} has shape {array.shape}, expected {length} rows")
        array.setflags(write=False)
        out[name] = array
    return MappingProxyType(out)
