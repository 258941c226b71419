"""A tagged mesh in, the ``inflation.xml`` and the pressure of a passive inflation by svMultiPhysics out.

The base is held, the pressure rises in ten steps without inertia: the density is zero, and a spectral radius of zero
puts the balance of forces at the end of each step.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.export.content import Content
from femprep.export.deck.names import facet_names, held
from femprep.export.deck.units import UNITS
from femprep.export.inflation import cavity_of, pressures
from femprep.export.inflation import require as require_step
from femprep.model import FloatArray, VolumeMesh
from femprep.options import ExportOptions

#: Elements svMultiPhysics solves on; a mesh of it has one type alone. It reads wedges too, but takes the slopes of
#: their shape functions at one point for those at all: displacements are a tenth off, on finer meshes as well.
ELEMENTS: Final = ("tetra", "tetra10", "hexahedron", "hexahedron20")
STEPS: Final = 10
#: The epicardium with stiffnesses, where a mesh has a pericardium.
PERICARDIUM: Final = "pericardium.vtp"

#: Name in the record of the mesh's file: what was taken off its coordinates, in the units of the file.
ORIGIN: Final = "origin"

#: Equation, and what stands in it of the material. The linear one is for small displacements.
_EQUATIONS: Final = {
    "linear": ("lElas", ""),
    "neo-hookean": (
        "struct",
        '<Constitutive_model type="neoHookean"> </Constitutive_model>\n'
        "<Dilational_penalty_model> Quad </Dilational_penalty_model>\n",
    ),
}


def require(content: Content, options: ExportOptions) -> None:
    """Make sure that svMultiPhysics has what an inflation of a mesh needs.

    Raises
    ------
    InputError
        It has no such element or material, or the mesh lacks what every inflation needs.
    """
    if options.step == "none":
        return
    require_step(content, options)
    if options.material not in _EQUATIONS:
        raise InputError(f"svMultiPhysics has no {options.material} material; choose from {', '.join(_EQUATIONS)}")
    if len(content.elements) > 1 or content.elements[0] not in ELEMENTS:
        raise InputError(
            f"svMultiPhysics solves on elements of one type, of {', '.join(ELEMENTS)}; this mesh has "
            f"{', '.join(content.elements)}"
        )
    if options.material == "neo-hookean" and content.elements[0] == "hexahedron20":
        raise InputError(
            "svMultiPhysics takes shape functions on the faces of hexahedron20 for wrong where pressure follows the "
            "wall; choose the linear material, or elements of order 1"
        )


def origin_of(mesh: VolumeMesh, options: ExportOptions) -> FloatArray:
    """What is taken off the coordinates ``(3,)``, mm: zeros, or the middle of the mesh.

    Where pressure follows facets of elements that may be curved or warped, svMultiPhysics looks their points up in the
    elements, to a millionth of the coordinates but asks for a ten-thousandth of an element: far from the origin it
    stops there.
    """
    curved = options.step != "none" and options.material == "neo-hookean" and set(mesh.cells) != {"tetra"}
    return np.asarray(np.round(mesh.points.mean(axis=0)), dtype=np.float64) if curved else np.zeros(3)


def write_step(mesh: VolumeMesh, folder: Path, options: ExportOptions) -> None:
    """Write ``inflation.xml`` and the pressures beside the mesh, to be run in that folder."""
    for name, pressure in pressures(facet_names(mesh), options).items():
        last = f"1.0 {pressure * UNITS[options.length_unit].per_kpa:.12g}\n"
        (folder / _ramp(name, options)).write_text(f"2 1\n0.0 0.0\n{last}", encoding="ascii")
    (folder / "inflation.xml").write_text(_document(mesh, folder, options), encoding="ascii")


def _ramp(name: str, options: ExportOptions) -> str:
    """File of the pressure on an endocardium: one for all of them, or one for each cavity."""
    return f"inflation_{cavity_of(name)}.dat" if isinstance(options.pressure, dict) else "inflation.dat"


def _document(mesh: VolumeMesh, folder: Path, options: ExportOptions) -> str:
    units = UNITS[options.length_unit]
    names = facet_names(mesh)
    equation, material = _EQUATIONS[options.material]
    text = f'<?xml version="1.0" encoding="UTF-8"?>\n<!-- femprep volume mesh; {units.line} -->\n'
    if (origin := origin_of(mesh, options)).any():
        x, y, z = (origin * units.per_mm).tolist()
        text += f"<!-- coordinates are from ({x:g}, {y:g}, {z:g}): svMultiPhysics wants curved elements near 0 -->\n"
    text += '<svMultiPhysicsFile version="0.1">\n' + _GENERAL
    text += '<Add_mesh name="wall">\n<Mesh_file_path> mesh-complete.mesh.vtu </Mesh_file_path>\n'
    for name in names:
        text += f'<Add_face name="{name}">\n<Face_file_path> mesh-surfaces/{name}.vtp </Face_file_path>\n</Add_face>\n'
    for file in ("fibersLong.vtu", "fibersSheet.vtu"):
        if (folder / file).exists():
            text += f"<Fiber_direction_file_path> {file} </Fiber_direction_file_path>\n"
    text += f'</Add_mesh>\n<Add_equation type="{equation}">\n<Coupled> true </Coupled>\n'
    text += "<Min_iterations> 1 </Min_iterations>\n<Max_iterations> 30 </Max_iterations>\n"
    text += "<Tolerance> 1e-9 </Tolerance>\n<Density> 0.0 </Density>\n"
    text += f"<Elasticity_modulus> {options.young_modulus * units.per_kpa:.12g} </Elasticity_modulus>\n"
    text += f"<Poisson_ratio> {options.poisson_ratio:.12g} </Poisson_ratio>\n{material}{_SOLVER}"
    for name in held(names):
        text += f'<Add_BC name="{name}">\n<Type> Dirichlet </Type>\n<Value> 0.0 </Value>\n</Add_BC>\n'
    follows = "true" if equation == "struct" else "false"
    for name in pressures(names, options):
        text += f'<Add_BC name="{name}">\n<Type> Neumann </Type>\n<Time_dependence> Unsteady </Time_dependence>\n'
        text += f"<Temporal_values_file_path> {_ramp(name, options)} </Temporal_values_file_path>\n"
        text += "<Ramp_function> true </Ramp_function>\n"
        text += f"<Follower_pressure_load> {follows} </Follower_pressure_load>\n</Add_BC>\n"
    if (folder / PERICARDIUM).exists():
        text += '<Add_BC name="epi">\n<Type> Robin </Type>\n'
        text += f"<Spatial_values_file_path> {PERICARDIUM} </Spatial_values_file_path>\n"
        text += "<Apply_along_normal_direction> true </Apply_along_normal_direction>\n</Add_BC>\n"
    return text + "</Add_equation>\n</svMultiPhysicsFile>\n"


_GENERAL: Final = f"""\
<GeneralSimulationParameters>
<Continue_previous_simulation> false </Continue_previous_simulation>
<Number_of_spatial_dimensions> 3 </Number_of_spatial_dimensions>
<Number_of_time_steps> {STEPS} </Number_of_time_steps>
<Time_step_size> {1 / STEPS:g} </Time_step_size>
<Spectral_radius_of_infinite_time_step> 0.0 </Spectral_radius_of_infinite_time_step>
<Searched_file_name_to_trigger_stop> STOP_SIM </Searched_file_name_to_trigger_stop>
<Save_results_to_VTK_format> true </Save_results_to_VTK_format>
<Name_prefix_of_saved_VTK_files> result </Name_prefix_of_saved_VTK_files>
<Increment_in_saving_VTK_files> {STEPS} </Increment_in_saving_VTK_files>
<Start_saving_after_time_step> 1 </Start_saving_after_time_step>
<Increment_in_saving_restart_files> {STEPS} </Increment_in_saving_restart_files>
<Convert_BIN_to_VTK_format> false </Convert_BIN_to_VTK_format>
<Verbose> true </Verbose>
<Warning> true </Warning>
<Debug> false </Debug>
</GeneralSimulationParameters>
"""

_SOLVER: Final = """\
<Output type="Spatial">
<Displacement> true </Displacement>
</Output>
<LS type="GMRES">
<Linear_algebra type="fsils">
<Preconditioner> fsils </Preconditioner>
</Linear_algebra>
<Tolerance> 1e-8 </Tolerance>
<Absolute_tolerance> 1e-30 </Absolute_tolerance>
<Max_iterations> 100 </Max_iterations>
<Krylov_space_dimension> 300 </Krylov_space_dimension>
</LS>
"""
