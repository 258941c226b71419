"""A heart's beat in fenicsx-pulse, from femprep's dolfinx folder: filling, contraction, ejection, relaxation.

    python fenicsx_pulse_beat.py OUT/dolfinx RESULT.npz [--fibres ldrb] [--tension 100]

Run by the Python that fenicsx-pulse and cardiac-geometriesx belong to (``examples/07_beating_heart.py`` calls it and
draws). The folder is of a left ventricle at end-diastole, in metres, with fibres and the pericardium's springs
(``--length-unit m --fibres --pericardium 1``).

1. The wall is unloaded: the shape is looked for that end-diastolic pressure turns into the image's.
2. From there an atrium fills it through a valve; then tension along the fibres rises and falls again, while a valve
   opens to a Windkessel. Circulation and wall are one system of equations.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

# This order is needed where the packages are wheels: their libraries of MPI and HDF5 shut others out.
import h5py  # isort: skip
import numpy as np

from mpi4py import MPI  # isort: skip
import dolfinx  # isort: skip
import pulse
import ufl
from cardiac_geometries.geometry import Geometry

MMHG, ML = 133.322387415, 1e-6
#: End-diastolic pressure, and the aorta's when filling begins, mmHg.
FILLED, AORTA = 10.0, 95.0
#: Seconds: the atrium fills until the first, tension rises from there to the second, and is gone at the third.
FILL, PEAK, END, STEP = 0.30, 0.50, 0.74, 0.02


def load(folder: Path) -> Geometry:
    """Mesh, tags, names and fibres; of the HDF5 file where this Python has no ADIOS2."""
    try:
        import adios2  # noqa: F401
    except ImportError:
        import io4dolfinx

        io4dolfinx.set_default_backend("h5py")
        return Geometry.from_file(MPI.COMM_WORLD, folder / "mesh.h5")
    return Geometry.from_folder(MPI.COMM_WORLD, folder)


class Windkessel:
    """Atrium, two valves, elastic aorta and the body's resistance: mL, mmHg, s."""

    state_names = ("V", "p_aorta")
    missing_names = ("p", "p_atrium")
    mitral, aortic, compliance, body = 0.005, 0.01, 1.4, 1.1

    def __init__(self, volume: float) -> None:
        self.initial_states = np.array([volume, AORTA])

    def rhs(self, t: object, states: list, missing: list) -> list:
        """Rates of the states; each valve lets flow through one way."""
        (_, aorta), (pressure, atrium) = states, missing
        into = ufl.conditional(ufl.gt(atrium, pressure), (atrium - pressure) / self.mitral, 0.0)
        out = ufl.conditional(ufl.gt(pressure, aorta), (pressure - aorta) / self.aortic, 0.0)
        return [into - out, (out - aorta / self.body) / self.compliance]


def ldrb(geo: Geometry, mirrored: bool) -> tuple[dolfinx.fem.Function, dolfinx.fem.Function]:
    """Fibres and sheets of fenicsx-ldrb on the same mesh, at femprep's angles; it cannot tell a mirrored heart."""
    import ldrb as rules

    markers = {"lv": geo.markers["ENDO"][0], "epi": geo.markers["EPI"][0], "base": geo.markers["BASE"][0]}
    helix = -60 if mirrored else 60
    angles = {"alpha_endo_lv": helix, "alpha_epi_lv": -helix, "beta_endo_lv": 0, "beta_epi_lv": 0}
    found = rules.dolfinx_ldrb(mesh=geo.mesh, ffun=geo.ffun, markers=markers, fiber_space="DG_0", **angles)
    return found.f0, found.s0


def corners(mesh: dolfinx.mesh.Mesh) -> np.ndarray:
    """Numbers of the points of each tetrahedron."""
    cells = mesh.geometry.dofmaps[0] if hasattr(mesh.geometry, "dofmaps") else mesh.geometry.dofmap
    return np.asarray(cells)[:, :4]


def springs(mesh: dolfinx.mesh.Mesh, folder: Path) -> dolfinx.fem.Function:
    """The pericardium's stiffness at the points of the mesh, kPa/mm."""
    with h5py.File(folder / "mesh.h5", "r") as store:
        given = store["point_data/pericardium"][()]
    stiffness = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh, ("Lagrange", 1)))
    stiffness.x.array[stiffness.function_space.dofmap.list] = given[mesh.geometry.input_global_indices][corners(mesh)]
    return stiffness


def nodes(mesh: dolfinx.mesh.Mesh, u: dolfinx.fem.Function) -> np.ndarray:
    """Displacement of each point, in the order of the file."""
    linear = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh, ("Lagrange", 1, (3,))))
    linear.interpolate(u)
    out = np.empty((len(mesh.geometry.x), 3))
    out[mesh.geometry.input_global_indices[corners(mesh)]] = linear.x.array.reshape(-1, 3)[
        linear.function_space.dofmap.list
    ]
    return out


def main(
    folder: Path, result: Path, fibres: str = "femprep", tension: float = 100.0, mirrored: bool = False
) -> dict[str, float]:
    """Unload, beat, and save the loop and the two shapes."""
    began = time.process_time()
    geo = load(folder)
    mesh = geo.mesh
    f0, s0 = (geo.f0, geo.s0) if fibres == "femprep" else ldrb(geo, mirrored)
    angle = 0.0
    if fibres != "femprep":
        one = dolfinx.fem.form(ufl.acos(ufl.min_value(abs(ufl.inner(f0, geo.f0)), 1.0)) * ufl.dx)
        volume = dolfinx.fem.assemble_scalar(dolfinx.fem.form(dolfinx.fem.Constant(mesh, 1.0) * ufl.dx))
        angle = math.degrees(dolfinx.fem.assemble_scalar(one) / volume)
    heart = pulse.HeartGeometry.from_cardiac_geometries(geo, metadata={"quadrature_degree": 4})
    # The base stays in its plane: with the origin in that plane the cavity's volume needs no lid.
    mesh.geometry.x[:] -= heart.base_center()
    base, epi = geo.markers["BASE"][0], geo.markers["EPI"][0]
    robin = (
        pulse.RobinBC(pulse.Variable(springs(mesh, folder), "kPa / mm"), epi),
        pulse.RobinBC(pulse.Variable(dolfinx.fem.Constant(mesh, 1e5), "kPa / m"), base),
        pulse.RobinBC(pulse.Variable(dolfinx.fem.Constant(mesh, 1e2), "kPa / m"), base, perpendicular=True),
    )
    contraction = pulse.Variable(dolfinx.fem.Constant(mesh, 0.0), "kPa")
    model = pulse.CardiacModel(
        material=pulse.HolzapfelOgden(f0=f0, s0=s0, **pulse.HolzapfelOgden.transversely_isotropic_parameters()),
        active=pulse.ActiveStress(f0, activation=contraction),
        compressibility=pulse.compressibility.Compressible2(),
    )

    traction = pulse.Variable(dolfinx.fem.Constant(mesh, 0.0), "mmHg")
    loaded = pulse.BoundaryConditions(neumann=(pulse.NeumannBC(traction, geo.markers["ENDO"][0]),), robin=robin)
    filled = heart.volume("ENDO") / ML
    unloading = pulse.PrestressProblem(
        geometry=heart, model=model, bcs=loaded, ramp_steps=11, targets=[pulse.TargetPressure(traction, FILLED, "")]
    )
    heart.deform(unloading.unload())
    rest = heart.volume("ENDO") / ML
    print(f"{mesh.topology.index_map(3).size_global} tetrahedra; {filled:.1f} mL, unloaded {rest:.1f} mL", flush=True)

    atrium = dolfinx.fem.Constant(mesh, 0.0)
    try:
        cavity = pulse.problem.Cavity(marker="ENDO")
    except TypeError:  # before fenicsx-pulse 0.12, which puts the circulation's volume in its place
        cavity = pulse.problem.Cavity(marker="ENDO", volume=dolfinx.fem.Constant(mesh, rest * ML))
    problem = pulse.StaticProblem(
        model=model,
        geometry=heart,
        bcs=pulse.BoundaryConditions(robin=robin),
        cavities=[cavity],
        circulation=Windkessel(rest),
        chambers=[pulse.ChamberCoupling("ENDO", "V", "p")],
        circulation_missing={"p_atrium": atrium},
    )
    rows, shapes, now, step, failed = [(0.0, rest, 0.0, AORTA, 0.0)], {}, 0.0, STEP, 0
    while now < END - 1e-9:
        step = min(step, END - now)
        then = now + step
        atrium.value = FILLED * min(then / (0.8 * FILL), 1.0)
        rise, fall = (then - FILL) / (PEAK - FILL), (END - then) / (END - PEAK)
        share = 0.0 if then <= FILL else math.sin(math.pi / 2 * min(rise, fall, 1.0)) ** 2
        contraction.assign(tension * share)
        problem.circulation_dt.value = step
        if not problem.solve():
            problem.reset_states()
            step, failed = step / 2, failed + 1
            if step < STEP / 64:
                raise SystemExit(f"no convergence at {then:.4f} s")
            continue
        now = then
        volume, aorta = (float(state.x.array[0]) for state in problem.circulation_states)
        pressure = float(problem.cavity_pressures[0].x.array[0]) / MMHG
        rows.append((now, volume, pressure, aorta, tension * share))
        print("{:.4f} s {:6.1f} mL {:6.1f} mmHg, aorta {:6.1f}, tension {:5.1f} kPa".format(*rows[-1]), flush=True)
        if abs(now - FILL) < 1e-9:
            shapes["end_diastole"] = nodes(mesh, problem.u)
        if now > FILL and volume <= min(row[1] for row in rows):
            shapes["end_systole"] = nodes(mesh, problem.u)
        step = min(STEP, 2 * step)
        # A step ends where filling does.
        if now < FILL < now + step:
            step = FILL - now
    loop = np.array(rows)
    full, least = loop[np.isclose(loop[:, 0], FILL), 1][0], loop[loop[:, 0] > FILL, 1].min()
    figures = {
        "tetrahedra": mesh.topology.index_map(3).size_global,
        "image_ml": filled,
        "unloaded_ml": rest,
        "end_diastolic_ml": full,
        "end_systolic_ml": least,
        "ejection_fraction_percent": 100 * (full - least) / full,
        "end_diastolic_mmhg": loop[np.isclose(loop[:, 0], FILL), 2][0],
        "greatest_mmhg": loop[:, 2].max(),
        "angle_to_femprep_degrees": angle,
        "steps": len(loop) - 1,
        "failed_steps": failed,
        "seconds": time.process_time() - began,
    }
    order = np.empty_like(mesh.geometry.x)
    order[mesh.geometry.input_global_indices] = mesh.geometry.x
    np.savez(result, loop=loop, unloaded=order, **shapes)
    print("RESULT " + json.dumps(figures))
    return figures


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("result", type=Path)
    parser.add_argument("--fibres", choices=("femprep", "ldrb"), default="femprep")
    parser.add_argument("--tension", type=float, default=100.0, help="greatest active tension along the fibres, kPa")
    parser.add_argument("--mirrored", action="store_true", help="the heart is stored mirrored: so are ldrb's angles")
    given = parser.parse_args()
    main(given.folder, given.result, given.fibres, given.tension, given.mirrored)
