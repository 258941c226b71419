"""What each measure of the smooth surface gains: each left out in turn, on hearts whose true surface is known.

    python tests/benchmarks/bench_ablation.py                     Rodero 01 and phantoms, as bench_surfaces.py
    python tests/benchmarks/bench_ablation.py --cases phantoms --seed 3

Symmetric mean distance to the truth between the first and the last slice centre, mm, and mean angle of the normals,
degrees; the last column is the mean ratio of the distances to those of the best other method.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from bench_surfaces import RODERO_LABELS, Case, phantoms, rodero

from femprep.model import Surface
from femprep.surface import end_planes, fit_surface, surface_distance
from femprep.surface.estimate import estimate, evidence
from femprep.surface.reference import METHODS

#: Constants replaced by module, for each measure left out.
WITHOUT: dict[str, dict[tuple[Any, str], Any]] = {
    "all measures": {},
    "sharp rims bend as evenly as the rest": {(estimate, "_EDGES"): 99},
    "a face counts by its voxel alone, not by its slant": {
        (estimate, "_OBLIQUE"): 10.0,
        # The weight of all faces falls by about this: the stiffness with it.
        (estimate, "_STIFFNESS"): tuple(s / 20.0 for s in estimate._STIFFNESS),
    },
    "voxel centres may lie on the wrong side": {(estimate, "_WRONG"): 1e6},
    "nothing from faces between slices": {(estimate, "_BETWEEN"): (1e-6, 1e-6)},
    "faces between slices at their middle": {(evidence, "_STRAIGHT"): 0.0},
    "a tenth of the stiffness": {(estimate, "_STIFFNESS"): tuple(s / 10.0 for s in estimate._STIFFNESS)},
    "ten times the stiffness": {(estimate, "_STIFFNESS"): tuple(s * 10.0 for s in estimate._STIFFNESS)},
}


@contextmanager
def replaced(changes: dict[tuple[Any, str], Any]) -> Iterator[None]:
    """Constants of modules replaced for a while."""
    with ExitStack() as stack:
        for (module, name), value in changes.items():
            stack.enter_context(mock.patch.object(module, name, value))
        yield


def figures(case: Case, surface: Surface) -> tuple[float, float]:
    """Distance and angle."""
    found = surface_distance(surface, case.truth, between=end_planes(case.obj))
    return found.both.mean, found.normals.mean


def main() -> None:
    """Read the arguments, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", choices=("rodero", "phantoms"), default=["rodero", "phantoms"])
    parser.add_argument("--chambers", nargs="+", default=["lv", "rv", "la", "ra", "epi"])
    parser.add_argument("--spacing", nargs=3, type=float, default=[1.4, 1.4, 8.0], help="voxels of the phantoms, mm")
    parser.add_argument("--supersample", type=int, default=1, help="partial volume from n x n x n points a voxel")
    parser.add_argument("--seed", type=int, help="move and tilt the phantoms on the grid")
    arguments = parser.parse_args()
    cases: list[Case] = []
    if "rodero" in arguments.cases:
        if "FEMPREP_DATA" not in os.environ:
            parser.error("Rodero 01 needs the environment variable FEMPREP_DATA; or give --cases phantoms")
        cases.extend(rodero(Path(os.environ["FEMPREP_DATA"]), [c for c in arguments.chambers if c in RODERO_LABELS]))
    if "phantoms" in arguments.cases:
        cases.extend(phantoms(arguments.chambers, arguments.spacing, arguments.supersample, arguments.seed))

    others: list[Callable[[Any], Surface]] = [METHODS[name] for name in METHODS if name.startswith("slice-wise")][:2]
    best = [min(figures(case, method(case.obj)) for method in others) for case in cases]
    print("| | " + " | ".join(case.name for case in cases) + " | ratio |")
    print("|---" * (len(cases) + 2) + "|")
    print("| best other method | " + " | ".join(f"{d:.3f} / {a:.1f}" for d, a in best) + " | 1.00 |", flush=True)
    for name, changes in WITHOUT.items():
        with replaced(changes):
            row = [figures(case, fit_surface(case.obj, method="smooth", vertices=1252)) for case in cases]
        ratio = float(np.mean([own[0] / other[0] for own, other in zip(row, best)]))
        print(f"| {name} | " + " | ".join(f"{d:.3f} / {a:.1f}" for d, a in row) + f" | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main()
