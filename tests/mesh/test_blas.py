"""One thread for linear algebra while a block asks for it, and as many as before when it ends."""

from __future__ import annotations

import threading

import pytest
import scipy.linalg  # noqa: F401
from threadpoolctl import threadpool_info, threadpool_limits

from femprep.mesh.blas import one_blas_thread


def threads() -> list[int]:
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_blocks_within_each_other():
    with threadpool_limits(2, "blas"):
        before = threads()
        assert 2 in before
        with one_blas_thread():
            assert set(threads()) == {1}
            with one_blas_thread():
                assert set(threads()) == {1}
            assert set(threads()) == {1}
        assert threads() == before


def test_a_failure_puts_it_back():
    with threadpool_limits(2, "blas"):
        before = threads()
        with pytest.raises(ValueError, match="stop"), one_blas_thread():
            raise ValueError("stop")
        assert threads() == before


def test_blocks_of_two_threads_that_overlap():
    """The first to begin is the first to end: when both have, the number is what it was."""
    begun, ended = threading.Event(), threading.Event()

    def other() -> None:
        with one_blas_thread():
            begun.set()
            assert ended.wait(10)

    with threadpool_limits(2, "blas"):
        before = threads()
        thread = threading.Thread(target=other)
        with one_blas_thread():
            thread.start()
            assert begun.wait(10)
            assert set(threads()) == {1}
        ended.set()
        thread.join()
        assert threads() == before


def test_as_a_decorator():
    @one_blas_thread()
    def inside() -> list[int]:
        return threads()

    with threadpool_limits(2, "blas"):
        assert set(inside()) == {1}
