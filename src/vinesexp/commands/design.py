"""`vinesexp design`: what clearance to build, what it gives, and how far that can be trusted."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from vinesexp.commands.options import (
    add_force,
    add_identified,
    add_values,
    check_picture,
    once,
    refuse_existing,
    whole,
    writing,
)
from vinesexp.design.inputs import OPTIONS, RIG, Given, gather
from vinesexp.errors import AnalysisError, VinesexpError

if TYPE_CHECKING:
    from vinesexp.design.advice import Advice
    from vinesexp.design.answer import Answer
    from vinesexp.figures.draw.design_curve import DesignCurve

#: Contract keys of the simulation, null where there is none.
SIMULATED = (
    "least_mean_mm",
    "least_max_mm",
    "robust_mm",
    "captured_share",
    "amplitude_mean_mm",
    "amplitude_max_mm",
    "bare_amplitude_mm",
    "tmd_amplitude_mm",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command; every number is written with its unit."""
    add_values(parser, OPTIONS)
    add_identified(parser)
    parser.add_argument(
        "--theory-only", action="store_true", help="b_c and b_t alone, without simulation"
    )
    parser.add_argument("--seed", metavar="N", action="append", help="of the random starts (1)")
    parser.add_argument(
        "--html", type=Path, metavar="FILE", action="append", help="a design sheet of one page"
    )
    add_force(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object for programs")
    parser.add_argument(
        "--plot",
        type=Path,
        metavar="FILE",
        action="append",
        help="picture (svg, pdf or png): amplitude over clearance, or the SIM without simulation",
    )


def run(args: argparse.Namespace) -> int:
    """Answer on standard output; the exit code is 0 or the error is one line."""
    identified = once(args.identified, "--identified")
    picture = once(args.plot, "--plot")
    sheet = once(args.html, "--html")
    seed = whole(args.seed, "--seed", 1)
    given = gather({o.symbol: getattr(args, o.symbol) for o in OPTIONS}, identified)
    check_picture(picture)
    refuse_existing(picture, sheet, force=args.force)
    if sheet is not None and sheet.suffix.lower() not in (".html", ".htm"):
        raise VinesexpError(
            f"'{sheet.suffix}' is no page; name a file that ends in .html", file=sheet
        )
    answer = design(given, simulate=not args.theory_only, seed=seed)
    if args.json:
        print(json.dumps(answer_of(given, answer), indent=2))
    else:
        from vinesexp.design.answer_text import text_of

        print(text_of(given, answer))
    # last: a place that cannot be written to does not cost the answer
    for path, write in ((picture, _plot), (sheet, _sheet)):
        if path is not None:
            with writing(path, "be drawn"):
                write(path, given, answer)
    return 0


def design(given: Given, *, simulate: bool = True, seed: int = 1) -> Answer:
    """Theory, and by simulation what to build for a base amplitude and what a release does.

    Raises
    ------
    AnalysisError
        Neither has an answer.
    """
    from vinesexp.design.answer import Answer
    from vinesexp.design.given_task import asked_of, release_of, task_of
    from vinesexp.design.predictions import predict

    theory = predict(given)
    falls = release_of(given, theory, seed=seed) if simulate else None
    if "G" not in given or not simulate:
        if theory.no_orbit and theory.b_t is None:
            raise AnalysisError(theory.no_orbit)
        return Answer(theory, None, falls)
    from vinesexp.design.advice import advise

    try:
        return Answer(theory, advise(task_of(given), asked=asked_of(given), seed=seed), falls)
    except AnalysisError as error:
        if theory.no_orbit:
            raise AnalysisError(f"{theory.no_orbit}; {error}") from None
        raise


def answer_of(given: Given, answer: Answer) -> dict[str, object]:
    """One object for programs: the contract's keys first, then everything else."""
    from vinesexp.design.answer_json import as_json, falls_as_json
    from vinesexp.design.answer_warnings import remarks_of
    from vinesexp.design.given_task import bands_given

    theory, advice = answer.theory, answer.advice
    found = theory.as_json() | dict.fromkeys(SIMULATED)
    if advice is not None:
        found |= as_json(advice)
    found["inputs"] = {
        o.symbol: [{"value": q.value, "std_error": q.std_error} for q in given[o.symbol]]
        for o in OPTIONS
        if o.symbol in given
    }
    for name, prediction in (("b_c", theory.b_c), ("b_t", theory.b_t)):
        if prediction is not None:
            found[name] = {
                "low_mm": 1e3 * prediction.low,
                "high_mm": 1e3 * prediction.high,
                "std_error_mm": 1e3 * prediction.std_error,
                "sensitivity_m_per_si": dict(prediction.gradient),
                "sensitivity_published_m_per_si": dict(prediction.gradient_published),
            }
    if theory.no_orbit:
        found["no_exact_b_c"] = theory.no_orbit
    if theory.releases:
        found["release"] = [
            {
                "level_mm": 1e3 * one.level,
                "b_mm": 1e3 * one.b,
                "low_mm": None if one.low is None else 1e3 * one.low,
                "high_mm": None if one.high is None else 1e3 * one.high,
                "time_s": one.time,
                "bare_time_s": one.bare_time if one.bare_time < float("inf") else None,
                "met_at_most": one.capture,
            }
            for one in theory.releases
        ]
    if answer.falls is not None:
        found["release_simulated"] = falls_as_json(answer.falls)
    found["bands_given_mm"] = [[1e3 * x.low, 1e3 * x.high] for _, x in bands_given(given)]
    found["warnings"] = remarks_of(given, answer)
    return found


def _sheet(path: Path, given: Given, answer: Answer) -> None:
    from vinesexp.report.design_sheet import write_sheet

    curve = None if answer.advice is None else curve_of(answer.advice)
    write_sheet(path, given, answer, curve)


def _plot(path: Path, given: Given, answer: Answer) -> None:
    from vinesexp.figures.draw.style import write

    theory, advice = answer.theory, answer.advice
    if advice is not None:
        from vinesexp.figures.draw.design_curve import design_curve

        write(design_curve(curve_of(advice)), path)
        return
    from vinesexp.design.predictions import start_amplitude
    from vinesexp.figures.draw.theory_curves import sim_with_working_points

    points: dict[str, tuple[float, float | None]] = {}
    if theory.b_c is not None:
        points["b_c"] = (theory.b_c.exact, _amplitude_at_b_c(given, theory.b_c.exact))
    if theory.b_t is not None:
        points["b_t"] = (theory.b_t.exact, start_amplitude(given))
    write(sim_with_working_points(r=given.one("r").value, points=points), path)


def curve_of(advice: Advice) -> DesignCurve:
    """What the scan saw, for the picture; mm."""
    import numpy as np

    from vinesexp.figures.draw.design_curve import DesignCurve

    found = advice.found
    low, middle, high = 1e3 * np.percentile(found.random.scan.mean, [10, 50, 90], axis=1)
    build = (
        ("least mean", advice.least_mean),
        ("least largest", advice.least_max),
        ("robust", advice.robust),
        ("given", advice.asked),
    )
    return DesignCurve(
        b=1e3 * found.grid,
        rest=1e3 * advice.task.average(found.rest.scan.mean),
        low=low,
        middle=middle,
        high=high,
        captured=found.random.scan.captured.mean(axis=1),
        bare=1e3 * advice.bare,
        absorber=1e3 * advice.den_hartog.amplitude,
        build={name: 1e3 * one.b for name, one in build if one is not None},
        published=1e3 * advice.published,
        exact=None if advice.exact is None else 1e3 * advice.exact,
    )


def _amplitude_at_b_c(given: Given, b: float) -> float:
    """Amplitude of the orbit a hair inside its end, m."""
    from vinesexp.design.predictions import frequency_of
    from vinesexp.theory.rig_orbits import symmetric_orbits

    rig = {o.symbol: given.one(o.symbol).value for o in RIG}
    inside = b * (1.0 - 1e-9)
    orbits = symmetric_orbits(
        G=given.one("G").value, b=inside, frequency=frequency_of(given), **rig
    )
    return orbits[0].amplitude
