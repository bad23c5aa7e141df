"""The question and its answer: from what was given to what to build, by theory and simulation."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

from vinesexp.arrays import as_number, several
from vinesexp.design.advice import advise
from vinesexp.design.answer_json import answer_of
from vinesexp.design.best_clearance import BUDGET
from vinesexp.design.headline import Answer, headline_of, remarks_of
from vinesexp.design.inputs import OPTIONS, RIG, Given, gather
from vinesexp.design.predictions import LEVELS, Theory, predict, start_amplitude
from vinesexp.design.recorded import under_record
from vinesexp.design.released import Falls, released
from vinesexp.design.shown import text_of
from vinesexp.design.task import OpenRig, Task
from vinesexp.errors import AnalysisError, ParameterError, RigWarning
from vinesexp.excitation import Measured, WeakDamping
from vinesexp.rig import NES, Rig
from vinesexp.theory.multiple import design_clearances

#: Tolerance of a cavity that is drilled, as a share of b.
DRILLED = 0.01


def open_rig_of(given: Given) -> OpenRig:
    """The rig as given, its clearances left open; their ratios 1 where none was given."""
    masses, r = (tuple(q.value for q in given[name]) for name in ("m", "r"))
    ratios = (1.0,) * len(masses)
    if "b" in given and len(given["b"]) > 1:
        largest = max(q.value for q in given["b"])
        ratios = tuple(q.value / largest for q in given["b"])
    return OpenRig(
        given.oscillator,
        masses,
        r * len(masses) if len(r) == 1 else r,
        ratios=ratios,
        friction=given.size("friction"),
        damping=WeakDamping(given.size("quadratic"), given.size("coulomb")),
        tolerance=given.one("tolerance").value if "tolerance" in given else DRILLED,
    )


def task_of(given: Given) -> Task:
    """The task of the simulation: every ball, the ranges, and the standard errors given."""
    one, levels = open_rig_of(given), given.ends("G")
    o = one.oscillator
    if "b" not in given and len(one.masses) > 1 and levels[0] < levels[1]:
        plan = design_clearances(
            G_low=levels[0], G_high=levels[1], oscillator=o, masses=one.masses, r=one.r
        )
        one = replace(one, ratios=tuple(b / max(plan) for b in plan))
    names = ("M", "c1", "k1", "m", "r", "G", "frequency")
    errors = {name: given[name][0].std_error for name in names if name in given}
    return Task(
        **{name: getattr(one, name) for name in one.__dataclass_fields__},
        levels=levels,
        frequencies=given.ends("frequency") if "frequency" in given else (o.f0, o.f0),
        std_errors={name: e for name, e in errors.items() if e},
    )


def asked_of(given: Given) -> float | None:
    """The clearance given (the largest, of several balls), m."""
    return max(q.value for q in given["b"]) if "b" in given else None


def release_of(given: Given, theory: Theory, *, seed: int) -> Falls | None:
    """Releases over clearance by simulation; None without a release or a whole rig."""
    if "x0" not in given or any(option.symbol not in given for option in RIG):
        return None
    one, asked, x_m = open_rig_of(given), asked_of(given), start_amplitude(given)
    if not one.oscillator.zeta < 0.9:
        return None
    marks = [level.b for level in theory.releases] + ([] if asked is None else [asked])
    if theory.b_t is not None:
        marks += [theory.b_t.published, theory.b_t.exact]
    return released(
        one,
        x0=given.one("x0").value,
        v0=given.size("v0"),
        levels=[share * x_m for share in LEVELS],
        marks=marks,
        asked=asked,
        seed=seed,
    )


#: A value with its unit as text ("32 g"), a number in SI, or several of them.
Value = str | float | Sequence[str | float]


class Design(Answer):
    """The answer, and the ways to show it."""

    @property
    def headline(self) -> str:
        """What to build and what it gives, or that nothing helps, in one paragraph."""
        return headline_of(self)

    @property
    def notes(self) -> list[str]:
        """What a reader would otherwise be misled by."""
        return remarks_of(self)

    def text(self) -> str:
        """The answer as the command shows it."""
        return text_of(self)

    def as_dict(self) -> dict[str, object]:
        """The answer as ``--json`` gives it."""
        return answer_of(self)


def answered(
    given: Given,
    *,
    simulate: bool = True,
    seed: int = 1,
    base: Measured | None = None,
    effort: int = 1,
) -> Design:
    """Theory, and by simulation what to build for a base amplitude and what a release does.

    `effort` is how many times the usual work may be done for a base amplitude. What was found
    before an interrupt is in the answer, which says so.

    Raises
    ------
    AnalysisError
        Neither has an answer.
    """
    theory = predict(given)
    warn_of(given)
    falls, driven, advice = None, None, None
    if not simulate:
        if theory.no_orbit and theory.b_t is None:
            raise AnalysisError(theory.no_orbit)
        return Design(given, theory, None, None)
    try:
        with warnings.catch_warnings():  # of clearances that only the search tries
            warnings.simplefilter("ignore", RigWarning)
            if base is not None:
                asked = asked_of(given)
                driven = under_record(open_rig_of(given), base, asked=asked, seed=seed)
            falls = release_of(given, theory, seed=seed)
            if "G" in given:
                advice = advise(
                    task_of(given), asked=asked_of(given), seed=seed, budget=effort * BUDGET
                )
    except AnalysisError as error:
        if theory.no_orbit:
            raise AnalysisError(f"{theory.no_orbit}; {error}") from None
        raise
    except KeyboardInterrupt:
        return Design(given, theory, advice, falls, driven, stopped=True)
    return Design(given, theory, advice, falls, driven)


def warn_of(given: Given) -> None:
    """Make the rig that was given: it warns of slips of units."""
    if all(symbol in given for symbol in ("M", "c1", "k1", "m")):
        b = [q.value for q in given["b"]] if "b" in given else [1e-9]
        Rig(
            given.oscillator,
            [NES(m=q.value, b=b[k % len(b)], r=0.0) for k, q in enumerate(given["m"])],
        )


def design(
    *,
    simulate: bool = True,
    seed: int = 1,
    base: Measured | None = None,
    effort: int = 1,
    **values: Value,
) -> Design:
    """What clearance to build and what it gives: `vinesexp design` as an object.

    Parameters
    ----------
    simulate : bool
        False: b_c and b_t alone.
    seed : int
        Of the random starts.
    base : Measured, optional
        Base motion as recorded, in place of base_amplitude or besides. The mass begins undeflected,
        where the record begins.
    effort : int
        How many times the usual number of runs may be spent where these do not decide.
    **values
        ``mass``, ``damping``, ``stiffness``, ``nes_mass``, ``restitution`` and an excitation,
        ``base_amplitude`` or ``release``; the options of the command by their names. Numbers are
        in SI; texts have a unit and may have an error (``"4.7 +- 0.05 kg"``). A pair is a range of
        base_amplitude or frequency; several of nes_mass, restitution or clearance are one per ball.

    Returns
    -------
    Design
        ``headline`` and ``notes`` in words, ``advice``, ``falls`` and ``theory`` in numbers,
        ``text()`` as the command shows it, ``as_dict()`` as ``--json`` gives it.

    Raises
    ------
    ParameterError
        A name that is no option, a value without meaning, or one that is missing.
    AnalysisError
        Nothing has an answer.

    Examples
    --------
    >>> answer = design(mass=4.7, damping=3.02, stiffness=1.147e4, nes_mass="32 g",
    ...                 restitution=0.6, base_amplitude=0.25e-3, simulate=False)
    >>> round(1e3 * answer.theory.b_c.exact, 3), answer.as_dict()["b_c_published_mm"] > 33.9
    (33.923, True)
    """
    options = {option.flag[2:].replace("-", "_"): option for option in OPTIONS}
    texts = {}
    for name, value in values.items():
        if name not in options:
            raise ParameterError(f"design({name}=...): expected one of {', '.join(options)}")
        option = options[name]
        words = [
            x if isinstance(x, str) else f"{as_number(x, name)!r} {option.unit}".strip()
            for x in several(value)
        ]
        texts[option.symbol] = (":" if option.symbol in ("G", "frequency") else "; ").join(words)
    given = gather(texts, recorded=base is not None)
    return answered(given, simulate=simulate, seed=seed, base=base, effort=effort)
