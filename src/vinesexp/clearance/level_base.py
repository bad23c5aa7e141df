"""The base at one level of periodic tests: as measured where it was, else as the sheet says.

Where the two differ a warning says so; predictions use what was measured.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vinesexp.clearance.base_choice import Believed, believed, contradicts, denies, widened_to
from vinesexp.records.checks import Check
from vinesexp.records.uncertainties import Uncertainties
from vinesexp.units import Quantity

Rows = Sequence[Mapping[str, str]]

#: Relative standard uncertainty of a base amplitude that nobody measured: what the display of a
#: shaker is good for. Of a base that is stated as exact: zero.
SHEET_ERROR = 0.02
#: A frequency that nobody measured is as good as the generator's clock and its display: twice the
#: relative error of the instrument's clock.
GENERATOR = 2.0
#: Relative error of a generator's display, which rounds whatever its clock is good for.
DISPLAY_ERROR = 1e-4
#: Standard errors from which on measured and sheet differ.
DIFFERS = 3.0
#: Share by which a base amplitude may be off without a word: what a lab sets it to.
NEGLIGIBLE = 5e-3
#: Shares from which on the base is worth a warning: harmonics, wander, dip.
HARMONICS, WANDER, DIP = 0.03, 0.02, 0.05


@dataclass(frozen=True)
class LevelBase:
    """Base motion of a level.

    Attributes
    ----------
    G : amplitude, m, with its standard error.
    frequency : Hz; None where the tests do not share one.
    measured : number of records that have a base channel; 0: all is from the sheet.
    believed : whose amplitude it is.
    channel : amplitude that the base channel shows, m; None without one.
    felt : amplitude that the motion of the mass asks for, m; None where unknown.
    denied : whether it contradicts both channel and sheet, which agree.
    """

    G: Quantity
    frequency: Quantity | None
    measured: int = 0
    believed: Believed = "sheet"
    channel: float | None = None
    felt: Quantity | None = None
    denied: bool = False


def base_of_level(
    nominal: float,
    frequencies: set[float],
    rows: Rows,
    *,
    inputs: Uncertainties,
    felt: Quantity | None = None,
) -> LevelBase:
    """Mean of the measured rows, else the sheet; where these differ, what the mass felt decides.

    Parameters
    ----------
    nominal : float
        Base amplitude of the sheet, m.
    frequencies : set of float
        Those of the sheet, Hz.
    rows : sequence of mappings
        Of base.csv, of the level's records.
    inputs : Uncertainties
        Of the base channel's sensitivity and of the clock.
    felt : Quantity, optional
        The base as the motion of the mass shows it, m (`base_choice.felt_of`).

    Examples
    --------
    >>> base = base_of_level(0.25e-3, {7.86}, [], inputs=Uncertainties())
    >>> base.G.std_error, base.frequency.value, base.measured
    (5e-06, 7.86, 0)
    """
    sheet = frequencies.pop() if len(frequencies) == 1 else None
    share = SHEET_ERROR if inputs.base.of(1.0) else 0.0
    stated = Quantity(nominal, share * nominal)
    if not rows:
        at = None if sheet is None else Quantity(sheet, GENERATOR * inputs.clock.of(sheet))
        if felt is not None and contradicts(felt, stated):
            return LevelBase(widened_to(stated, felt), at, believed="open", felt=felt)
        return LevelBase(stated, at, felt=felt)
    gain, clock = inputs.base.of(1.0), inputs.clock.of(1.0)
    G, noise = _mean([(float(r["amplitude_m"]), float(r["amplitude_error_m"])) for r in rows])
    amplitude = Quantity(G, math.hypot(noise, gain * G))
    source: Believed = "channel"
    denied = False
    if _differs(amplitude, nominal):
        amplitude, source = believed(stated, amplitude, felt)
    elif felt is not None and denies(felt, amplitude):
        amplitude, source, denied = widened_to(amplitude, felt), "open", True
    f, noise = _mean([(float(r["frequency_hz"]), float(r["frequency_error_hz"])) for r in rows])
    # Tests at different frequencies have no prediction of their own: none is drawn for their mean.
    shared = _spread([float(r["frequency_hz"]) for r in rows]) < 1e-3 * f
    return LevelBase(
        amplitude,
        Quantity(f, math.hypot(noise, clock * f)) if shared else None,
        len(rows),
        source,
        G,
        felt,
        denied,
    )


def _differs(amplitude: Quantity, nominal: float) -> bool:
    """Whether the base channel contradicts the sheet."""
    off = abs(amplitude.value / nominal - 1.0)
    return off > max(DIFFERS * amplitude.std_error / nominal, NEGLIGIBLE)


def _mean(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Mean, and what scatter from record to record and the errors of each leave of it."""
    values = [value for value, _ in pairs]
    centre = sum(values) / len(values)
    scatter = math.sqrt(sum((v - centre) ** 2 for v in values) / len(values))
    return centre, math.hypot(scatter, max(error for _, error in pairs))


def _spread(values: Sequence[float]) -> float:
    return max(values) - min(values)


def base_checks(
    name: str, nominal: float, frequencies: set[float], base: LevelBase, rows: Rows
) -> list[Check]:
    """Where the base did not do what the sheet says, or was no steady sine.

    Parameters
    ----------
    name : str
        Of the level.
    nominal, frequencies : float, set of float
        Of the sheet, m and Hz.
    base : LevelBase
    rows : sequence of mappings
        Of base.csv, of the level's records.
    """
    checks = _amplitude(name, nominal, base)
    if not rows:
        return checks
    if len(frequencies) == 1 and base.frequency is not None:
        sheet, found = next(iter(frequencies)), base.frequency
        allowed = math.hypot(found.std_error, DISPLAY_ERROR * sheet)
        if abs(found.value - sheet) > DIFFERS * allowed:
            checks.append(
                Check("", "base frequency", "warning",
                      f"{name}: the base channel shows {found.value:.6g} Hz, the sheet says "
                      f"{sheet:.6g} Hz; predictions use what was measured; check frequency_hz and "
                      "the sample rate")
            )  # fmt: skip
    return checks + [check for row in rows for check in _steadiness(row)]


def _amplitude(name: str, nominal: float, base: LevelBase) -> list[Check]:
    """Where channel, sheet and motion of the mass do not say the same."""
    felt = "" if base.felt is None else f"{1e3 * base.felt.value:.4g} mm"
    if base.channel is None:
        if base.believed != "open":
            return []
        detail = (
            f"{name}: the mass moves as by a base amplitude of {felt}; the error of b_c holds "
            "both. No channel shows the base: check base_amplitude_mm, or the sensitivity of the "
            "displacement"
        )
        return [Check("", "base amplitude", "warning", detail)]
    off = base.channel / nominal - 1.0
    if base.believed == "channel" and not _differs(base.G, nominal):
        return []
    if base.denied:
        detail = (
            f"{name}: the mass moves as by a base amplitude of {felt}, base channel and sheet say "
            f"{1e3 * base.channel:.4g} mm; the error of b_c holds both. If the sheet was read off "
            "the channel, its sensitivity is wrong; else that of the displacement, or f0 and zeta "
            "at this amplitude"
        )
        return [Check("", "base amplitude", "warning", detail)]
    detail = (
        f"{name}: the base channel shows {1e3 * base.channel:.4g} mm, "
        f"{100 * abs(off):.{2 if abs(off) < 0.995 else 3}g} % "
        f"{'below' if off < 0.0 else 'above'} the sheet; "
    )
    if base.believed == "sheet":
        detail += (
            f"the mass moves as by {felt}, as the sheet says: the sensitivity of the base channel "
            f"is {base.channel / nominal:.3g} times what campaign.yaml states; predictions use "
            "the sheet"
        )
    elif base.believed == "channel":
        detail += (
            f"the mass moves as by {felt}, as the channel says; predictions use what was "
            "measured; check base_amplitude_mm"
        )
    elif felt:
        detail += (
            f"the mass moves as by {felt}, which is neither; predictions use that, with an error "
            "that reaches the nearer one; check base_amplitude_mm and the sensitivities"
        )
    else:
        detail += (
            "nothing shows which is right: the error of b_c holds both; check base_amplitude_mm "
            "and the base channel's sensitivity"
        )
    return [Check("", "base amplitude", "warning", detail)]


def _steadiness(row: Mapping[str, str]) -> list[Check]:
    harmonics = math.hypot(float(row["harmonic_2"]), float(row["harmonic_3"]))
    wander, dip = float(row["wander"]), float(row["dip"])
    words = []
    if harmonics > HARMONICS:
        words.append(f"harmonics of {100 * harmonics:.2g} %")
    if wander > WANDER:
        words.append(f"an amplitude that wanders by {100 * wander:.2g} %")
    if dip > DIP:
        words.append(f"a dip of {100 * dip:.2g} %")
    if not words:
        return []
    detail = f"the base moved with {', '.join(words)}; predictions are for a steady sine"
    return [Check(row["record"], "base motion", "warning", detail)]
