"""f0, zeta, c1 and k1 at the amplitude of each level, as the report shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vinesexp.figures.numbers import plus_minus, significant

Row = Mapping[str, str]

_VALUES = {
    "f0": ("f0_hz", "f0_error_hz"),
    "zeta": ("zeta", "zeta_error"),
    "c1": ("c1_n_s_m", "c1_error_n_s_m"),
    "k1": ("k1_n_m", "k1_error_n_m"),
}


def levels_table(rows: Sequence[Row]) -> list[dict[str, str]]:
    """Rows of level_values.csv as text; a value that is not known is a dash.

    Examples
    --------
    >>> row = {"base_amplitude_mm": "0.25", "amplitude_m": "0.0053", "f0_hz": "7.86732",
    ...        "f0_error_hz": "0.0012", "zeta": "0.00776", "zeta_error": "0.00002"}
    >>> levels_table([row])[0]["zeta"], levels_table([row])[0]["c1"]
    ('(7.760 ± 0.039)·10⁻³', '–')
    """
    return [
        {
            "base": significant(row["base_amplitude_mm"]),
            "amplitude": significant(row["amplitude_m"], factor=1e3),
            **{name: _shown(row, *columns) for name, columns in _VALUES.items()},
        }
        for row in rows
    ]


def _shown(row: Row, value: str, error: str) -> str:
    if not row.get(value):
        return "–"
    return plus_minus(float(row[value]), float(row[error]))
