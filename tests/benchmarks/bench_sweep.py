"""The sweep mesher over ACDC: every map, every element, against its limits; ED and ES on one template; prints tables.

    python tests/benchmarks/bench_sweep.py meshes                       all maps at 2.5 mm: tetra, wedge, hexahedron
    python tests/benchmarks/bench_sweep.py meshes --orders 1 2 --repeat elements of order 2 as well; each mesh twice
    python tests/benchmarks/bench_sweep.py sequences                    ED and ES of each patient on one template
    python tests/benchmarks/bench_sweep.py speed                        200,000 elements from matched surfaces
    python tests/benchmarks/bench_sweep.py speed --image SEG            the same, and the whole command on an image

Needs FEMPREP_DATA, but for the last two. A line per mesh goes to standard output as it is made, and to --lines; what
stands there already is not made again, so that a study that was stopped goes on. Fitted surfaces are kept in
--surfaces. Limits: no inverted element (Jacobian positive at corners and quadrature points); tetrahedra: smallest
dihedral angle 8 degrees, mean of the mean ratio 0.75; wedges and hexahedra: scaled Jacobian at least 0.15, mean 0.75.
--correct-shifts moves slices back against breath-hold shifts first, as the command's option does.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import zlib
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from bench_acdc import cases, choose

#: How surfaces are fitted, where not as by default.
METHOD: dict[str, Any] = {}
#: Template of the sequences: one connectivity for all hearts.
TEMPLATE = {"columns": 80, "rows": 16, "layers": 4}


def labelled(path: str, shifts: bool) -> Any:
    """The segmentation of one map, with its slices moved where that is asked for."""
    import femprep as fp

    seg = fp.read_segmentation(path, preset="acdc")
    return fp.orient(fp.align_slices(seg) if shifts else seg)


def prepared(path: str, store: Path | None, offset: float = 0.0, shifts: bool = False) -> dict[str, Any]:
    """Surfaces, plane and direction of one map, as the pipeline makes them; kept in a folder where one is given."""
    import femprep as fp
    from femprep.model import Plane, Surface
    from femprep.report.notices import lines
    from femprep.surface import fit_surface
    from femprep.surface.fitting.patches import patches_of

    file = store / f"{Path(path).name.split('.')[0]}{'-corrected' if shifts else ''}.npz" if store else None
    if file is None or not file.exists():
        seg = labelled(path, shifts)
        cavity, heart = seg.object("lv", name="lv"), seg.object("lv", "myo", name="epi")
        endo = fit_surface(cavity, **METHOD)
        epi = fit_surface(heart, boundary=fp.extend_apex(seg, heart), **METHOD)
        base = fp.find_base(seg)
        inside, outside = patches_of(endo), patches_of(epi)
        found: Any = {
            "endo": inside.points,
            "endo_cells": inside.triangles,
            "epi": outside.points,
            "epi_cells": outside.triangles,
            "base": np.stack([base.point, base.normal]),
            "toward": np.eye(3)[0] if seg.frame is None else seg.frame[:, 0],
            "labels_mm3": cavity.volume,
            "notices": lines(endo.info, epi.info),
        }
        if file is not None:
            np.savez(file, **found)
    else:
        found = np.load(file)
    point, normal = found["base"]
    surfaces = {
        "endo": Surface(found["endo"], found["endo_cells"], name="lv"),
        "epi": Surface(found["epi"], found["epi_cells"], name="epi"),
        "base": Plane(point - offset * normal, normal),
        "toward": tuple(found["toward"].tolist()),
    }
    return {"surfaces": surfaces, "labels_mm3": float(found["labels_mm3"])}


def judged(mesh: Any, matched: Any, order: int) -> dict[str, Any]:
    """Figures of one mesh, and what of its limits it misses."""
    from femprep.mesh.measures.volume_elements import element_measures

    ((kind, cells),) = mesh.cells.items()
    found = element_measures(mesh.points, cells, kind)
    row: dict[str, Any] = {
        "cells": len(cells),
        "layers": matched.layers,
        "dihedral_min": float(found["minimum_dihedral"].min()),
        "mean_ratio_mean": float(found["mean_ratio"].mean()),
        "scaled_jacobian_min": float(found["scaled_jacobian"].min()),
        "scaled_jacobian_mean": float(found["scaled_jacobian"].mean()),
        "relative_jacobian_min": float(found["relative_jacobian"].min()),
        "straightened": mesh.info.get("straightened", 0),
        "pushed_mm": matched.info["pushed"]["maximum_mm"],
        "thickness_min_mm": matched.info["thickness_mm"]["minimum"],
    }
    cup, layers = matched.cup, matched.layers
    side = (2 if kind.startswith("tetra") else 1) * layers * len(cup.base)
    ends = (2 if kind.startswith("tetra") and cup.cells.shape[1] == 4 else 1) * len(cup.cells)
    base = mesh.facet_tag == mesh.facet_names["base"]
    tags = {name: int(np.sum(mesh.facet_tag == tag)) for name, tag in mesh.facet_names.items()}
    row["facets_exact"] = tags == {"endo": ends, "epi": ends, "base": side}
    first, on_base = 0, []
    for block in mesh.facets.values():
        on_base.append(block[base[first : first + len(block)]].ravel())
        first += len(block)
    nodes = np.unique(np.concatenate(on_base))
    row["base_error_mm"] = float(np.abs(mesh.planes["base"].signed_distance(mesh.points[nodes])).max())
    missed = []
    if row["relative_jacobian_min"] <= 0.0:
        missed.append(f"{int(np.sum(found['relative_jacobian'] <= 0.0))} inverted")
    if order == 1 and kind == "tetra":
        if row["dihedral_min"] < 8.0:
            missed.append(f"dihedral {row['dihedral_min']:.1f}")
        if row["mean_ratio_mean"] < 0.75:
            missed.append(f"mean ratio {row['mean_ratio_mean']:.2f}")
    elif order == 1:
        if row["scaled_jacobian_min"] < 0.15:
            missed.append(f"scaled Jacobian {row['scaled_jacobian_min']:.2f}")
        if row["scaled_jacobian_mean"] < 0.75:
            missed.append(f"mean scaled Jacobian {row['scaled_jacobian_mean']:.2f}")
    if not row["facets_exact"] or row["base_error_mm"] > 1e-9:
        missed.append("facets or base")
    row["outcome"] = ", ".join(missed) or "passed"
    return row


def one_map(
    job: tuple[str, str, float, tuple[str, ...], tuple[int, ...], bool, Path | None, bool],
) -> list[dict[str, Any]]:
    """All meshes of one map."""
    import femprep as fp

    name, path, edge, elements, orders, repeat, store, shifts = job
    try:
        start = time.process_time()
        surfaces = prepared(path, store, shifts=shifts)["surfaces"]
        fitted = time.process_time() - start
    except fp.FemprepError as error:
        return [{"case": name, "element": e, "order": 1, "outcome": f"no surfaces: {error}"} for e in elements]
    rows = []
    for element in elements:
        row = {"case": name, "element": element, "order": 1, "fit_cpu_s": fitted}
        try:
            start = time.process_time()
            matched = fp.match_surfaces(**surfaces, element=element, edge_length=edge)
            row["match_cpu_s"] = time.process_time() - start
            for order in orders:
                start = time.process_time()
                mesh = fp.sweep(matched, element=element, order=order)
                row = {**row, "order": order, "sweep_cpu_s": time.process_time() - start}
                row |= judged(mesh, matched, order)
                if repeat:
                    again = fp.match_surfaces(**surfaces, element=element, edge_length=edge)
                    twin = fp.sweep(again, element=element, order=order)
                    row["bytes_equal"] = twin.points.tobytes() == mesh.points.tobytes()
                rows.append(row)
        except fp.FemprepError as error:
            rows.append({**row, "outcome": f"{'refused' if error.exit_status == 2 else 'failed'}: {error}"})
    return rows


def one_patient(job: tuple[str, dict[str, str], Path | None, bool]) -> list[dict[str, Any]]:
    """ED and ES of one patient on the template; correspondence and ejection fraction."""
    import femprep as fp
    from femprep.report.volumes import cavity_volume

    patient, paths, store, shifts = job
    row: dict[str, Any] = {"case": patient}
    meshes, labels = {}, {}
    try:
        offsets = fp.phase_base_offsets([labelled(path, shifts) for path in paths.values()])
        for (phase, path), offset in zip(paths.items(), offsets, strict=True):
            found = prepared(path, store, offset, shifts)
            labels[phase] = found["labels_mm3"]
            matched = fp.match_surfaces(**found["surfaces"], **TEMPLATE)
            meshes[phase] = fp.sweep(matched, **TEMPLATE)
            figures = judged(meshes[phase], matched, 1)
            row |= {f"{phase}_{key}": figures[key] for key in ("dihedral_min", "mean_ratio_mean", "outcome")}
            row[f"{phase}_base_offset_mm"] = offset
        moved = fp.displacements([meshes["ED"], meshes["ES"]])[1].point_data["displacement"]
        cavity = {phase: cavity_volume(mesh) for phase, mesh in meshes.items()}
        row["moved_mean_mm"] = float(np.linalg.norm(moved, axis=1).mean())
        row["nodes"] = len(moved)
        row["ef_mesh"] = 100.0 * (1.0 - cavity["ES"] / cavity["ED"])
        row["ef_labels"] = 100.0 * (1.0 - labels["ES"] / labels["ED"])
        row["ef_difference"] = row["ef_mesh"] - row["ef_labels"]
        row["cells_digest"] = zlib.crc32(meshes["ED"].cells["tetra"].tobytes())
        # One template for all hearts is too coarse for some of them: their quality stands in the row, and only what is
        # inverted counts.
        missed = [f"{phase} {row[f'{phase}_outcome']}" for phase in paths if "inverted" in row[f"{phase}_outcome"]]
        if abs(row["ef_difference"]) > 3.0:
            missed.append(f"ejection fraction off by {row['ef_difference']:+.1f} points")
        row["outcome"] = "; ".join(missed) or "passed"
    except fp.FemprepError as error:
        row["outcome"] = f"failed: {error}"
    return [row]


def bench_speed(repeats: int = 5) -> None:
    """Sweep about 200,000 elements of each kind between matched ellipsoids."""
    import femprep as fp
    from femprep.model import Plane, Surface
    from femprep.template import charge_template

    template = charge_template(1500)
    axes = {"lv": (23.0, 25.0, 45.0), "epi": (33.0, 35.0, 53.0)}
    endo, epi = (Surface(template.directions * np.array(a), template.cells, name=n) for n, a in axes.items())
    base = Plane(np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, 1.0]))
    print(f"{'element':12s}{'elements':>10s}{'sweep wall s':>14s}{'processor s':>13s}{'match processor s':>19s}")
    for element, edge in (("tetra", 1.6), ("wedge", 1.12), ("hexahedron", 0.84)):
        start = time.process_time()
        matched = fp.match_surfaces(endo=endo, epi=epi, base=base, element=element, edge_length=edge)
        matching = time.process_time() - start
        fp.sweep(matched, element=element)
        wall, cpu = [], []
        for _ in range(repeats):
            start, used = time.perf_counter(), time.process_time()
            mesh = fp.sweep(matched, element=element)
            wall.append(time.perf_counter() - start)
            cpu.append(time.process_time() - used)
        print(f"{element:12s}{mesh.n_cells:10d}{min(wall):14.3f}{min(cpu):13.3f}{matching:19.2f}", flush=True)


def summary(rows: list[dict[str, Any]]) -> None:
    """Passed of all by element and order, what failed and why, and least, mean and greatest of every figure."""
    groups = dict.fromkeys((row.get("element", ""), row.get("order", "")) for row in rows)
    for element, order in groups:
        own = [row for row in rows if (row.get("element", ""), row.get("order", "")) == (element, order)]
        passed = sum(row["outcome"] == "passed" for row in own)
        print(f"\n{element} {order}: {passed} of {len(own)} passed")
        for row in own:
            if row["outcome"] != "passed":
                print(f"    {row['case']}: {row['outcome']}")
        print(f"{'':26s}{'min':>12s}{'mean':>12s}{'max':>12s}")
        for key in dict.fromkeys(key for row in own for key in row):
            values = [row[key] for row in own if isinstance(row.get(key), int | float) and key != "cells_digest"]
            if values and key != "order":
                print(f"{key:26s}{min(values):12.4g}{np.mean(values):12.4g}{max(values):12.4g}")
    digests = Counter(row["cells_digest"] for row in rows if "cells_digest" in row)
    if digests:
        print(f"\ndistinct connectivities: {len(digests)} in {sum(digests.values())} hearts")


def bench_command(image: Path) -> None:
    """Seconds of the whole command, image to finished mesh on disk, after one run that compiles."""
    program = str(Path(sys.executable).with_name("femprep"))
    command = [program, "mesh", str(image), "--mesher", "sweep", "--preset", "acdc", "--quiet"]
    for number in range(3):
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            subprocess.run([*command, "-o", str(Path(folder) / "out")], check=False)
            if number:
                seconds = time.perf_counter() - start
                stages = json.loads((Path(folder) / "out" / "run.json").read_text())["stages"]
                print(f"femprep mesh --mesher sweep: {seconds:.2f} s", {s["name"]: s["seconds"] for s in stages})


def study(jobs: list[Any], work: Any, workers: int, lines: Path | None) -> list[dict[str, Any]]:
    """Rows of all jobs, a line of each printed and appended to a file; jobs that stand there are read back."""
    results: list[dict[str, Any]] = []
    if lines and lines.exists():
        results = [json.loads(line) for line in lines.read_text().splitlines()]
    done = {row["case"] for row in results}
    left = [job for job in jobs if job[0] not in done]
    with ProcessPoolExecutor(workers) as pool:
        for found in pool.map(work, left):
            for row in found:
                results.append(row)
                print(
                    " ".join(f"{k}={v:.4g}" if isinstance(v, float) else f"{k}={v}" for k, v in row.items()), flush=True
                )
                if lines:
                    with lines.open("a") as stream:
                        stream.write(json.dumps(row) + "\n")
    return results


def main(arguments: list[str] | None = None) -> None:
    """Run the chosen benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("meshes", "sequences", "speed"))
    parser.add_argument("--edge", type=float, default=2.5, help="edge length, mm")
    parser.add_argument("--elements", nargs="+", default=["tetra", "wedge", "hexahedron"])
    parser.add_argument("--orders", nargs="+", type=int, default=[1])
    parser.add_argument("--repeat", action="store_true", help="make each mesh twice and compare their bytes")
    parser.add_argument("--every", type=int, default=1, help="every how manieth map or patient")
    parser.add_argument("--count", type=int, help="the awkward maps, and others of each group, so many")
    parser.add_argument("--only", nargs="+", help="maps or patients to run, by name: patient001_frame01, patient001")
    parser.add_argument("--correct-shifts", action="store_true", help="move slices back first")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--lines", type=Path, help="file for a JSON line per mesh; goes on where it ends")
    parser.add_argument("--surfaces", type=Path, help="folder that keeps the fitted surfaces")
    parser.add_argument("--method", choices=("paper", "even", "smooth"), help="how surfaces are fitted")
    parser.add_argument("--image", type=Path, help="speed: a label map to take through the whole command")
    given = parser.parse_args(arguments)
    if given.what == "speed":
        bench_speed()
        if given.image:
            bench_command(given.image)
        return
    METHOD.update({"method": given.method} if given.method else {})
    data = Path(os.environ["FEMPREP_DATA"]) / "acdc"
    rows = cases(data.parent)
    if given.surfaces:
        given.surfaces.mkdir(parents=True, exist_ok=True)
    if given.what == "meshes":
        rows = choose(rows, given.count) if given.count else rows[:: given.every]
        kinds = (given.edge, tuple(given.elements), tuple(given.orders))
        rest = (*kinds, given.repeat, given.surfaces, given.correct_shifts)
        jobs: list[Any] = [(row["id"], str(data / row["file"]), *rest) for row in rows]
        work: Any = one_map
    else:
        patients: dict[str, dict[str, str]] = {}
        for row in rows:
            patients.setdefault(row["id"].split("_")[0], {})[row["phase"]] = str(data / row["file"])
        both = {name: paths for name, paths in patients.items() if set(paths) == {"ED", "ES"}}
        jobs = [(name, paths, given.surfaces, given.correct_shifts) for name, paths in both.items()][:: given.every]
        work = one_patient
    if given.only:
        jobs = [job for job in jobs if job[0] in given.only]
    summary(study(jobs, work, given.jobs, given.lines))


if __name__ == "__main__":
    main()
