"""`vinesexp map`: amplitude and share of captured starts over any two of b, f, G, m, r."""

from __future__ import annotations

import argparse
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

from vinesexp.commands import options
from vinesexp.errors import ParameterError, VinesexpError, say
from vinesexp.maps.map_options import OPTIONS, along, cells_of, shortened

if TYPE_CHECKING:
    from vinesexp.maps.response_map import MapGrid, Values


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command; every number is written with its unit, two of them as ranges."""
    axes = "values along the two axes, horizontal first (40x40)"
    options.add_map_values(parser, cells=("--cells NxM", axes), starts="starts in each cell (8)")
    options.add_options(
        parser,
        ("--kind KIND", "kind of starts: random or wall (random)"),
        ("--out FILE", "NetCDF file (map.nc); an existing one is completed"),
        ("--plot FILE", "draw the map too (svg, pdf or png)"),
        ("--rows K/N", "only the K-th of N shares of the rows: a part, to be joined later"),
        action=options.Once,
    )
    parser.add_argument("--join", nargs="+", type=Path, metavar="FILE", help="parts to be joined")


def run(args: argparse.Namespace) -> int:
    """Write the map; the exit code is 0 or the error is one line."""
    from vinesexp.maps.response_map import fill, joined, known_of, write_map

    grid = grid_of(args)
    out, picture = args.out or Path("map.nc"), args.plot
    options.refuse_existing(force=args.force, picture=picture)
    if args.rows is not None and (picture is not None or args.join):
        raise ParameterError("cannot be combined with --plot or --join", where="--rows")
    if args.join:
        values = joined(grid, args.join)
    else:
        rows = share_of_rows(args.rows, grid.shape[0])
        known = known_of(grid, out)
        say(grid.workload() if args.rows is None else f"{len(rows)} rows of: {grid.workload()}")
        bar = options.Bar("rows")
        saved = time.monotonic()

        def progress(done: int, total: int, so_far: Values) -> None:
            nonlocal saved, known
            bar(done, total)
            known = so_far
            if time.monotonic() - saved > 5.0:  # s
                write_map(grid, so_far, out)
                saved = time.monotonic()

        try:
            values = fill(grid, known, rows=rows, progress=progress)
        except KeyboardInterrupt:
            if known is not None:
                write_map(grid, known, out)
            raise VinesexpError("stopped; the same command continues from here", file=out) from None
        finally:
            bar.end()
    write_map(grid, values, out)
    print(f"{grid.shape[0]} x {grid.shape[1]} cells of {grid.starts} starts: {out}")
    if picture is not None:
        from vinesexp.figures.response_map_panels import response_map_panels

        options.draw(response_map_panels(grid, values), picture)
    return 0


def grid_of(args: argparse.Namespace) -> MapGrid:
    """The grid that the options describe."""
    from vinesexp.maps.response_map import AXES, MapGrid

    values, ranges = options.map_values(args)
    if len(ranges) != 2:
        flags = ", ".join(option.flag for option in OPTIONS if option.symbol in AXES)
        given = ", ".join(option.flag for option in OPTIONS if option.symbol in ranges) or "none"
        raise ParameterError(
            f"a map has two axes: give two of {flags} as a range such as '5:60 mm'; "
            f"ranges found: {given}"
        )
    x, y = (symbol for symbol in AXES if symbol in ranges)
    cells = cells_of(args.cells or "40x40", 2)
    return MapGrid(
        values=values,
        x=x,
        x_values=along(ranges[x], cells[0]),
        y=y,
        y_values=along(ranges[y], cells[1]),
        starts=options.whole_option(args.starts, "--starts", 8),
        kind=args.kind or "random",
        seed=options.whole_option(args.seed, "--seed", 1),
    )


def share_of_rows(share: str | None, rows: int) -> range:
    """The rows of 'K/N', the K-th of N shares, evenly spread; all where none is named."""
    if share is None:
        return range(rows)
    found = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", share)
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise ParameterError(f"found '{shortened(share)}', expected such as 3/8", where="--rows")
    return range(int(found[1]) - 1, rows, int(found[2]))
