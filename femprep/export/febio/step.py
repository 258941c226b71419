"""A tagged mesh in, the passive inflation of an FEBio model out: solver, loads, springs of the pericardium.

FEBio's ``pressure Robin BC`` presses against a wall that moves along the normal of its facets, and lets one that moves
the other way go. The springs of a pericardium push and pull, so there are two: on the epicardium as it is, and on the
same facets seen from inside.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.export.deck.names import facet_names, held
from femprep.export.deck.springs import has_pericardium, per_millimetre
from femprep.export.deck.units import UNITS
from femprep.export.inflation import pressures
from femprep.mesh.operations.turned import turned_facets
from femprep.model import IntArray, VolumeMesh
from femprep.model.blocks import block_rows, chosen_rows
from femprep.options import ExportOptions

#: The epicardium seen from inside, and the stiffnesses of both sides.
INWARD: Final = "pericardium_inward"
_SIDES: Final = {"epi": "pericardium_outward_eps", INWARD: "pericardium_inward_eps"}

# The matrix is symmetric, as the rim of the pressed surface is held: no solver but those of Intel's library, which not
# every FEBio is built with, takes another. Those others do not order the unknowns themselves: a thousand points of
# ten-node tetrahedra took a minute in place of two seconds. Newton steps in full, until displacements change by a
# millionth.
CONTROL: Final = """<Control>
<analysis>STATIC</analysis>
<time_steps>10</time_steps>
<step_size>0.1</step_size>
<solver type="solid">
<symmetric_stiffness>symmetric</symmetric_stiffness>
<equation_scheme>staggered</equation_scheme>
<optimize_bw>1</optimize_bw>
<dtol>1e-06</dtol>
<etol>1e-06</etol>
<rtol>0</rtol>
<qn_method type="BFGS">
<max_ups>0</max_ups>
</qn_method>
</solver>
<time_stepper type="default">
<max_retries>5</max_retries>
<opt_iter>11</opt_iter>
<dtmin>0.001</dtmin>
<dtmax>0.1</dtmax>
</time_stepper>
</Control>
"""


def epicardium(mesh: VolumeMesh) -> dict[str, IntArray]:
    """Facets of the epicardium by type."""
    return chosen_rows(mesh.facets, mesh.facet_tag == facet_names(mesh)["epi"])


def stiffness(mesh: VolumeMesh, options: ExportOptions) -> list[str]:
    """``SurfaceData`` of both sides: the stiffness at the nodes of each facet."""
    values = np.asarray(mesh.point_data["pericardium"], dtype=np.float64) * per_millimetre(options)
    facets = epicardium(mesh)
    width = max(block.shape[1] for block in facets.values())  # every facet gives as many numbers as the largest
    out = []
    for surface, name in _SIDES.items():
        out.append(f'<SurfaceData surface="{surface}" name="{name}" data_type="scalar">\n')
        for kind, nodes, rows in block_rows(facets):
            own = nodes if surface == "epi" else turned_facets(kind, nodes)
            numbers = np.pad(values[own], ((0, 0), (0, width - own.shape[1]))).tolist()
            lines = (
                f'<face lid="{i}">{",".join(map(repr, n))}</face>\n' for i, n in enumerate(numbers, rows.start + 1)
            )
            out.append("".join(lines))
        out.append("</SurfaceData>\n")
    return out


def inflation(mesh: VolumeMesh, options: ExportOptions) -> str:
    """Base, pressure and springs, and the ramp of the pressure."""
    unit = UNITS[options.length_unit].per_kpa
    loads = "".join(
        f'<surface_load name="pressure_{name}" type="pressure" surface="{name}">\n<pressure lc="1">'
        f"{pressure * unit:.12g}</pressure>\n<symmetric_stiffness>1</symmetric_stiffness>\n</surface_load>\n"
        for name, pressure in pressures(facet_names(mesh), options).items()
    )
    if has_pericardium(mesh):
        loads += "".join(
            f'<surface_load name="{name}" type="pressure Robin BC" surface="{surface}">\n'
            f'<spring_eps type="map">{name}</spring_eps>\n<dashpot_eps>0</dashpot_eps>\n</surface_load>\n'
            for surface, name in _SIDES.items()
        )
    # Prescribed to be zero, not fixed: FEBio gives reactions of the former alone.
    supports = "".join(
        f'<bc name="{name}_{axis}" type="prescribed displacement" node_set="{name}">\n<dof>{axis}</dof>\n'
        "<value>0</value>\n<relative>0</relative>\n</bc>\n"
        for name in held(facet_names(mesh))
        for axis in "xyz"
    )
    return (
        f"<Boundary>\n{supports}</Boundary>\n<Loads>\n{loads}</Loads>\n"
        '<LoadData>\n<load_controller id="1" type="loadcurve">\n<interpolate>LINEAR</interpolate>\n'
        "<extend>CONSTANT</extend>\n<points>\n<pt>0,0</pt>\n<pt>1,1</pt>\n</points>\n</load_controller>\n</LoadData>\n"
    )
