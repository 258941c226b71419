"""The store of templates: kept once, damage mended, other processes and read-only folders survived."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from femprep.template import charge_template, charges, store


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FEMPREP_CACHE", str(tmp_path / "kept"))
    return tmp_path / "kept"


def forbid(count: int) -> None:
    raise AssertionError(f"template of {count} vertices was made again")


def test_made_once(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = charge_template(60)
    assert [path.name for path in cache.iterdir()] == ["charges-v2-60.npz"]
    monkeypatch.setattr(charges, "_make", forbid)
    again = charge_template(60)
    np.testing.assert_array_equal(again.directions, first.directions)
    np.testing.assert_array_equal(again.cells, first.cells)


@pytest.mark.parametrize("damage", ["empty", "cut", "flipped", "text", "other"])
def test_a_damaged_file_is_made_anew(cache: Path, damage: str, caplog: pytest.LogCaptureFixture) -> None:
    first = charge_template(60)
    path = cache / "charges-v2-60.npz"
    whole = path.read_bytes()
    if damage == "empty":
        path.write_bytes(b"")
    elif damage == "cut":
        path.write_bytes(whole[: len(whole) // 2])
    elif damage == "flipped":
        path.write_bytes(whole[:700] + bytes([whole[700] ^ 0xFF]) + whole[701:])
    elif damage == "text":
        path.write_text("not a template")
    else:
        charge_template(61)
        path.write_bytes((cache / "charges-v2-61.npz").read_bytes())
    with caplog.at_level("WARNING"):
        again = charge_template(60)
    assert "made anew" in caplog.text
    np.testing.assert_array_equal(again.directions, first.directions)
    assert path.read_bytes() == whole


@pytest.mark.skipif(os.name == "nt", reason="folders are not files there")
def test_a_folder_that_cannot_be_written_is_only_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("FEMPREP_CACHE", str(blocked / "kept"))
    with caplog.at_level("WARNING"):
        assert len(charge_template(60).directions) == 60
    assert "cannot be kept" in caplog.text


def test_nothing_half_made_is_left(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    template = charge_template(60)

    def fail(*_: object, **__: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(store.np, "savez", fail)
    store.save("charges", 70, template)
    assert [path.name for path in cache.iterdir()] == ["charges-v2-60.npz"]


@pytest.mark.slow
def test_processes_that_make_the_same_template_at_once(cache: Path) -> None:
    code = "from femprep.template import charge_template; print(charge_template(333).directions.tobytes().hex()[:64])"
    children = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, env=dict(os.environ)) for _ in range(3)
    ]
    answers = {child.communicate()[0] for child in children}
    assert [child.returncode for child in children] == [0, 0, 0]
    assert len(answers) == 1
    assert [path.name for path in cache.iterdir()] == ["charges-v2-333.npz"]


def test_folder_of_the_platform(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FEMPREP_CACHE", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert store.folder() == Path("/somewhere/femprep")
    monkeypatch.setenv("FEMPREP_CACHE", "/elsewhere")
    assert store.folder() == Path("/elsewhere")
