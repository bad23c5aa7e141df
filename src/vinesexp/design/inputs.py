"""What a person gives for a design: rig values, lists of balls, ranges, an identified.csv."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vinesexp.errors import ParameterError, VinesexpError
from vinesexp.records.stored.result_columns import IDENTIFIED
from vinesexp.records.stored.tables import Table, read_rows
from vinesexp.rig import Oscillator
from vinesexp.units import Quantity, parse_quantity, refuse_impossible


@dataclass(frozen=True)
class Option:
    """A rig value: its symbol, its option, what it measures, and how one writes it."""

    symbol: str
    flag: str
    quantity: str
    example: str
    unit: str
    note: str = ""


#: In the order of the table.
RIG = (
    Option("M", "--mass", "mass", "4.7 kg", "kg"),
    Option("c1", "--damping", "damping", "3.02 N s/m", "N s/m"),
    Option("k1", "--stiffness", "stiffness", "1.147e4 N/m", "N/m"),
    Option("m", "--nes-mass", "mass", "32 g", "kg", "; of several balls '32 g; 32 g'"),
    Option("r", "--restitution", "ratio", "0.6", "", "; of several balls '0.6; 0.7'"),
)
#: The excitation.
EXCITATION = (
    Option("G", "--base-amplitude", "displacement", "0.25 mm", "m", " or '0.15:0.25 mm'"),
    Option("x0", "--release", "displacement", "30 mm", "m"),
    Option("v0", "--release-velocity", "velocity", "0.1 m/s", "m/s"),
    Option("frequency", "--frequency", "frequency", "7.86 Hz", "Hz", " or '7.2:8.4 Hz'"),
)
#: What is left out of the model unless it is given.
BEYOND = (
    Option("friction", "--friction", "acceleration", "0.02 m/s^2", "m/s^2", ": mu g of the balls"),
    Option(
        "quadratic", "--quadratic-damping", "quadratic damping", "2 N s^2/m^2", "N s^2/m^2",
        ": damping force over velocity squared",
    ),
    Option("coulomb", "--coulomb-damping", "force", "0.05 N", "N", ": dry friction of the mass"),
)  # fmt: skip
#: How what is designed will be built.
BUILT = (
    Option(
        "tolerance", "--tolerance", "ratio", "1 %", "",
        ": of the clearance as built, plus or minus; 0 for exactly (default 1 %)",
    ),
)  # fmt: skip
#: Clearances that a person has in mind: judged besides those that are found.
ASKED = (
    Option(
        "b", "--clearance", "displacement", "30 mm", "m",
        ", to be judged too; of several balls '23 mm; 34 mm', searched in that ratio",
    ),
)  # fmt: skip
OPTIONS = (*RIG, *EXCITATION, *BEYOND, *BUILT, *ASKED)
_LISTS, _RANGES = ("m", "r", "b"), ("G", "frequency")
#: What is read of identified.csv: a file typed in by hand needs no intervals and no records.
_READ = ("parameter", "value", "std_error", "unit", "method")
_IDENTIFIED = Table(
    IDENTIFIED.name, IDENTIFIED.step, tuple(c for c in IDENTIFIED.columns if c.name in _READ)
)


@dataclass(frozen=True)
class Given:
    """Everything given, each symbol as the values written for it: one, a list, or a range's ends.

    ``given["m"]`` holds one entry per ball, ``given["G"]`` one level or the two ends of a range.
    """

    values: Mapping[str, tuple[Quantity, ...]]

    def __contains__(self, symbol: str) -> bool:
        return symbol in self.values

    def __getitem__(self, symbol: str) -> tuple[Quantity, ...]:
        return self.values[symbol]

    def one(self, symbol: str) -> Quantity:
        """The single value of a symbol: the sum of ball masses, the greatest of a range."""
        found = self.values[symbol]
        if symbol == "m":
            error = sum(q.std_error**2 for q in found) ** 0.5
            return Quantity(sum(q.value for q in found), error)
        return found[-1] if symbol in _RANGES else found[0]

    @property
    def oscillator(self) -> Oscillator:
        """The oscillator, where M, c1 and k1 were given."""
        return Oscillator(*(self.values[symbol][0].value for symbol in ("M", "c1", "k1")))

    def size(self, symbol: str) -> float:
        """The value of a symbol, 0 where it was not given."""
        return self.values[symbol][0].value if symbol in self.values else 0.0

    def ends(self, symbol: str) -> tuple[float, float]:
        """Ends of a range; twice the value where one was given."""
        return self.values[symbol][0].value, self.values[symbol][-1].value


def gather(
    texts: Mapping[str, str | None], identified: Path | None = None, *, recorded: bool = False
) -> Given:
    """Read what was written for each symbol; an option wins over the file.

    Parameters
    ----------
    texts : mapping
        For each symbol what was written for it, None for nothing.
    identified : path, optional
        An identified.csv, or the results folder it is in.
    recorded : bool
        Whether the excitation is a record of the base, which is not among the texts.

    Raises
    ------
    ParameterError
        A value that cannot be read, or what is still missing, all of it in one line.
    """
    read = read_identified(identified) if identified is not None else {}
    given: dict[str, tuple[Quantity, ...]] = {name: (value,) for name, value in read.items()}
    given |= read_options(OPTIONS, texts, parse_values)
    if "v0" in given and "x0" not in given:
        given["x0"] = (Quantity(0.0, 0.0),)  # a blow: from rest with a velocity
    _ask_for_missing(given, recorded)
    _refuse_unlike(given)
    for option in (*BEYOND, *BUILT):
        if option.symbol in given and given[option.symbol][0].value < 0.0:
            raise ParameterError("expected zero or above", where=option.flag)
    if "tolerance" in given and not given["tolerance"][0].value < 0.5:
        raise ParameterError("expected less than 50 %", where="--tolerance")
    for symbol, other in (("G", None), ("x0", "v0")):
        moves = other in given and given[other][0].value != 0.0
        if symbol in given and any(q.value == 0.0 for q in given[symbol]) and not moves:
            flag = next(o.flag for o in EXCITATION if o.symbol == symbol)
            raise ParameterError(
                "found 0: without excitation there is no best clearance", where=flag
            )
    return Given(given)


def read_options(
    options: Sequence[Option],
    texts: Mapping[str, str | None],
    parse: Callable[[str, Option], tuple[Quantity, ...]],
) -> dict[str, tuple[Quantity, ...]]:
    """What was written for each option, as `parse` reads it; mistakes name the option."""
    found = {}
    for option in options:
        text = texts.get(option.symbol)
        if text is None:
            continue
        try:
            found[option.symbol] = parse(text, option)
            for one in found[option.symbol]:
                refuse_impossible(text, one.value, option.quantity)
        except ParameterError as error:
            raise ParameterError(error.problem, where=option.flag) from None
    return found


def _refuse_unlike(given: Mapping[str, tuple[Quantity, ...]]) -> None:
    """Restitutions or clearances that are not as many as there are balls; clearances of zero."""
    balls = len(given["m"]) if "m" in given else len(given.get("r", "1"))
    of = f"for {balls} ball{'s' if balls > 1 else ''}: give one, or one per ball"
    if len(given.get("r", "1")) not in (1, balls):
        raise ParameterError(f"{len(given['r'])} restitutions {of}", where="--restitution")
    if "b" not in given:
        return
    if any(not q.value > 0.0 for q in given["b"]):
        raise ParameterError("expected clearances above zero", where="--clearance")
    if len(given["b"]) not in (1, balls):
        raise ParameterError(
            f"{len(given['b'])} clearances {of} in the order of --nes-mass", where="--clearance"
        )


def ends_of(text: str) -> tuple[str, str]:
    """The two ends of a range ``a:b unit``; the first takes the unit of the second.

    Examples
    --------
    >>> ends_of("5:60 mm")
    ('5 mm', '60 mm')
    >>> ends_of("5e-3 m:60 mm")
    ('5e-3 m', '60 mm')
    """
    first, last = text.split(":", 1)
    if not re.search(r"[A-Za-z%]", re.sub(r"(?<=[0-9.])[eE](?=[+-]?\d)", "", first)):
        first += re.sub(r"^[\s+-]*[0-9.,]+(?:[eE][+-]?\d+)?", "", last)
    return first, last


def parse_values(text: str, option: Option) -> tuple[Quantity, ...]:
    """One value, a list ``a; b`` of balls, or a range ``a:b unit``.

    Examples
    --------
    >>> [q.value for q in parse_values("7.2:8.4 Hz", EXCITATION[3])]
    [7.2, 8.4]
    >>> [q.value for q in parse_values("32 g; 16 g", RIG[3])]
    [0.032, 0.016]
    """
    if option.symbol in _LISTS and ";" in text:
        return tuple(parse_quantity(part, option.quantity) for part in text.split(";"))
    if option.symbol in _RANGES and ":" in text:
        low, high = ends_of(text)
        ends = parse_quantity(low, option.quantity), parse_quantity(high, option.quantity)
        if not 0.0 < ends[0].value <= ends[1].value:
            raise ParameterError(
                f"found the range '{text}'; write the smaller value first, and both above zero"
            )
        return ends
    return (parse_quantity(text, option.quantity),)


def _ask_for_missing(given: Mapping[str, tuple[Quantity, ...]], recorded: bool) -> None:
    def wanted(options: list[Option]) -> str:
        return ", ".join(f"{o.flag} '{o.example}'" for o in options)

    if "G" not in given and "x0" not in given and not recorded:
        excitation = [o for o in EXCITATION if o.symbol in ("G", "x0")]
        missing = [o for o in RIG if o.symbol not in given]
        also = f"; also give {wanted(missing)}" if missing else ""
        raise ParameterError(
            f"nothing to design for: give {' or '.join(wanted([o]) for o in excitation)}{also}"
        )
    symbols = {o.symbol for o in RIG} if "G" in given or recorded else {"r"}
    if "v0" in given:
        symbols |= {"M", "k1"}
    missing = [o for o in RIG if o.symbol in symbols and o.symbol not in given]
    if missing:
        raise ParameterError(f"values are missing: give {wanted(missing)}")


def read_identified(path: Path) -> dict[str, Quantity]:
    """M, c1, k1 and r with standard errors from an identified.csv (rows `combined`).

    Raises
    ------
    TableError
        Unreadable file, a missing column, or a cell that is no number.
    VinesexpError
        A value with a wrong unit, or no value at all.
    """
    if path.is_dir():
        path = path / "identified.csv"
    found: dict[str, Quantity] = {}
    options = {option.symbol: option for option in RIG}
    for line, row in enumerate(read_rows(path, _IDENTIFIED), start=2):
        symbol = "r" if row["parameter"] == "r_1" else row["parameter"]
        if symbol not in options or row["method"] != "combined" or symbol in found:
            continue
        error_text = row["std_error"] or "0"
        text = f"{row['value']} +- {error_text} {row['unit'].strip() if symbol != 'r' else ''}"
        try:
            found[symbol] = parse_quantity(text, options[symbol].quantity)
        except ParameterError as error:
            raise VinesexpError(error.problem, file=path, where=f"line {line}") from None
    if not found:
        raise VinesexpError("holds no row with method 'combined' of M, c1, k1 or r", file=path)
    return found
