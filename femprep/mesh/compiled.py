"""A decorator in, a compiled kernel out: numba's ``njit``, kept on disk wherever a folder can be written."""

from __future__ import annotations

import logging
import os
import threading
from collections.abc import Callable
from functools import cache, wraps
from importlib import import_module
from inspect import signature
from typing import Any, Final

import numba
import numpy as np
from numba.core.caching import FunctionCache

_log = logging.getLogger(__name__)

#: Held while a kernel runs on several threads: not every library that numba spreads loops by bears two at a time.
_SPREAD: Final = threading.Lock()
#: What tells OpenMP how threads without work wait.
_WAITING: Final = "OMP_WAIT_POLICY"


def compiled(
    parallel: bool = False, part: bool = False, writes: str | None = None
) -> Callable[[Callable[..., Any]], Any]:
    """Compile a kernel with numba and keep the machine code for the next process.

    numba keeps it beside the source, in the user's cache folder, or in ``NUMBA_CACHE_DIR``. Where none of them can
    be written (a read-only installation without a home folder) the kernel is compiled anew by each process.

    A kernel lets other threads of Python run meanwhile.

    Parameters
    ----------
    parallel : bool
        Spread ``prange`` loops over threads. One such kernel runs at a time; another kernel cannot call it.
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
        "parallel": parallel,
        # Never: sums that may be reordered are summed as wide as the processor is, and fused with products where it
        # can, so that no two machines agree.
        "fastmath": False,
        "error_model": "numpy",
        "forceinline": part,
        "nogil": True,
    }

    def decorate(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(**settings)(function)
        try:
            kernel._cache = _Kept(function)
        except RuntimeError as error:
            _log.info("compiled code of %s is not kept: %s", function.__name__, error)
        call = _alone(kernel) if parallel else kernel
        return call if writes is None else _reading(call, function, writes.split())

    return decorate


class _Kept(FunctionCache):  # type: ignore[misc]
    """numba's folder of machine code for one kernel; a full disk stops nothing."""

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code; where there is no room for it, the next process compiles it anew."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _log.warning("compiled code cannot be kept in %s: %s", self.cache_path, error.strerror or error)


def _alone(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """The kernel, run while no other one of its kind does."""

    @wraps(kernel)
    def call(*args: Any) -> Any:
        with _SPREAD:
            _wait_asleep()
            return kernel(*args)

    return call


def _reading(kernel: Callable[..., Any], function: Callable[..., Any], writes: list[str]) -> Callable[..., Any]:
    """The kernel, given what it does not write to as arrays that cannot be written."""
    names = list(signature(function).parameters)
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


@cache
def _wait_asleep() -> None:
    """Have OpenMP's threads sleep while they wait for work, unless the user has told how they wait.

    Else they spin for milliseconds after every kernel, of which a run has thousands: on a busy machine they took the
    processor for two seconds out of six. OpenMP reads this once, when its library is loaded, so that it is told then;
    nobody else's threads are meant.
    """
    if _WAITING in os.environ or "GOMP_SPINCOUNT" in os.environ:
        return
    os.environ[_WAITING] = "passive"
    try:
        import_module("numba.np.ufunc.omppool")
    except ImportError:
        _log.debug("numba has no OpenMP here")
    finally:
        os.environ.pop(_WAITING, None)
