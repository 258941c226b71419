"""A scheduler that goes away is told in one line, however dask tells it; a row whose worker died is waited for."""

from __future__ import annotations

import asyncio
from concurrent.futures import CancelledError
from pathlib import Path
from types import SimpleNamespace

import pytest

from femprep.cli import main
from femprep.errors import StageError


@pytest.mark.parametrize("kind", ["closed", "cancelled", "cancelled by the loop"])
def test_scheduler_that_went_away_is_one_line(kind: str) -> None:
    closed = pytest.importorskip("distributed.comm", reason="dask.distributed is not installed").CommClosedError
    from femprep.cohort.run import _scheduler_there

    error = {"closed": closed, "cancelled": CancelledError, "cancelled by the loop": asyncio.CancelledError}
    with (
        pytest.raises(StageError, match="the scheduler went away, 3 subjects are done") as told,
        _scheduler_there([1, 2, 3]),
    ):
        raise error[kind]("in <TCP local> while fetching")
    assert "\n" not in str(told.value)


class Row:
    """A future whose states are given, one for each time that it is asked."""

    def __init__(self, *states: str) -> None:
        self.states = list(states)

    @property
    def status(self) -> str:
        return self.states.pop(0) if len(self.states) > 1 else self.states[0]

    def result(self) -> SimpleNamespace:
        return SimpleNamespace(record=SimpleNamespace(reason="done"), timing=None)

    def release(self) -> None:
        pass


class InTurn(list[Row]):
    """What dask calls ``as_completed``: futures as they end, and those that are added."""

    def __init__(self, futures: list[Row], loop: object) -> None:
        super().__init__(futures)

    def add(self, future: Row) -> None:
        self.append(future)


def test_a_row_that_was_lost_with_its_worker_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")

    from femprep.cohort import run

    monkeypatch.setattr(distributed, "as_completed", InTurn)
    states = iter([("lost", "finished"), ("finished",)])
    client = SimpleNamespace(loop=None, submit=lambda *_, **__: Row(*next(states)))
    jobs = [SimpleNamespace(subject=SimpleNamespace(name=name), run="r") for name in ("one", "two")]
    rows: list[object] = []
    run._work(client, jobs, SimpleNamespace(add=lambda record, timing: rows.append(record)), lambda: None)
    assert len(rows) == 2


@pytest.mark.parametrize("there", [False, True])
def test_a_scheduler_that_does_not_answer_leaves_nothing(there: bool, tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "one.nii.gz").touch()
    if there:
        (tmp_path / "made" / "out").mkdir(parents=True)
    before = sorted(tmp_path.rglob("*"))
    words = ["--preset", "acdc", "-q", "--scheduler", "nobody"]
    assert main(["cohort", str(tmp_path / "in"), "-o", str(tmp_path / "made" / "out"), *words]) == 2
    assert sorted(tmp_path.rglob("*")) == before
