"""`vinesexp watch`: files analysed as instruments write them; a page says what to do next."""

from __future__ import annotations

import argparse
import threading
import webbrowser
from pathlib import Path

from vinesexp.commands.options import add_options
from vinesexp.errors import ParameterError
from vinesexp.live.server import serve
from vinesexp.live.session import Session
from vinesexp.resultslock import hold_results


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The folder that is measured into."""
    parser.add_argument(
        "folder", type=Path, metavar="FOLDER", help="folder of campaign.yaml and of the files"
    )
    quiet = "time without a change after which a file is finished (1)"
    add_options(parser, ("--results DIR", "folder of the results (results/<folder>-live)"))
    add_options(parser, ("--quiet SECONDS", quiet), type=float, default=1.0)
    add_options(parser, ("--port PORT", "port of the page (any free one)"), type=int, default=0)
    add_options(parser, ("--no-browser", "only print the address"))


def run(args: argparse.Namespace) -> int:
    """Watch until Ctrl-C."""
    results: Path = args.results or Path("results") / f"{args.folder.resolve().name}-live"
    if not args.quiet >= 0.0:
        raise ParameterError(f"found {args.quiet:g}, expected 0 s or more", where="--quiet")
    session = Session(args.folder, results, quiet=args.quiet)
    session.begin()
    lock = hold_results(results, campaign=args.folder)
    try:
        served = serve(session, port=args.port)
    except (OSError, OverflowError) as error:
        raise ParameterError(
            f"no page can be shown there ({error}); leave this out for any free one",
            where=f"--port {args.port}",
        ) from None
    threading.Thread(target=served.server.serve_forever, daemon=True).start()
    print(f"watching {args.folder}; the page: {served.address}", flush=True)
    print("Ctrl-C ends it; the same command continues where it stopped", flush=True)
    if not args.no_browser:  # pragma: no cover
        webbrowser.open(served.address)
    try:
        session.run()
    except KeyboardInterrupt:
        print(f"\nended; the report: vinesexp run {args.folder}")
    finally:
        session.stop()
        served.server.shutdown()
        lock.close()
    return 0
