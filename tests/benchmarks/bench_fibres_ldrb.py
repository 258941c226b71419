"""Fibres of an ellipsoid by femprep's rules and by fenicsx-ldrb beside the analytic ones, by elements through the wall.

    python tests/benchmarks/bench_fibres_ldrb.py --out DIR --dolfinx-python /opt/fenicsx/bin/python
    python tests/benchmarks/bench_fibres_ldrb.py --valves --out DIR --dolfinx-python /opt/fenicsx/bin/python

Mean angles over the volume, degrees. With ``--valves`` the rule of Doste et al. on an ellipsoid with two openings and
on two ventricles with four, by femprep and by fenicsx-ldrb on the same mesh with the same apex: the whole wall, and its
parts. fenicsx-ldrb runs in the Python that has dolfinx, cardiac-geometriesx and fenicsx-pulse, with every file it needs
in DIR, which it has to see under that name.
"""

from __future__ import annotations

import argparse
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

BEAT = Path(__file__).resolve().parents[2] / "examples" / "fenicsx_pulse_beat.py"
#: Quadrilaterals along an edge of the patch at the apex, and layers through the wall.
SIZES = ((3, 1), (4, 2), (6, 3), (8, 5), (12, 8))


def inside(folder: Path) -> None:
    """In dolfinx' Python: fibres of fenicsx-ldrb and the middles of the elements they belong to."""
    sys.path.insert(0, str(folder.parent))
    import fenicsx_pulse_beat as beat

    geo = beat.load(folder / "dolfinx")
    told = folder / "apex.npz"
    fibre = doste(geo, dict(np.load(told))) if told.exists() else beat.ldrb(geo, mirrored=False)[0]
    corners = beat.corners(geo.mesh)
    np.savez(folder / "ldrb.npz", middle=geo.mesh.geometry.x[corners].mean(axis=1), fibre=fibre.x.array.reshape(-1, 3))


def doste(geo: Any, apex: dict[str, np.ndarray]) -> Any:
    """In dolfinx' Python: fibres by the rule of Doste et al., without the transverse angles femprep leaves out.

    Where it is not told an apex it takes the point farthest from the inflow valve, which with the valve on one side is
    not the one on the long axis.
    """
    import ldrb

    theirs = {"lv": ("ENDO", "ENDO_LV"), "rv": ("ENDO_RV",), "epi": ("EPI",), "mv": ("MITRAL",), "av": ("AORTIC",)}
    theirs |= {"tv": ("TRICUSPID",), "pv": ("PULMONARY",)}
    markers = {key: geo.markers[name][0] for key, names in theirs.items() for name in names if name in geo.markers}
    straight = dict.fromkeys(("beta_endo_lv", "beta_epi_lv", "beta_epi_rv"), 0.0)
    found = ldrb.dolfinx_doste(mesh=geo.mesh, ffun=geo.ffun, markers=markers, fiber_space="DG_0", **straight, **apex)
    return found.f0


def theirs(mesh: Any, folder: Path, command: list[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fibres of fenicsx-ldrb ``(m, 3)`` on a mesh of tetrahedra, with the elements' middles and volumes."""
    from scipy.spatial import cKDTree

    from femprep.export import write_format

    write_format(mesh, folder, "dolfinx")
    subprocess.run([*command, str(folder.parent / Path(__file__).name), "--inside", str(folder)], check=True)
    found = np.load(folder / "ldrb.npz")
    corners = mesh.points[mesh.cells["tetra"]]
    middle, volume = corners.mean(axis=1), np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    away, at = cKDTree(found["middle"]).query(middle)
    assert away.max() < 1e-6, "elements of another mesh"
    return found["fibre"][at], middle, volume


def angles(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Between fibres, which have no sense, degrees."""
    cosine = np.abs(np.einsum("ij,ij->i", one, other))
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0))))


def one(folder: Path, size: int, layers: int, command: list[str]) -> dict[str, Any]:
    """Angles on one mesh."""
    from anatomy_meshes import ellipsoid
    from ellipsoid_wall import EllipsoidWall

    import femprep as fp

    mesh = fp.add_fibres(fp.add_coordinates(ellipsoid("tetra", size=size, layers=layers).mesh))
    bayer = fp.add_fibres(mesh, rule="bayer", depth="laplace").cell_data["fiber"]
    ldrb, middle, volume = theirs(mesh, folder, command)
    exact = EllipsoidWall((25.0, 55.0), (35.0, 65.0)).triads(middle)[:, :, 0]
    ours = mesh.cell_data["fiber"]
    pairs = {"femprep_exact": (ours, exact), "bayer_exact": (bayer, exact), "ldrb_exact": (ldrb, exact)}
    pairs |= {"femprep_ldrb": (ours, ldrb), "bayer_ldrb": (bayer, ldrb)}
    found = {name: float(np.average(angles(*pair), weights=volume)) for name, pair in pairs.items()}
    return {"layers": layers, "elements": mesh.n_cells, **found}


def with_valves(folder: Path, fineness: float, command: list[str], *, both: bool) -> dict[str, Any]:
    """Angles between the two rules for outflow tracts on one mesh, and where they differ."""
    from anatomy_meshes import ellipsoid, open_valves
    from biventricular import biventricular

    import femprep as fp
    from femprep.anatomy import WallFields
    from femprep.anatomy.rules import at_centres, node_fields

    if both:
        centres = {("mitral", "aortic"): np.zeros(3), ("tricuspid", "pulmonary"): np.array([-75.0, 0.0, 0.0])}
        mesh = open_valves(biventricular(fineness), centres, axis=1)
    else:
        wall = ellipsoid("tetra", size=4 * int(fineness), layers=2 * int(fineness))
        mesh = open_valves(wall.mesh, {("mitral", "aortic"): np.zeros(3)})
    fields = WallFields(mesh)
    mesh = fp.add_fibres(fp.add_coordinates(mesh), rule="doste", depth="laplace", fields=fields)
    apex = {"apex_lv": mesh.points[fields.space.nodes[fields.apex_nodes]].max(axis=0)}  # the endocardial one
    np.savez(folder / "apex.npz", **apex)
    ldrb, _, volume = theirs(mesh, folder, command)
    off = angles(np.asarray(mesh.cell_data["fiber"]), ldrb)
    sites = at_centres(node_fields(fields, "doste"), np.concatenate([rows for _, rows in fields.space.parts()]))
    septum = sites.outside < 0.5 * (1 - np.abs(sites.across)) if both else np.zeros(len(off), dtype=bool)
    parts = {"all": np.ones(len(off), dtype=bool), "septum": septum, "outflow": ~septum & (sites.outflow > 0.5)}
    parts["rest"] = ~septum & (sites.outflow <= 0.5)
    found = {f"{name}_mean": float(np.average(off[at], weights=volume[at])) for name, at in parts.items() if at.any()}
    found |= {f"{name}_median": float(np.median(off[at])) for name, at in parts.items() if at.any()}
    return {"elements": mesh.n_cells, **found}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="folder of the meshes")
    parser.add_argument("--dolfinx-python", help="command of the Python that has dolfinx and fenicsx-ldrb")
    parser.add_argument("--valves", action="store_true", help="the rule for outflow tracts")
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.inside:
        inside(given.inside)
        return
    if not given.out or not given.dolfinx_python:
        parser.error("--out and --dolfinx-python are needed")
    from rows import shown

    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    given.out.mkdir(parents=True, exist_ok=True)
    for script in (BEAT, Path(__file__)):
        shutil.copy(script, given.out)
    command = shlex.split(given.dolfinx_python)

    def folder(name: str) -> Path:
        found: Path = given.out.resolve() / name
        found.mkdir(exist_ok=True)
        return found

    if given.valves:
        for fineness in (1.0, 2.0, 3.0):
            print(shown(with_valves(folder(f"lv{fineness:g}"), fineness, command, both=False)), flush=True)
        for edge in (5.0, 3.0, 2.0):
            print(shown(with_valves(folder(f"biv{edge:g}"), edge, command, both=True)), flush=True)
        return
    for size, layers in SIZES:
        print(shown(one(folder(f"{layers}"), size, layers, command)), flush=True)


if __name__ == "__main__":
    main()
