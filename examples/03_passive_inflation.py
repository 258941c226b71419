"""Passive inflation of a left ventricle, solved by CalculiX and by dolfinx from femprep's decks, and a picture of it.

    python examples/03_passive_inflation.py [--material neo-hookean] [--picture FILE.png]
    python examples/03_passive_inflation.py --image patient.nii.gz --structure lv=3 --structure myo=2
    python examples/03_passive_inflation.py --acdc patient007_frame01          (with FEMPREP_DATA)

A phantom heart where no image is given. The base is held, the endocardium bears a pressure. Two programs, two formats
and two ways to integrate must give one displacement; and what the base holds must balance the pressure on all other
points, which no wrong facet, node number or unit survives.

CalculiX is ``ccx`` (Debian: ``calculix-ccx``), dolfinx belongs to a Python of its own (Debian: ``python3-dolfinx``,
``--dolfinx-python``). What is not installed is left out, and said.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import femprep as fp
from femprep.phantoms import lv_ellipsoid

#: Of the passive wall: kPa, and -.
PRESSURE, YOUNG, POISSON = 1.0, 30.0, 0.4


def find_map(name: str) -> Path:
    """The label map of an ACDC case in the data folder."""
    found = sorted(Path(os.environ["FEMPREP_DATA"]).glob(f"acdc/training/*/{name}_gt.nii.gz"))
    if not found:
        raise SystemExit(f"no {name}_gt.nii.gz under FEMPREP_DATA")
    return found[0]


def calculix(mesh: fp.VolumeMesh, folder: Path, material: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Displacement of each point (mm) and total reaction on the base (N) by CalculiX; None where there is none."""
    if shutil.which("ccx") is None:
        print("CalculiX (ccx) is not installed: left out")
        return None
    options = {"material": material, "pressure": PRESSURE, "young_modulus": YOUNG, "poisson_ratio": POISSON}
    fp.write_mesh(mesh, folder / "lv.inp", step="inflation", **options)
    done = subprocess.run(["ccx", "lv"], cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"CalculiX stopped with exit status {done.returncode}:\n{done.stdout[-2000:]}")
    text, number = (folder / "lv.dat").read_text(), r"\s+(-?\d\.\d+E[+-]\d+)"
    force = re.findall(rf"total force[^\n]*\n\s*{number * 3}", text)[-1]
    rows = re.findall(rf"^\s*\d+{number * 3}\s*$", text[text.rindex("displacements") :], re.MULTILINE)
    return np.array(rows, dtype=float), np.array(force, dtype=float)


def dolfinx(mesh: fp.VolumeMesh, folder: Path, material: str, python: str) -> tuple[np.ndarray, np.ndarray] | None:
    """The same by dolfinx, from the XDMF deck."""
    # The other Python must not see this one's packages.
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
    clean["PATH"] = f"{Path(python).parent}:/usr/bin:/bin"
    try:
        there = subprocess.run([python, "-c", "import dolfinx"], env=clean, capture_output=True).returncode == 0
    except OSError:
        there = False
    if not there:
        print(f"{python} has no dolfinx: left out")
        return None
    (deck,) = (path for path in fp.write_mesh(mesh, folder / "mesh.xdmf", format="dolfinx") if path.suffix == ".xdmf")
    script = Path(__file__).resolve().parent / "dolfinx_inflation.py"
    # MPa in the deck's millimetres.
    numbers = [str(value) for value in (PRESSURE * 1e-3, YOUNG * 1e-3, POISSON)]
    done = subprocess.run(
        [python, str(script), str(deck.parent), material, *numbers], env=clean, capture_output=True, text=True
    )
    if done.returncode != 0:
        raise SystemExit(f"dolfinx stopped with exit status {done.returncode}:\n{(done.stdout + done.stderr)[-2000:]}")
    with np.load(deck.parent / "solution.npz") as solution:
        return solution["displacement"], solution["reaction"]


def balance(mesh: fp.VolumeMesh, points: np.ndarray, reaction: np.ndarray) -> float:
    """Misfit of the reaction and the pressure on all free points, as a share of the latter.

    A pressure p on a triangle of area A and outward normal n puts -p A n / 3 on each corner.
    """
    names, facets = mesh.facet_names, mesh.facets["triangle"]
    endo = facets[mesh.facet_tag == names["endo"]]
    a, b, c = (points[endo[:, i]] for i in range(3))
    corner = -PRESSURE * 1e-3 * np.cross(b - a, c - a) / 6
    free = ~np.isin(endo, facets[mesh.facet_tag == names["base"]])
    load = (corner * free.sum(axis=1)[:, None]).sum(axis=0)
    return float(np.linalg.norm(reaction + load) / np.linalg.norm(load))


def cavity(mesh: fp.VolumeMesh, points: np.ndarray) -> float:
    """Volume between the endocardium and the base plane, mL; the base is held, so that it stays a plane."""
    base = mesh.planes["base"]
    endo = mesh.facets["triangle"][mesh.facet_tag == mesh.facet_names["endo"]]
    a, b, c = (points[endo[:, i]] - base.point for i in range(3))
    return float(-np.einsum("ij,ij->", a, np.cross(b, c)) / 6000.0)


def draw(mesh: fp.VolumeMesh, displacement: np.ndarray, picture: Path) -> None:
    """The displaced wall coloured by displacement, whole and cut along its axis, with the outline at rest."""
    import pyvista as pv

    count = len(mesh.cells["tetra"])
    cells = np.column_stack([np.full(count, 4), mesh.cells["tetra"]]).ravel()
    rest = pv.UnstructuredGrid(cells, np.full(count, pv.CellType.TETRA), np.array(mesh.points))
    moved = rest.copy()
    moved.points = mesh.points + displacement
    moved["displacement, mm"] = np.linalg.norm(displacement, axis=1)
    up = np.array(mesh.planes["base"].normal)
    across = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    across /= np.linalg.norm(across)
    view, centre = np.cross(up, across), np.array(rest.center)
    plotter = pv.Plotter(off_screen=True, shape=(1, 2), window_size=(1200, 600), border=False)
    bar = {"title": "displacement, mm\n", "n_labels": 4, "fmt": "%.1f", "color": "black", "height": 0.09, "width": 0.5,
           "position_x": 0.25, "position_y": 0.02}  # fmt: skip
    plotter.add_mesh(moved, cmap="viridis", ambient=0.35, show_edges=True, edge_color="#444444", line_width=0.4,
                     scalar_bar_args=bar)  # fmt: skip
    plotter.camera_position = [centre + 1.6 * rest.length * (view + 0.3 * up), centre - 0.06 * rest.length * up, up]
    plotter.subplot(0, 1)
    plotter.add_mesh(moved.slice(normal=view, origin=centre), cmap="viridis", ambient=0.35, show_scalar_bar=False)
    at_rest = rest.extract_surface(algorithm=None).slice(normal=view, origin=centre)
    plotter.add_mesh(at_rest, color="black", line_width=2.0)
    plotter.camera_position = [centre + 1.6 * rest.length * view, centre - 0.06 * rest.length * up, up]
    picture.parent.mkdir(parents=True, exist_ok=True)
    plotter.screenshot(str(picture))
    plotter.close()


def main(
    seg: fp.Segmentation | None = None,
    edge: float = 4.0,
    material: str = "linear",
    picture: Path | None = None,
    out: Path | None = None,
    dolfinx_python: str = "/usr/bin/python3",
) -> dict[str, Any]:
    """Mesh, solve twice, compare.

    Returns
    -------
    dict
        Tetrahedra, cavity at rest (mL); by program the greatest displacement (mm), the cavity when inflated (mL), the
        reaction (N) and its misfit; and the greatest difference of the two displacement fields (mm).
    """
    seg = seg or lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0))
    mesh = fp.mesh_segmentation(seg, volume={"edge_length": edge}).mesh
    figures: dict[str, Any] = {"tetrahedra": mesh.n_cells, "cavity_ml": cavity(mesh, mesh.points)}
    fields = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = out or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name, solved in (
            ("calculix", calculix(mesh, folder, material)),
            ("dolfinx", dolfinx(mesh, folder, material, dolfinx_python)),
        ):
            if solved is None:
                continue
            fields[name], reaction = solved
            shape = mesh.points if material == "linear" else mesh.points + fields[name]
            figures[f"{name}_greatest_mm"] = float(np.linalg.norm(fields[name], axis=1).max())
            figures[f"{name}_cavity_ml"] = cavity(mesh, mesh.points + fields[name])
            figures[f"{name}_reaction_n"] = float(np.linalg.norm(reaction))
            figures[f"{name}_reaction_misfit"] = balance(mesh, shape, reaction)
    if len(fields) == 2:
        figures["greatest_difference_mm"] = float(np.abs(fields["calculix"] - fields["dolfinx"]).max())
    if picture is not None and fields:
        draw(mesh, next(iter(fields.values())), picture)
    for key, value in figures.items():
        print(f"{key:26s} {value:.9g}" if isinstance(value, float) else f"{key:26s} {value}")
    return figures


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--image", type=Path, help="label map of your own; name its labels by --structure")
    source.add_argument("--acdc", metavar="CASE", help="a case of ACDC in the folder FEMPREP_DATA")
    parser.add_argument("--structure", action="append", default=[], metavar="NAME=LABEL")
    parser.add_argument("--edge", type=float, default=4.0, help="edge length, mm")
    parser.add_argument("--material", choices=("linear", "neo-hookean"), default="linear")
    parser.add_argument("--out", type=Path, help="folder that keeps the decks and what the solvers wrote")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--dolfinx-python", default="/usr/bin/python3")
    given = parser.parse_args()
    heart = None
    if given.acdc:
        heart = fp.read_segmentation(find_map(given.acdc), preset="acdc")
    elif given.image:
        pairs = (item.partition("=") for item in given.structure)
        heart = fp.read_segmentation(given.image, structures={name: int(label) for name, _, label in pairs})
    main(heart, given.edge, given.material, given.picture, given.out, given.dolfinx_python)
