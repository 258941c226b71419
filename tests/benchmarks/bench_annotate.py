"""How many facets of a published whole heart are named right when every name is taken away, and in how many seconds.

The heart is that of the wheel ``ansys-health-heart`` (MIT; mesh after Rodero et al. 2021, CC BY 4.0, doi
10.5281/zenodo.4590294)::

    pip download ansys-health-heart --no-deps && unzip ansys_health_heart-*.whl
    python tests/benchmarks/bench_annotate.py ansys/health/heart/data_examples/rodero_01_fullheart_1.5mm.vtu

Once with the bare points and tetrahedra, once with the numbers of its seven volumes, shuffled.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import numpy as np
import pyvista

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
    parser.add_argument("mesh", type=Path)
    parser.add_argument("--numbers", action="store_true", help="only with the numbers of the volumes")
    arguments = parser.parse_args()
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
    cases = (("points and tetrahedra alone", np.ones(len(tetra))), ("numbers of volumes kept", shuffled))
    for title, region in cases[1:] if arguments.numbers else cases:
        mesh = VolumeMesh(points, {"tetra": tetra}, region)
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
            cosine = np.abs(np.einsum("ij,ij->i", fibre, np.asarray(found.mesh.cell_data["fiber"])))[at]
            angle = np.degrees(np.arccos(np.clip(cosine, 0, 1)))
            print(f"fibres: median {np.median(angle):.1f}, mean {angle.mean():.1f} degrees off in {at.sum()} elements")
        print("verdict:", found.quality.failures or "passed")


def report(found: fp.Annotation, triangles: np.ndarray, truth: np.ndarray) -> None:
    """Share of area named right, by name."""
    shell = shell_of(found.mesh)
    have = shell.facets["triangle"]
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
