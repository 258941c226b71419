"""The examples in docstrings: every public function, class, method and property has one, and they are so."""

from __future__ import annotations

import doctest
import inspect
from functools import cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

import femprep as fp
from femprep.model.convert import Convertible
from femprep.phantoms import lv_ellipsoid

PUBLIC = {
    name: getattr(fp, name)
    for name in fp.__all__
    if inspect.isfunction(getattr(fp, name)) or inspect.isclass(getattr(fp, name))
}


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """What the ten lines of ``help(femprep)`` make; the mesh is swept, which takes less than fTetWild."""
    seg = lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped")
    cavity, heart = seg.object("lv"), seg.object("lv", "myo")
    endo = fp.fit_surface(cavity, vertices=500)
    epi = fp.fit_surface(heart, boundary=fp.extend_apex(seg, heart, endo=endo), vertices=500)
    base = fp.find_base(seg)
    wall = fp.build_wall(epi=epi, endo={"lv": endo}, base=base)
    swept = fp.sweep(fp.match_surfaces(endo=endo, epi=epi, base=base, edge_length=5.0), edge_length=5.0)
    made = {"seg": seg, "cavity": cavity, "heart": heart, "endo": endo, "epi": epi, "wall": wall}
    return {"fp": fp, **made, "mesh": swept, "swept": swept}


def own_members(found: Any) -> list[str]:
    """Public methods and properties that a class of ours, or one it is made from, defines."""
    bases = [base for base in getattr(found, "__mro__", ()) if base.__module__.startswith("femprep")]
    kinds = (property, cached_property, classmethod, staticmethod, FunctionType)
    return sorted(
        {key for base in bases for key, each in vars(base).items() if key[0] != "_" and isinstance(each, kinds)}
    )


def test_every_public_name_has_an_example() -> None:
    asked = list(PUBLIC.items())
    asked += [
        (f"{name}.{key}", inspect.getattr_static(found, key))
        for name, found in PUBLIC.items()
        for key in own_members(found)
    ]
    assert [name for name, found in asked if ">>>" not in (found.__doc__ or "")] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", [*PUBLIC, "Convertible"])
def test_examples_are_so(name: str, names: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    found = PUBLIC.get(name, Convertible)
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for example in doctest.DocTestFinder(exclude_empty=True).find(found, name, globs={**names}):
        runner.run(example, out=said.append)
    assert runner.failures == 0, "".join(said)
