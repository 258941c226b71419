"""An Exodus II file in, its variables by name out, whether it is HDF5 (netCDF 4) or of netCDF's classic kind.

Neither needs netCDF's library, which waits for ever on some damaged files.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from femprep.errors import FileError

_HDF5, _CLASSIC = b"\x89HDF", (b"CDF\x01", b"CDF\x02")


class Variables:
    """Variables of an open file.

    Parameters
    ----------
    get : callable
        What a name stands for, or None: something that is read by ``[...]``.
    attribute : callable
        Value of an attribute of that, or nothing.
    """

    def __init__(self, get: Callable[[str], Any], attribute: Callable[[Any, str], Any]) -> None:
        self._get, self._attribute = get, attribute

    def __contains__(self, name: str) -> bool:
        return self._get(name) is not None

    def read(self, name: str, *, first: bool = False) -> np.ndarray | None:
        """Values of a variable, or of its first step in time; None where there is no such variable."""
        found = self._get(name)
        if found is None or (first and not found.shape[0]):
            return None
        values = np.array(found[0] if first else found[...])
        return values if values.dtype.kind == "S" else values.astype(values.dtype.newbyteorder("="))

    def steps(self) -> int:
        """Number of steps in time."""
        times = self._get("time_whole")
        return 0 if times is None else int(times.shape[0])

    def names(self, variable: str, count: int) -> list[str]:
        """As many names: those of a variable of letters, and empty ones behind them."""
        rows = self.read(variable)
        words = [] if rows is None else [b"".join(row).split(b"\0")[0] for row in rows]
        said = [word.decode("utf-8", "replace").strip() for word in words]
        return [*said, *[""] * count][:count]

    def type_of(self, block: str) -> str:
        """Which elements a block says it has, in upper case."""
        value = self._attribute(self._get(block), "elem_type")
        word = value.decode("latin-1") if isinstance(value, bytes) else str(value)
        return word.strip("\0 ").upper()


@contextlib.contextmanager
def opened(path: Path) -> Iterator[Variables]:
    """The variables of a file, while it is open.

    Raises
    ------
    FileError
        It is neither HDF5 nor of netCDF's classic kind.
    """
    with path.open("rb") as file:
        head = file.read(4)
    if head == _HDF5:
        import h5py

        with h5py.File(path, "r") as store:
            yield Variables(store.get, lambda found, name: found.attrs.get(name, ""))
    elif head in _CLASSIC:
        from scipy.io import netcdf_file

        with netcdf_file(path, "r", mmap=True) as store:  # steps that nobody wants stay on the disk
            # Not a method of what closing lets go: it would be kept.
            yield Variables(lambda name: store.variables.get(name), lambda found, name: getattr(found, name, ""))
    else:
        raise FileError(f"{str(path)!r} is no Exodus file: neither HDF5 nor netCDF (version 5 of that is not read)")
