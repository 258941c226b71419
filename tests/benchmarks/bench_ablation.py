"""What each measure of the smooth surface gains: each left out in turn, on hearts whose true surface is known.

    python tests/benchmarks/bench_ablation.py --csv ablation.csv                          all of it: takes an hour
    python tests/benchmarks/bench_ablation.py --csv ablation.csv --scenarios "8 mm" "CT heart"

Symmetric mean distance to the truth between the first and the last slice centre, mm, at 2,500 triangles. Phantoms: LV,
crescent RV at end-diastole and end-systole, atrium with an appendage, whole heart; by default on a grid moved and
tilted at random. The CT heart is Rodero 01 and needs FEMPREP_DATA. Lines go to the file as they come, and what stands
there is not run again; the tables are made of the whole file.
"""

from __future__ import annotations

import argparse
import csv
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from bench_surfaces import RODERO_LABELS, Case, phantoms, placed, rodero

from femprep.model import Surface
from femprep.surface import end_planes, fit_surface, surface_distance
from femprep.surface.estimate import estimate, observations
from femprep.surface.fit import TABLE_1
from femprep.surface.fitting import smooth
from femprep.surface.reference import METHODS
from femprep.surface.reference.side_by_side import VERTICES

BODIES = ("lv", "rv crescent", "rv crescent, end-systolic", "la", "whole heart")
#: Voxels, points across a voxel (more than one: partial volume), seed of the grid's place, slice shifts in mm.
SCENARIOS: dict[str, dict[str, Any]] = {
    "8 mm": {},
    "8 mm, along the axes": {"seed": None},
    "8 mm, partial volume": {"supersample": 4},
    "5 mm": {"spacing": [1.4, 1.4, 5.0]},
    "10 mm": {"spacing": [1.4, 1.4, 10.0]},
    "8 mm, slices shifted by 1 mm": {"shift": 1.0},
}
HEART, MOVED = "CT heart", "CT heart, moved and tilted"

Change = tuple[Any, str, Any]
#: Names in modules that are replaced, and options, for each measure left out or changed.
SMOOTH: dict[str, tuple[list[Change], dict[str, Any]]] = {
    "smooth, all measures": ([], {}),
    "without: stiffness chosen from the data (one for all)": (
        [(estimate, "_SOFTEST", 1000.0), (estimate, "_STIFFEST", 1000.0)],
        {},
    ),
    "without: faces between slices placed by interpolation": ([(observations, "_INTERPOLATED", 0.0)], {}),
    "without: faces between slices": ([(estimate, "_BETWEEN", (1e-6, 1e-6))], {}),
    "without: a face weighted by its slant": (
        # The weight of all faces falls by about twenty, and the bounds with it.
        [(estimate, "_OBLIQUE", 10.0), (estimate, "_SOFTEST", 15.0), (estimate, "_STIFFEST", 5000.0)],
        {},
    ),
    "without: sharp rims spared": ([(estimate, "_LEAST", 1.0)], {}),
    "without: voxel centres on their side": ([(estimate, "_WRONG", 1e6)], {}),
    "without: corners set out by the chords": ([(smooth, "outset", lambda surface, area: surface)], {}),
    "a quarter of the chosen stiffness": ([(estimate, "_ALIKE", 1.0)], {}),
    "four times the chosen stiffness": ([(estimate, "_ALIKE", 16.0)], {}),
    "triangles finer where curved (curvature_sizing=0.5)": ([], {"curvature_sizing": 0.5}),
}
OTHERS = ("slice-wise distance, Taubin", "slice-wise distance, Akima, Taubin")


@contextmanager
def replaced(changes: list[Change]) -> Iterator[None]:
    """Names of modules replaced for a while."""
    with ExitStack() as stack:
        for module, name, value in changes:
            stack.enter_context(mock.patch.object(module, name, value))
        yield


def methods(chamber: str) -> dict[str, Callable[[Any], Surface]]:
    """The methods in use, the harmonic surfaces, and the smooth one with each measure left out."""

    def without(changes: list[Change], options: dict[str, Any]) -> Callable[[Any], Surface]:
        def fit(obj: Any) -> Surface:
            with replaced(changes):
                return fit_surface(obj, method="smooth", vertices=VERTICES, **options)

        return fit

    numbers = {name: count for name, count in TABLE_1[chamber].items() if name != "vertices"}
    return {
        **{name: METHODS[name] for name in OTHERS},
        "paper, its M and K": lambda obj: fit_surface(obj, method="paper", vertices=VERTICES, **numbers),
        "paper, M and K from the object": lambda obj: fit_surface(obj, method="paper", vertices=VERTICES),
        "even: smoothed as far as sound, vertices moved": lambda obj: fit_surface(
            obj, method="even", vertices=VERTICES
        ),
        **{name: without(*measure) for name, measure in SMOOTH.items()},
    }


def cases(wanted: list[str], seed: int) -> Iterator[tuple[str, Case]]:
    """Scenario and object, one by one."""
    chambers = ["lv", "rv", "la", "ra", "epi"]
    for name, changes in SCENARIOS.items():
        if name in wanted:
            given = {"spacing": [1.4, 1.4, 8.0], "supersample": 1, "seed": seed, **changes}
            for case in phantoms(chambers, **given):
                if case.name.removeprefix("phantom ") in BODIES:
                    yield name, case
    for name in (HEART, MOVED):
        if name in wanted and "FEMPREP_DATA" in os.environ:
            for case in rodero(Path(os.environ["FEMPREP_DATA"]), list(RODERO_LABELS)):
                yield name, case if name == HEART else placed(case, [1.4, 1.4, 8.0], 1, seed)


def tables(rows: list[dict[str, str]]) -> None:
    """By scenario, means over the bodies; the objects of each scenario one by one. A dagger: some were left out."""
    value = {(r["scenario"], r["case"], r["method"]): float(r["mean"]) for r in rows if r["mean"]}
    names = list(dict.fromkeys(r["method"] for r in rows))
    scenarios = list(dict.fromkeys(r["scenario"] for r in rows))
    objects = {s: list(dict.fromkeys(r["case"] for r in rows if r["scenario"] == s)) for s in scenarios}

    def mean(scenario: str, method: str, some: list[str]) -> str:
        found = [value[key] for case in some if (key := (scenario, case, method)) in value]
        return f"{np.mean(found):.3f}{'' if len(found) == len(some) else ' †'}" if found else "-"

    def show(columns: dict[str, tuple[str, list[str]]]) -> None:
        print("\n| | " + " | ".join(columns) + " |\n" + "|---" * (len(columns) + 1) + "|")
        for method in names:
            print(f"| {method} | " + " | ".join(mean(s, method, some) for s, some in columns.values()) + " |")

    show({scenario: (scenario, objects[scenario]) for scenario in scenarios})
    for scenario in scenarios:
        print(f"\n{scenario}:")
        show({case.split(", placement")[0]: (scenario, [case]) for case in objects[scenario]})


def main() -> None:
    """Read the arguments, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    everything = [*SCENARIOS, HEART, MOVED]
    parser.add_argument("--scenarios", nargs="+", choices=everything, default=everything)
    parser.add_argument("--methods", nargs="+", help="names of methods, or the beginnings of names; all by default")
    parser.add_argument("--seed", type=int, default=7, help="of the grid's place")
    parser.add_argument("--csv", type=Path, required=True, help="figures, kept as they come")
    arguments = parser.parse_args()
    rows: list[dict[str, str]] = []
    if arguments.csv.exists():
        with arguments.csv.open(newline="") as stream:
            rows = list(csv.DictReader(stream))
    done = {(r["scenario"], r["case"], r["method"]) for r in rows}
    with arguments.csv.open("a", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=["scenario", "case", "method", "mean", "normals"])
        if not rows:
            writer.writeheader()
        for scenario, case in cases(arguments.scenarios, arguments.seed):
            for name, method in methods(case.chamber).items():
                if (scenario, case.name, name) in done:
                    continue
                if arguments.methods and not any(name.startswith(wanted) for wanted in arguments.methods):
                    continue
                found = surface_distance(method(case.obj), case.truth, between=end_planes(case.obj), samples=20_000)
                row = [scenario, case.name, name, f"{found.both.mean:.4f}", f"{found.normals.mean:.2f}"]
                rows.append(dict(zip(writer.fieldnames, row)))
                writer.writerow(rows[-1])
                stream.flush()
    tables(rows)


if __name__ == "__main__":
    main()
