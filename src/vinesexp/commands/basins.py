"""`vinesexp basins`: the motions that coexist over the clearance, with their shares of starts.

A command of its own beside `map`: it goes over the clearance alone and says what the motions are,
where `map` goes over any two values and says how large they are.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from vinesexp.commands import options
from vinesexp.errors import ParameterError, say
from vinesexp.maps.map_options import OPTIONS, along, cells_of

if TYPE_CHECKING:
    from vinesexp.maps.basins import Attractor

#: Columns of the table that have a unit, as they are headed.
HEADS = {name: f"{name}_m" for name in ("b", "mean", "low", "high", "largest")}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command; the clearance is a range."""
    cells = ("--cells N", "clearances tried (40)")
    options.add_map_values(parser, cells=cells, starts="random starts at each (40)")
    options.add_options(
        parser,
        ("--out FILE", "table of the motions (csv)"),
        ("--plot FILE", "picture: amplitude over clearance (svg, pdf or png)"),
        ("--json", "one JSON object for programs"),
        action=options.Once,
    )


def run(args: argparse.Namespace) -> int:
    """Answer on standard output; the exit code is 0 or the error is one line."""
    from vinesexp.design.ensemble import workload_of
    from vinesexp.maps.basins import coexisting
    from vinesexp.maps.response_map import rig_of

    values, ranges = options.map_values(args)
    more = [option.flag for option in OPTIONS if option.symbol in ranges and option.symbol != "b"]
    if more:
        raise ParameterError("found a range, expected one value", where=more[0])
    (cells,) = cells_of(args.cells or "40", 1)
    clearances = along(ranges["b"], cells) if "b" in ranges else (values["b"],)
    starts = options.whole_option(args.starts, "--starts", 40)
    seed = options.whole_option(args.seed, "--seed", 1)
    options.refuse_existing(args.out, force=args.force, picture=args.plot)
    rig = rig_of(values | {"b": clearances[0]})
    say(workload_of(rig, values["frequency"], len(clearances) * starts))
    bar, stopped = options.Bar("clearances"), False
    found: list[Attractor] = []
    level, frequency = values["G"], values["frequency"]
    try:
        for done, b in enumerate(clearances, start=1):
            found += coexisting(
                rig, level=level, frequency=frequency, clearances=[b], starts=starts, seed=seed
            )
            bar(done, len(clearances))
    except KeyboardInterrupt:
        stopped = True
    bar.end()
    if stopped:
        known = len({one.b for one in found})
        say(f"vinesexp basins: stopped after {known} of {len(clearances)} clearances")
        if not found:
            return 130
    if args.json:
        motions = [asdict(one) for one in found]
        answer = {"inputs": values, "starts": starts, "seed": seed, "motions": motions}
        print(json.dumps(answer, indent=2))
    else:
        print(motions_text(found))
    if args.out is not None:
        write_table(found, args.out)
    if args.plot is not None:
        from vinesexp.design.task import bare_gain
        from vinesexp.figures.response_map_panels import coexisting_motions

        bare = values["G"] * bare_gain(rig.oscillator, values["frequency"])
        options.draw(coexisting_motions(found, bare=bare), args.plot)
    return 130 if stopped else 0


def motions_text(found: Sequence[Attractor]) -> str:
    """A table that a person reads."""
    lines = [f"{'b (mm)':>8}  {'starts':>7}  {'mean (mm)':>9}  {'largest':>8}  motion"]
    before = None
    for one in found:
        b = f"{1e3 * one.b:8.2f}" if one.b != before else " " * 8
        before = one.b
        lines.append(
            f"{b}  {100 * one.share:5.0f} %  {1e3 * one.mean:9.3f}  {1e3 * one.largest:8.3f}  "
            f"{one.regime}"
        )
    return "\n".join(lines)


def write_table(found: Sequence[Attractor], path: Path) -> None:
    """The same as a csv file, SI; the unit stands in the name of a column."""
    import pandas

    table = pandas.DataFrame(map(asdict, found))
    with options.writing(path):
        table.rename(columns=HEADS).to_csv(path, index=False, lineterminator="\r\n")
