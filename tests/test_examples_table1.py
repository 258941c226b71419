from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest
from faults import faults

SCRIPT = Path(__file__).parents[1] / "examples" / "01_table_1.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("example_table_1", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def faults_of_table(example, rows) -> list[str]:
    """What is unsound, farther off than in the paper, or of triangles no better than its 0.84 to 0.86."""
    found = faults(([row.name for row in rows] == ["lv", "rv", "la", "ra", "epi"], "rows missing or out of order"))
    for row in rows:
        paper, _ = example.PAPER[row.name]
        found += faults(
            (row.sound, f"{row.name}: not sound"),
            (row.distance <= paper, f"{row.name}: distance {row.distance}, in the paper {paper}"),
            (row.nearest <= paper + 0.1, f"{row.name}: distance to the nearest {row.nearest}, in the paper {paper}"),
            (row.quality_mean >= 0.92, f"{row.name}: mean quality {row.quality_mean}"),
            # What a wall may have; the tips of the crescent come closest.
            (row.quality_min >= 0.2, f"{row.name}: least quality {row.quality_min}"),
            (row.fewer >= 2.0, f"{row.name}: only {row.fewer} times fewer triangles"),
            (
                row.triangles == 2 * example.TABLE_1[row.name]["vertices"] - 4,
                f"{row.name}: {row.triangles} triangles",
            ),
        )
    return found


@pytest.mark.slow
def test_one_heart_is_as_good_as_the_papers(example, capsys):
    rows = example.main(subjects=1)
    assert faults_of_table(example, rows) == []
    printed = capsys.readouterr().out
    for row in rows:
        line = next(line for line in printed.splitlines() if line.startswith(example.TITLES[row.name]))
        assert f"{row.quality_mean:.2f}" in line
        assert f"{row.distance:.2f}" in line


def test_the_table_repeats_exactly(example):
    objects = [example.subject(3)["la"]]
    assert example.measure("la", objects) == example.measure("la", objects)


@pytest.mark.slow
def test_five_hearts_are_as_good_as_the_papers(example):
    assert faults_of_table(example, example.main()) == []
