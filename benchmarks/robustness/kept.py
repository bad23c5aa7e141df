"""Outcomes kept as small files, so that a run that broke off goes on where it was.

A file is named after the rig, the seed and a digest of the code and of the rig: what was measured
by other code is not found again.
"""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import asdict
from pathlib import Path

from benchmarks.robustness.campaigns import Departure
from benchmarks.robustness.end_of_orbit import stays, true_end
from benchmarks.robustness.study import Outcome, Truth, Value

from vinesexp.codedigest import code_digest
from vinesexp.whole_files import write_whole

_HERE = Path(__file__).resolve().parent
KEPT = _HERE.parents[1] / "results" / "robustness"
_SIMULATOR = ("motion", "rig", "end_of_orbit")
_WHOLE = (*_SIMULATOR, "campaigns", "measuring", "study")


def _texts(names: tuple[str, ...]) -> list[str]:
    return [(_HERE / f"{name}.py").read_text(encoding="utf-8") for name in names]


def _hashed(*parts: str) -> str:
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:12]


def _place(kind: str, departure: Departure, end: str) -> Path:
    name = re.sub(r"[^a-z0-9]+", "-", departure.name.lower()).strip("-")
    return KEPT / kind / f"{name}-{end}.json"


def outcome_file(departure: Departure, seed: int) -> Path:
    """Where the outcome of one campaign is kept."""
    code = map(code_digest, ("vinesexp.pipeline", "vinesexp.report.verdict"))
    digest = _hashed(*code, *_texts(_WHOLE), repr(departure))
    return _place("outcomes", departure, f"{seed}-{digest}")


def kept(departure: Departure, seed: int) -> Outcome | None:
    """The outcome of one campaign by the present code, if it was measured."""
    path = outcome_file(departure, seed)
    if not path.is_file():
        return None
    found = json.loads(path.read_text(encoding="utf-8"))
    found["departure"] = departure
    found["values"] = tuple(Value(**one) for one in found["values"])
    for name in ("b_c", "effects", "measured", "warnings"):
        found[name] = None if found[name] is None else tuple(found[name])
    return Outcome(**found)


def keep(outcome: Outcome) -> None:
    """Write the outcome of one campaign."""
    content = asdict(outcome)
    del content["departure"]
    write_whole(outcome_file(outcome.departure, outcome.seed), json.dumps(content, indent=1))


class KeptTruth(Truth):
    """What the simulated rig does, kept from run to run."""

    def end(self, departure: Departure) -> float | None:
        """Where the orbit ends, m."""
        path = _place("truth", departure, f"end-{self._digest(departure)}")
        if path.is_file():
            return json.loads(path.read_text(encoding="utf-8"))["end"]  # type: ignore[no-any-return]
        end = true_end(departure.body, departure.driven(), departure.guess)
        write_whole(path, json.dumps({"end": end}))
        return end

    def stays(self, departure: Departure, b: float) -> bool:
        """Whether a test at a clearance, m, comes to the orbit."""
        path = _place("truth", departure, f"{1e6 * b:.0f}um-{self._digest(departure)}")
        if path.is_file():
            return bool(json.loads(path.read_text(encoding="utf-8"))["stays"])
        found = stays(departure.body, departure.driven(), b)
        write_whole(path, json.dumps({"stays": found}))
        return found

    @staticmethod
    def _digest(departure: Departure) -> str:
        rig = departure.body, departure.driven(), departure.guess
        return _hashed(*_texts(_SIMULATOR), repr(rig))
