"""An ACDC heart beats in fenicsx-pulse: meshed here, solved by the Python that has it, drawn here.

    python examples/07_beating_heart.py --dolfinx-python /opt/fenicsx/bin/python --out out [--picture heart.png]
    python examples/07_beating_heart.py --image ed.nii.gz --preset acdc --out out

A case of ACDC in the folder FEMPREP_DATA (``--acdc patient072``) or a phantom where there is none. The heart at
end-diastole is meshed coarsely with layers of tetrahedra, fibres and the pericardium's springs;
``fenicsx_pulse_beat.py`` fills it and lets it beat along femprep's fibres, and with ``--compare`` along those of
fenicsx-ldrb too.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

import femprep as fp
from femprep.export import write_format
from femprep.phantoms import lv_ellipsoid


def acdc(case: str) -> tuple[fp.Segmentation, list[float]]:
    """The heart at end-diastole, and the cavity's volume in the labels at end-diastole and end-systole, mL."""
    paths = sorted(Path(os.environ["FEMPREP_DATA"]).glob(f"acdc/training/{case}/{case}_frame*_gt.nii.gz"))
    if len(paths) != 2:
        raise SystemExit(f"no two frames of {case} under FEMPREP_DATA")
    hearts = [fp.read_segmentation(path, preset="acdc") for path in paths]
    volumes = [heart.grid.voxel_volume * float(heart.mask("lv").sum()) / 1000 for heart in hearts]
    order = np.argsort(volumes)[::-1]
    return hearts[order[0]], [volumes[i] for i in order]


def beat(command: list[str], folder: Path, result: Path, fibres: str, *options: str) -> dict[str, Any]:
    """Figures of a beat, by the other Python, which must not see this one's packages."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}
    clean |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "ADIOS2_ALWAYS_USE_MPI": "1"}
    script = Path(__file__).resolve().parent / "fenicsx_pulse_beat.py"
    done = subprocess.run(
        [*command, str(script), str(folder), str(result), "--fibres", fibres, *options],
        env=clean,
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise SystemExit(
            f"fenicsx-pulse stopped with exit status {done.returncode}:\n{(done.stdout + done.stderr)[-2000:]}"
        )
    found: dict[str, Any] = json.loads(next(x for x in done.stdout.splitlines() if x.startswith("RESULT"))[7:])
    return found


def draw(folder: Path, results: dict[str, Path], labels: list[float] | None, picture: Path) -> None:
    """The wall cut open at end-diastole and end-systole, and the loops of pressure and volume."""
    import matplotlib.pyplot as plt
    import pyvista as pv

    mesh = fp.read_mesh(folder / "mesh.xdmf")
    with np.load(results["femprep"]) as found:
        shapes = {name: (found["unloaded"] + found[name]) * 1000 for name in ("end_diastole", "end_systole")}
    cells = np.column_stack([np.full(mesh.n_cells, 4), mesh.cells["tetra"]]).ravel()
    base = mesh.facets["triangle"][mesh.facet_tag == mesh.facet_names["base"]]
    corners = [shapes["end_diastole"][base[:, i]] for i in range(3)]
    up = np.cross(corners[1] - corners[0], corners[2] - corners[0]).sum(axis=0)
    up /= np.linalg.norm(up)
    across = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    view = np.cross(across / np.linalg.norm(across), up)
    plotter = pv.Plotter(off_screen=True, shape=(1, 2), window_size=(1000, 620), border=False)
    centre = shapes["end_diastole"].mean(axis=0)
    for column, (name, points) in enumerate(shapes.items()):
        plotter.subplot(0, column)
        grid = pv.UnstructuredGrid(cells, np.full(mesh.n_cells, pv.CellType.TETRA), points)
        half = grid.clip(normal=view, origin=centre)
        plotter.add_mesh(half, color="#c96f6f", show_edges=True, edge_color="#55292b", line_width=0.6, ambient=0.3)
        rest = pv.UnstructuredGrid(cells, np.full(mesh.n_cells, pv.CellType.TETRA), shapes["end_diastole"])
        outline = rest.extract_surface(algorithm=None).slice(normal=view, origin=centre)
        plotter.add_mesh(outline, color="black", line_width=2)
        plotter.add_text(name.replace("_", "-"), font_size=11, color="black")
        plotter.camera_position = [centre + 230 * view, centre, up]
    image = plotter.screenshot(return_img=True)
    plotter.close()
    figure, axes = plt.subplots(1, 2, figsize=(12, 4.4), gridspec_kw={"width_ratios": [1.75, 1]})
    axes[0].imshow(image)
    axes[0].axis("off")
    for (name, path), colour in zip(results.items(), ("#a83232", "#3266a8")):
        with np.load(path) as found:
            axes[1].plot(found["loop"][:, 1], found["loop"][:, 2], color=colour, label=f"fibres of {name}")
    for value, text in zip(labels or (), ("labels, end-diastole", "labels, end-systole")):
        axes[1].axvline(value, color="grey", linestyle=":" if "systole" in text else "--", label=text)
    axes[1].set(xlabel="cavity, mL", ylabel="pressure, mmHg")
    axes[1].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(picture, dpi=90)


def main(
    out: Path,
    heart: fp.Segmentation | None = None,
    labels: list[float] | None = None,
    command: str = "/usr/bin/python3",
    edge: float = 12.0,
    layers: int = 1,
    tension: float = 100.0,
    compare: bool = False,
    picture: Path | None = None,
) -> dict[str, dict[str, Any]]:
    """Mesh, beat, draw.

    Returns
    -------
    dict
        Of each set of fibres the figures of its beat.
    """
    heart = heart or lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0))
    run = fp.mesh_segmentation(
        heart,
        volume={"mesher": "sweep", "edge_length": edge},
        sweep={"layers": layers},
        fibres=fp.FibreOptions(),
        pericardium=fp.PericardiumOptions(),
    )
    out.mkdir(parents=True, exist_ok=True)
    write_format(run.mesh, out, "dolfinx", length_unit="m")
    results = {name: out / f"beat_{name}.npz" for name in (("femprep", "ldrb") if compare else ("femprep",))}
    options = ["--tension", str(tension), *(["--mirrored"] if run.mesh.info["fibres"]["mirrored"] else [])]
    figures = {
        name: beat(shlex.split(command), out / "dolfinx", path, name, *options) for name, path in results.items()
    }
    for name, found in figures.items():
        for key, value in found.items():
            print(f"{name:8s} {key:28s} {value:.4g}" if isinstance(value, float) else f"{name:8s} {key:28s} {value}")
    if labels:
        print(f"labels   {labels[0]:.1f} mL, {labels[1]:.1f} mL: {100 * (1 - labels[1] / labels[0]):.1f} %")
    if picture is not None:
        draw(out / "dolfinx", results, labels, picture)
    return figures


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--acdc", metavar="CASE", help="a case of ACDC in the folder FEMPREP_DATA")
    source.add_argument("--image", type=Path, help="label map of your own at end-diastole")
    parser.add_argument("--preset", default="acdc", help="what its labels mean")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--edge", type=float, default=12.0, help="edge length, mm")
    parser.add_argument("--layers", type=int, default=1, help="layers of elements, of order 2 in the solver")
    parser.add_argument("--tension", type=float, default=100.0, help="greatest active tension, kPa")
    parser.add_argument("--compare", action="store_true", help="a second beat along the fibres of fenicsx-ldrb")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--dolfinx-python", default="/usr/bin/python3", help="command of the Python with fenicsx-pulse")
    given = parser.parse_args()
    labelled, volumes = (None, None)
    if given.acdc:
        labelled, volumes = acdc(given.acdc)
    elif given.image:
        labelled = fp.read_segmentation(given.image, preset=given.preset)
    main(
        given.out,
        labelled,
        volumes,
        given.dolfinx_python,
        given.edge,
        given.layers,
        given.tension,
        given.compare,
        given.picture,
    )
