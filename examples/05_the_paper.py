"""Table 1 and Figures 3 to 7 and 10 of the paper anew, as one page, with the paper's values beside ours.

    python examples/05_the_paper.py --out paper.html
    python examples/05_the_paper.py --acdc 007 021    ACDC patients in FEMPREP_DATA, at end-diastole, too

Phantom hearts at 1.44 x 1.44 x 8 mm, whose true surfaces are known, and on request ACDC's right and left ventricles.
Table and pictures are made with the method as published and with the one that moves the vertices, or others by
--method; Figures 3 to 5 with the first of them. Needs matplotlib (the extra ``plot``).

O. Skrinjar, A. Bistoquet, 2009, doi 10.1155/2009/313517.
"""

from __future__ import annotations

import argparse
import base64
import html
import io
import os
import runpy
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import femprep as fp
from femprep.image import LabelObject
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.plane_sections import plane_sections
from femprep.model import Plane, Surface
from femprep.phantoms import Phantom
from femprep.surface import fit_surface, in_slice_distance, slice_planes, surface_distance, surface_quality
from femprep.surface.fit import TABLE_1
from femprep.surface.reference import marching_cubes
from femprep.template import charge_template

FIRST = runpy.run_path(str(Path(__file__).with_name("01_table_1.py")))
RV = TABLE_1["rv"]

#: Figure 7 of the paper: V, then mean, deviation, least and greatest Q on the sphere and on the right ventricle.
FIGURE_7 = {
    200: ((0.93, 0.07, 0.75, 1.0), (0.85, 0.07, 0.68, 0.99)),
    500: ((0.94, 0.06, 0.78, 1.0), (0.84, 0.06, 0.62, 0.99)),
    1000: ((0.93, 0.07, 0.77, 1.0), (0.86, 0.06, 0.65, 0.99)),
    5000: ((0.95, 0.05, 0.76, 1.0), (0.85, 0.07, 0.63, 0.99)),
}
#: What is varied in Figures 3, 4 and 5, and its values.
SERIES = {
    3: ("singularities", "singularities M", (50, 75, 100, 150, 200, 250, 300, 400)),
    4: ("control_points", "control points K", (50, 75, 100, 150, 200, 250, 300, 400)),
    5: ("vertices", "vertices V", (200, 300, 500, 750, 1000, 1500, 2000, 3000)),
}
#: Region of a phantom each object of the table is, so that its true surface is known.
REGION = {"lv": "lv", "rv": "rv", "la": "la", "ra": "la", "epi": "epi"}
COLOURS = {"marching cubes": "goldenrod", "paper": "crimson"}


@cache
def fitted(obj: LabelObject, method: str, singularities: int, control_points: int, vertices: int) -> Surface:
    """A surface, fitted once however many figures show it."""
    numbers = {"singularities": singularities, "control_points": control_points, "vertices": vertices}
    return fit_surface(obj, method=method, **numbers)


@dataclass(frozen=True)
class Row:
    """One object of Table 1 by one method, over all subjects; lengths in mm."""

    name: str
    method: str
    in_slice: float
    deviation: float
    truth: float | None
    q_mean: float
    q_min: float
    triangles: int


def measured(name: str, method: str, objects: Sequence[LabelObject], phantoms: Sequence[Phantom | None]) -> Row:
    """One row: in-slice distance to marching cubes as in the paper, distance to the truth, quality."""
    slices, truth, quality, triangles = [], [], [], []
    for obj, phantom in zip(objects, phantoms):
        cubes = marching_cubes(obj)
        surface = cubes if method == "marching cubes" else fitted(obj, method, **TABLE_1[name])
        slices.extend(in_slice_distance(surface, cubes, slice_planes(obj)).slice_means)
        quality.append(triangle_quality(surface.points, surface.triangles))
        triangles.append(len(surface.triangles))
        if phantom is not None:
            truth.append(np.abs(phantom.distance(REGION[name], between(surface, obj))).mean())
    return Row(
        name,
        method,
        float(np.mean(slices)),
        float(np.std(slices)),
        float(np.mean(truth)) if truth else None,
        float(np.mean([q.mean() for q in quality])),
        float(min(q.min() for q in quality)),
        int(np.mean(triangles)),
    )


def between(surface: Surface, obj: LabelObject) -> np.ndarray:
    """Vertices between the first and the last slice, where the labels tell where the surface is."""
    planes = slice_planes(obj)
    low, high = planes[0].signed_distance(surface.points), planes[-1].signed_distance(surface.points)
    return surface.points[(low > 0.0) & (high < 0.0)]


def table(methods: Sequence[str], hearts: Sequence[dict[str, LabelObject]], names: Sequence[str]) -> list[Row]:
    """Table 1 on phantoms, the first subjects of the first example."""
    bodies = [FIRST["bodies"](1.0 + 0.06 * (number - 2)) for number in range(len(hearts))]
    return [
        measured(name, method, [heart[name] for heart in hearts], [body[name][0] for body in bodies])
        for name in names
        for method in ("marching cubes", *methods)
    ]


def convergence(obj: LabelObject, number: int, method: str, values: Sequence[int]) -> list[float]:
    """Figures 3 to 5: mean distance of each mesh to the one before, as one number grows, mm."""
    fixed = {key: value for key, value in RV.items() if key != SERIES[number][0]}
    meshes = [fitted(obj, method, **fixed, **{SERIES[number][0]: value}) for value in values]
    return [surface_distance(one, other).both.mean for one, other in pairwise(meshes)]


def quality_by_vertices(obj: LabelObject, method: str, counts: Sequence[int]) -> dict[int, np.ndarray]:
    """Figures 6 and 7: Q of the triangles for numbers of vertices."""
    found = {}
    for count in counts:
        surface = fitted(obj, method, **{**RV, "vertices": count})
        found[count] = triangle_quality(surface.points, surface.triangles)
    return found


def draw_curves(curves: dict[str, dict[int, list[float]]], values: dict[int, tuple[int, ...]]) -> Any:
    """Figures 3, 4 and 5."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.2), layout="constrained")
    for axes, number in zip(figure.subplots(1, 3), SERIES):
        for label, found in curves.items():
            axes.plot(values[number][1:], found[number], "o-", ms=3, label=label)
        axes.set(
            xlabel=SERIES[number][1], ylabel="mm", title=f"Figure {number}: distance to the mesh before", ylim=(0, None)
        )
        axes.title.set_fontsize(9)
        axes.grid(alpha=0.3)
    axes.legend(fontsize=7)
    return figure


def draw_quality(found: dict[str, dict[int, np.ndarray]]) -> Any:
    """Figure 6, with the paper's values from its Figure 7."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 3.2), layout="constrained")
    axes = figure.subplots()
    for label, by_count in found.items():
        (line,) = axes.plot(list(by_count), [q.mean() for q in by_count.values()], "o-", ms=3, label=f"{label}, mean")
        axes.plot(
            list(by_count), [q.min() for q in by_count.values()], ":", color=line.get_color(), label=f"{label}, least"
        )
    axes.plot(list(FIGURE_7), [row[1][0] for row in FIGURE_7.values()], "k^", label="in the paper, mean")
    axes.plot(list(FIGURE_7), [row[1][2] for row in FIGURE_7.values()], "kv", mfc="none", label="in the paper, least")
    axes.set(xscale="log", xlabel="vertices V", ylabel="Q", ylim=(0, 1), title="Figure 6: quality of the triangles")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7)
    return figure


def draw_meshes(obj: LabelObject, methods: Sequence[str], counts: Sequence[int]) -> Any:
    """Figure 7: the sphere and the right ventricle with ever more vertices."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(2.6 * len(counts), 2.6 * (1 + len(methods))), layout="constrained")
    for column, count in enumerate(counts):
        template = charge_template(count)
        meshes = {"sphere": (template.directions, template.cells)}
        for method in methods:
            surface = fitted(obj, method, **{**RV, "vertices": count})
            meshes[method] = (surface.points, surface.triangles)
        for row, (label, (points, cells)) in enumerate(meshes.items()):
            axes = figure.add_subplot(1 + len(methods), len(counts), 1 + row * len(counts) + column, projection="3d")
            axes.plot_trisurf(*points.T, triangles=cells, color="lightsteelblue", edgecolor="k", lw=0.15)
            axes.set_box_aspect(np.ptp(points, axis=0))
            axes.set_axis_off()
            q = triangle_quality(points, cells)
            axes.set_title(
                f"{label}, V = {count}\nQ {q.mean():.2f} ± {q.std():.2f} ({q.min():.2f}, {q.max():.2f})", fontsize=7
            )
    return figure


def draw_contours(objects: dict[str, LabelObject], methods: Sequence[str]) -> Any:
    """Figure 10: contours of marching cubes and of the fits over the labels, in a slice; of the LV lengthwise too."""
    from matplotlib.figure import Figure

    views = [(name, False) for name in objects] + [("lv", True)] * ("lv" in objects)
    figure = Figure(figsize=(2.9 * len(views), 3.1), layout="constrained")
    for axes, (name, lengthwise) in zip(np.atleast_1d(figure.subplots(1, len(views))), views):
        obj = objects[name]
        stack = obj.stack_axis
        across = next(a for a in range(3) if a != stack) if lengthwise else stack
        flat = [a for a in range(3) if a != across]
        number = int(np.median(np.argwhere(obj.mask)[:, across]))
        index = np.where(np.arange(3) == across, number, 0.0)
        plane = Plane(obj.grid.to_world(index[None])[0], obj.grid.direction[:, across])
        size = obj.grid.spacing[flat]
        extent = [-0.5 * size[0], (obj.mask.shape[flat[0]] - 0.5) * size[0]]
        extent += [-0.5 * size[1], (obj.mask.shape[flat[1]] - 0.5) * size[1]]
        axes.imshow(np.take(obj.mask, number, axis=across).T, cmap="gray", origin="lower", extent=extent, vmax=1.6)
        meshes = {"marching cubes": marching_cubes(obj)}
        meshes |= {method: fitted(obj, method, **TABLE_1[name]) for method in methods}
        for label, surface in meshes.items():
            for k, contour in enumerate(plane_sections(surface.points, surface.triangles, [plane])[0]):
                line = obj.grid.to_index(contour)[:, flat] * size
                axes.plot(*line.T, lw=1.2, color=COLOURS.get(label, "deepskyblue"), label=label if k == 0 else None)
        axes.set_title(f"{FIRST['TITLES'][name]}{', long axis' if lengthwise else ''}", fontsize=8)
        axes.set_axis_off()
    axes.legend(fontsize=6, loc="lower right")
    return figure


def page(rows: Sequence[Row], parts: Sequence[tuple[str, str, Any]]) -> str:
    """The page: the table, then figures with their captions, pictures within."""
    lines = [
        "<!doctype html><meta charset='utf-8'><title>The paper, made anew</title>",
        "<style>body{font:14px sans-serif;max-width:1150px;margin:2em auto}td,th{padding:2px 10px;text-align:right}"
        "img{max-width:100%}</style><h1>The paper, made anew</h1>",
        "<h2>Table 1</h2><table><tr><th>object<th>method<th>triangles<th>D, mm<th>D in the paper, mm"
        "<th>to the truth, mm<th>Q mean<th>Q min</tr>",
    ]
    for row in rows:
        paper = FIRST["PAPER"].get(row.name) if row.method == "paper" else None
        cells = (
            FIRST["TITLES"][row.name],
            row.method,
            row.triangles,
            f"{row.in_slice:.2f} ± {row.deviation:.2f}",
            f"{paper[0]} ± {paper[1]}" if paper else "",
            "" if row.truth is None else f"{row.truth:.2f}",
            f"{row.q_mean:.2f}",
            f"{row.q_min:.2f}",
        )
        lines.append("<tr>" + "".join(f"<td>{html.escape(str(cell))}" for cell in cells) + "</tr>")
    lines.append(
        "</table><p>D: in-slice distance to marching cubes, mean and deviation over the slices. To the truth: vertices "
        "between the first and the last slice to the phantom's surface without its flat base, which a tilted stack "
        "cuts too.</p>"
    )
    for title, caption, figure in parts:
        data = base64.b64encode(png(figure)).decode()
        lines.append(f"<h2>{html.escape(title)}</h2><img src='data:image/png;base64,{data}' alt=''><p>{caption}</p>")
    return "\n".join(lines) + "\n"


def png(figure: Any) -> bytes:
    """A figure as PNG."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110)
    return stream.getvalue()


def acdc(patients: Sequence[str]) -> dict[str, dict[str, LabelObject]]:
    """LV and RV cavities of ACDC patients at end-diastole."""
    if not patients:
        return {}
    folder = Path(os.environ["FEMPREP_DATA"]) / "acdc" / "training"
    found = {}
    for patient in patients:
        seg = fp.read_segmentation(folder / f"patient{patient}" / f"patient{patient}_frame01_gt.nii.gz", preset="acdc")
        found[f"ACDC {patient}"] = {name: seg.object(name) for name in ("lv", "rv")}
    return found


def main(
    out: Path,
    methods: Sequence[str] = ("paper", "even"),
    patients: Sequence[str] = (),
    subjects: int = 5,
    quick: bool = False,
    picture: Path | None = None,
) -> dict[str, Any]:
    """Make the page; returns its figures."""
    step = 3 if quick else 1
    values = {number: chosen[::step] for number, (_, _, chosen) in SERIES.items()}
    counts = tuple(FIGURE_7)[: 2 if quick else None]
    names = ("lv", "rv") if quick else tuple(TABLE_1)
    phantoms = [FIRST["subject"](number) for number in range(subjects)]
    rows = table(methods, phantoms, names)
    hearts = {"phantom": {name: phantoms[0][name] for name in names}, **acdc(patients)}
    curves, quality, parts = {}, {}, []
    for heart, objects in hearts.items():
        found = {number: convergence(objects["rv"], number, methods[0], values[number]) for number in SERIES}
        curves[f"{heart}, {methods[0]}"] = found
        for method in methods:
            quality[f"{heart}, {method}"] = quality_by_vertices(objects["rv"], method, counts)
        if heart != "phantom":
            rows += [
                measured(name, m, [objects[name]], [None]) for name in objects for m in ("marching cubes", *methods)
            ]
    series = draw_curves(curves, values)
    parts.append(("Figures 3, 4, 5", "Right ventricle. The paper's curves fall towards zero as ours do.", series))
    parts.append(("Figure 6", "Right ventricle: Q hardly depends on V.", draw_quality(quality)))
    for heart, objects in hearts.items():
        parts.append((f"Figure 7, {heart}", _caption(counts), draw_meshes(objects["rv"], methods, counts)))
        shown = {name: obj for name, obj in objects.items() if name != "epi"}
        words = "Marching cubes (yellow), the method of the paper (red), with vertices moved (blue)."
        contours = draw_contours(shown, methods)
        parts.append((f"Figure 10, {heart}", words, contours))
        if heart == "phantom" and picture is not None:
            picture.write_bytes(png(contours))
            picture.with_name(f"{picture.stem}_convergence.png").write_bytes(png(series))
    out.write_text(page(rows, parts), encoding="utf-8")
    for row in rows:
        truth = "" if row.truth is None else f", to the truth {row.truth:.2f} mm"
        print(
            f"{row.name:4s}{row.method:16s}{row.triangles:6d} triangles, D {row.in_slice:.2f} ± {row.deviation:.2f} mm"
            f"{truth}, Q {row.q_mean:.2f} mean, {row.q_min:.2f} least"
        )
    for label, found in quality.items():
        print(label, *(f"V {count}: Q {q.mean():.2f} ± {q.std():.2f} ({q.min():.2f});" for count, q in found.items()))
    return {"rows": rows, "curves": curves, "quality": quality, "sound": _sound(hearts["phantom"]["rv"], methods)}


def _caption(counts: Sequence[int]) -> str:
    said = (
        f"V = {v}: {FIGURE_7[v][1][0]} ± {FIGURE_7[v][1][1]} ({FIGURE_7[v][1][2]}, {FIGURE_7[v][1][3]})" for v in counts
    )
    return "Q of the right ventricle in the paper, " + "; ".join(said) + "."


def _sound(obj: LabelObject, methods: Sequence[str]) -> dict[str, bool]:
    return {method: surface_quality(fitted(obj, method, **RV)).sound for method in methods}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("paper.html"))
    parser.add_argument("--method", nargs="+", default=["paper", "even"])
    parser.add_argument("--acdc", nargs="*", default=[], metavar="NUMBER", help="patients, as 007")
    parser.add_argument("--subjects", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="fewer points in each figure")
    parser.add_argument("--picture", type=Path, help="keep Figure 10 and Figures 3 to 5 of the phantom as PNG")
    args = parser.parse_args()
    main(args.out, args.method, args.acdc, args.subjects, args.quick, args.picture)
