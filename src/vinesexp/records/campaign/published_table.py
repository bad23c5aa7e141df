"""Published values that a campaign is compared with: the table that campaign.yaml names.

One row a value: what it is of (quantity, and the test it was found in), the value as printed, and
where it stands. Nothing of it enters the analysis.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from vinesexp.errors import ParameterError, VinesexpError, nearest
from vinesexp.records.campaign.problems import named_file
from vinesexp.records.campaign.yamltree import Section
from vinesexp.records.stored.tables import Row, Table, columns, read_rows

#: Rig values: rows of identified.csv, and what follows from them.
RIG = ("f0", "zeta", "M", "c1", "k1", "r", "eps", "lambda")
#: What a published value can be of, each with what its row has to say.
QUANTITIES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(RIG, ()),
    "best clearance": ("base_amplitude_mm",),
    "best of tried": ("base_amplitude_mm", "tried_mm"),
    "b_c": ("base_amplitude_mm",),
    "b_t": ("release_mm",),
    "fastest clearance": ("release_mm",),
    "fastest of tried": ("release_mm", "level_mm", "tried_mm"),
    "largest amplitude": ("clearance_mm", "base_amplitude_mm"),
    "time to level": ("clearance_mm", "release_mm", "level_mm"),
    "transition amplitude": ("clearance_mm", "release_mm"),
}
PUBLISHED = Table("published", "", columns(
    "quantity value unit? clearance_mm? tried_mm? source note? base_amplitude_mm:number? "
    "release_mm:number? level_mm:number?"
))  # fmt: skip


@dataclass(frozen=True)
class PublishedValue:
    """One row; empty text and None where the row says nothing.

    Attributes
    ----------
    quantity : a key of `QUANTITIES`.
    value : as printed; of a clearance of several balls as ``33;10``.
    unit : of the value, for people.
    clearance_mm : of the test, as in records.csv.
    tried_mm : clearances that the value was the best of, parted by ``|``.
    base_amplitude_mm, release_mm, level_mm : of the test; amplitude to be reached.
    source, note : where it stands, and how it is to be read.
    """

    quantity: str
    value: str
    unit: str = ""
    clearance_mm: str = ""
    tried_mm: str = ""
    base_amplitude_mm: float | None = None
    release_mm: float | None = None
    level_mm: float | None = None
    source: str = ""
    note: str = ""

    @property
    def tried(self) -> tuple[str, ...]:
        """The clearances of `tried_mm`, one by one."""
        return tuple(self.tried_mm.split("|"))

    @property
    def half_digit(self) -> float:
        """Half a unit of the last printed digit: the value says no more.

        Examples
        --------
        >>> PublishedValue("r", "0.60").half_digit, PublishedValue("k1", "1.147e4").half_digit
        (0.005, 5.0)
        """
        digits, _, power = self.value.lower().partition("e")
        decimals = len(digits.partition(".")[2])
        return float(f"0.5e{int(power or 0) - decimals}")


def read_published(
    top: Section, folder: Path, *, allow_outside: bool
) -> tuple[PublishedValue, ...]:
    """The table named by ``published``, seen from the campaign folder; mistakes are noted."""
    name = top.text("published")
    if name is None:
        return ()
    with top.at("published"):
        file = named_file(name, folder, allow_outside)
        if not file.is_file():
            raise ParameterError(f"no file '{name}' in the campaign folder")
        where, found = "", []
        try:
            for line, row in enumerate(read_rows(file, PUBLISHED), start=2):
                where = f", line {line}"
                found.append(_value(row))
        except VinesexpError as error:
            where = f", {error.where}" if error.where else where
            raise ParameterError(f"'{name}'{where}: {error.problem}") from None
        return tuple(found)
    return ()


def _value(row: Row) -> PublishedValue:
    quantity = row["quantity"]
    if quantity not in QUANTITIES:
        raise ParameterError(f"unknown quantity '{quantity}'; {nearest(quantity, QUANTITIES)}")
    missing = [name for name in QUANTITIES[quantity] if row.get(name) in (None, "")]
    if missing:
        raise ParameterError(f"'{quantity}' needs {' and '.join(missing)}")
    try:
        [float(part) for part in row["value"].split(";")]
    except ValueError:
        raise ParameterError(f"found '{row['value']}' as value, expected a number") from None
    return PublishedValue(**{name: row[name] for name in PUBLISHED.names if name in row})
