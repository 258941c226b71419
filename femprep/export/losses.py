"""A mesh and the name of a format in, what the file of that format leaves out of the mesh out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from femprep.export.deck.fields import user_fields
from femprep.export.deck.springs import NEEDED, RING
from femprep.export.purkinje import HOLDS
from femprep.export.xdmf.write import WHOLE, reduced
from femprep.mesh.elements import ELEMENTS
from femprep.model import Notice, VolumeMesh

#: Formats whose readers know linear elements alone.
_LINEAR: Final = ("medit", "opencarp", "opencarp-binary")


class _Held(NamedTuple):
    """Names of the data of elements, points and facets that a format holds; ``None`` for all.

    It holds ``users``, the user's own fields of these, as well.
    """

    elements: tuple[str, ...] | None = None
    points: tuple[str, ...] | None = None
    facets: tuple[str, ...] | None = None
    users: tuple[str, ...] = ("elements", "points")


#: The normal is what stands across fibre and sheet.
_AXES: Final = ("fiber", "sheet", "normal", "aha")
_DECK: Final = _Held(_AXES, (*NEEDED, RING), ())
#: Ventricular coordinates are there as UVC, which hold the angle alone.
_CARP: Final = _Held(
    _AXES,
    ("apicobasal", "transmural", "transventricular", "rotational", "rotational_cos", "rotational_sin", RING),
    (),
)
#: Formats that hold some data alone.
_HELD: Final[Mapping[str, _Held]] = {
    "abaqus": _DECK,
    "febio": _DECK,
    "ls-dyna": _DECK._replace(users=("elements",)),
    "opencarp": _CARP,
    "opencarp-binary": _CARP,
    "medit": _Held(_AXES, (), ()),
    "gmsh": _Held((), None, ()),
    "dolfinx": _Held(facets=()),
    "fenics": _Held(facets=()),
    "svmultiphysics": _Held(facets=()),
}


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
    words = [f"the {name} files hold {note}, as their readers know no others"] if note else []
    if mesh.purkinje is not None and name not in HOLDS:
        words.append(f"the {name} files hold no Purkinje fibres; those of vtu do")
    if data := _data_left_out(mesh, _HELD.get(name, _Held())):
        words.append(f"the {name} files leave out {data}; those of vtu hold them")
    return [Notice.of("left out", one) for one in words]


def _data_left_out(mesh: VolumeMesh, held: _Held) -> str:
    """The data of a mesh that are not among those held, in words."""
    found = []
    users = dict(zip(_Held._fields, user_fields(mesh)))
    for what, data, names in zip(_Held._fields, (mesh.cell_data, mesh.point_data, mesh.facet_data), held):
        written = {field.own for field in users.get(what, ()) if what in held.users}
        left_out = [
            name if np.isfinite(values).all() else f"{name}, as values are not finite"
            for name, values in data.items()
            if names is not None and name not in {*names, *written}
        ]
        if left_out:
            found.append(f"of {what} ({', '.join(left_out)})")
    return f"data {', '.join(found)}" if found else ""
