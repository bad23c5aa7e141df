"""Which cause a text of the report names, as a fact or among rivals."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

#: Cause: how the package writes of it. A text may name several.
CAUSES: Mapping[str, str] = {
    "friction": r"ball rubs|friction slows",
    "tilt": r"cavity slopes|tilt of",
    "walls": r"two walls differ|walls of different r|walls? differ",
    "speed": r"r depends on (impact )?speed|r over speed|r (rises|falls) (by|with)",
    "contact": r"contact lasts|contact of [\d.]+",
    "rolling": r"ball rolls|rolling",
    "damping": r"damping (depends|has|is not|over amplitude)|quadratic|Coulomb",
    "spring": r"spring (stiffens|softens)|stiffen|soften",
    "cross-axis": r"cross-axis|across its axis",
    "delay": r"comes? [\d.]+ \S+ late|late by|delay of|lags? behind",
    "contact rings": r"contact that rings|contact rings|pulse is off|pulse area|ringing",
    "local mode": r"local mode|part that answers",
    "second harmonic": r"second harmonic|harmonic",
    "third harmonic": r"third harmonic|harmonic",
    "wear": r"wear|r (falls|drifts|changes) (along|over|through|with) the (campaign|order|records)",
    "drift of f0": r"f0 (falls|rises|drifts|changes)|drift.{0,40}f0|f0.{0,40}(drift|order of the)",
    "drift of gain": r"gain.{0,40}(drift|order|changes|falls|rises)|drift.{0,40}(gain|sensitivity)",
    "change": r"change[sd]? after|differs? (from|after) .{0,30}on\b|from record .{0,40} on",
    "second clock": r"clock",
    "lost samples": r"lost|samples? (are )?missing|gap of",
    "magnet": r"magnet|pull to the middle|hollow",
    "knocks": r"knock|bursts?|spikes that are no impacts",
    "clearance": r"clearance_mm|clearances? (of|is|are|in) ",
    "rows exchanged": r"exchanged|swapped|interchanged",
    "twice": r"2 ?b\b|total travel|factor (of )?(2|0\.5|one half)|twice|half of what",
    "diameter": r"diameter|(offset|length|all).{0,40}clearance|clearance.{0,60}(off|offset|all)",
    "base amplitude": r"base.amplitude|base_amplitude|peak to peak|rms",
    "displacement scale": (
        r"displacement.{0,80}(too (large|small)|factor|sensitivity|gain)|laser.{0,30}gain"
    ),
    "acceleration scale": r"accelero?(meter|ation).{0,80}(factor|sensitivity|gain|unit)",
    "base scale": r"base channel|base.{0,60}(sensitivity|gain|factor)",
    "added mass": r"added.mass|added_mass",
    "ball mass": r"nes_mass|ball.{0,30}(weigh|mass)",
    "release": r"release_mm|release.{0,60}(factor|unit|off)",
    "stuck": r"stuck|ball (does|did) not move|ball that does not move|ball (is )?(blocked|idle)",
    "inverted": r"inverted|sign|upside",
    "held": r"held|before (its|the) release",
    "dropouts": r"lost its target|dropout|gaps?",
    "short": r"too short|short record|cycles? (is|are) too few|longer",
    "alias": r"alias",
    "frequency": r"frequency_hz|base frequency",
}

#: What is a name of the same thing: a campaign with the first may be told of the others.
SAME: Mapping[str, frozenset[str]] = {
    "twice": frozenset({"clearance", "diameter"}),
    "diameter": frozenset({"clearance"}),
    "rows exchanged": frozenset({"clearance"}),
    "clearance": frozenset({"diameter"}),
    "change": frozenset({"wear", "drift of f0", "drift of gain"}),
    "wear": frozenset({"change"}),
    "drift of f0": frozenset({"change"}),
    "drift of gain": frozenset({"change", "displacement scale"}),
    "contact rings": frozenset({"local mode", "acceleration scale"}),
    "local mode": frozenset({"contact rings", "acceleration scale", "displacement scale"}),
    "lost samples": frozenset({"second clock"}),
    "second clock": frozenset({"lost samples"}),
    "third harmonic": frozenset({"second harmonic"}),
    "second harmonic": frozenset({"third harmonic"}),
    "alias": frozenset({"contact rings"}),
    "damping": frozenset({"spring"}),
    "spring": frozenset({"damping"}),
}

#: Causes that change how the rig is understood: naming one that is not there is false. The others
#: are words that honest texts use of many things.
TELLING = frozenset({
    "friction", "tilt", "walls", "speed", "contact", "rolling", "damping", "spring", "cross-axis",
    "local mode", "wear", "drift of f0", "drift of gain", "second clock", "lost samples", "magnet",
    "rows exchanged", "twice", "stuck", "inverted", "clearance",
})  # fmt: skip

_OPEN = re.compile(
    r"nearly as well|one of these|either|rival|cannot (tell|part|be told)|not explained|may be|"
    r"\bor\b.{0,80}would explain|check |expected|not been told|needs?:? ",
)


def named(texts: Iterable[str]) -> set[str]:
    """Causes that any of these texts names, as a fact or among others."""
    return {cause for text in texts for cause, how in CAUSES.items() if re.search(how, text)}


def stated(texts: Iterable[str]) -> set[str]:
    """Causes that a text states as a fact: it offers no rival."""
    return named(text for text in texts if not _OPEN.search(text)) & TELLING


def allowed(causes: Iterable[str]) -> set[str]:
    """The causes that are there, under all their names."""
    own = set(causes)
    return own.union(*(SAME.get(cause, frozenset()) for cause in own))
