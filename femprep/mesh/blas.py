"""Linear algebra by one thread, for loops that call it in small pieces."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS and LAPACK use one thread; a context manager, or a decorator.

    OpenBLAS hands small products to all its threads, and these wait for the next one at full speed. Where our own loops
    ask for many of them, beside other work on the machine, most of the time goes into that: .7 s of one thread have
    been seen to take 86 s. Of several threads of Python that ask for it at a time the first one rules, and puts the
    number back.
    """
    # Loaded first: what is loaded later is not limited.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield
