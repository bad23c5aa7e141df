"""`vinesexp design`: what clearance to build, what it gives, and how far that can be trusted."""

from __future__ import annotations

import argparse
import json
import os
from typing import TYPE_CHECKING

from vinesexp.commands import options
from vinesexp.design.inputs import OPTIONS, RIG, Given, gather
from vinesexp.errors import OtherQuantityError, ParameterError, VinesexpError, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vinesexp.design.headline import Answer
    from vinesexp.excitation import Measured


#: s of work from which on it is said beforehand.
SHORT = 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command; every number is written with its unit."""
    options.add_values(parser, OPTIONS)
    options.add_identified(parser)
    picture = "picture (svg, pdf or png): amplitude over clearance, or the SIM without simulation"
    more = "multiple of the usual work, where more starts are needed to decide or runs are slow (1)"
    options.add_options(
        parser,
        ("--base FILE", "base motion as recorded (any format), displacement or velocity"),
        ("--base-column NAME", "its column, by name or by number from 0 (the second, or the only)"),
        ("--base-unit UNIT", "unit of that column, such as mm, or a sensitivity such as 0.5 V/mm"),
        ("--theory-only", "b_c and b_t alone, without simulation"),
        ("--seed N", "seed of the random starts (1)"),
        ("--effort N", more),
        ("--html FILE", "a design sheet of one page"),
        action=options.Once,
    )
    options.add_force(parser)
    options.add_options(parser, ("--json", "one JSON object for programs"))
    options.add_options(parser, ("--plot FILE", picture), action=options.Once)


def run(args: argparse.Namespace) -> int:
    """Answer on standard output; the exit code is 0 or the error is one line."""
    identified, picture, sheet = args.identified, args.plot, args.html
    seed = options.whole_option(args.seed, "--seed", 1)
    base = base_of(args)
    texts = {o.symbol: getattr(args, o.symbol) for o in OPTIONS}
    given = gather(texts, identified, recorded=base is not None)
    options.refuse_existing(sheet, force=args.force, picture=picture)
    if sheet is not None and sheet.suffix.lower() not in (".html", ".htm"):
        raise VinesexpError(
            f"'{sheet.suffix}' is not a page; name a file that ends in .html", file=sheet
        )
    from vinesexp.design.ask import answered
    from vinesexp.design.best_clearance import BUDGET

    effort = options.whole_option(args.effort, "--effort", 1)
    expected = effort * BUDGET / (os.cpu_count() or 1) if "G" in given else 0.0
    if expected > SHORT and not args.theory_only:
        say(f"{effort} times the usual work: up to about {expected:.0f} s")
    with options.clock("simulating", expected):
        answer = answered(given, simulate=not args.theory_only, seed=seed, base=base, effort=effort)
    if args.json:
        from vinesexp.design.answer_json import answer_of

        print(json.dumps(answer_of(answer), indent=2))
    else:
        from vinesexp.design.shown import text_of

        print(text_of(answer))
    # last: a place that cannot be written to does not cost the answer
    if picture is not None:
        options.draw(_figure(answer), picture)
    if sheet is not None:
        from vinesexp.report.command_pages import write_sheet

        with options.writing(sheet, "be drawn"):
            write_sheet(sheet, answer)
    return 130 if answer.stopped else 0


def base_of(args: argparse.Namespace) -> Measured | None:
    """The recorded base, None where none is named.

    Raises
    ------
    ParameterError
        A column or unit without a file, or a file without its unit.
    VinesexpError
        The file cannot be read.
    """
    file, column, unit = args.base, args.base_column, args.base_unit
    if file is None:
        if column is not None or unit is not None:
            raise ParameterError(
                "is for a recorded base; name its file with --base", where="--base-column"
            )
        return None
    integrate = "integrate an acceleration twice and high-pass filter it first"
    if unit is None:
        raise ParameterError(
            "the unit of the record is missing; state it, such as --base-unit mm (the column is a "
            f"displacement or a velocity; {integrate})",
            where="--base",
        )
    from vinesexp.excitation import Measured
    from vinesexp.records.instrument.ingest import read_file
    from vinesexp.records.readers import open_source

    if column is None:
        column = str(min(1, len(open_source(file).columns) - 1))
    try:  # the role of which a velocity is integrated
        found = read_file(file, {"displacement": (column, unit)})
    except ParameterError as error:
        accelerates = isinstance(error, OtherQuantityError) and error.quantity == "acceleration"
        more = f"; {integrate}" if accelerates else ""
        raise ParameterError(f"{error.problem}{more}", where="--base-unit") from None
    return Measured(found.channels["displacement"], found.sample_rate)


def _figure(answer: Answer) -> Figure:
    given, theory, advice = answer.given, answer.theory, answer.advice
    if advice is not None:
        from vinesexp.figures.design_curve import design_curve

        return design_curve(advice)
    from vinesexp.design.predictions import start_amplitude
    from vinesexp.figures.invariant_manifold import sim_with_working_points

    points: dict[str, tuple[float, float | None]] = {}
    if theory.b_c is not None:
        points["b_c"] = (theory.b_c.exact, _amplitude_at_b_c(given, theory.b_c.exact))
    if theory.b_t is not None:
        points["b_t"] = (theory.b_t.exact, start_amplitude(given))
    return sim_with_working_points(r=given.one("r").value, points=points)


def _amplitude_at_b_c(given: Given, b: float) -> float:
    """Amplitude of the orbit a hair inside its end, m."""
    from vinesexp.design.predictions import frequency_of
    from vinesexp.theory.floquet import symmetric_orbits

    rig = {o.symbol: given.one(o.symbol).value for o in RIG}
    inside = b * (1.0 - 1e-9)
    orbits = symmetric_orbits(
        G=given.one("G").value, b=inside, frequency=frequency_of(given), **rig
    )
    return orbits[0].amplitude
