"""Does the predicted b_c lie where the tests show the end of permanent two impacts per cycle?"""

from __future__ import annotations

import math
from collections.abc import Mapping

from vinesexp.figures.numbers import outwards
from vinesexp.records.tables import number

Row = Mapping[str, str]


#: Width of the interval of b_c, over b_c, up to which it can agree or disagree with anything.
DECIDES = 0.1


def within(row: Row) -> str:
    """Where a measured clearance lies for sure, from the tried ones around it; empty if unknown.

    Examples
    --------
    >>> within({"measured_mm": "27", "measured_low_mm": "26", "measured_high_mm": "28"})
    'between 26 and 28 mm'
    >>> within({"measured_mm": "27", "measured_low_mm": "", "measured_high_mm": "28"})
    'below 28 mm'
    """
    if not row.get("measured_mm"):
        return ""
    low, high = number(row["measured_low_mm"]), number(row["measured_high_mm"])
    least, most = outwards(low, high)
    if least and most:
        return f"between {least} and {most} mm"
    if least:
        return f"above {least} mm"
    return f"below {most} mm" if most else "not bracketed by what was tried"


#: A prediction that misses the bracket by less than this share is reported as agreeing: clearances
#: are set to a few tenths of a millimetre.
NEAR = 0.01


def agreement(lowest: Row, end: Row) -> tuple[str, bool | None]:
    """Whether b_c lies where it should: at the end of permanent impacts, else at the optimum.

    Returns
    -------
    sentence : str
    agrees : bool or None
        None where there is nothing to compare, or a bound that b_c does not contradict.

    Examples
    --------
    >>> predicted = {"exact_mm": "33.91", "predicted_low_mm": "33.89", "predicted_high_mm": "33.94"}
    >>> end = {"measured_mm": "34.25", "measured_low_mm": "34", "measured_high_mm": "34.5"}
    >>> agreement({}, {**end, **predicted})
    ('b_c is 0.3 % below the clearances between which two impacts per cycle end', True)
    >>> agreement({}, {**end, **predicted, "measured_low_mm": "31", "measured_high_mm": ""})
    ('two impacts per cycle end above 31 mm: b_c is not tested further', None)
    """
    if end.get("measured_mm"):
        row, what = end, "two impacts per cycle end"
    else:
        row, what = lowest, "amplitude is lowest"
        if lowest.get("bound"):
            return "nothing to compare: the lowest amplitude is at the edge of what was tried", None
    if not row.get("measured_mm") or not row.get("exact_mm"):
        return "nothing to compare", None
    low = number(row["measured_low_mm"])
    high = number(row["measured_high_mm"])
    bound = low is None or high is None
    low = low if low is not None else 0.0
    high = high if high is not None else math.inf
    reach = float(row["predicted_low_mm"]), float(row["predicted_high_mm"])
    exact = float(row["exact_mm"])
    width = (reach[1] - reach[0]) / exact
    if width > DECIDES:
        return (
            f"cannot decide: the 95 % interval of b_c is {100.0 * width:.0f} % wide; the error "
            "budget says what would narrow it most",
            None,
        )
    if reach[0] <= high and reach[1] >= low:
        if bound:
            return f"{what} {within(row)}: b_c is not tested further", None
        return f"b_c lies in the gap in which {what}", True
    apart = exact / low - 1.0 if exact < low else exact / high - 1.0
    side = "below" if apart < 0.0 else "above"
    share = f"b_c is {100.0 * abs(apart):.1f} % {side}"
    if bound:
        tried = low if apart < 0.0 else high
        text = f"{share} {tried:.4g} mm, but {what} {within(row)}"
        return text, None if abs(apart) < NEAR else False
    return f"{share} the clearances between which {what}", abs(apart) < NEAR
