"""A decorator in, a compiled kernel out: numba's ``njit``, kept on disk wherever a folder can be written."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, wraps
from inspect import signature
from itertools import pairwise
from typing import Any

import numba
import numpy as np
from numba.core.caching import FunctionCache

_log = logging.getLogger(__name__)


def compiled(
    grain: int | None = None, inner: bool = False, part: bool = False, writes: str | None = None
) -> Callable[[Callable[..., Any]], Any]:
    """Compile a kernel with numba and keep the machine code for the next process.

    numba keeps it beside the source, in the user's cache folder, or in ``NUMBA_CACHE_DIR``. Where none of them can
    be written (a read-only installation without a home folder) the kernel is compiled anew by each process.

    A kernel lets other threads of Python run meanwhile.

    Parameters
    ----------
    grain : int, optional
        Run the kernel on several threads. Its first two parameters are the numbers of the first item and of the one
        after the last; it is called with the number of all items in their place. A thread gets at least so many items
        at a time. numba's own parallel loops would compile every kernel twice. Another kernel cannot call it.
    inner : bool
        Only other kernels call this function: what Python would need to call it is not compiled, and its calls raise
        TypeError.
    part : bool
        This function is only a part of other kernels: it becomes one with each of them. Without that, a kernel that
        has just been compiled may call another version of it than the one read back from disk.
    writes : str, optional
        Names of the arguments that it writes to, with blanks between; all others it gets read-only. numba compiles a
        kernel once more for each mix of arrays that may be written and that may not, of which the calls of one had up
        to nine. Not for kernels that another one calls.
    """
    # numpy's error model: x / 0 is infinite. Python's would test each divisor, and a loop with a test in it is not
    # vectorised.
    settings: dict[str, Any] = {
        # Never: sums that may be reordered are summed as wide as the processor is, and fused with products where it
        # can, so that no two machines agree.
        "fastmath": False,
        "error_model": "numpy",
        "forceinline": part,
        "nogil": True,
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": inner,
    }

    def decorate(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(**settings)(function)
        if inner:  # numba would call an address that is none
            kernel._compile_for_args = _refuse
            kernel.add_overload = lambda made: kernel.overloads.update({tuple(made.signature.args): made})
        try:
            kernel._cache = _Kept(function)
        except RuntimeError as error:
            _log.info("compiled code of %s is not kept: %s", function.__name__, error)
        call = kernel if grain is None else _on_threads(kernel, grain)
        return call if writes is None else _reading(call, function, writes.split(), 0 if grain is None else 1)

    return decorate


def _refuse(*args: Any, **names: Any) -> None:
    raise TypeError("only compiled kernels can call this one")


class _Kept(FunctionCache):  # type: ignore[misc]
    """numba's folder of machine code for one kernel; a full disk stops nothing."""

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code; where there is no room for it, the next process compiles it anew."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _log.warning("compiled code cannot be kept in %s: %s", self.cache_path, error.strerror or error)


def _on_threads(kernel: Callable[..., None], grain: int) -> Callable[..., None]:
    """The kernel, called with a number of items, its items in pieces on as many threads as numba may use."""

    @wraps(kernel)
    def call(count: int, *args: Any) -> None:
        threads = numba.config.NUMBA_NUM_THREADS
        # More pieces than threads: where some take longer, no thread waits for long.
        pieces = min(4 * threads, count // grain)
        if threads == 1 or pieces < 2:
            kernel(0, count, *args)
            return
        ends = [count * k // pieces for k in range(pieces + 1)]
        running = [_pool(os.getpid(), threads).submit(kernel, *piece, *args) for piece in pairwise(ends)]
        for piece in running:
            piece.result()

    return call


@cache
def _pool(process: int, threads: int) -> ThreadPoolExecutor:
    """Threads that wait for pieces of work; a process that was forked has none of its parent's."""
    return ThreadPoolExecutor(threads, thread_name_prefix=f"femprep-{process}")


def _reading(
    kernel: Callable[..., Any], function: Callable[..., Any], writes: list[str], skipped: int
) -> Callable[..., Any]:
    """The kernel, given what it does not write to as arrays that cannot be written."""
    names = list(signature(function).parameters)[skipped:]
    written = {names.index(name) for name in writes}

    @wraps(function)
    def call(*args: Any) -> Any:
        return kernel(*(each if k in written else _read_only(each) for k, each in enumerate(args)))

    return call


def _read_only(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(map(_read_only, value))
    if isinstance(value, np.ndarray) and value.flags.writeable:
        value = value.view()
        value.flags.writeable = False
    return value
