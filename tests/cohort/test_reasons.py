"""The list of reasons is closed: every raise that a subject can come to has a row of its own."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

import femprep
from femprep import errors
from femprep.cohort.reasons import REASONS, reason_at, reason_of, reason_of_failures
from femprep.errors import DiskFullError, InputError, StageError
from femprep.options import Options
from femprep.preflight import check_options
from femprep.stages import fill

PACKAGE = Path(femprep.__file__).parent
#: Rooms and files that no subject of a cohort comes to: other commands, phantoms, readers of meshes.
ELSEWHERE = (
    *("cli", "cohort", "annotation", "phantoms", "errors", "surface.reference", "surface.measure"),
    *("surface.files", "surface.rows", "volume.refine"),
)
#: What each failed check says, as the check words it.
LINES = {
    "not-solved": "CalculiX did not solve the inflation by 1 kPa: exit status 201",
    "fibres-missing": "fibres: not made: the equations were not solved",
    "far-from-labels": "endo against the labels of lv: 0.61 pixels (0.86 mm) from their outlines",
    "poor-elements": "smallest dihedral angle in degrees is 4.2, asked for is at least 10",
}


def raises() -> Iterator[tuple[str, str, str]]:
    """Class, module and function of each error of ours that is raised."""
    for path in sorted(PACKAGE.rglob("*.py")):
        module = ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")
        if module.split(".")[0] in ELSEWHERE or module.startswith(ELSEWHERE):
            continue
        yield from _in(ast.parse(path.read_text()), module, "<module>")


def _in(node: ast.AST, module: str, function: str) -> Iterator[tuple[str, str, str]]:
    for child in ast.iter_child_nodes(node):
        inside = child.name if isinstance(child, ast.FunctionDef) else function
        if isinstance(child, ast.Raise) and isinstance(child.exc, ast.Call) and isinstance(child.exc.func, ast.Name):
            name = {"cannot_write": "FileError"}.get(child.exc.func.id, child.exc.func.id)
            if issubclass(getattr(errors, name, object), errors.FemprepError):
                yield name, module, inside
        yield from _in(child, module, inside)


@pytest.fixture(scope="module")
def sites() -> list[tuple[str, str, str]]:
    return sorted(set(raises()))


def test_every_raise_of_ours_has_a_reason(sites: list[tuple[str, str, str]]) -> None:
    assert len(sites) > 150
    unknown = [
        site for site in sites if reason_at(getattr(errors, site[0]), *site[1:]).code == "unforeseen"
        and site[0] != "QualityError"
    ]  # fmt: skip
    assert unknown == []


def test_every_reason_can_be_come_to(sites: list[tuple[str, str, str]]) -> None:
    come_to = {reason_at(getattr(errors, name), module, function).code for name, module, function in sites}
    known = {found.code for found in REASONS if found.sites}
    assert known - come_to <= {"memory-ran-out", "unforeseen"}  # errors of Python's own


@pytest.mark.parametrize(("kind", "place", "code"), [
    (InputError, ("image.pieces", "_require_slices"), "slice-missing"),
    (InputError, ("image.pieces", "require_one_body"), "labels-broken"),
    (InputError, ("preflight", "_check_planes"), "planes-miss"),
    (InputError, ("wall.planes.base_slice", "closed_rings"), "rings-open"),
    (InputError, ("wall.planes.stack", "read_stack"), "labels-missing"),
    (InputError, ("image.object", "_require_size"), "labels-broken"),
    (InputError, ("image.reading.itk", "_require_volume"), "image-unreadable"),
    (InputError, ("wall.planes.misnamed", "require_order"), "labels-missing"),
    (InputError, ("wall.joining.build", "_thicken"), "wall-too-thin"),
    (StageError, ("volume.tetwild.guard", "_wait"), "mesher-limit"),
    (StageError, ("stages.fill", "_tetrahedra"), "mesher-failed"),
    (StageError, ("volume.tetwild.guard", "_require_success"), "mesher-failed"),
    (DiskFullError, ("image.reader", "anywhere"), "disk-full"),
    (MemoryError, ("image.reader", "anywhere"), "memory-ran-out"),
    (ZeroDivisionError, ("image.reader", "anywhere"), "unforeseen"),
])  # fmt: skip
def test_reason_is_that_of_the_longest_place(kind: type[Exception], place: tuple[str, str], code: str) -> None:
    assert reason_at(kind, *place).code == code


def test_reason_of_an_error_is_known_by_where_it_was_raised() -> None:
    with pytest.raises(errors.OptionError) as caught:
        check_options(Options(surface={"cells": "quad"}))
    assert reason_of(caught.value).code == "options-wrong"


def test_error_that_was_raised_again_is_known_by_its_cause() -> None:
    def again() -> None:
        try:
            check_options(Options(surface={"cells": "quad"}))
        except errors.OptionError as cause:
            raise InputError("with more words") from cause

    with pytest.raises(InputError) as caught:
        again()
    assert reason_of(caught.value).code == "options-wrong"


def test_where_neither_mesher_fills_the_wall_the_one_asked_for_is_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(error: Exception) -> Callable[..., None]:
        def raises(*_: object) -> None:
            raise error

        return raises

    monkeypatch.setattr(fill, "_tetwild", fail(StageError("it crashed")))
    monkeypatch.setattr(fill, "_swept", fail(InputError("the surfaces cross")))
    with pytest.raises(StageError, match="it crashed; nor could the wall be swept: the surfaces cross") as caught:
        fill._tetrahedra(SimpleNamespace(base="base"), Options(), None)  # type: ignore[arg-type]
    assert reason_of(caught.value).code == "mesher-failed"


@pytest.mark.parametrize("code", LINES)
def test_failed_checks_have_reasons(code: str) -> None:
    assert reason_of_failures([LINES["poor-elements"], LINES[code]]) == code


def test_codes_are_unique_and_say_what_to_do() -> None:
    codes = [found.code for found in REASONS]
    assert len(set(codes)) == len(codes)
    assert all(found.what.endswith(".") and found.remedy.endswith(".") for found in REASONS)
