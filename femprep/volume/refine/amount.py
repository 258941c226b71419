"""A mesh and a number of levels in; an error where what it is cut into does not fit into memory."""

from __future__ import annotations

from typing import Final

from femprep.errors import ResourceError
from femprep.image.reading.native import memory
from femprep.model import VolumeMesh

#: Memory of the finest elements, at the least, bytes for each of their nodes (measured, without data and improvement:
#: 2.9 million tetrahedra 1.09 GB, a million hexahedra 0.91 GB).
_BYTES_PER_NODE: Final = 90


def check_levels(mesh: VolumeMesh, levels: int) -> None:
    """Refuse more levels than the memory of the machine holds, before the first; what is refused is certain.

    Raises
    ------
    ResourceError
    """
    there = memory()
    # Of the mesh itself, to be multiplied by 8 for each level.
    need = _BYTES_PER_NODE * sum(block.size for block in mesh.cells.values())
    if there is None or need * 8.0**levels <= there:
        return
    most = max((k for k in range(1, levels) if need * 8.0**k <= there), default=0)
    raise ResourceError(
        f"{mesh.n_cells} elements refined {levels} times are {mesh.n_cells * 8.0**levels:.2g} and need "
        f"{need * 8.0**levels / 1e9:.3g} GB or more, and there are {there / 1e9:.3g} GB; "
        + (f"choose at most {most} levels" if most else "refine a mesh of fewer elements")
    )
