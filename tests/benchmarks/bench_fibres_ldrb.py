"""Fibres of an ellipsoid by femprep's rules and by fenicsx-ldrb beside the analytic ones, by elements through the wall.

    python tests/benchmarks/bench_fibres_ldrb.py --out DIR --dolfinx-python /opt/fenicsx/bin/python

Mean angles over the volume, degrees. fenicsx-ldrb runs in the Python that has dolfinx, cardiac-geometriesx and
fenicsx-pulse, with every file it needs in DIR, which it has to see under that name.
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
    fibre, _ = beat.ldrb(geo, mirrored=False)
    corners = beat.corners(geo.mesh)
    np.savez(folder / "ldrb.npz", middle=geo.mesh.geometry.x[corners].mean(axis=1), fibre=fibre.x.array.reshape(-1, 3))


def one(folder: Path, size: int, layers: int, command: list[str]) -> dict[str, Any]:
    """Angles on one mesh."""
    from scipy.spatial import cKDTree

    import femprep as fp
    from femprep.export import write_format

    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    from anatomy_meshes import ellipsoid
    from ellipsoid_wall import EllipsoidWall

    mesh = fp.add_fibres(fp.add_coordinates(ellipsoid("tetra", size=size, layers=layers).mesh))
    write_format(mesh, folder, "dolfinx")
    bayer = fp.add_fibres(mesh, rule="bayer", depth="laplace").cell_data["fiber"]
    subprocess.run([*command, str(folder.parent / Path(__file__).name), "--inside", str(folder)], check=True)
    found = np.load(folder / "ldrb.npz")
    corners = mesh.points[mesh.cells["tetra"]]
    middle, volume = corners.mean(axis=1), np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    away, at = cKDTree(found["middle"]).query(middle)
    assert away.max() < 1e-6, "elements of another mesh"
    theirs = found["fibre"][at]
    exact = EllipsoidWall((25.0, 55.0), (35.0, 65.0)).triads(middle)[:, :, 0]

    def angle(one: np.ndarray, other: np.ndarray) -> float:
        cosine = np.abs(np.einsum("ij,ij->i", one, other))
        return float(np.degrees(np.average(np.arccos(np.clip(cosine, 0.0, 1.0)), weights=volume)))

    ours = mesh.cell_data["fiber"]
    return {
        "layers": layers,
        "elements": mesh.n_cells,
        "femprep_exact": angle(ours, exact),
        "bayer_exact": angle(bayer, exact),
        "ldrb_exact": angle(theirs, exact),
        "femprep_ldrb": angle(ours, theirs),
        "bayer_ldrb": angle(bayer, theirs),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="folder of the meshes")
    parser.add_argument("--dolfinx-python", help="command of the Python that has dolfinx and fenicsx-ldrb")
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.inside:
        inside(given.inside)
        return
    if not given.out or not given.dolfinx_python:
        parser.error("--out and --dolfinx-python are needed")
    from rows import shown

    given.out.mkdir(parents=True, exist_ok=True)
    for script in (BEAT, Path(__file__)):
        shutil.copy(script, given.out)
    for size, layers in SIZES:
        folder = given.out.resolve() / f"{layers}"
        folder.mkdir(exist_ok=True)
        print(shown(one(folder, size, layers, shlex.split(given.dolfinx_python))), flush=True)


if __name__ == "__main__":
    main()
