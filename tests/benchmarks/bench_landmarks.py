"""Where anatomical landmarks lie on the template: how far one vertex number wanders over phases and patients of ACDC.

    python tests/benchmarks/bench_landmarks.py [--patients 100] [--method smooth]

Needs FEMPREP_DATA. Apex, base, four points of the base ring, middle of the septum and the insertions of the right
ventricle are found from the labels of each map and looked up on its epicardium (LV + myocardium): the direction on the
template at the nearest point of the surface. With templates turned by the heart and, for comparison, by the image.
Spread between patients: to the landmark's mean direction over all maps; between phases: from end-diastole to
end-systole of a patient. "Front" is (apex to base) x (LV to RV), as in a heart that is not mirrored: templates are
turned with a heart and never mirrored, and whether a map is mirrored the labels do not always tell. Millimetres are
the angle times the surface's radius (root mean square about its middle).
"""

from __future__ import annotations

import argparse
import csv
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from femprep.anatomy import VentricularAxes, orient, ventricular_axes
from femprep.errors import FemprepError
from femprep.image import read_segmentation
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, Surface
from femprep.surface import fit_surface

LANDMARKS = (
    "apex",
    "base",
    "ring septal",
    "ring front",
    "ring lateral",
    "ring back",
    "septum",
    "front insertion",
    "back insertion",
)


def one_map(job: tuple[str, str, int]) -> tuple[str, dict[str, FloatArray], float] | None:
    """Patient, directions of the landmarks on the template by what turns it, and the surface's radius, mm."""
    path, method, vertices = job
    name = Path(path).name
    try:
        seg = read_segmentation(path, preset="acdc")
        axes = ventricular_axes(seg)
        if not axes.insertions:
            return None
        found, at = {}, None
        for kind, source in (("heart", orient(seg)), ("image", seg)):
            surface = fit_surface(source.object("lv", "myo"), method=method, vertices=vertices)
            if at is None:
                at = landmarks(surface, axes)
            closest = ClosestFinder(surface.points, surface.triangles)(at)
            corners = surface.directions[surface.triangles[closest.triangle]]
            mean = np.einsum("qi,qik->qk", closest.weights, corners)
            found[kind] = mean / np.linalg.norm(mean, axis=1, keepdims=True)
        # Directions in the template's own axes, whatever way it is turned.
        image = np.linalg.svd(seg.grid.direction)
        turn = image[0] @ image[2]
        turn[:, 2] *= np.sign(np.linalg.det(turn))
        found = {"heart": found["heart"] @ orient(seg).frame, "image": found["image"] @ turn}
    except FemprepError as error:
        print(f"{name}: {error}")
        return None
    size = float(np.sqrt(np.mean(np.sum((surface.points - surface.points.mean(axis=0)) ** 2, axis=1))))
    return name[:10], found, size


def landmarks(surface: Surface, axes: VentricularAxes) -> FloatArray:
    """Landmarks ``(9, 3)``, mm: those of the labels, carried outward onto the surface where they lie inside."""
    far = 200.0
    middle = axes.apex + 0.5 * axes.length * axes.long_axis
    front = np.cross(axes.long_axis, axes.septal)
    across = (axes.septal, front, -axes.septal, -front)
    rays = [(middle, -axes.long_axis), (middle, axes.long_axis)]
    rays += [(axes.base - 0.05 * axes.length * axes.long_axis, way) for way in across]
    rays += [(middle, axes.septal)]
    points = [_exit(surface, start, way, far) for start, way in rays]
    insertions = sorted(axes.insertions.values(), key=lambda at: -float((at - middle) @ front))
    return np.array([*points, *insertions])


def _exit(surface: Surface, start: FloatArray, way: FloatArray, far: float) -> FloatArray:
    """Where a ray leaves the surface last."""
    a, b, c = (surface.points[surface.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    down = normal @ way
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.einsum("ij,ij->i", normal, a - start) / down
        hit = start + t[:, None] * way
        inside = np.ones(len(t), dtype=bool)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= np.einsum("ij,ij->i", np.cross(q - p, hit - p), normal) >= 0.0
    ahead = t[inside & (t > 0.0)]
    return start + (float(ahead.max()) if len(ahead) else far) * way


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--patients", type=int, default=100)
    parser.add_argument("--method", default="smooth")
    parser.add_argument("--vertices", type=int, default=1500)
    parser.add_argument("--processes", type=int, default=2)
    args = parser.parse_args()
    folder = Path(os.environ["FEMPREP_DATA"]) / "acdc"
    with (folder / "cases.csv").open(newline="") as stream:
        files = [row["file"] for row in csv.DictReader(stream) if (folder / row["file"]).is_file()]
    patients = sorted({Path(file).name[:10] for file in files})
    patients = patients[:: max(1, len(patients) // args.patients)][: args.patients]
    jobs = [(str(folder / f), args.method, args.vertices) for f in files if Path(f).name[:10] in patients]
    with ProcessPoolExecutor(args.processes) as pool:
        rows = [row for row in pool.map(one_map, jobs) if row is not None]
    pairs: dict[str, list[int]] = {}
    for number, row in enumerate(rows):
        pairs.setdefault(row[0], []).append(number)
    both = np.array([numbers for numbers in pairs.values() if len(numbers) == 2])
    size = np.array([row[2] for row in rows])
    print(f"{len(rows)} maps of {len(pairs)} patients; root mean square over maps, degrees and mm (of arc)")
    print(f"{'':17s}{'between patients':>36s}{'end-diastole to end-systole':>40s}")
    print(f"{'':17s}" + 2 * f"{'heart':>12s}{'image':>24s}")
    for k, name in enumerate(LANDMARKS):
        line = f"{name:17s}"
        for spread in ("patients", "phases"):
            for kind in ("heart", "image"):
                at = np.array([row[1][kind][k] for row in rows])
                if spread == "patients":
                    mean = at.mean(axis=0)
                    turn, scale = _angle(at, mean / np.linalg.norm(mean)), size
                else:
                    turn, scale = _angle(at[both[:, 0]], at[both[:, 1]]), size[both].mean(axis=1)
                mm = np.radians(turn) * scale
                line += f"{np.sqrt(np.mean(turn**2)):11.1f}{np.sqrt(np.mean(mm**2)):7.1f}"
        print(line)


def _angle(one: FloatArray, other: FloatArray) -> FloatArray:
    """Angles between unit vectors, degrees."""
    return np.degrees(np.arccos(np.clip((one * other).sum(axis=-1), -1.0, 1.0)))


if __name__ == "__main__":
    main()
