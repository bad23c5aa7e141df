"""The answer in words: first what to build, what it gives, what to fear; then the notes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from vinesexp.design.advice import JUDGED, Advice, Judged
from vinesexp.design.around import JUMP, STEPS, Side
from vinesexp.design.best_clearance import MATTERS, Race
from vinesexp.design.ensemble import mean_of_cycle
from vinesexp.design.inputs import BEYOND, Given
from vinesexp.design.predictions import Theory
from vinesexp.design.recorded import UnderRecord
from vinesexp.design.released import Falls
from vinesexp.design.task import WORTH, Task
from vinesexp.excitation import WeakDamping
from vinesexp.rig import UNHEARD_OF
from vinesexp.theory.multiple import gaps
from vinesexp.units import with_error

#: Share of the peak of a record from which on what is taken off it is named.
SEEN = 1e-3

# What `design` has found, whole: theory, simulation of a base motion, simulation of a release.


@dataclass(frozen=True)
class Answer:
    """The answer to one question; None where its excitation was not given or nothing simulated.

    `driven` is that under a recorded base; `stopped`: the simulation was broken off.
    """

    given: Given
    theory: Theory
    advice: Advice | None
    falls: Falls | None
    driven: UnderRecord | None = None
    stopped: bool = False


def mm(length: float) -> str:
    """A length (m) in mm, in four digits.

    Examples
    --------
    >>> mm(0.0339234), mm(2.177e-7), mm(0.02), mm(0.0)
    ('33.92', '0.0002177', '20.00', '0.000')
    """
    return f"{1e3 * length:#.4g}".removesuffix(".")


def percent(share: float) -> str:
    """A share in whole percent, never minus zero.

    Examples
    --------
    >>> percent(0.726), percent(-0.001)
    ('73 %', '0 %')
    """
    return f"{round(100.0 * share) + 0:d} %"


def brief(value: float) -> str:
    """An amplitude (m) in mm, as exactly as it is known to a reader: three digits.

    Examples
    --------
    >>> brief(0.0103921), clearance(0.0339234), clearance(0.034)
    ('10.4', '33.92', '34')
    """
    return f"{1e3 * value:.3g}"


def clearance(length: float) -> str:
    """A clearance (m) in mm, as exactly as it is built: four digits."""
    return f"{1e3 * length:.4g}"


def headline_of(answer: Answer) -> str:
    """One paragraph: what to build, or that nothing helps, and why."""
    held = held_by_friction(answer.given)
    said: list[str] = []
    if answer.advice is not None:
        said += _clearances(answer.advice)
    if answer.driven is not None:
        said += driven(answer.driven)
    if answer.falls is not None:
        said += releases(answer.falls)
    if answer.stopped:
        said.append("The simulation was stopped before its end: a part of the answer is missing.")
    if not said:
        said.append("These values are theory alone; nothing was simulated.")
        for name, found in (("b_c", answer.theory.b_c), ("b_t", answer.theory.b_t)):
            if found is not None:
                said.append(
                    f"{name} = {clearance(found.exact)} mm (published: "
                    f"{clearance(found.published)})."
                )
        said.append("Only a simulation shows which starts lead to this motion.")
    if answer.falls is None and answer.theory.unreached:
        levels = ", ".join(brief(level) for level in answer.theory.unreached)
        said.append(
            f"For {levels} mm the fastest clearance by theory is larger than the release, so most "
            "balls would never meet a wall; it is not given."
        )
    return " ".join([*held, *said])


def held_by_friction(given: Given) -> list[str]:
    """That dry friction holds the mass, so that no ball has a motion to reduce; what would move it.

    On a moving base friction has to give the mass the acceleration of the base, released it has to
    balance the spring.
    """
    friction = given.size("coulomb")
    if friction == 0.0:
        return []
    M, k1 = given.one("M").value, given.one("k1").value
    w2 = (2.0 * math.pi * given.one("frequency").value) ** 2 if "frequency" in given else k1 / M
    base = given.one("G").value if "G" in given else math.inf
    still = "x0" in given and given.size("v0") == 0.0
    release = abs(given.size("x0")) if still else math.inf
    return [
        f"Dry friction of {friction:.3g} N holds the mass {where}, where {force} is "
        f"{stiffness * length:.3g} N: give a {name} above {brief(friction / stiffness)} mm, or "
        "less friction."
        for where, force, stiffness, length, name in (
            ("to its base", "M (2 pi f)^2 G", M * w2, base, "base amplitude"),
            ("where it is released", "k1 x0", k1, release, "release"),
        )
        if stiffness * length <= friction
    ]


def _clearances(advice: Advice) -> list[str]:
    if advice.hopeless:
        return nothing_helps(advice)
    if advice.random_gain < WORTH:
        return from_the_wall_alone(advice)
    return build_this(advice)


def build_this(advice: Advice) -> list[str]:
    """A clearance with its tolerance, what it gives, how far the cliff, what else there is."""
    best, task = advice.robust, advice.task
    each = _each(task, best.b)
    at = _between(task.levels, 1e3, "mm"), _between(task.frequencies, 1.0, "Hz")
    said = [
        f"Build a one-sided clearance b of {each} mm{within(task.tolerance)}.",
        f"At a base amplitude of {at[0]} and {at[1]} the mean amplitude is then "
        f"{brief(best.random_mean)} mm over random starts "
        f"({percent(1.0 - best.random_mean / best.random_bare)} less than the "
        f"{brief(best.random_bare)} mm without a ball) and {brief(best.rest_mean)} mm from rest "
        "with the ball at a wall.",
        _by_start(best),
    ]
    other = advice.least_mean
    better = other.rest_mean < 0.8 * best.random_mean or (
        other.random_mean < (1.0 - WORTH) * best.random_mean
    )
    if better and abs(other.b / best.b - 1.0) > task.tolerance:
        said.append(_at_a_wall(task, other))
    return [*said, *_ties(task, advice.found.race), _cliff(advice), damper(advice)]


def _at_a_wall(task: Task, one: Judged, bare: str = "") -> str:
    """What a clearance gives that is best for balls at a wall, and what it is elsewhere."""
    return (
        f"If every test starts at rest with the ball at a wall, b = {_each(task, one.b)} mm leaves "
        f"{brief(one.rest_mean)} mm{bare}; over random starts it leaves a mean of "
        f"{brief(one.random_mean)} mm, and one of ten gives {brief(one.random_p90)} mm or more."
    )


def from_the_wall_alone(advice: Advice) -> list[str]:
    """That a clearance takes a twentieth only from tests that start with the ball at a wall."""
    best = min(advice.least_mean, advice.robust, key=lambda one: one.rest_mean)
    return [
        "No clearance helps from every start: over random starts the best one for nine of "
        f"ten of them, b = {_each(advice.task, advice.robust.b)} mm, reduces the bare amplitude of "
        f"{brief(advice.robust.random_bare)} mm by {percent(max(advice.random_gain, 0.0))}.",
        _at_a_wall(advice.task, best, f" of {brief(advice.bare_mean)} mm"),
        damper(advice),
    ]


def _by_start(one: Judged) -> str:
    """What nine of ten random starts give, and the others where they give far more.

    A mean that a few lost starts raise may be above the 90th percentile.
    """
    said = f"Nine of ten random starts give less than {percentile_in_words(one, brief)} mm"
    if one.random_tail <= JUMP * one.random_p90:
        return f"{said}."
    above = ", which raises the mean above that" if one.random_mean > one.random_p90 else ""
    return (
        f"{said}; the tenth with the largest amplitudes gives {brief(one.random_tail)} mm on the "
        f"average{above}."
    )


def percentile_in_words(one: Judged, plain: Callable[[float], str]) -> str:
    """90th percentile in mm, with its error where that is not below the digits that are shown."""
    p90, error = 1e3 * one.random_p90, 2e3 * one.random_error
    return with_error(p90, error) if error > 2e-3 * p90 else plain(one.random_p90)


def within(tolerance: float) -> str:
    """The tolerance of a clearance, as it stands behind it; nothing where there is none."""
    return f" +- {100.0 * tolerance:.2g} %" if tolerance else ""


def _each(task: Task, b: float) -> str:
    """Clearances (mm) that balls of unlike ones have."""
    return "; ".join(clearance(b * ratio) for ratio in dict.fromkeys(task.ratios))


def nothing_helps(advice: Advice) -> list[str]:
    """That no clearance takes a twentieth off the bare amplitude, or more than its mass does."""
    if advice.gain >= WORTH:
        return no_more_than_mass(advice)
    grid, best = advice.found.grid, advice.robust
    have = "The ball has" if len(advice.task.masses) == 1 else "The balls together have"
    bare = f"the bare amplitude of {brief(best.random_bare)} mm"
    does = f"{'reduces' if advice.gain >= 0.0 else 'raises'} {bare} by {percent(abs(advice.gain))}"
    if percent(abs(advice.gain)) == percent(0.0):
        does = f"leaves {bare} as it is"
    return [
        f"No clearance helps: from {_each(advice.task, float(grid[0]))} to "
        f"{_each(advice.task, float(grid[-1]))} mm the best one {does}.",
        f"{have} {100.0 * advice.task.eps:.2g} % of the mass, the damping ratio is "
        f"{advice.task.oscillator.zeta:.2g}.",
        damper(advice),
    ]


def no_more_than_mass(advice: Advice) -> list[str]:
    """That the mass of the balls does alone what they do: held, or so heavy that they detune."""
    best, mass, bare = advice.robust, advice.fixed_mass, advice.bare_mean
    which, are = ("ball", "is") if len(advice.task.masses) == 1 else ("balls", "are")
    return [
        f"No clearance is worth more than the mass of the {which} alone: fixed to the oscillator "
        f"without a cavity it leaves a mean of {brief(mass)} mm ({percent(1.0 - mass / bare)} less "
        f"than the {brief(bare)} mm without it). The best clearance for nine of ten random starts, "
        f"b = {_each(advice.task, best.b)} mm, leaves {brief(best.random_mean)} mm over random "
        f"starts and {brief(best.rest_mean)} mm from rest, where the {which} {are} at a wall.",
        tuned(advice),
    ]


def _ties(task: Task, race: Race) -> list[str]:
    """Clearances that are not certainly worse, and by how much they may be."""
    if len(race.tied) < 2:
        return []
    those = f"learances from {_each(task, race.tied[0])} to {_each(task, race.tied[-1])} mm are"
    if race.within <= WORTH:
        return [f"C{those} equal within {max(percent(race.within), '1 %')}."]
    more = f"{percent(race.within)} more"
    if race.within > 1.0:
        more = f"{1.0 + race.within:.2g} times as much"
    return [
        f"With {race.starts} random starts c{those} not told apart; the worst of them may give up "
        f"to {more}."
    ]


def _cliff(advice: Advice) -> str:
    sides = (("narrower", advice.cliffs.narrower), ("wider", advice.cliffs.wider))
    words = [_side(name, side) for name, side in sides if side.jump is not None]
    if words:
        said = f"The amplitude jumps by a quarter or more {' and '.join(words)}"
    rest = [(name, side.clear) for name, side in sides if side.jump is None]
    untold = [
        f"more than {100.0 * clear:.2g} % {name}" if clear else f"anywhere {name}"
        for name, clear in rest
        if clear < STEPS[-1]
    ]
    if not untold:
        if not words:
            return (
                f"At {len(STEPS)} clearances tried on either side, up to {percent(STEPS[-1])} "
                "away, the amplitude rises by less than a quarter."
            )
        return f"{said}; {rest[0][0]} it does not, within 10 %." if rest else f"{said}."
    doubt = (
        "Too few starts were run to tell whether the amplitude jumps by a quarter "
        f"{' or '.join(untold)}."
    )
    return f"{said}. {doubt}" if words else doubt


def _side(name: str, side: Side) -> str:
    """Where it jumps, and to how many times itself: few starts do not know the amplitude better."""
    assert side.jump is not None
    assert side.before is not None
    assert side.amplitude is not None
    return f"{100.0 * side.jump:.2g} % {name} (to {side.amplitude / side.before:.2g} times)"


def damper(advice: Advice) -> str:
    """Whether a tuned mass damper of the same mass, or the mass alone, does better, in words."""
    mass, ball = advice.fixed_mass, advice.robust.random_mean
    if mass > (1.0 + MATTERS) * ball or mass > (1.0 - WORTH) * advice.bare_mean:
        return tuned(advice)
    return (
        f"{tuned(advice)} Fixed to the oscillator without a cavity, the same mass would leave "
        f"{brief(mass)} mm, no more than the ball."
    )


def tuned(advice: Advice) -> str:
    """Whether a tuned mass damper of the same mass does better, in words."""
    optimal, ball = advice.optimal, advice.robust.random_mean
    exact, off = min(optimal.mean, advice.den_hartog.mean), optimal.mean_detuned
    law = ""
    if advice.task.damping != WeakDamping():
        law = " (on an oscillator that c1 alone damps, the ball's has its damping law too)"
    if min(advice.den_hartog.detuned, optimal.detuned) >= advice.bare:
        if exact < (1.0 - WORTH) * advice.bare_mean:
            return (
                f"A tuned mass damper of the same mass would leave a mean of {brief(exact)} mm if "
                f"its tuning is kept; 5 % detuned it does not help{law}."
            )
        either = " either" if advice.hopeless else ""
        return f"A tuned mass damper of the same mass does not help{either}{law}."
    word = "less than the ball" if off < ball else "more than the ball"
    if exact < ball <= off:
        word = "less than the ball if its tuning is kept, more if not"
    return (
        f"A tuned mass damper of the same mass would leave a mean of {brief(exact)} mm, "
        f"{brief(off)} mm when 5 % detuned: {word}{law}."
    )


def driven(found: UnderRecord) -> list[str]:
    """Under a recorded base: the clearance of least rms, and that of least peak."""
    bare, rms, peak = found.bare, found.found[found.least_rms], found.found[found.least_peak]
    off = within(found.tolerance)
    record = f"the recorded base ({found.duration:.4g} s, peak {brief(found.base_peak)} mm)"
    without = (
        f"without a ball rms {brief(float(bare.rms[0]))} mm, peak {brief(float(bare.peak[0]))} mm"
    )
    if found.as_fixed and found.hopeless and found.fixed.rms[0] < (1.0 - WORTH) * bare.rms[0]:
        return [
            f"Under {record} no clearance is worth more than the same mass fixed to the "
            f"oscillator, without a cavity: rms {brief(float(found.fixed.rms[0]))} mm, peak "
            f"{brief(float(found.fixed.peak[0]))} mm of the deflection x - x_e ({without})."
        ]
    if found.hopeless:
        return [f"Under {record} no clearance reduces the deflection x - x_e by 5 % ({without})."]
    return [
        f"Under {record} a clearance of {clearance(rms.b)} mm{off} leaves the least rms of the "
        f"deflection x - x_e, {brief(float(np.median(rms.rms)))} mm (median over balls at rest "
        f"anywhere and at the walls); {clearance(peak.b)} mm{off} the least peak, below "
        f"{brief(float(np.percentile(peak.peak, 90.0)))} mm for nine of ten; {without}."
    ]


def beginning(found: UnderRecord) -> list[str]:
    """What was taken off the record of a base, and how one that has no rest is begun."""
    if abs(found.rest) <= SEEN * found.base_peak:
        return []
    rest = f"{brief(found.rest)} mm"
    if not found.moves:
        return [f"the base record shows {rest} before it moves, which was taken off"]
    return [
        f"the base record moves from its first sample; its mean, {rest}, was taken off, and the "
        "mass begins at rest and undeflected"
    ]


def releases(falls: Falls) -> list[str]:
    """The release: to each level how fast, from where, with which clearance.

    Balls put at the wall are in the table; here only where no others help.
    """
    if said := _ways(falls, "three of four balls at rest anywhere bring", at_wall=False):
        return said
    followed = ""
    if max(falls.bare) > falls.followed:
        followed = f" in the {falls.followed:.3g} s that were simulated"
    return [
        "After a release, at no clearance do three of four balls at rest anywhere in their cavity "
        f"make the decay faster than without a ball{followed}.",
        *_ways(falls, "a ball placed at the wall that pushes it first brings", at_wall=True),
    ]


def _ways(falls: Falls, balls: str, *, at_wall: bool) -> list[str]:
    fastest = falls.fastest_at_wall if at_wall else falls.fastest
    ways = [
        (brief(level), _time(best.sure(k, at_wall=at_wall)), clearance(best.b), _time(bare))
        for k, (level, bare) in enumerate(zip(falls.levels, falls.bare, strict=True))
        if falls.helps(k, at_wall=at_wall) and (best := falls.found[fastest[k]])
    ]
    if not ways:
        return []
    levels, times, each, bare = (_listed(words) for words in zip(*ways, strict=True))
    return [
        f"After a release, {balls} the amplitude to {levels} mm in {times} with b = {each} mm"
        f"{within(falls.tolerance)} (without a ball: {bare})."
    ]


def _listed(words: Iterable[str]) -> str:
    """`1, 2 and 3`."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def seconds(time: float, followed: float = math.inf) -> str:
    """A time of a release, s, in three digits; of one not reached while it was followed, that.

    Examples
    --------
    >>> seconds(0.731), seconds(0.00812), seconds(1234.5), seconds(math.inf, 60.0)
    ('0.731', '0.00812', '1234', '> 60')
    """
    if math.isfinite(time):
        return f"{time:.3g}" if time < 999.5 else f"{time:.0f}"
    return "never" if math.isinf(followed) else f"> {followed:.3g}"


def _time(time: float) -> str:
    return f"{seconds(time)} s" if math.isfinite(time) else seconds(time)


def _between(ends: tuple[float, float], size: float, unit: str) -> str:
    low, high = (size * end for end in ends)
    return f"{low:.4g} {unit}" if low == high else f"{low:.4g} to {high:.4g} {unit}"


def warnings_of(advice: Advice) -> list[str]:
    """What a reader of b_c would otherwise be misled by."""
    best = advice.robust
    said = slips_of(advice)
    if advice.exact is None:
        said.append(
            "no orbit with two symmetric impacts per cycle is stable at any clearance: the "
            "published b_c does not apply"
        )
    else:
        said += apart(advice.published, advice.exact)
    alike = len(set(advice.task.ratios)) == 1  # the orbit is that of all balls as one
    if alike and advice.orbit is not None and advice.orbit[1] > 1.3 * advice.orbit[0]:
        said.append(
            f"just below the exact b_c the orbit has {brief(advice.orbit[0])} mm but is not "
            f"reached from rest, where the mean is {brief(advice.orbit[1])} mm"
        )
    untouched = {"robust": best, "least-mean": advice.least_mean,
                 "least-largest": advice.least_max, "given": advice.asked}  # fmt: skip
    names = [n for n, one in untouched.items() if one is not None and not one.centre_touched]
    if names and not advice.hopeless:
        said.append(
            f"with the {_listed(names)} clearance a ball at rest in the middle of its cavity never "
            f"meets a wall (the bare amplitude of {brief(advice.bare)} mm is too small): start it "
            "at a wall"
        )
    said += [] if advice.hopeless else ends_of_search(advice)
    if advice.task.undamped:
        said.append(
            "nothing damps the oscillator alone: without a ball it keeps the motion that it "
            "started with, besides the bare amplitude. Give its damping, however small"
        )
    if advice.watched < 1.0:
        said.append(
            "with damping this light the motion settles more slowly than can be simulated: the "
            f"runs last {100 * advice.watched:.2g} % of the time needed, and the amplitudes still "
            "contain a part of the transient"
        )
    said += few_starts(advice)
    if not advice.task.plain:
        said.append(
            "the simulation includes friction and the damping law; b_c and b_t do not (friction of "
            "0.3 m/s^2 moves b_c of the published rig by -0.9 %, of 1 m/s^2 by -3.2 %)"
        )
    for which, one in (("", best), ("with the clearances given ", advice.asked)):
        gaps = [] if one is None else gaps_of(advice.task, one.b)
        if gaps:
            words = ", ".join(f"{low:.3g} to {high:.3g} mm" for low, high in gaps)
            said.append(
                f"{which}no ball is captured at amplitudes of {words}: choose clearances closer to "
                "each other"
            )
    return said + beside_resonance(advice.task)


def slips_of(advice: Advice) -> list[str]:
    """A ball faster than any is, or a cavity smaller: a value in another unit than it is meant in.

    Far from resonance the clearance may really be so small.
    """
    b = advice.robust.b
    if b < LEAST and not advice.hopeless:
        return [f"a clearance of {clearance(b)} mm is smaller than any that can be built"]
    speed = 2.0 * b * advice.task.oscillator.w0 / math.pi
    if speed <= UNHEARD_OF:
        return []
    return [
        f"a ball would cross the cavity of {clearance(b)} mm at {speed:.3g} m/s: is "
        f"the base amplitude of {clearance(advice.task.levels[1])} mm in the unit it is meant in?"
    ]


def few_starts(advice: Advice) -> list[str]:
    """Where runs take so long that the time of an answer allows fewer starts than usual."""
    if advice.judged.random >= JUDGED[0]:
        return []
    phases, ranged = advice.judged.phases, advice.task.ranged
    from_rest = f"{phases} start{'s' * (phases > 1)} from rest"
    from_rest += " in each part of the ranges" * ranged
    return [
        f"a run of this rig takes {1e3 * advice.found.work[1]:.2g} ms of processor time, which is "
        f"long. Each clearance was judged by {from_rest} and "
        f"{advice.judged.random} random ones, and fewer clearances than usual were compared; "
        "--effort 4 does four times as much"
    ]


def apart(published: float, exact: float) -> list[str]:
    """Where the two b_c (m) differ by more than a tenth."""
    if abs(published / exact - 1.0) <= 0.1:
        return []
    return [
        f"the published b_c, {clearance(published)} mm, holds at resonance and for a light ball; "
        f"here the exact one is {clearance(exact)} mm"
    ]


def remarks_of(answer: Answer) -> list[str]:
    """All that a reader of the answer should know, whatever was asked."""
    given = answer.given
    if answer.advice is not None:
        said = warnings_of(answer.advice)
    elif answer.theory.b_c is not None:
        said = apart(answer.theory.b_c.published, answer.theory.b_c.exact)
    else:
        said = []
    said += [] if answer.driven is None else beginning(answer.driven)
    law = any(given.size(option.symbol) > 0.0 for option in BEYOND)
    if law and answer.falls is not None:
        said.append(
            "the simulated release includes friction and the damping law; b*(level), the bare "
            "times and b_t of theory do not"
        )
    if law and answer.advice is None and answer.falls is None:
        said.append("b_c and b_t neglect friction and damping laws, and nothing was simulated")
    if "m" in given and len(given["m"]) > 1:
        r = {q.value for q in given["r"]}
        word = f", with r = {given.one('r').value:g}, that of the first" if len(r) > 1 else ""
        said.append(
            "b_c, b_t, b*(level) and the sensitivities treat all balls as one of "
            f"{1e3 * given.one('m').value:.4g} g in one cavity{word}"
        )
    return said


#: A clearance, m, that no workshop and no hand can set.
LEAST = 5e-6
#: Amplitudes are means of hypot(x, x'/w0); from this share beside f0 on the difference is named.
BESIDE = 0.1


def beside_resonance(task: Task) -> list[str]:
    """What the amplitude means far from resonance, where x'/w0 is not as large as x."""
    f0, G = task.oscillator.f0, task.levels[1]
    off = max(task.frequencies, key=lambda f: abs(math.log(f / f0)))
    if abs(off / f0 - 1.0) < BESIDE:
        return []
    ratio = float(mean_of_cycle(np.array(off / f0)))
    return [
        f"amplitudes are means of hypot(x, x'/w0): of a motion at {off:.4g} Hz {ratio:.3g} times "
        f"its amplitude in x (bare oscillator: {mm(task.bare(G, off) / ratio)} mm in x). Compare "
        "them with each other, not with a displacement sensor"
    ]


def ends_of_search(advice: Advice) -> list[str]:
    """Clearances that lie where the scan ended, or beyond: no minimum, a bound."""
    first, last = float(advice.found.grid[0]), float(advice.found.grid[-1])
    three = {"least-mean": advice.least_mean, "least-largest": advice.least_max,
             "robust": advice.robust}  # fmt: skip
    narrow = [name for name, one in three.items() if one.b < 1.03 * first]
    wide = [name for name, one in three.items() if one.b > 0.97 * last]
    return [
        f"the {_listed(names)} clearance lies at an end of the scan, {1e3 * first:.3g} to "
        f"{1e3 * last:.3g} mm, or beyond: a {side} one may be better still"
        for names, side in ((narrow, "narrower"), (wide, "wider"))
        if names
    ]


def gaps_of(task: Task, b: float) -> list[list[float]]:
    """Amplitudes between the activation bands of several balls (mm), by (49)."""
    if len(task.masses) < 2:
        return []
    return [[1e3 * gap.low, 1e3 * gap.high] for gap in gaps(task.rig(b).nes)]
