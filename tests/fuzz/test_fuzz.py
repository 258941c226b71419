"""Damaged input is answered: some cases of the kinds that read, three hundred of all.

``run.py`` runs as many as one likes; what it found stands in ``docs/damaged-input.md``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from fuzz.cases import KINDS, REAL, make_case
from fuzz.instants import try_instants
from fuzz.odd_cases import NAMES
from fuzz.sources import Sources

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="each case is run in a fork")
RUN = Path(__file__).with_name("run.py")
#: Kinds whose cases are read or refused, most of them, and not meshed.
QUICK = ("mesh file", "surface file", "toml", "options", "segments", "annotate", "refine")


def outcomes(tmp_path: Path, *arguments: str) -> list[dict[str, object]]:
    records = tmp_path / "cases.jsonl"
    command = [sys.executable, str(RUN), "--records", str(records), *arguments]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    return [json.loads(line) for line in records.read_text().splitlines()]


@pytest.mark.slow
def test_a_few_damaged_files_and_options(tmp_path: Path) -> None:
    found = outcomes(tmp_path, "--cases", "40", "--seed", "5", "--kinds", *QUICK, "--read-only")
    assert len(found) == 40
    assert {one["kind"] for one in found} == set(QUICK)
    assert [one for one in found if one["fault"]] == []
    assert sum(one["status"] == 2 for one in found) > 15


@pytest.mark.slow
def test_many_of_every_kind(tmp_path: Path) -> None:
    kinds = [kind for kind in KINDS if kind != REAL]
    found = outcomes(tmp_path, "--cases", "300", "--seed", "3", "--kinds", *kinds)
    assert len(found) == 300
    assert {one["kind"] for one in found} == set(kinds)
    assert [one for one in found if one["fault"]] == []


@pytest.mark.slow
def test_every_odd_case_that_is_read(tmp_path: Path) -> None:
    numbers = map(str, range(len(NAMES)))
    found = outcomes(tmp_path, "--kinds", "odd", "--read-only", "--only", *numbers)
    assert len(found) > 500
    assert [one for one in found if one["fault"]] == []
    assert sum(one["status"] == 2 for one in found) > 350


@pytest.mark.slow
def test_cases_are_the_same_for_a_seed(tmp_path: Path) -> None:
    sources = Sources(tmp_path / "sources")
    for kind in KINDS.keys() - {REAL}:
        made = []
        for turn in range(2):
            folder = tmp_path / f"{kind}-{turn}" / "case"
            folder.mkdir(parents=True)
            case = make_case(kind, 1, 3, sources, folder)
            files = {p.relative_to(folder): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
            made.append((case.what, [word.replace(str(folder), "") for word in case.arguments], files))
        assert made[0] == made[1], kind


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
def test_runs_ended_at_random_instants_lose_nothing(tmp_path: Path) -> None:
    tried = try_instants(tmp_path, 2, seed=1)
    assert tried.lost == []
    assert tried.ended + tried.late >= 2
