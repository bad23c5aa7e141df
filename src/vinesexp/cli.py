"""The command `vinesexp`: check a campaign, design a clearance, simulate, find impacts."""

from __future__ import annotations

import argparse
import io
import sys
import warnings
from collections.abc import Sequence
from functools import partial
from importlib import import_module
from typing import Any

from vinesexp.environment import keep_caches_writable, one_thread_each
from vinesexp.errors import RigWarning, VinesexpError, shown

#: Commands, each a module of vinesexp.commands with add_arguments(parser) and run(args).
COMMANDS = {
    "look": "what is in instrument files, and which channel is which",
    "init": "campaign.yaml and records.csv proposed from a folder of files",
    "check": "check a campaign folder without running it",
    "run": "the workflow on a campaign: records to report; all options of snakemake",
    "watch": "while measuring: files analysed as instruments write them, on a live page",
    "plan": "what to test next and why, or a first campaign from rig values",
    "compare": (
        "two results folders: which differences exceed their errors; more: which values repeat"
    ),
    "export": "records, impacts and tables for Matlab, spreadsheets, modal software, archives",
    "design": "which clearance to build and its amplitude; b_c and b_t with sensitivities",
    "map": "amplitude and share of captured starts over any two of b, f, G, m, r",
    "basins": "which motions coexist over the clearance, and how many starts lead to each",
    "simulate": "simulated records of a scene",
    "impacts": "impacts in instrument files",
    "completion": "completion of commands and options in bash, zsh or fish",
}


def build_parser(command: str | None = None) -> argparse.ArgumentParser:
    """The argument parser; only the module of `command` is imported, so that help stays quick."""
    from vinesexp import __version__

    parser = argparse.ArgumentParser(
        prog="vinesexp",
        description="Vibro-impact nonlinear energy sinks: records to the best clearance.",
    )
    parser.add_argument("--version", action="version", version=f"vinesexp {__version__}")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, purpose in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=purpose, description=purpose)
        if name == command:
            module = import_module(f"vinesexp.commands.{name}")
            module.add_arguments(subparser)
            subparser.set_defaults(run=module.run)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; a user's mistake is one line on standard error and exit code 1."""
    for stream in (sys.stdout, sys.stderr):  # what it cannot show is written as its code
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    words = list(sys.argv[1:] if arguments is None else arguments)
    command = next((word for word in words if word in COMMANDS), None)
    one_thread_each()
    keep_caches_writable()
    warnings.showwarning = partial(_in_one_line, command, warnings.showwarning)
    try:
        parsed = build_parser(command).parse_args(words)
        code: int = parsed.run(parsed)
    except VinesexpError as error:
        print(f"vinesexp {command}: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return 1
    except OSError as error:  # a full disk, a folder that nobody may write
        file = "" if error.filename is None else f"{shown(str(error.filename))}: "
        print(f"vinesexp {command}: {file}{error.strerror or error}", file=sys.stderr)
        return 1
    return code


def _in_one_line(command: str | None, others: Any, message: Any, category: Any, *more: Any) -> None:
    """A warning about the user's own values without the place in the code that gave it."""
    if issubclass(category, RigWarning):
        print(f"vinesexp {command}: warning: {message}", file=sys.stderr)
    else:
        others(message, category, *more)


if __name__ == "__main__":
    raise SystemExit(main())
