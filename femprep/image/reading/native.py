"""What the system tells of this process: what native code writes to standard error, and how much memory there is."""

from __future__ import annotations

import math
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from femprep.errors import ResourceError

#: Memory that reading a label map and taking its objects apart needs, bytes per voxel, at the least.
_BYTES_PER_VOXEL: Final = 4


@contextmanager
def captured_stderr() -> Iterator[list[str]]:
    """Catch what is written to file descriptor 2 meanwhile; the list is filled when the block ends, also by an error.

    For short calls only: the descriptor belongs to the whole process, other threads' messages are caught with it.
    """
    said: list[str] = []
    sys.stderr.flush()
    try:
        saved = os.dup(2)
    except OSError:
        # The process has no standard error, so that there is nothing to catch.
        yield said
        return
    try:
        place = tempfile.TemporaryFile()  # noqa: SIM115
    except OSError:
        # No room for it: what is said goes where it always goes.
        os.close(saved)
        yield said
        return
    with place as store:
        try:
            os.dup2(store.fileno(), 2)
            yield said
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            store.seek(0)
            said.extend(line.strip() for line in store.read().decode(errors="replace").splitlines() if line.strip())


def memory() -> int | None:
    """Memory that this process may have: the machine's, or its limit of address space; None where it is not told."""
    try:
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):  # Windows
        return None
    import resource

    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return there if limit == resource.RLIM_INFINITY else min(there, limit)


def require_memory(file: Path, shape: Sequence[int]) -> None:
    """Refuse what does not fit into the memory of the machine, before it is asked for.

    Raises
    ------
    ResourceError
    """
    need, there = _BYTES_PER_VOXEL * math.prod(shape), memory()
    if there is not None and need > there:
        shown = " x ".join(map(str, shape))
        raise ResourceError(
            f"{file}: its {shown} voxels need about {need / 1e9:.3g} GB, and there are {there / 1e9:.3g} GB; crop or "
            "resample the image"
        )
