"""Which way of a surface fit is taken how often: ACDC, Rodero's heart, the pig's and the phantoms; prints tables.

    python tests/benchmarks/bench_ways.py                          all of them, the left and the right ventricle of each
    python tests/benchmarks/bench_ways.py --every 10 --others      one ACDC map in ten, and all that are not ACDC's
    python tests/benchmarks/bench_ways.py --maps patient029_frame01 --objects rv

Each object is fitted to the boundary points that the pipeline gives it: LV + myocardium goes on where its labels end.
Ways that no heart takes are told last. Needs FEMPREP_DATA. A line per fit in CSV goes to --csv.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from bench_acdc import cases
from hash_meshes import PHANTOMS
from rows import keep

import femprep as fp
from femprep.model.stages import Stages
from femprep.pipeline import begin
from femprep.surface.fitting.ways import BEGINNINGS, FALLBACK, LAYING_WAYS

#: Other hearts, with the anatomy that their labels have.
RODERO: Final = {"lv": 1, "myo": 2, "rv": 3, "rv_wall": 4, "la": 5, "la_wall": 6, "ra": 7, "ra_wall": 8}
OTHERS: Final[dict[str, tuple[str, dict[str, int], str]]] = {
    "rodero01 1 mm": ("rodero01/rodero01_4ch_1.0mm_label.nii.gz", RODERO, "whole-heart"),
    "rodero01 stack": ("rodero01/rodero01_sax_4ch_1.4x1.4x8_label.nii.gz", RODERO, "whole-heart"),
    "rodero01 vent": ("rodero01/rodero01_sax_vent_1.5x1.5x10_label.nii.gz", {"lv": 3, "myo": 2, "rv": 1}, "biv"),
    "pig ED": ("pig/ep_pig_E774_SAX_ED_phase00_slices6-19_label.nii.gz", {"lv": 1, "myo": 2}, "lv"),
    "pig ES": ("pig/ep_pig_E774_SAX_ES_phase11_slices6-19_label.nii.gz", {"lv": 1, "myo": 2}, "lv"),
}
#: The column that the objects of every anatomy go to.
COLUMNS: Final = {"lv": "lv", "epi": "lv + myo", "lv_epi": "lv + myo", "rv": "rv"}
Heart = Callable[[], tuple[fp.Segmentation, str]]


def hearts(data: Path, every: int, maps: list[str] | None, others: bool) -> Iterator[tuple[str, str, Heart]]:
    """Where each heart is from, its name, and what gives its segmentation and anatomy."""
    for row in [row for row in cases(data) if row["id"] in maps] if maps else cases(data)[::every]:
        path = data / "acdc" / row["file"]
        yield "ACDC", row["id"], lambda path=path: (fp.read_segmentation(path, preset="acdc"), "biv")
    if not others:
        return
    for name, (file, labels, anatomy) in OTHERS.items():
        given = data / file, labels, anatomy
        yield "other", name, lambda given=given: (fp.read_segmentation(given[0], structures=given[1]), given[2])
    for name, (phantom, anatomy) in PHANTOMS.items():
        made = phantom, anatomy
        yield "phantom", name, lambda made=made: (made[0]().segmentation(spacing=(1.8, 1.8, 9.0)), made[1])


def fits(heart: Heart, wanted: list[str] | None) -> Iterator[tuple[str, fp.Surface | Exception]]:
    """Each object of a heart with its surface, or why there is none."""
    seg, anatomy = heart()
    if anatomy == "surfaces":
        objects = {name: seg.object(name, name=name) for name in seg.structures}
    else:
        seg, layout, _ = begin(seg, fp.Options(anatomy=anatomy), Stages(None))
        objects = dict(layout.objects)
    fitted: dict[str, fp.Surface] = {}
    for name, obj in objects.items():
        if wanted and COLUMNS.get(name, name) not in wanted and not (name == "lv" and "lv + myo" in wanted):
            continue
        try:
            outer = name in ("epi", "lv_epi") and anatomy in ("lv", "biv")
            boundary = fp.extend_apex(seg, obj, endo=fitted.get("lv")) if outer else None
            fitted[name] = fp.fit_surface(obj, boundary=boundary)
            yield name, fitted[name]
        except fp.FemprepError as error:
            yield name, error


def run(source: str, name: str, heart: Heart, wanted: list[str] | None) -> Iterator[dict[str, Any]]:
    """A row per fit."""
    start = time.perf_counter()
    try:
        for key, surface in fits(heart, wanted):
            row = {"source": source, "case": name, "object": COLUMNS.get(key, "other chambers")}
            if isinstance(surface, Exception):
                row |= {"beginning": "none", "way": str(surface), "tried": 0}
            else:
                tried = surface.info["attempts"]
                taken = next(one for one in tried if one["status"] == "taken")
                row |= {key: taken.get(key) for key in ("beginning", "way", "greatest_pixels", "least_quality")}
                row["tried"] = len(tried)
            yield row | {"seconds": time.perf_counter() - start}
            start = time.perf_counter()
    except fp.FemprepError as error:
        yield {"source": source, "case": name, "object": "all", "beginning": "none", "way": str(error), "tried": 0}


def table(rows: list[dict[str, Any]]) -> None:
    """Surfaces by way and object, of each source; then the ways that none took."""
    ways = [(one.name, way.name) for one in BEGINNINGS for way in LAYING_WAYS if not (one.drawn and way.known)]
    ways.append(FALLBACK)
    for source in dict.fromkeys(row["source"] for row in rows):
        own = [row for row in rows if row["source"] == source]
        columns = [name for name in ("lv", "lv + myo", "rv", "other chambers") if any(r["object"] == name for r in own)]
        print(f"\n| {source}: surfaces that took it | {' | '.join(columns)} |")
        print("|---|" + "---|" * len(columns))
        for way in ways:
            counts = [sum((r["beginning"], r["way"]) == way for r in own if r["object"] == name) for name in columns]
            print(f"| {', '.join(way)} | {' | '.join(map(str, counts))} |")
        tried = [[r["tried"] for r in own if r["object"] == name and r["tried"]] for name in columns]
        print(f"| ways tried: mean, most | {' | '.join(f'{np.mean(t):.1f}, {max(t)}' for t in tried if t)} |")
        for row in own:
            if row["beginning"] == "none":
                print(f"    no surface: {row['case']} {row['object']}: {row['way']}")
    taken = Counter((row["beginning"], row["way"]) for row in rows)
    print("\nnever taken: " + ("; ".join(", ".join(way) for way in ways if not taken[way]) or "none"))
    known = {*ways, ("none", "")}
    print("not in the table: " + (", ".join(f"{w}" for w in taken if w not in known and w[0] != "none") or "none"))


def main() -> None:
    """Fit everything, print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=int, default=1, help="one ACDC map in so many")
    parser.add_argument("--maps", nargs="*", help="ACDC maps by name, these alone")
    parser.add_argument("--others", action="store_true", help="the other hearts and the phantoms, too")
    parser.add_argument("--objects", nargs="+", choices=sorted({*COLUMNS.values()}), help="these alone")
    parser.add_argument("--csv", type=Path, help="file for a line per fit")
    given = parser.parse_args()
    rows: list[dict[str, Any]] = []
    everything = not (given.maps or given.every > 1 or given.objects)
    chosen = hearts(Path(os.environ["FEMPREP_DATA"]), given.every, given.maps, given.others or everything)
    for source, name, heart in chosen:
        for row in run(source, name, heart, given.objects):
            rows.append(row)
            print(*row.values(), flush=True)
        if given.csv:
            keep(rows, given.csv)
    table(rows)


if __name__ == "__main__":
    main()
