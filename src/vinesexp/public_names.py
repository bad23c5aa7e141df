"""The public names of a room, imported when they are first used: `vinesexp.theory.b_c_exact`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any

Lazy = tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]


def lazy(room: str, modules: Mapping[str, Sequence[str]]) -> Lazy:
    """``__all__``, ``__getattr__`` and ``__dir__`` of a package whose names live in its modules.

    Parameters
    ----------
    room : str
        The package's own name.
    modules : mapping
        Module of the room, as seen from it, to the public names that it defines. A name must not
        be that of a module of the room, which would take its place once it is imported.

    Examples
    --------
    >>> import vinesexp.theory
    >>> round(float(1e3 * vinesexp.theory.b_t_exact(x_m=0.03, r=0.6)), 2)
    40.98
    """
    homes = {name: f"{room}.{module}" for module, names in modules.items() for name in names}
    names = sorted(homes)

    def find(name: str) -> Any:
        if name in homes:
            return getattr(import_module(homes[name]), name)
        raise AttributeError(f"module '{room}' has no attribute '{name}'")

    return names, find, lambda: names
