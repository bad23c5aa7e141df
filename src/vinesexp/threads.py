"""One thread for the linear algebra of each process.

A step solves many small systems, of tens of unknowns. OpenBLAS hands each to as many threads as the
machine has cores, which wait for one another longer than they compute, and most of all where
several steps, or other programs, share the cores. What runs side by side here are processes.
"""

from __future__ import annotations

import os

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
