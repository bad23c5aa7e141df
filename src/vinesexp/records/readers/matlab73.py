"""What MATLAB 7.3 writes into HDF5 in a way of its own: structures, cells, words, nothing.

An array of structures is a group whose datasets hold references, one a structure; a cell is one
dataset of references; words are 16-bit codes; an empty array holds its own size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

_DEEPEST = 20  # structures inside structures
_WIDEST = 2000  # members of an array of structures or of a cell
_UNITS = ("unit", "units")


def visit(
    file: Any,
    see: Callable[[str, Any], None],
    units: dict[str, str],
    require_own: Callable[[str, Any], None],
) -> None:
    """Call `see` with name and item for all that a file holds, as MATLAB names it.

    Parameters
    ----------
    file : h5py.File
        Open.
    see : function
        Of the name (``ch/0/x`` in an array of structures) and the group or dataset.
    units : dict
        Filled with the words called unit, by the name of what they stand in.
    require_own : function
        Of the same, before anything is read from it: raises where it stands in another file.
    """
    _Walk(file, see, units, require_own).down("", file, 0)


@dataclass(frozen=True)
class _Walk:
    """A way through all that a file holds."""

    file: Any
    see: Callable[[str, Any], None]
    units: dict[str, str]
    require_own: Callable[[str, Any], None]

    def down(self, name: str, item: Any, depth: int) -> None:
        """Into what `item` holds: by the file's own links and references, not by those out of it.

        A soft link is another name of what is seen under its own.
        """
        import h5py

        if depth > _DEEPEST:
            return
        if hasattr(item, "keys"):
            if name:
                self.see(name, item)
            for key in item:
                own = f"{name}/{key}" if name else key
                hard = isinstance(item.get(key, getlink=True), h5py.HardLink)
                if hard and not key.startswith("#"):  # MATLAB's own bookkeeping
                    self.down(own, item[key], depth + 1)
            return
        if not hasattr(item, "shape"):  # a type that the file names
            return
        kind = _class(item)
        if item.attrs.get("MATLAB_empty"):
            return
        group, _, key = name.rpartition("/")
        if kind == "char":
            if key.lower() in _UNITS:
                self.require_own(name, item)
                self.units[group] = _word(item)
            return
        if item.dtype.kind != "O" or not item.size:
            if item.size == 1:  # a single number is read at once
                self.require_own(name, item)
            self.see(name, item)
            return
        self.require_own(name, item)
        references = item[()].reshape(-1)[:_WIDEST]
        for k, reference in enumerate(references):
            if not isinstance(reference, h5py.Reference) or not reference:
                continue
            own = f"{name}/{k}" if kind == "cell" else f"{group}/{k}/{key}"
            inner = self.file[reference]
            self.down(name if len(references) == 1 else own, inner, depth + 1)


def _word(item: Any) -> str:
    return "".join(chr(int(code)) for code in item[()].reshape(-1)[:_WIDEST]).strip()


def _class(item: Any) -> str:
    value = item.attrs.get("MATLAB_class", b"")
    return value.decode("ascii", "replace") if isinstance(value, bytes) else str(value)
