"""What refusals and failed checks advise, followed where it is an option: how often a mesh comes of it, by reason.

    FEMPREP_DATA=... python tests/benchmarks/bench_advice.py --cohort OUT/cohort.tsv --options "--edge-length 5"
    FEMPREP_DATA=... python tests/benchmarks/bench_advice.py --fuzz cases.jsonl --table table.md --out rows.jsonl
    python tests/benchmarks/bench_advice.py --sum rows.jsonl more.jsonl --table table.md
    python tests/benchmarks/bench_advice.py --cases --table table.md

``--cohort`` takes the subjects of an earlier run of ``femprep cohort`` over the ACDC maps that did not pass, with the
options it had; where ``--then "OTHER/cohort.tsv --correct-shifts"`` names a run in which advice of theirs was followed
already, what came of it is taken from there. ``--fuzz`` takes the label maps that did not pass among the records of
``tests/fuzz/run.py``. Each is run again with the first option that its line names and that has not been followed, until
it passes or names no more. Options it names without a figure are taken as: ``--edge-length`` six tenths of what it was,
``--vertices`` twice. ``--cases`` follows each advice of the small inputs of ``tests/advice_cases.py`` by itself, and
names the functions of the package that advise and that none of them reaches.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import csv
import io
import json
import logging
import os
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parent.parent)]

from advice_cases import cases, followed  # noqa: E402
from fuzz.cases import REAL, make_case  # noqa: E402
from fuzz.sources import Sources  # noqa: E402

import femprep  # noqa: E402
from femprep.cli._app import app  # noqa: E402
from femprep.cohort.reasons import DONE, REASONS, reason, reason_of, reason_of_failures  # noqa: E402
from femprep.errors import FemprepError  # noqa: E402

#: Options, the last of each counting; None for a switch.
Options = dict[str, str | None]
_NUMBER = r"(-?[\d.]+(?:e-?\d+)?)"
#: What a line advises, and the options that follow it.
ADVICE: tuple[tuple[str, Callable[[re.Match[str], Options], Options]], ...] = (
    (rf"--spacing {_NUMBER} {_NUMBER} {_NUMBER}", lambda m, old: {"--spacing": " ".join(m.groups())}),
    (rf"choose at most {_NUMBER}", lambda m, old: {"--edge-length": m[1]}),
    # Named where it suffices, beside shifts of which correcting does not.
    (r"--leave-out (\d+(?: --leave-out \d+)*)", lambda m, old: {"--leave-out": m[1]}),
    (r"--correct-shifts", lambda m, old: {"--correct-shifts": None}),
    (rf"--base-offset {_NUMBER}", lambda m, old: {"--base-offset": m[1]}),
    (r"--base=([-\d.,e]+)", lambda m, old: {"--base": m[1]}),
    (r"--basal-end (first|last)", lambda m, old: {"--basal-end": m[1]}),
    (rf"--minimum-thickness {_NUMBER}", lambda m, old: {"--minimum-thickness": m[1]}),
    (r"smaller --edge-length", lambda m, old: {"--edge-length": f"{0.6 * float(old.get('--edge-length') or 2.5):.3g}"}),
    (r"more --vertices", lambda m, old: {"--vertices": str(2 * int(old.get("--vertices") or 1500))}),
    (r"--mesher tetwild", lambda m, old: {"--mesher": "tetwild"}),
)
_ROUNDS = 4


def advised(line: str, old: Options, followed: list[str]) -> Options:
    """The first options a line names that have not been followed; none where it names none."""
    for pattern, options in ADVICE:
        if (found := re.search(pattern, line)) and told(new := options(found, old)) not in followed:
            return new
    return {}


def told(options: Options) -> str:
    """Options as they are typed."""
    return " ".join(word for name, value in options.items() for word in (name, value) if word)


def run(source: Path, options: Options, folder: Path) -> tuple[str, str, int]:
    """Reason, line and status of a run."""
    out = folder / "out"
    words = [word for name, value in options.items() for word in (name, *(() if value is None else value.split()))]
    # A value may begin with a minus.
    words = [f"--base={options['--base']}" if w == "--base" else w for w in words if w != options.get("--base")]
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            status = app(["mesh", str(source), "-o", str(out), "--quiet", *words], standalone_mode=False)
    except FemprepError as error:
        return reason_of(error).code, str(error), error.exit_status
    if not status:
        return DONE, "", 0
    lines = json.loads((out / "quality.json").read_text())["failures"]
    return reason_of_failures(lines), "; ".join(lines), 1


def follow(source: Path, options: Options, first: tuple[str, str, int] | None = None) -> dict[str, Any]:
    """A row: what came of a map, what was followed, and what came of that."""
    with tempfile.TemporaryDirectory(prefix="advice-") as name:
        code, line, status = first or run(source, options, Path(name))
        row = {"reason": code, "status": status, "line": line}
        followed: list[str] = []
        while code != DONE and len(followed) < _ROUNDS and (new := advised(line, options, followed)):
            followed.append(told(new))
            options = options | new
            code, line, status = run(source, options, Path(name) / str(len(followed)))
    return {**row, "followed": followed, "then": code, "then_status": status, "then_line": line if followed else ""}


def followed_before(first: tuple[str, str, int], subject: str, runs: list[str]) -> dict[str, Any] | None:
    """A row of a subject from the first of other cohorts that it is in, if its line names that option."""
    for table, words in (one.split(" ", 1) for one in runs):
        if words.split()[0] not in first[1] and first[0] != "edge-too-long":
            continue
        with open(table, newline="") as stream:
            for row in csv.DictReader(stream, delimiter="\t"):
                if row["subject"] == subject:
                    then = {"then": row["reason"], "then_status": int(row["exit_status"]), "then_line": row["message"]}
                    start = {"reason": first[0], "status": first[2], "line": first[1]}
                    return {**start, "followed": [words], **then}
    return None


def of_cohort(table: Path, options: Options) -> Iterator[tuple[str, Path, Options, tuple[str, str, int] | None]]:
    """The subjects of a table that did not pass."""
    maps = {p.name.removesuffix("_gt.nii.gz"): p for p in Path(os.environ["FEMPREP_DATA"]).glob("acdc/training/*/*gz")}
    with table.open(newline="") as stream:
        for row in csv.DictReader(stream, delimiter="\t"):
            if row["exit_status"] not in ("0", ""):
                first = row["reason"], row["message"], int(row["exit_status"])
                subject = row["subject"].removesuffix("_gt")  # as a cohort over a folder names it
                yield subject, maps[subject], options, first


def of_fuzz(records: Path, folder: Path) -> Iterator[tuple[str, Path, Options, None]]:
    """Damaged label maps among the records of ``tests/fuzz/run.py`` that were to be meshed, and did not pass."""
    sources = Sources(folder / "sources")
    rows = [json.loads(line) for line in records.read_text().splitlines()]
    wanted = [row for row in rows if row["kind"] in ("labels", REAL) and row["status"]]
    cases = []
    for row in wanted:
        kind, seed, number = row["kind"], row["seed"], row["number"]
        place = folder / f"{kind.split()[0]}-{seed}-{number}"
        place.mkdir()
        case = make_case(kind, seed, number, sources, place)
        if case.arguments[0] == "mesh":
            cases.append((row["status"] == 1, "sweep" not in case.arguments, seed, case))
    for _, _, seed, case in sorted(cases, key=lambda one: one[:2]):  # those that take long come last
        options: Options = {}
        for word in case.arguments[4:]:
            if word.startswith("--"):
                name, _, value = word.partition("=")
                options[name] = value or None
            else:
                options[name] = word
        options.pop("--quiet", None)
        yield f"{case.kind} {seed}-{case.number}: {case.what}", Path(case.arguments[1]), options, None


def table(rows: list[dict[str, Any]]) -> str:
    """Rows by reason, as Markdown."""
    head = "| reason | maps | advice | name an option | then passed | then a check fails | then refused or failed |"
    lines = [head, "|---|---|---|---|---|---|---|"]
    for code in [one.code for one in REASONS if any(row["reason"] == one.code != DONE for row in rows)]:
        own = [row for row in rows if row["reason"] == code]
        named = [row for row in own if row["followed"]]
        then = [sum(row["then_status"] in status for row in named) for status in ((0,), (1,), (2, 3))]
        lines.append(
            "| " + " | ".join(map(str, (f"`{code}`", len(own), reason(code).remedy, len(named), *then))) + " |"
        )
    return "\n".join(lines) + "\n"


def advising() -> set[str]:
    """Functions of the package that raise an error with advice, ``module:function``.

    Those of the checks of options within pydantic are raised by ``choose``.
    """
    package = Path(femprep.__file__).parent
    found = set()
    for path in package.rglob("*.py"):
        module = ".".join(path.relative_to(package).with_suffix("").parts)
        for function in ast.walk(ast.parse(path.read_text())):
            if (
                isinstance(function, ast.FunctionDef)
                and module != "options.run"
                and any(map(_advises, ast.walk(function)))
            ):
                found.add(f"{module}:{function.name}")
    return {one for one in found if not one.startswith("options.run:")}


def _advises(node: ast.AST) -> bool:
    return isinstance(node, ast.Raise) and any(
        isinstance(one, ast.keyword) and one.arg == "advice" for one in ast.walk(node)
    )


def of_cases() -> str:
    """What came of each advice of the small inputs, as Markdown, with counts."""
    rows = [row for case in cases() for row in followed(case)]
    lines = ["| input | raised in | advice | outcome |", "|---|---|---|---|"]
    lines += [f"| {row.case} | `{row.site}` | {row.advice} | {row.outcome} |" for row in rows]
    counts = Counter(row.outcome.partition(":")[0] for row in rows)
    told = ", ".join(f"{outcome}: {count}" for outcome, count in counts.most_common())
    left = sorted(advising() - {row.site for row in rows})
    return "\n".join(
        [*lines, "", f"{len(rows)} followed; {told}.", "", "Not reached: " + ", ".join(f"`{x}`" for x in left), ""]
    )


def main() -> None:
    """Command line of this script."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cohort", type=Path, help="table of a cohort over the ACDC maps")
    parser.add_argument("--options", default="", help="options of that cohort beside --preset acdc")
    parser.add_argument("--then", action="append", default=[], metavar="'TABLE OPTIONS'")
    parser.add_argument("--known", action="store_true", help="leave out subjects that would have to be run")
    parser.add_argument("--fuzz", type=Path, help="records of tests/fuzz/run.py")
    parser.add_argument("--only", nargs="*", help="subjects of the cohort")
    parser.add_argument("--out", type=Path, help="rows, added to this file; those in it are not run again")
    parser.add_argument("--sum", type=Path, nargs="*", help="no run: the table over rows of these files")
    parser.add_argument("--table", type=Path)
    parser.add_argument("--cases", action="store_true", help="the small inputs of tests/advice_cases.py")
    given = parser.parse_args()
    logging.disable()
    if given.cases:
        text = of_cases()
        print(text)
        if given.table:
            given.table.write_text(text)
        return
    files = given.sum or ([given.out] if given.out and given.out.exists() else [])
    rows = [json.loads(line) for path in files for line in path.read_text().splitlines()]
    done = {row["map"] for row in rows}
    words = re.findall(r"(--\S+)(?:[ =]([^-\s]\S*))?", given.options)
    with tempfile.TemporaryDirectory(prefix="advice-") as name:
        cases: Iterator[Any] = iter(())
        if given.cohort:
            cases = of_cohort(given.cohort, {"--preset": "acdc", **{n: v or None for n, v in words}})
        elif given.fuzz:
            cases = of_fuzz(given.fuzz, Path(name))
        for subject, source, options, first in cases:
            if subject in done or (given.only and subject not in given.only):
                continue
            before = followed_before(first, subject, given.then) if first else None
            if given.known and before is None:
                continue
            rows.append({"map": subject, **(before or follow(source, options, first))})
            print(rows[-1], flush=True)
            if given.out:
                with given.out.open("a") as stream:
                    stream.write(json.dumps(rows[-1]) + "\n")
    print(table(rows))
    if given.table:
        given.table.write_text(table(rows))


if __name__ == "__main__":
    main()
