"""A scheduler that goes away is told in one line, however dask tells it."""

from __future__ import annotations

import asyncio
from concurrent.futures import CancelledError

import pytest

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
