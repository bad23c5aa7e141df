"""Which cause a text of the report names, as a fact or among rivals."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

#: Cause: how the package writes of it. A text may name several.
CAUSES: Mapping[str, str] = {
    "friction": r"ball rubs|friction on its floor|friction of the ball",
    "tilt": r"cavity (that )?slopes|tilt of|slope of the cavity",
    "walls": r"two walls differ|walls of different r",
    "speed": r"r (that )?depends on (impact )?speed",
    "contact": r"contact (that )?lasts",
    "rolling": r"ball (that )?rolls",
    "damping": r"damping (depends|has|is not|over amplitude)|quadratic|Coulomb",
    "spring": r"spring (stiffens|softens)|stiffen|soften",
    "cross-axis": r"cross-axis|across its axis",
    "delay": r"us (after|before) the acceleration|comes? [\d.]+ \S+ late|delay",
    "contact rings": (
        r"contact that rings|contact rings|pulse (is|whose area is) off|ringing|wrong area"
    ),
    "local mode": r"local mode|part that (answers|vibrates)",
    "second harmonic": r"harmonic",
    "third harmonic": r"harmonic",
    "wear": r"\br (drifts|changes) by|\br that changes|wears?\b",
    "drift of f0": r"\bf0 (drifts|changes) by|\bf0 that changes",
    "drift of gain": r"gain( of \S+)? (drifts|changes) by|gain( of \S+)? that changes",
    "change": r"(drifts|changes) by .{0,40}(with|from the first) record|that changes (from|along)",
    "other record": r"differs by .{0,60}from that of all other",
    "second clock": r"clock",
    "lost samples": r"samples? (is|are|were) (lost|missing)|lost samples|samples lost",
    "magnet": r"magnet(?! near one wall)|pull(ed)? to the middle|hollow|concave",
    "drag": r"drag of the air|air in the cavity",
    "viscous": r"viscous friction|film of oil",
    "knocks": r"knock|spikes that are no impacts",
    "clearance": r"clearance_mm (of|is|in|that)|true value of clearance_mm|clearances [-+\d]",
    "release": r"release_mm",
    "rows exchanged": r"exchanged|swapped|interchanged",
    "twice": r"clearance_mm (that )?is [12][.\d]* times",
    "diameter": (
        r"clearance_mm in all records|clearance_mm that is off by (one length|the same amount)"
        r"|clearances [-+\d]"
    ),
    "base amplitude": r"base_amplitude_mm|base amplitude",
    "displacement scale": r"displacement.{0,100}(factor|sensitivity|gain|times)|laser.{0,30}gain",
    "acceleration scale": r"accelero?(meter|ation).{0,80}(factor|sensitivity|gain|unit)"
    r"|sensitivity of the accelera",
    "base scale": r"base channel|base.{0,60}(sensitivity|gain|factor)",
    "added mass": r"added.mass|added_mass",
    "ball mass": r"nes_mass|ball.{0,30}(weigh|mass)",
    "aboard": r"in the ring-downs the mass carries|ring-downs in which the mass carries",
    "stuck": r"stuck|ball (does|did) not move|ball that does not move|without an impact",
    "inverted": r"inverted|opposite sign|sign of|upside",
    "dropouts": r"lost its target|loses its target|dropout|\bgaps?\b",
    "short": r"too short|too few cycles|longer records|record longer|cycles are too few",
    "alias": r"alias",
    "beside the table": r"beside the table",
    "base late": r"base channel (that )?comes",
}

#: What is a name of the same thing: a campaign with the first may be told of the others.
SAME: Mapping[str, frozenset[str]] = {
    "added mass": frozenset({"rows exchanged"}),
    "twice": frozenset({"clearance", "diameter"}),
    "diameter": frozenset({"clearance", "twice"}),
    "rows exchanged": frozenset({"clearance"}),
    "change": frozenset({"wear", "drift of f0", "drift of gain"}),
    "wear": frozenset({"change"}),
    "drift of f0": frozenset({"change"}),
    # of the tests between two changes, those after them are other ones
    "drift of gain": frozenset({"change", "displacement scale", "other record"}),
    "contact rings": frozenset({"local mode", "acceleration scale"}),
    "local mode": frozenset({"contact rings", "acceleration scale", "displacement scale"}),
    "lost samples": frozenset({"second clock"}),
    "second clock": frozenset({"lost samples"}),
    "third harmonic": frozenset({"second harmonic"}),
    "second harmonic": frozenset({"third harmonic"}),
    "alias": frozenset({"contact rings"}),
    "damping": frozenset({"spring"}),
    "spring": frozenset({"damping"}),
    "delay": frozenset({"base late"}),  # of the displacement, beside which the base is early
}

#: Causes that change how the rig or the sheet is understood: naming one that is not there is false.
#: The others are words that honest texts use of many things, or gains that scatter anyway.
TELLING = frozenset({
    "friction", "tilt", "walls", "speed", "contact", "rolling", "damping", "spring", "cross-axis",
    "local mode", "wear", "drift of f0", "drift of gain", "change", "other record",
    "second clock", "lost samples", "magnet", "drag", "viscous",
    "rows exchanged", "twice", "diameter", "stuck", "aboard", "inverted", "clearance",
    "beside the table", "base late",
})  # fmt: skip

_OPEN = re.compile(
    r"nearly as well|one of these|[Ee]ach of these|either|rival|cannot (tell|part|be told)|"
    r"not explained|may be|stuck, or |did not move, or |"
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
