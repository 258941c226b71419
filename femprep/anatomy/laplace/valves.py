"""Fields of a ventricular wall in, those between its apex and its open valves out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.anatomy.laplace.dirichlet import solve
from femprep.anatomy.laplace.fields import WallFields
from femprep.errors import InputError
from femprep.model import FloatArray

#: Facets of the inflow and the outflow valve of each ventricle.
VALVES: Final = {"lv": ("mitral", "aortic"), "rv": ("tricuspid", "pulmonary")}


def closed_valves(fields: WallFields) -> dict[str, list[str]]:
    """Valves that are not open, by ventricle; ventricles where both are, are left out."""
    ventricles = ("lv", "rv") if fields.biventricular else ("lv",)
    shut = {one: [name for name in VALVES[one] if not len(fields.facet_nodes(name))] for one in ventricles}
    return {one: names for one, names in shut.items() if names}


def valve_fields(fields: WallFields, ventricle: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Harmonic fields of a ventricle with open valves (Doste et al. 2019, doi 10.1002/cnm.3185, section 2.3).

    Parameters
    ----------
    fields : WallFields
    ventricle : {"lv", "rv"}

    Returns
    -------
    inflow, outflow : (n,) arrays
        0 at the ventricle's apex, 1 at its inflow and its outflow valve.
    share : (n,) array
        Of the outflow tract: 0 at the apex and the inflow valve, 1 at the outflow valve.

    Raises
    ------
    InputError
        Facets of a valve are missing.
    """
    names = VALVES[ventricle]
    rings = [fields.facet_nodes(name) for name in names]
    for name, ring in zip(names, rings):
        if not len(ring):
            have = ", ".join(fields.mesh.facet_names)
            raise InputError(
                f"rule doste needs facets tagged {name}, where the {ventricle} is open; the mesh has {have}; take "
                "rule linear, or open the valves"
            )
    inflow, outflow = rings
    apex = fields.apex_nodes
    if ventricle == "rv":
        centre = fields.space.points[inflow].mean(axis=0)
        apex = fields.rv[[np.argmax(np.linalg.norm(fields.space.points[fields.rv] - centre, axis=1))]]
    sides = (((inflow, 1.0),), ((outflow, 1.0),), ((inflow, 0.0), (outflow, 1.0)))
    first, second, third = (
        solve(fields.space, fields.laplace, fields.prescribed((apex, 0.0), *valve)) for valve in sides
    )
    return first, second, third
