"""numba's kernels: kept for the next process, and run on several threads."""

import errno
import os
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from multiprocessing import get_context

import numba
import numpy as np
import pytest
from numba.core.caching import FunctionCache
from numba.core.errors import NumbaError

from femprep.mesh.compiled import compiled
from femprep.mesh.measures.tetrahedra import tetra_volumes
from femprep.mesh.search.closest import ClosestFinder


def test_each_item_is_done_once_on_any_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    @compiled(grain=10, writes="out")
    def add_numbers(first: int, last: int, out: np.ndarray) -> None:
        for i in range(first, last):
            out[i] += i

    for threads in (1, 2, 5):
        monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", threads)
        for count in (0, 1, 19, 20, 1234):
            out = np.zeros(count)
            add_numbers(count, out)
            assert (out == np.arange(count)).all()


def test_kernels_of_several_threads_run_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 2)
    points = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    finder = ClosestFinder(points, np.array([(0, 1, 2)]))
    queries = np.random.default_rng(0).random((20000, 3))
    alone = finder(queries).distance
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda _: finder(queries).distance, range(8)))
    assert all(np.array_equal(distance, alone) for distance in found)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked here")
def test_a_forked_process_has_threads_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 2)
    points, cells = np.eye(4, 3), np.tile([(0, 1, 2, 3)], (40_000, 1))
    before = tetra_volumes(points, cells)
    with get_context("fork").Pool(1) as pool:
        there = pool.apply_async(tetra_volumes, (points, cells)).get(timeout=60)
    assert np.array_equal(there, before)


def test_full_disk_keeps_no_machine_code_and_stops_nothing(monkeypatch, caplog):
    def refuse(self, sig, data):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(FunctionCache, "save_overload", refuse)

    @compiled()
    def twice(x):
        return 2 * x

    assert twice(21) == 42
    assert "cannot be kept" in caplog.text


def test_a_kernel_is_compiled_once_whatever_of_its_arrays_may_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    monkeypatch.setattr(FunctionCache, "load_overload", lambda self, sig, context: None)
    monkeypatch.setattr(FunctionCache, "save_overload", lambda self, sig, data: made.append(sig))

    @compiled(writes="out")
    def add(one: np.ndarray, rest: tuple[np.ndarray, np.ndarray], out: np.ndarray) -> None:
        for i in range(len(out)):
            out[i] = one[i] + rest[0][i] + rest[1][i]

    given, kept, out = np.ones(3), np.ones(3), np.zeros(3)
    kept.flags.writeable = False
    for one, two, three in product((given, kept), repeat=3):
        add(one, (two, three), out)
    assert len(made) == 1
    assert (out == 3.0).all()
    assert given.flags.writeable
    with pytest.raises(NumbaError, match="read"):
        add(given, (given, given), kept)


def test_what_a_kernel_does_not_say_it_writes_to_it_cannot() -> None:
    @compiled(writes="")
    def spoil(values: np.ndarray) -> None:
        values[0] = 1.0

    with pytest.raises(NumbaError, match="read"):
        spoil(np.zeros(3))


def test_python_cannot_call_an_inner_kernel() -> None:
    @compiled(inner=True)
    def twice(x: float) -> float:
        return 2.0 * x

    @compiled()
    def thrice(x: float) -> float:
        return twice(x) + x

    for _ in range(2):  # before it is compiled, and after
        with pytest.raises(TypeError, match="only"):
            twice(1.0)
        assert thrice(1.0) == 3.0
