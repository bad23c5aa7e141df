"""What MATLAB 7.3 writes into HDF5 in a way of its own: structures, cells, words, nothing.

An array of structures is a group whose datasets hold references, one a structure; a cell is one
dataset of references; words are 16-bit codes; an empty array holds its own size.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_DEEPEST = 20  # structures inside structures
_WIDEST = 2000  # members of an array of structures or of a cell
_UNITS = ("unit", "units")


def visit(file: Any, see: Callable[[str, Any], None], units: dict[str, str]) -> None:
    """Call `see` with name and item for all that a file holds, as MATLAB names it.

    Parameters
    ----------
    file : h5py.File
        Open.
    see : function
        Of the name (``ch/0/x`` in an array of structures) and the group or dataset.
    units : dict
        Filled with the words called unit, by the name of what they stand in.
    """
    _walk(file, "", file, see, units, 0)


def _walk(
    file: Any, name: str, item: Any, see: Callable[[str, Any], None], units: dict[str, str],
    depth: int,
) -> None:  # fmt: skip
    if depth > _DEEPEST:
        return
    if hasattr(item, "keys"):
        if name:
            see(name, item)
        for key in item:
            inner = item.get(key)
            if inner is not None and not key.startswith("#"):  # MATLAB's own bookkeeping
                own = f"{name}/{key}" if name else key
                _walk(file, own, inner, see, units, depth + 1)
        return
    kind = _class(item)
    if item.attrs.get("MATLAB_empty"):
        return
    if kind == "char":
        group, _, key = name.rpartition("/")
        if key.lower() in _UNITS:
            units[group] = "".join(chr(int(code)) for code in item[()].reshape(-1)).strip()
        return
    if item.dtype.kind != "O" or not item.size:
        see(name, item)
        return
    references = item[()].reshape(-1)[:_WIDEST]
    group, _, key = name.rpartition("/")
    for k, reference in enumerate(references):
        if not reference:
            continue
        own = f"{name}/{k}" if kind == "cell" else f"{group}/{k}/{key}"
        _walk(file, name if len(references) == 1 else own, file[reference], see, units, depth + 1)


def _class(item: Any) -> str:
    value = item.attrs.get("MATLAB_class", b"")
    return value.decode("ascii", "replace") if isinstance(value, bytes) else str(value)
