"""The benchmarks' imports and arguments hold, though the tests do not run them."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

SCRIPTS = sorted((Path(__file__).parent / "benchmarks").glob("bench_*.py"))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_benchmark_tells_its_arguments(script, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(script.parent))
    spec = importlib.util.spec_from_file_location(script.stem, script)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, script.stem, module)  # where its dataclasses look for their module
    spec.loader.exec_module(module)
    monkeypatch.setattr("sys.argv", [script.name, "--help"])
    with pytest.raises(SystemExit) as end:
        module.main()
    assert end.value.code == 0
    assert "usage: " in capsys.readouterr().out


def test_every_benchmark_is_named_in_the_pages():
    told = (Path(__file__).parent.parent / "docs" / "measured.md").read_text(encoding="utf-8")
    assert [script.name for script in SCRIPTS if script.name not in told] == []
