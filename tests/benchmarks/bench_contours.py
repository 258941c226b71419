"""Surfaces fitted to the contours of a real patient over a heartbeat: how far the contours lie from them.

    python tests/benchmarks/bench_contours.py FOLDER [--phases 0 8 ...] [--ways given aligned] [--plot FILE.png]

FOLDER holds GPFile_000.txt and so on with their SliceInfoFile.txt, as the example of biv-me does, and possibly its own
fitted surfaces of some phases, fitted_LV_ENDOCARDIAL_000.vtk and so on. Printed are, for each phase, the mean distance
in mm of the contours' points to the surface, of the short-axis planes / of the long-axis planes. Rows:

    biv-me     its fitted surfaces, contours as they are
    given      our surfaces, slices and views taken to lie where they are
    aligned    our surfaces after align_slices, contours moved with their slices and views
    unmoved    the same surfaces, contours as they are

Contours of the left ventricle that were left out, because a slice passes through a valve, do not count for our
surfaces.
Points of the septum count for the right ventricle only, because biv-me's epicardium is that of both ventricles.
Volumes are those inside of the closed surfaces, in mL.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

import femprep as fp
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import volume
from femprep.model import FloatArray

OBJECTS = {"lv": ("lv",), "epi": ("lv", "myo"), "rv": ("rv",)}
THEIRS = {"lv": "LV_ENDOCARDIAL", "epi": "EPICARDIAL", "rv": "RV_ENDOCARDIAL"}
Points = dict[str, dict[str, FloatArray]]
Row = dict[str, tuple[float, float]]


def outlines(contours: fp.Contours) -> Points:
    """Points of the contours by plane and surface, the septum's of the right ventricle only."""
    found: Points = {plane.name: {} for plane in contours.planes}
    for plane, own in found.items():
        for name in OBJECTS:
            own[name] = np.concatenate([np.empty((0, 3)), *(one.points for one in contours.on(plane, name))])
        septum = {tuple(point) for point in own["rv"]}
        own["epi"] = np.array([p for p in own["epi"] if tuple(p) not in septum]).reshape(-1, 3)
    return found


def used(points: Points, short: set[str], seg: fp.Segmentation) -> Points:
    """The points without those of contours in the stack that were left out."""
    found = {plane: dict(own) for plane, own in points.items()}
    for plane in short & set(points):
        number = round(float(seg.grid.to_index(np.concatenate(list(points[plane].values())))[:, 2].mean()))
        for name in OBJECTS:
            if not np.isin(seg.labels[:, :, number], seg.numbers(name if name != "epi" else "myo")).any():
                found[plane][name] = np.empty((0, 3))
    return found


def moved(points: Points, seg: fp.Segmentation, shifts: fp.SliceShifts) -> Points:
    """The points moved as align_slices moves their slices and views; those of views left out are left out."""
    views = {view.name: view for view in shifts.views}
    back = {int(k): -s for k, s in zip(shifts.index, shifts.shift)}
    found: Points = {}
    for plane, own in points.items():
        if plane in shifts.left_out:
            continue
        if plane in views:
            found[plane] = {n: p @ views[plane].rotation.T + views[plane].translation for n, p in own.items()}
            continue
        number = round(float(seg.grid.to_index(np.concatenate(list(own.values())))[:, 2].mean()))
        way = seg.grid.direction[:, :2] @ back.get(number, np.zeros(2))
        found[plane] = {name: p + way for name, p in own.items()}
    return found


def row(points: Points, short: set[str], surfaces: Mapping[str, tuple[FloatArray, FloatArray]]) -> Row:
    """Mean distances of the points on short-axis and on long-axis planes."""
    found = {}
    for name, surface in surfaces.items():
        finder = ClosestFinder(*surface)
        kinds = [np.concatenate([own[name] for p, own in points.items() if (p in short) == kind]) for kind in (1, 0)]
        one, other = (float(finder(kind).distance.mean()) for kind in kinds)
        found[name] = (one, other)
    return found


def show(phase: str, way: str, found: Row, volumes: str = "") -> None:
    figures = "  ".join(f"{name} {one:.2f} / {other:.2f}" for name, (one, other) in found.items())
    print(f"{phase} {way:8} {figures}  {volumes}", flush=True)


def theirs(folder: Path, phase: str) -> dict[str, tuple[FloatArray, FloatArray]]:
    """biv-me's surfaces of a phase, where the folder has them."""
    found = {}
    for name, long in THEIRS.items():
        path = folder / f"fitted_{long}_{phase}.vtk"
        if path.is_file():
            words = path.read_text().split()
            at, cells = words.index("POINTS"), words.index("CONNECTIVITY")
            count = 3 * int(words[at + 1])
            points = np.array(words[at + 3 : at + 3 + count], dtype=float).reshape(-1, 3)
            total = int(words[words.index("POLYGONS") + 2])
            found[name] = (points, np.array(words[cells + 2 : cells + 2 + total], dtype=np.int64).reshape(-1, 3))
    return found


def fit(seg: fp.Segmentation) -> tuple[dict[str, tuple[FloatArray, FloatArray]], dict[str, float]]:
    """Our surfaces and the volumes inside."""
    made = {name: fp.fit_surface(seg.object(*parts, name=name)) for name, parts in OBJECTS.items()}
    surfaces = {name: (np.asarray(s.points), np.asarray(s.triangles)) for name, s in made.items()}
    return surfaces, {name: volume(*s) / 1e3 for name, s in surfaces.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--phases", type=int, nargs="*")
    parser.add_argument("--ways", nargs="*", default=["given", "aligned"])
    parser.add_argument("--plot", type=Path, help="volumes over the phases")
    asked = parser.parse_args()
    files = sorted(asked.folder.glob("GPFile_*.txt"))
    rows: dict[str, list[Row]] = {}
    beat: dict[str, list[dict[str, float]]] = {way: [] for way in asked.ways}
    for file in files if asked.phases is None else [files[number] for number in asked.phases]:
        phase = re.findall(r"\d+", file.stem)[-1]
        contours = fp.read_contours(file)
        short = {plane.name for plane in contours.planes if plane.short_axis}
        points, seg = outlines(contours), contours.to_segmentation()
        results: dict[str, Row] = {}
        if own := theirs(asked.folder, phase):
            results["biv-me"] = row(points, short, own)
            show(phase, "biv-me", results["biv-me"])
        points = used(points, short, seg)
        for way in asked.ways:
            shifts = fp.estimate_shifts(seg) if way == "aligned" else None
            surfaces, volumes = fit(seg if shifts is None else fp.align_slices(seg, shifts))
            beat[way].append(volumes)
            words = ", ".join(f"{name} {size:.1f}" for name, size in volumes.items()) + " mL"
            results[way] = row(points if shifts is None else moved(points, seg, shifts), short, surfaces)
            if shifts is None:
                show(phase, way, results[way], words)
                continue
            far = max((view.way for view in shifts.views), default=0.0)
            words += f"; slices moved by up to {shifts.largest:.1f} mm, views {far:.1f} mm, out: {shifts.left_out}"
            show(phase, way, results[way], words)
            results["unmoved"] = row(points, short, surfaces)
            show(phase, "unmoved", results["unmoved"])
        for way, one in results.items():
            rows.setdefault(way, []).append(one)
    for way, found in rows.items():
        mean = {name: tuple(np.mean([one[name] for one in found], axis=0)) for name in OBJECTS}
        show("mean", way, mean, f"of {len(found)} phases")
    if asked.plot:
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots()
        for way, volumes_of in beat.items():
            for name in ("lv", "rv"):
                axes.plot([one[name] for one in volumes_of], ".-", label=f"{name}, {way}")
        axes.set(xlabel="phase", ylabel="mL", title="volume inside of the closed surface")
        axes.legend()
        figure.savefig(asked.plot)


if __name__ == "__main__":
    main()
