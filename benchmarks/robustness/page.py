"""docs/benchmarks/robustness.md: a row a departure, the shares, and where it fails."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from benchmarks.pages import code_measured
from benchmarks.robustness.study import PARAMETERS, Outcome, Value

_FAR = 4.0  # standard errors
_SAID = 110  # letters of a warning that are shown

_HOW = """\
Every campaign comes from a simulator of the benchmark's own (`benchmarks/robustness/motion.py`:
Runge-Kutta steps of 50 us, events bisected to 1e-13 s; on the plain rig its impact times agree with
the package's exact solver to 1e-9 s) and is analysed by the whole pipeline, raw file to verdict:
ring-downs bare and with 300 and 600 g, six periodic tests at 0.25 mm, two releases, 10 kHz,
noise as in the shipped campaign, where a rig's name does not say otherwise. Sheet values are stated
without uncertainty, so that the defaults of a lab are in the errors: on most rigs they are all of
them.

The truth of c1 and k1 is that of one harmonic at an amplitude of 5.3 mm, of r the mean of both
walls, at the speed that identified.csv names where it depends on speed, of b_c the clearance at
which the simulated two impacts per cycle lose their stability when they are followed from clearance
to clearance. Tests begin with the mass pulled out by 10 mm; off the resonance they miss the orbit
well below its end. The statement of a headline on the end of two impacts per cycle is therefore
compared with longer runs of the same tests. A base with a second frequency, or one that drifts, has
no periodic orbit: there two impacts per cycle last while the ball meets its walls in turn, over 860
cycles or, of a drift, over the record."""
_COLUMNS = """\
Error in percent and, in brackets, over the stated standard error; the worst seed. *right*: every
abs(z) is below 4, or a warning names the cause. b_c: error of the first seed, and how often the
95 % interval, and 0.1 % for the error of the true end itself, holds it."""


def page(outcomes: Sequence[Outcome], *, missing: Sequence[str] = ()) -> str:
    """The page in Markdown; `missing`: rigs of which no campaign was measured by this code."""
    by_name: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        by_name.setdefault(outcome.departure.name, []).append(outcome)
    rows = "\n".join(_row(name, own) for name, own in by_name.items())
    said = "\n".join(_said(name, own[0]) for name, own in by_name.items())
    return "\n".join(
        [
            "# Rigs that differ from the model",
            "",
            f"`python -m benchmarks.robustness`, {_seeds(by_name)}, by the code of "
            f"{code_measured()}. {_HOW}",
            "",
            summary(outcomes),
            "",
            *_missing(missing),
            "## Each departure",
            "",
            _COLUMNS,
            "",
            "| departure | M | c1 | k1 | r | b_c | cause named | right |",
            "|---|---|---|---|---|---|---|---|",
            rows,
            "",
            "## Where it fails",
            "",
            failures(outcomes),
            "",
            "## What was said",
            "",
            "The effects found and the warnings, the first words of each, of the first seed.",
            "",
            said,
            "",
        ]
    )


def _missing(names: Sequence[str]) -> list[str]:
    if not names:
        return []
    return [
        f"Not measured by the present code, {len(names)} rigs (the same command goes on): "
        f"{'; '.join(names)}.",
        "",
    ]


def failures(outcomes: Sequence[Outcome]) -> str:
    """Every campaign with something wrong, and what."""
    lines = []
    for outcome in outcomes:
        found = [
            f"{v.name} {100.0 * v.relative:+.2g} %, z {v.z:+.1f}"
            for v in outcome.values
            if v.given and not abs(v.z) <= _FAR
        ]
        if found and not outcome.named:
            found.append("the cause is not named")
        if outcome.b_c_holds is False and outcome.b_c is not None and outcome.end is not None:
            off = 100.0 * (outcome.b_c[0] / outcome.end - 1.0)
            found.append(f"b_c {off:+.2g} % off, its interval does not hold the true end")
        if outcome.false_headline:
            found.append(f"headline: {outcome.false_headline}")
        if found:
            lines.append(f"- {outcome.departure.name}, seed {outcome.seed}: {'; '.join(found)}")
    return "\n".join(lines) or "In none of these campaigns."


def _seeds(by_name: Mapping[str, Sequence[Outcome]]) -> str:
    """How many seeds each rig had."""
    counts = [len(own) for own in by_name.values()]
    few, many = min(counts), max(counts)
    seeds = f"{few} seed{'s' if few > 1 else ''}" if few == many else f"{few} to {many} seeds"
    return f"{len(counts)} rigs, {seeds} of each, {sum(counts)} campaigns"


def summary(outcomes: Sequence[Outcome]) -> str:
    """Shares that the targets are about."""
    lines = ["| | measured | wanted |", "|---|---|---|"]
    departures = [o for o in outcomes if o.departure.name != "plain rig"]
    values = [v for o in departures for v in o.values if v.given]
    right = [o.right for o in departures]
    lines.append(f"| campaigns with every abs(z) < 4, or the cause named | {_share(right)} | all |")
    near = _share([abs(v.z) < 4.0 for v in values])
    lines.append(f"| abs(z) < 4, whatever is said | {near} | |")
    for name in PARAMETERS:
        own = [v.holds for v in values if v.name == name]
        words = f"95 % intervals of {name} with the truth, departures"
        lines.append(f"| {words} | {_share(own)} | 85 % |")
    held = [h for o in departures if (h := o.b_c_holds) is not None]
    lines.append(f"| intervals of b_c with the true end | {_share(held)} | 90 % |")
    false = [not o.false_headline for o in departures]
    lines.append(f"| headlines with nothing found false | {_share(false)} | all |")
    return "\n".join(lines)


def _share(held: Sequence[bool]) -> str:
    return f"{100.0 * sum(held) / len(held):.0f} % of {len(held)}" if held else "none"


def _row(name: str, own: Sequence[Outcome]) -> str:
    cells = [_worst([o.values[i] for o in own]) for i in range(len(PARAMETERS))]
    named = sum(o.named for o in own)
    right = sum(o.right for o in own)
    false = next((o.false_headline for o in own if o.false_headline), "")
    verdict = f"{right} of {len(own)}" + (f"; headline: {false}" if false else "")
    return f"| {name} | {' | '.join(cells)} | {_b_c(own)} | {named} of {len(own)} | {verdict} |"


def _worst(values: Sequence[Value]) -> str:
    given = [v for v in values if v.given]
    if not given:
        return "not given"
    worst = max(given, key=lambda v: abs(v.z) if math.isfinite(v.z) else math.inf)
    return f"{100.0 * worst.relative:+.3f} ({worst.z:+.1f})"


def _b_c(own: Sequence[Outcome]) -> str:
    held = [h for o in own if (h := o.b_c_holds) is not None]
    if not held:
        return "none"
    first = next(o for o in own if o.b_c_holds is not None)
    assert first.b_c is not None
    assert first.end is not None
    off = 100.0 * (first.b_c[0] / first.end - 1.0)
    return f"{off:+.2f} %, {sum(held)} of {len(held)}"


def _said(name: str, outcome: Outcome) -> str:
    effects = ", ".join(
        f"{e['parameter']} = {e['value']:.4g} +- {e['std_error'] or 0.0:.2g} {e['unit']}"
        for e in outcome.effects
    )
    lines = [f"- **{name}**" + (f" ({effects})" if effects else "")]
    words = [w for w in outcome.warnings if "clearances tried" not in w]
    for text in words[:5]:
        lines.append(f"    - {text[:_SAID]}{'…' if len(text) > _SAID else ''}")
    return "\n".join(lines)
