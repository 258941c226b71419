"""The meshes whose element quality is held to a baseline, and their figures; run as a script it renews the baseline.

    FEMPREP_DATA=... python tests/quality_cases.py           measures all cases, prints old and new, writes the file
    FEMPREP_DATA=... python tests/quality_cases.py biv       those with such a word in their name alone

A figure may fall below its baseline by its tolerance: little for the sweep, whose meshes follow the surfaces fitted
before them and repeat byte for byte, more for fTetWild, no two of whose meshes are equal: its baselines are the least
of ``RUNS`` runs. Renew after a change that is meant to change meshes, and look at every figure that falls.
"""

from __future__ import annotations

import json
import os
import sys
from functools import cache
from pathlib import Path

import numpy as np

import femprep as fp
from femprep.image import Segmentation
from femprep.mesh.measures.volume_elements import element_measures
from femprep.model import Plane, Surface, VolumeMesh
from femprep.phantoms import biventricular, lv_ellipsoid
from femprep.sweeping import sweep
from femprep.sweeping.cup.matched import MatchedSurfaces
from femprep.sweeping.matching.match import match_surfaces

BASELINE = Path(__file__).with_name("baselines") / "quality.json"

#: Phantoms by name: semi-axes of endocardium and epicardium and height of the base, mm.
PHANTOMS = {
    "round": ((25.0, 25.0, 60.0), (34.0, 34.0, 69.0), 20.0),
    "flat": ((20.0, 26.0, 55.0), (29.0, 36.0, 66.0), -5.0),
}
#: ACDC maps: thick at the end of systole, with few slices, with a thin wall.
ACDC = ("patient021_frame13", "patient041_frame01", "patient084_frame01")

#: What each kind of mesh is made with.
SWEPT = {
    "sweep-tetra": {"element": "tetra", "order": 1},
    "sweep-tetra10": {"element": "tetra", "order": 2},
    "sweep-wedge": {"element": "wedge", "order": 1},
    "sweep-wedge15": {"element": "wedge", "order": 2},
    "sweep-hexahedron": {"element": "hexahedron", "order": 1},
    "sweep-hexahedron20": {"element": "hexahedron", "order": 2},
}
TETWILD = {
    "tetwild-fast": {"quality": "fast", "order": 1},
    "tetwild-good": {"quality": "good", "order": 1},
    "tetwild-good-10": {"quality": "good", "order": 2},
}
#: Both ventricles, from the label map to the mesh.
VENTRICLES = {"tetwild-biv": {}, "tetwild-biv-blood": {"blood_pool": True}}
EDGE, VENTRICLES_EDGE = 4.0, 3.5
#: Runs of fTetWild that a baseline is the least of.
RUNS = 6
#: Kinds by case: all of them on one phantom, a few on the others.
KINDS = {
    "round": (*SWEPT, *TETWILD),
    "flat": ("sweep-tetra", "sweep-hexahedron", "tetwild-good"),
    "ventricles": tuple(VENTRICLES),
    "patient021_frame13": ("sweep-tetra", "sweep-wedge", "sweep-hexahedron"),
    "patient041_frame01": ("sweep-tetra", "sweep-wedge", "sweep-hexahedron"),
    "patient084_frame01": ("sweep-tetra", "sweep-wedge", "sweep-hexahedron"),
}


@cache
def surfaces(case: str) -> tuple[Surface, Surface, Plane]:
    """Endocardium, epicardium and base plane, from the label map as in the main job."""
    seg = segmentation(case)
    outer = seg.object("lv", "myo")
    endo = fp.fit_surface(seg.object("lv"))
    return endo, fp.fit_surface(outer, boundary=fp.extend_apex(seg, outer, endo=endo)), fp.find_base(seg)


def segmentation(case: str) -> Segmentation:
    if case in PHANTOMS:
        return lv_ellipsoid(*PHANTOMS[case]).segmentation(spacing=(1.4, 1.4, 8.0))
    if case == "ventricles":
        return biventricular().segmentation(spacing=(1.4, 1.4, 8.0))
    folder = Path(os.environ["FEMPREP_DATA"]) / "acdc" / "training" / case[:10]
    return fp.read_segmentation(folder / f"{case}_gt.nii.gz", preset="acdc")


@cache
def matched(case: str, template: str) -> MatchedSurfaces:
    """Both surfaces of a case on one cup."""
    endo, epi, base = surfaces(case)
    return match_surfaces(endo=endo, epi=epi, base=base, template=template, edge_length=EDGE)


def make(case: str, kind: str) -> VolumeMesh:
    """The mesh of one case."""
    if kind in SWEPT:
        return sweep(matched(case, "quad" if "hexahedron" in kind else "triangle"), **SWEPT[kind])
    if kind in VENTRICLES:
        volume = {"edge_length": VENTRICLES_EDGE}
        return fp.mesh_segmentation(segmentation(case), anatomy="biv", volume=volume, **VENTRICLES[kind]).mesh
    endo, epi, base = surfaces(case)
    wall = fp.build_wall(epi=epi, endo={"lv": endo}, base=base)
    return fp.tetrahedralize(wall, edge_length=EDGE, **TETWILD[kind])


def figures(mesh: VolumeMesh) -> dict[str, float]:
    """What is held: the worst and the mean elements, and that none is inverted."""
    ((name, cells),) = mesh.cells.items()
    found = element_measures(mesh.points, cells, name)
    return {
        "smallest_dihedral": float(found["minimum_dihedral"].min()),
        "first_percentile_dihedral": float(np.percentile(found["minimum_dihedral"], 1)),
        "smallest_scaled_jacobian": float(found["scaled_jacobian"].min()),
        "smallest_relative_jacobian": float(found["relative_jacobian"].min()),
        "smallest_mean_ratio": float(found["mean_ratio"].min()),
        "mean_of_mean_ratio": float(found["mean_ratio"].mean()),
    }


#: How far a figure may fall below its baseline.
TOLERANCES = {
    "sweep": {"smallest_dihedral": 2.0, "first_percentile_dihedral": 1.0, "smallest_scaled_jacobian": 0.04,
              "smallest_relative_jacobian": 0.04, "smallest_mean_ratio": 0.04, "mean_of_mean_ratio": 0.005},
    "tetwild": {"smallest_dihedral": 4.0, "first_percentile_dihedral": 1.5, "smallest_scaled_jacobian": 0.1,
                "smallest_relative_jacobian": 0.15, "smallest_mean_ratio": 0.1, "mean_of_mean_ratio": 0.01},
}  # fmt: skip


def main() -> None:
    old = json.loads(BASELINE.read_text())["cases"] if BASELINE.exists() else {}
    cases = {}
    words = sys.argv[1:]
    for case in (*PHANTOMS, "ventricles", *(ACDC if "FEMPREP_DATA" in os.environ else ())):
        for kind in KINDS[case]:
            key = f"{case} {kind}"
            if words and not any(word in key for word in words):
                continue
            found = [figures(make(case, kind)) for _ in range(RUNS if kind.startswith("tetwild") else 1)]
            cases[key] = {name: float(f"{min(one[name] for one in found):.4g}") for name in found[0]}
            print(key, *(f"{n} {old.get(key, {}).get(n, '-')} -> {v}" for n, v in cases[key].items()), sep="\n    ")
            sys.stdout.flush()
    kept = {key: value for key, value in old.items() if key not in cases}
    record = {"edge_length_mm": EDGE, "tolerances": TOLERANCES, "cases": {**kept, **cases}}
    BASELINE.write_text(json.dumps(record, indent=2) + "\n")


if __name__ == "__main__":
    main()
