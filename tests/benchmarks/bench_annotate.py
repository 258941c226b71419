"""How many facets of a published whole heart are named right when every name is taken away, and in how many seconds.

The heart is that of the wheel ``ansys-health-heart`` (MIT; mesh after Rodero et al. 2021, CC BY 4.0, doi
10.5281/zenodo.4590294)::

    pip download ansys-health-heart --no-deps && unzip ansys_health_heart-*.whl
    python tests/benchmarks/bench_annotate.py ansys/health/heart/data_examples/rodero_01_fullheart_1.5mm.vtu

Once with the bare points and tetrahedra, once with the numbers of its seven volumes, shuffled, once as its makers
give it, with the names in the file beside it (``--named-by-makers`` runs this alone).

``--examples`` takes instead the left ventricles that svMultiPhysics is shown with, against their own surfaces, and the
fibres of the one that has some (helix angle 90 to -90 degrees). Its repository keeps pointers to large files alone; the
one of its tests before holds them::

    git clone --depth 1 https://github.com/SimVascular/svFSI-Tests
    python tests/benchmarks/bench_annotate.py --examples svFSI-Tests

``--named`` gives a surface whose array ``class`` is 1 on the base, 2 on the epicardium, 3 and 4 on the endocardia, as
those of Cobiveco and LDRB_Fibers are (https://github.com/KIT-IBT); the elements, where the repository keeps none, are
made of that surface (``pip install tetgen``: ``tetgen.TetGen(pyvista.read("heart.vtp")).tetrahedralize(mindihedral=10,
minratio=1.5)``)::

    python tests/benchmarks/bench_annotate.py heart.vtu --named heart.vtp
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np
import pyvista
from scipy.spatial import cKDTree

import femprep as fp
from femprep.annotation.shell import shell_of
from femprep.mesh.numbering import set_numbers
from femprep.model import FACET_TAGS, VolumeMesh

#: Words in the names of their surfaces, and ours; the first that fits.
WORDS = (
    ("interface mitral", "mitral"),
    ("interface tricuspid", "tricuspid"),
    ("interface aortic", "aortic"),
    ("interface pulmonary-valve", "pulmonary"),
    ("interface", "veins"),
    ("border", "veins"),
    ("left ventricle endo", "endo_lv"),
    ("right ventricle endo", "endo_rv"),
    ("right ventricle septum", "endo_rv"),
    ("left atrium endo", "endo_la"),
    ("right atrium endo", "endo_ra"),
    ("epicard", "epi"),
    ("aorta wall", "aorta_wall"),
    ("pulmonary artery wall", "pulmonary_artery_wall"),
)
#: Left ventricles of the examples: ten-node tetrahedra, hexahedra, tetrahedra.
EXAMPLES = (
    "05-struct/02-LV-Guccione-passive/mesh/P2",
    "05-struct/02-LV-Guccione-passive/mesh/Q1",
    "06-ustruct/03-LV-Guccione-active/mesh/P1",
)
KINDS = {10: "tetra", 24: "tetra10", 12: "hexahedron"}
CAPS = {
    1001: "mitral",
    1002: "aortic",
    1003: "tricuspid",
    1004: "pulmonary",
    **dict.fromkeys(range(1006, 1014), "veins"),
}
del CAPS[1011]


def ours(name: str) -> str | None:
    """Our name of one of their surfaces."""
    low = name.lower()
    return next((own for words, own in WORDS if all(word in low for word in words.split())), None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", type=Path, help="the published heart, or the folder of the examples")
    parser.add_argument("--numbers", action="store_true", help="only with the numbers of the volumes")
    parser.add_argument("--named-by-makers", action="store_true", help="only with the names beside the file")
    parser.add_argument("--examples", action="store_true", help="the left ventricles of svMultiPhysics's examples")
    parser.add_argument("--named", type=Path, help="a surface with the array class")
    parser.add_argument("--unit", default="auto", help="of the examples, or of the mesh that --named names")
    arguments = parser.parse_args()
    if arguments.named:
        beside(arguments.mesh, pyvista.read(arguments.named), arguments.unit)
        return
    if arguments.examples:
        for name in EXAMPLES:
            example(arguments.mesh / name, arguments.unit)
        return
    file = pyvista.read(arguments.mesh)
    names = json.loads(arguments.mesh.with_suffix(".namemap.json").read_text())["_surface_id_to_name"]
    tetra, triangles = file.cells_dict[10].astype(np.int64), file.cells_dict[5].astype(np.int64)
    kinds = file.celltypes
    surface = file.cell_data["_surface-id"][kinds == 5].astype(int)
    volume = file.cell_data["_volume-id"][kinds == 10].astype(int)
    fibre = np.asarray(file.cell_data["fiber"][kinds == 10], dtype=float)
    points = np.asarray(file.points, dtype=float)
    chosen = surface > 10_000
    truth = np.array([FACET_TAGS[ours(names[str(i)]) or "epi"] for i in surface[chosen]])
    shuffled = np.random.default_rng(0).permutation(90)[volume] + 10
    cases = (
        ("points and tetrahedra alone", VolumeMesh(points, {"tetra": tetra}, np.ones(len(tetra)))),
        ("numbers of volumes kept", VolumeMesh(points, {"tetra": tetra}, shuffled)),
        ("as its makers give it", fp.read_mesh(arguments.mesh)),
    )
    first, last = (2, 3) if arguments.named_by_makers else (1, 2) if arguments.numbers else (0, 3)
    for title, mesh in cases[first:last]:
        start, busy = time.perf_counter(), time.process_time()
        found = fp.annotate(mesh)
        with tempfile.TemporaryDirectory() as folder:
            fp.write_annotation(found, Path(folder) / "out")
        seconds, busy = time.perf_counter() - start, time.process_time() - busy
        stages = {name: round(own, 1) for name, own in found.seconds.items()}
        print(f"\n## {title}: {seconds:.1f} s with writing ({busy:.1f} of the processor), {stages}")
        report(found, triangles[chosen], truth)
        for one in found.openings:
            caps = [(i, surface == i) for i, name in CAPS.items() if name == one.name]
            near = min(
                (float(np.linalg.norm(points[triangles[own]].mean(axis=(0, 1)) - one.centre)), i) for i, own in caps
            )
            print(f"opening {one.name} of {one.cavity}: {one.area:.0f} mm2, {near[0]:.1f} mm from cap {near[1]}")
        if not np.ptp(fibre, axis=0).any():
            print(f"fibres: the file has the same direction {fibre[0]} everywhere, so there is nothing to compare with")
        elif "fiber" in found.mesh.cell_data:
            at = np.isin(found.mesh.region, [1, 2, 3]) & (np.linalg.norm(fibre, axis=1) > 0.5)
            angles("fibres", fibre[at], found.mesh.cell_data["fiber"][at])
        print("verdict:", found.quality.failures or "passed")


def example(folder: Path, unit: str) -> None:
    """A left ventricle of SimVascular's: a file of elements, one of facets for each surface, perhaps two of fibres."""
    file = pyvista.read(folder / "mesh-complete.mesh.vtu")
    kind, cells = next((KINDS[int(code)], block) for code, block in file.cells_dict.items())
    mesh = VolumeMesh(np.asarray(file.points, dtype=float), {kind: cells.astype(np.int64)}, np.ones(file.n_cells))
    start = time.perf_counter()
    found = fp.annotate(mesh, fibres={"endo_angle": 90.0, "epi_angle": -90.0}, unit=unit)
    print(f"\n## {folder}: {file.n_cells} {kind}, {time.perf_counter() - start:.1f} s")
    nodes, truth = [], []
    for name in ("endo", "epi", "base"):
        surface = pyvista.read(folder / "mesh-surfaces" / f"{name}.vtp")
        corners = 4 if kind == "hexahedron" else 3
        facets = surface.faces.reshape(surface.n_cells, -1)[:, 1 : 1 + corners]
        nodes.append(surface.point_data["GlobalNodeID"][facets] - 1)
        truth.append(np.full(surface.n_cells, FACET_TAGS[name]))
    report(found, np.concatenate(nodes), np.concatenate(truth))
    for own, theirs in (("fiber", "fibersLong.vtu"), ("sheet", "fibersSheet.vtu")):
        if (folder / theirs).is_file():
            angles(own, pyvista.read(folder / theirs)["FIB_DIR"], found.mesh.cell_data[own])
    print("verdict:", found.quality.failures or "passed")


def beside(path: Path, surface: pyvista.PolyData, unit: str) -> None:
    """A mesh whose facets are named as the nearest places of a surface are."""
    start = time.perf_counter()
    found = fp.annotate(fp.read_mesh(path, unit=unit), names={}, fibres=None)
    print(f"\n## {path}: {found.mesh.n_cells} elements, {time.perf_counter() - start:.1f} s")
    shell = shell_of(found.mesh)
    if "class" in surface.cell_data:
        places, number = surface.cell_centers().points, surface.cell_data["class"]
    else:
        places, number = surface.points, surface.point_data["class"]
    names = np.array([0, *(FACET_TAGS[name] for name in ("base", "epi", "endo_lv", "endo_rv"))])
    (triangles,) = shell.facets.values()
    report(found, triangles, names[number[cKDTree(places).query(shell.centre)[1]].astype(int)])
    print("read by:", next(attempt.way for attempt in found.attempts if attempt.taken))


def angles(what: str, theirs: np.ndarray, own: np.ndarray) -> None:
    """How many degrees one direction is from another, either way along it."""
    cosine = np.abs(np.einsum("ij,ij->i", theirs, own)) / np.linalg.norm(theirs, axis=1)
    off = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
    told = f"median {np.median(off):.2f}, mean {off.mean():.2f}, 95 % {np.percentile(off, 95):.2f}"
    print(f"{what}: {told}, at most {off.max():.1f} degrees off in {len(off)} elements")


def report(found: fp.Annotation, triangles: np.ndarray, truth: np.ndarray) -> None:
    """Share of area named right, by name."""
    shell = shell_of(found.mesh)
    kind = next(iter(shell.facets))
    have = shell.facets[kind][:, : triangles.shape[1]]
    number = set_numbers(have, triangles)
    true = np.zeros(int(number.max()) + 1, dtype=int)
    true[number[len(have) :]] = truth
    want = true[number[: len(have)]]
    area, tag = shell.area, found.mesh.facet_tag
    known = want > 0
    share = area[known & (want == tag)].sum() / area[known].sum()
    print(f"named right: {100 * share:.2f} % of {area[known].sum():.0f} mm2")
    label = {number: name for name, number in FACET_TAGS.items()}
    for one in np.unique(want[known]):
        own = want == one
        wrong = {label[int(t)]: round(float(area[own & (tag == t)].sum())) for t in np.unique(tag[own]) if t != one}
        share = area[own & (tag == one)].sum() / area[own].sum()
        print(f"  {label[int(one)]}: {100 * share:.1f} % of {area[own].sum():.0f} mm2; else {wrong}")


if __name__ == "__main__":
    main()
