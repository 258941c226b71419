"""A mesh and the name of a format in, what the file of that format leaves out of the mesh out."""

from __future__ import annotations

from typing import Final

from femprep.export.purkinje import HOLDS
from femprep.export.xdmf.write import WHOLE, reduced
from femprep.mesh.elements import ELEMENTS
from femprep.model import Notice, VolumeMesh

#: Formats whose readers know linear elements alone.
_LINEAR: Final = ("medit", "opencarp", "opencarp-binary")


def losses(mesh: VolumeMesh, name: str) -> list[Notice]:
    """What a file of some format holds otherwise than the mesh does.

    Parameters
    ----------
    mesh : VolumeMesh
    name : str
        A name of ``FORMATS``.
    """
    if name in WHOLE:
        note = reduced(mesh, WHOLE[name])
    elif name in _LINEAR and any(ELEMENTS[kind].quadratic for kind in mesh.cells):
        note = "elements without their mid-side nodes"
    else:
        note = ""
    found = [Notice.of("left out", f"the {name} files hold {note}, as their readers know no others")] if note else []
    if mesh.purkinje is not None and name not in HOLDS:
        found.append(Notice.of("left out", f"the {name} files hold no Purkinje fibres; purkinje.vtp does"))
    return found
