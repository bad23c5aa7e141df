"""The answer in words, first of all that is shown: what to build, what it gives, what to fear."""

from __future__ import annotations

import math

import numpy as np

from vinesexp.design.advice import WORTH, Advice
from vinesexp.design.answer import Answer
from vinesexp.design.cliffs import Side
from vinesexp.design.compared import Race
from vinesexp.design.numbers_text import percent
from vinesexp.design.recorded import UnderRecord
from vinesexp.design.released import Falls


def mm(length: float) -> str:
    """An amplitude (m) in mm, as exactly as it is known to a reader: three digits.

    Examples
    --------
    >>> mm(0.0103921), clearance(0.0339234)
    ('10.4', '33.92')
    """
    return f"{1e3 * length:.3g}"


def clearance(length: float) -> str:
    """A clearance (m) in mm, as exactly as it is built: four digits."""
    return f"{1e3 * length:.4g}"


def headline_of(answer: Answer) -> str:
    """One paragraph: what to build, or that nothing helps, and why."""
    said = []
    if answer.advice is not None:
        said += (
            nothing_helps(answer.advice) if answer.advice.hopeless else build_this(answer.advice)
        )
    if answer.driven is not None:
        said += driven(answer.driven)
    if answer.falls is not None:
        said += releases(answer.falls)
    if answer.stopped:
        said.append("The simulation was stopped before its end: this is not all that was asked.")
    if not said:
        said.append("By theory alone; nothing was simulated.")
        for name, found in (("b_c", answer.theory.b_c), ("b_t", answer.theory.b_t)):
            if found is not None:
                said.append(
                    f"{name} = {clearance(found.exact)} mm (published: "
                    f"{clearance(found.published)})."
                )
        said.append("Which starts reach these clearances only a simulation tells.")
    if answer.falls is None and answer.theory.unreached:
        levels = ", ".join(mm(level) for level in answer.theory.unreached)
        said.append(
            f"Down to {levels} mm theory's fastest clearance is wider than the release is large: "
            "most balls would never be struck, so it is not given."
        )
    return " ".join(said)


def build_this(advice: Advice) -> list[str]:
    """A clearance with its tolerance, what it gives, how far the cliff, what else there is."""
    best, task = advice.robust, advice.task
    each = "; ".join(clearance(best.b * ratio) for ratio in dict.fromkeys(task.ratios))
    tolerance = f" +- {100.0 * task.tolerance:.2g} %" if task.tolerance else ""
    at = _between(task.levels, 1e3, "mm"), _between(task.frequencies, 1.0, "Hz")
    said = [
        f"Build a one-sided clearance b of {each} mm{tolerance}.",
        f"At a base amplitude of {at[0]} and {at[1]} the mean amplitude is then "
        f"{mm(best.random_mean)} mm over random starts, below {mm(best.random_p90)} mm "
        f"(+- {mm(2.0 * best.random_error)}) for nine of ten, against {mm(best.random_bare)} mm "
        f"without a ball ({percent(1.0 - best.random_mean / best.random_bare)} less); from rest "
        f"with the ball at a wall {mm(best.rest_mean)} mm.",
    ]
    if advice.least_mean.rest_mean < 0.8 * best.random_mean:
        said.append(
            f"Where nothing but rest with the ball at a wall is to be expected, b = "
            f"{clearance(advice.least_mean.b)} mm leaves {mm(advice.least_mean.rest_mean)} mm, and "
            f"{mm(advice.least_mean.random_mean)} mm over random starts."
        )
    tied = advice.found.race.tied
    if len(tied) > 1:
        said.append(
            f"Clearances from {clearance(tied[0])} to {clearance(tied[-1])} mm are "
            f"{_alike(advice.found.race)}; this one has the widest margin."
        )
    said.append(_cliff(advice))
    return [*said, damper(advice)]


def nothing_helps(advice: Advice) -> list[str]:
    """That no clearance takes a twentieth off the bare amplitude."""
    grid, best = advice.found.grid, advice.robust
    taken = max(advice.gain, 0.0)
    return [
        f"No clearance helps: from {clearance(float(grid[0]))} to "
        f"{clearance(float(grid[-1]))} mm the best takes {percent(taken)} off the bare "
        f"amplitude of {mm(best.random_bare)} mm.",
        f"The ball has {100.0 * advice.task.eps:.2g} % of the mass, the damping ratio is "
        f"{advice.task.oscillator.zeta:.2g}.",
        damper(advice),
    ]


def _alike(race: Race) -> str:
    if race.within <= WORTH:
        return f"equal within {max(percent(race.within), '1 %')}"
    return f"no different beyond the error of {race.starts} random starts"


def _cliff(advice: Advice) -> str:
    sides = (("narrower", advice.cliffs.narrower), ("wider", advice.cliffs.wider))
    words = [_side(name, side) for name, side in sides if side.jump is not None]
    if not words:
        least = min(side.clear for _, side in sides)
        return f"Within {percent(least)} on either side the amplitude rises by less than a quarter."
    clear = [name for name, side in sides if side.jump is None]
    rest = f"; {clear[0]} it does not within 10 %" if clear else ""
    return f"The amplitude jumps by a quarter or more {' and '.join(words)}{rest}."


def _side(name: str, side: Side) -> str:
    assert side.jump is not None
    ends = f"from {mm(side.before or 0.0)} to {mm(side.amplitude or 0.0)} mm"
    return f"{100.0 * side.jump:.2g} % {name} ({ends})"


def damper(advice: Advice) -> str:
    """Whether a tuned mass damper of the same mass does better, in words."""
    optimal, ball = advice.optimal, advice.robust.random_mean
    if min(advice.den_hartog.detuned, optimal.detuned) >= advice.bare:
        return "A tuned mass damper of the same mass does not help either."
    exact, off = min(optimal.amplitude, advice.den_hartog.amplitude), optimal.detuned
    word = "less than the ball" if off < ball else "more than the ball"
    if exact < ball <= off:
        word = "less than the ball if its tuning is kept, more if not"
    return (
        f"A tuned mass damper of the same mass would leave {mm(exact)} mm, {mm(off)} mm when 5 % "
        f"detuned: {word}."
    )


def driven(found: UnderRecord) -> list[str]:
    """Under a recorded base: the clearance of least rms, and that of least peak."""
    bare, rms, peak = found.bare, found.found[found.least_rms], found.found[found.least_peak]
    record = f"the recorded base ({found.duration:.4g} s, peak {mm(found.base_peak)} mm)"
    without = f"without a ball rms {mm(float(bare.rms[0]))} mm, peak {mm(float(bare.peak[0]))} mm"
    if found.hopeless:
        return [f"Under {record} no clearance takes 5 % off the deflection x - x_e ({without})."]
    return [
        f"Under {record} a clearance of {clearance(rms.b)} mm leaves the least rms of the "
        f"deflection x - x_e, {mm(float(np.median(rms.rms)))} mm (median over balls at rest "
        f"anywhere and at the walls); {clearance(peak.b)} mm the least peak, below "
        f"{mm(float(np.percentile(peak.peak, 90.0)))} mm for nine of ten; {without}."
    ]


def releases(falls: Falls) -> list[str]:
    """The release: to each level how fast, from where, with which clearance."""
    helped = [k for k in range(len(falls.levels)) if falls.helps(k)]
    walled = [k for k in range(len(falls.levels)) if falls.helps(k, at_wall=True)]
    said = []
    if not helped:
        said.append(
            "Released, three of four balls at rest somewhere in their cavity are no faster than "
            "none at any clearance."
        )
    ways = [
        f"to {mm(falls.levels[k])} mm in {_time(falls.found[i].sure(k))} with b = "
        f"{clearance(falls.found[i].b)} mm (without a ball {_time(falls.bare[k])})"
        for k, i in enumerate(falls.fastest)
        if k in helped
    ]
    if ways:
        said.append(f"Released, three of four balls at rest somewhere bring it {'; '.join(ways)}.")
    walls = [
        f"to {mm(falls.levels[k])} mm in {_time(falls.found[i].sure(k, at_wall=True))} with b = "
        f"{clearance(falls.found[i].b)} mm"
        for k, i in enumerate(falls.fastest_at_wall)
        if k in walled
    ]
    if walls:
        said.append(f"A ball put at the wall that will push it: {'; '.join(walls)}.")
    return said


def _time(seconds: float) -> str:
    return f"{seconds:.2f} s" if math.isfinite(seconds) else "no time that was watched"


def _between(ends: tuple[float, float], size: float, unit: str) -> str:
    low, high = (size * end for end in ends)
    return f"{low:.4g} {unit}" if low == high else f"{low:.4g} to {high:.4g} {unit}"
