"""The base of objects whose arrays and tables are read-only: copies and pickles of them are read-only as well."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

import numpy as np

from femprep.model.arrays import frozen


class Immutable:
    """Base of the immutable objects that hold arrays.

    Python cannot pickle a read-only table (``mappingproxy``), and arrays become writable when they are unpickled or
    deep-copied. So the state of an object holds ordinary dictionaries, and what is restored from it is made read-only
    again. Arrays that two objects share stay shared.
    """

    def __getstate__(self) -> tuple[dict[str, Any], list[str]]:
        tables = {name: dict(value) for name, value in vars(self).items() if isinstance(value, MappingProxyType)}
        return vars(self) | tables, list(tables)

    def __setstate__(self, state: tuple[dict[str, Any], list[str]]) -> None:
        values, tables = state
        for value in values.values():
            for array in value.values() if isinstance(value, dict) else (value,):
                if isinstance(array, np.ndarray):
                    frozen(array)
        vars(self).update(values | {name: MappingProxyType(values[name]) for name in tables})
