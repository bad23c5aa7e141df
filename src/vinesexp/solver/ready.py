"""Importing this has numba load what it knows of types, which takes as long as numba itself.

It does so when it gets its first function: a process that forks imports this before, and its forks
need not load it again.
"""

from typing import Any

from numba import njit


def _nothing() -> None:
    pass


_make: Any = njit
_make("void()", no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)(_nothing)
