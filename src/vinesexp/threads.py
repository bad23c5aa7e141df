"""One thread for the linear algebra of each process.

A step solves many small systems, of tens of unknowns. OpenBLAS hands each to as many threads as the
machine has cores, which wait for one another longer than they compute, and most of all where
several steps, or other programs, share the cores. What runs side by side here are processes.
"""

from __future__ import annotations

import os
from contextlib import AbstractContextManager

#: What OpenBLAS, OpenMP, MKL and Accelerate read when they are loaded.
VARIABLES = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def one_thread_each() -> None:
    """Ask for one thread here and in processes started from here; to be called before numpy loads.

    What the person has set is left alone.

    Examples
    --------
    >>> one_thread_each()
    >>> all(name in os.environ for name in VARIABLES)
    True
    """
    for name in VARIABLES:
        os.environ.setdefault(name, "1")


def one_thread_here() -> AbstractContextManager[object]:
    """One thread for the linear algebra of a block, where numpy has been loaded: in a notebook.

    After the block the threads are those there were before.

    Examples
    --------
    >>> from threadpoolctl import threadpool_info
    >>> with one_thread_here():
    ...     {found["num_threads"] for found in threadpool_info() if found["user_api"] == "blas"}
    {1}
    """
    from threadpoolctl import threadpool_limits

    limits: AbstractContextManager[object] = threadpool_limits(limits=1, user_api="blas")
    return limits
