"""Run cases of damaged input, each in a process of its own, and write what came of them as a table.

    python tests/fuzz/run.py --cases 1000 --seed 1 --records cases.jsonl --table table.md

Cases are the same for a seed. Those already among the records are not run again, so that a run can be taken up. Maps
of patients come along where ``FEMPREP_DATA`` names the folder they are in.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from importlib import import_module
from itertools import count
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parent.parent)]
# Each case is run in a fork, which GNU OpenMP does not survive.
os.environ["NUMBA_THREADING_LAYER"] = "workqueue"

from fuzz.cases import KINDS, ODD, REAL, make_case  # noqa: E402
from fuzz.judge import Outcome, fresh, run  # noqa: E402
from fuzz.sources import Sources  # noqa: E402

#: Of each round of cases, so many are of each kind: fewer of those that mesh.
SHARES = {
    "labels": 2,
    "header": 6,
    "bytes": 6,
    "affine": 3,
    "options": 6,
    "toml": 5,
    "mesh file": 10,
    "surface file": 6,
    "annotate": 8,
    "refine": 4,
    "transfer": 4,
    "activate": 4,
    "template": 4,
    "own surfaces": 3,
    "masks": 4,
    "segments": 5,
    "frames": 4,
    "second images": 3,
    "table": 4,
    REAL: 1,
    ODD: 3,
}
_STATUS = {0: "made, passed", 1: "made, a check failed", 2: "refused", 3: "a stage failed"}


def numbered(kinds: Iterable[str]) -> Iterator[tuple[str, int]]:
    """Kinds and numbers of cases without end, the kinds by their shares."""
    order = [kind for kind in kinds for _ in range(SHARES[kind])]
    seen: Counter[str] = Counter()
    for index in count():
        kind = order[index * 7 % len(order)] if len(order) % 7 else order[index % len(order)]
        yield kind, seen[kind]
        seen[kind] += 1


def load() -> None:
    """Load what commands need, for forks to have it; nothing is run here: threads do not outlive a fork."""
    own = ("cli._app", "cli.mesh", "cli._summary", "pipeline", "report.output", "export", "volume")
    own += ("cli.annotate", "annotation", "report.annotated", "anatomy.transfer", "activation", "own_surfaces")
    others = ("SimpleITK", "pyvista", "meshio", "h5py", "trimesh", "manifold3d", "scipy.spatial", "scipy.sparse.linalg")
    for name in (*(f"femprep.{name}" for name in own), *others):
        import_module(name)
    gc.collect()
    gc.freeze()  # a fork then copies less


def table(outcomes: list[Outcome]) -> str:
    """Counts by kind and by what came of them, and seconds, as Markdown."""
    head = " | ".join(_STATUS.values())
    lines = [f"| kind | cases | {head} | fell short | median, s | longest, s | over five medians |"]
    lines.append("|---" * (len(_STATUS) + 6) + "|")
    slow = slower(outcomes)
    for kind in [*(k for k in KINDS if any(o.kind == k for o in outcomes)), "all"]:
        own = [o for o in outcomes if kind in (o.kind, "all")]
        counts = [sum(o.status == status and not o.fault for o in own) for status in _STATUS]
        short, seconds = sum(bool(o.fault) for o in own), [o.seconds for o in own]
        late = sum(row in slow for row, o in enumerate(outcomes) if kind in (o.kind, "all"))
        figures = [len(own), *counts, short, f"{np.median(seconds):.2g}", f"{max(seconds):.2g}", late]
        lines.append(f"| {kind} | " + " | ".join(map(str, figures)) + " |")
    return "\n".join(lines) + "\n"


def slower(outcomes: list[Outcome]) -> set[int]:
    """Rows of the cases that took a second and more than five times the median of those like them.

    Like each other are cases of a kind that end in the same status and may come to be meshed, or are read alone.
    """
    groups: dict[tuple[str, int, bool], list[float]] = {}
    for o in outcomes:
        groups.setdefault((o.kind, o.status, o.meshes), []).append(o.seconds)
    return {
        row
        for row, o in enumerate(outcomes)
        if o.seconds > max(1.0, 5.0 * float(np.median(groups[o.kind, o.status, o.meshes])))
    }


def recorded(path: Path, seed: int | None = None) -> list[Outcome]:
    """Outcomes among the records of a file, of a seed or of all."""
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    return [
        Outcome(**{name: value for name, value in row.items() if name != "seed"})
        for row in rows
        if seed in (None, row["seed"])
    ]


def main() -> None:
    """Command line of this script."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="*", choices=list(KINDS))
    parser.add_argument("--only", type=int, nargs="*", help="numbers of cases of the kinds")
    parser.add_argument("--records", type=Path, default=Path("cases.jsonl"))
    parser.add_argument("--table", type=Path)
    parser.add_argument("--read-only", action="store_true", help="leave out cases that may come to be meshed")
    parser.add_argument("--keep", type=Path, help="folder in which cases that fall short are kept")
    parser.add_argument("--sum", type=Path, nargs="*", help="no run: the table over records of these files")
    given = parser.parse_args()
    kinds = given.kinds or [kind for kind in KINDS if kind != REAL or "FEMPREP_DATA" in os.environ]
    if given.sum:
        print(table([one for path in given.sum for one in recorded(path)]))
        return
    outcomes = recorded(given.records, given.seed)
    done = {(o.kind, o.number) for o in outcomes}
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        folder = Path(name)
        sources = Sources(folder / "sources")
        load()
        wanted = numbered(kinds)
        if given.only:
            wanted = ((kind, number) for kind in kinds for number in given.only)
        for kind, number in wanted:
            if len(outcomes) >= given.cases and not given.only:
                break
            if (kind, number) in done and not given.only:
                continue
            place = fresh((given.keep.absolute() if given.keep else folder) / f"{kind.split()[0]}-{number}")
            case = make_case(kind, given.seed, number, sources, place)
            if given.read_only and case.meshes:
                fresh(place).rmdir()
                continue
            outcome = run(case, place)
            if not given.keep or (not outcome.fault and not given.only):
                fresh(place).rmdir()
            outcomes.append(outcome)
            with given.records.open("a") as file:
                file.write(json.dumps({"seed": given.seed, **outcome.record()}) + "\n")
            if outcome.fault or given.only:
                print(kind, number, outcome.what, "->", outcome.status, outcome.fault, "|", outcome.line, flush=True)
    print(table(outcomes))
    if given.table:
        given.table.write_text(table(outcomes))


if __name__ == "__main__":
    main()
