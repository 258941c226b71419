"""The same hearts stored, moved and written in every other way: how far surfaces come out apart, and what differs.

    FEMPREP_DATA=... python tests/benchmarks/bench_same_heart.py --maps 20 --table same.md --out same.csv
    FEMPREP_DATA=... python tests/benchmarks/bench_same_heart.py --maps 3 --mesh --ways "another way in all"

Of each map the left ventricle's surfaces are fitted, as for a mesh of it, and the right ventricle's, and both
anatomies are laid out and checked. ``--mesh`` sweeps the left ventricle as well. Answers are the same where each
anatomy is accepted or refused for the same reason, and the mesh, where it is made, is judged alike. Mirrored hearts
are compared as bodies. A fit that is handed the very bytes of an earlier one is not done again, unless with
``--repeat``: it is deterministic.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from rows import keep, shown

sys.path[:0] = [str(Path(__file__).resolve().parent.parent)]

from same_heart import WAYS, Way, moved  # noqa: E402

import femprep as fp  # noqa: E402
from femprep.model.stages import Stages  # noqa: E402
from femprep.options import Options  # noqa: E402
from femprep.pipeline import begin, fit_surfaces  # noqa: E402
from femprep.surface.fitting import smooth  # noqa: E402
from femprep.wall.anatomies import left_ventricle  # noqa: E402

_MIRROR = np.diag([-1.0, 1.0, 1.0])
MIRRORED = "mirrored"
ALL = {**WAYS, MIRRORED: Way(lambda seg: moved(seg, _MIRROR, np.zeros(3)), _MIRROR)}


def remembered(fit: Callable[..., Any]) -> Callable[..., Any]:
    """The fit of a surface at rest, done once for the same bytes."""
    known: dict[str, Any] = {}

    def fitted(obj: Any, beginning: Any, evidence: Any, goal: Any, slices: Any) -> Any:
        given = [obj.mask, obj.grid.spacing, obj.grid.direction, obj.grid.offset_at(np.arange(obj.mask.shape[2]))]
        given += [*vars(evidence).values(), goal.directions, goal.cells]
        key = sha256(repr((beginning, goal.connectivity, goal.curvature, obj.mask.shape)).encode())
        for one in given:
            key.update(np.ascontiguousarray(one).tobytes())
        if key.hexdigest() not in known:
            known[key.hexdigest()] = fit(obj, beginning, evidence, goal, slices)
        return known[key.hexdigest()]

    return fitted


def answer(act: Callable[[], Any]) -> tuple[Any, str]:
    """What came of it, and in words: a refusal without its numbers, which are those of the file."""
    try:
        return act(), "made"
    except fp.FemprepError as error:
        return None, type(error).__name__ + " " + re.sub(r"\(axis .\)|[-\d.]+", "", str(error))[:90]


def made(seg: fp.Segmentation, vertices: int, meshed: bool) -> tuple[dict[str, fp.Surface], list[str]]:
    """Surfaces of a heart, and the answers to it."""
    options = Options(preset="acdc", surface={"vertices": vertices}, volume={"mesher": "sweep"})
    both = options.model_copy(update={"anatomy": "biv"})
    begun, words = answer(lambda: begin(seg, options, Stages(None)))
    answers = [words, answer(lambda: begin(seg, both, Stages(None)))[1]]
    surfaces: dict[str, fp.Surface] = {}
    if begun is not None:
        parts, words = answer(lambda: left_ventricle(*begun[:2], options, Stages(None)))
        surfaces = dict(parts.surfaces) if parts else {}
        answers.append(words)
    right, words = answer(lambda: fit_surfaces(seg, {"rv": ("rv",)}, options).surfaces)
    answers.append(words)
    if meshed:
        run, words = answer(lambda: fp.mesh_segmentation(seg, options))
        answers.append(f"{run.quality.passed} {len(run.mesh.points)}" if run else words)
    return surfaces | (right or {}), answers


def compared(one: dict[str, fp.Surface], other: dict[str, fp.Surface], name: str) -> dict[str, float]:
    """How far surfaces are apart, mm: their vertices, or mirrored ones as bodies."""
    way = ALL[name]
    if name == MIRRORED:
        far = []
        for key, surface in other.items():
            back = replace(surface, points=way.back(surface.points), cells=surface.cells[:, ::-1])
            distance = fp.compare_surfaces(back, one[key]).distance
            far.append((distance.mean, distance.max))
        return {"mean": max(f[0] for f in far), "max": max(f[1] for f in far)}
    same = all(np.array_equal(one[key].cells, surface.cells) for key, surface in other.items())
    far = [np.linalg.norm(way.back(s.points) - one[key].points, axis=1) for key, s in other.items()] if same else []
    return {"mean": max((f.mean() for f in far), default=np.inf), "max": max((f.max() for f in far), default=np.inf)}


def table(rows: list[dict[str, Any]]) -> str:
    """Rows by way, as Markdown."""
    lines = ["| way | hearts | the same answers | surfaces within 1e-9 mm | in the mean, mm | farthest, mm |"]
    lines.append("|---|---|---|---|---|---|")
    for name in dict.fromkeys(row["way"] for row in rows):
        own = [row for row in rows if row["way"] == name]
        near, far = sum(row["max"] < 1e-9 for row in own), max(row["max"] for row in own)
        mean = max(row["mean"] for row in own)
        lines.append(f"| {name} | {len(own)} | {sum(row['same'] for row in own)} | {near} | {mean:.2g} | {far:.2g} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Command line of this script."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--maps", type=int, default=20, help="maps, spread evenly over those there are")
    parser.add_argument("--ways", nargs="*", choices=list(ALL), default=list(ALL))
    parser.add_argument("--vertices", type=int, default=300)
    parser.add_argument("--mesh", action="store_true")
    parser.add_argument("--repeat", action="store_true", help="repeat fits of the same bytes")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--table", type=Path)
    given = parser.parse_args()
    if not given.repeat:
        smooth._fitted = remembered(smooth._fitted)
    maps = sorted((Path(os.environ["FEMPREP_DATA"]) / "acdc" / "training").glob("*/*_gt.nii.gz"))
    rows: list[dict[str, Any]] = []
    for path in maps[:: max(len(maps) // given.maps, 1)][: given.maps]:
        heart = fp.read_segmentation(path, preset="acdc")
        surfaces, answers = made(heart, given.vertices, given.mesh)
        for name in given.ways:
            others, theirs = made(ALL[name].change(heart), given.vertices, given.mesh)
            row = {"map": path.name.removesuffix("_gt.nii.gz"), "way": name, "same": theirs == answers}
            rows.append({**row, **compared(surfaces, others, name), "answers": "; ".join(theirs)})
            print(shown(rows[-1]), flush=True)
        if given.out:
            keep(rows, given.out)
        if given.table:
            given.table.write_text(table(rows))
    print(table(rows))


if __name__ == "__main__":
    main()
