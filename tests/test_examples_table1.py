from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "examples" / "01_table_1.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("example_table_1", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def check(example, rows):
    """Sound, distances no greater than the paper's, triangles better than its 0.84 to 0.86."""
    assert [row.name for row in rows] == ["lv", "rv", "la", "ra", "epi"]
    for row in rows:
        paper, _ = example.PAPER[row.name]
        assert row.sound, row.name
        assert row.distance <= paper, row.name
        assert row.nearest <= paper + 0.1, row.name
        assert row.quality_mean >= 0.92, row.name
        assert row.quality_min >= 0.2, row.name  # what a wall may have; the tips of the crescent come closest
        assert row.fewer >= 2.0, row.name
        assert row.triangles == 2 * example.TABLE_1[row.name]["vertices"] - 4


def test_one_heart_is_as_good_as_the_papers(example, capsys):
    rows = example.main(subjects=1)
    check(example, rows)
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
    check(example, example.main())
