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

import vinesexp.garbage  # noqa: F401  # before anything large is loaded
from vinesexp.environment import keep_caches_writable, one_thread_each
from vinesexp.errors import RigWarning, VinesexpError, shown

#: Commands, each a module of vinesexp.commands with add_arguments(parser) and run(args).
COMMANDS = {
    "look": "show the columns of instrument files and what each may be",
    "init": "propose campaign.yaml and records.csv for a folder of files",
    "check": "check a campaign folder without running it",
    "run": (
        "run the workflow on a campaign, from records to report; accepts all options of snakemake"
    ),
    "watch": "analyse files while you measure, and show the results on a live page",
    "plan": "show what to test next and why, or plan a first campaign from rig values",
    "compare": (
        "show which differences of two results folders exceed their errors, or which values of "
        "more repeat"
    ),
    "export": (
        "write records, impacts and tables for Matlab, spreadsheets, modal software or archives"
    ),
    "design": "find the clearance to build and its amplitude; b_c and b_t with sensitivities",
    "map": "compute amplitude and share of captured starts over any two of b, f, G, m, r",
    "basins": (
        "find the motions that coexist at each clearance, and the share of starts that leads to "
        "each"
    ),
    "simulate": "simulate the records of a scene",
    "impacts": "find impacts in instrument files",
    "completion": "print the completion of commands and options for bash, zsh or fish",
}


def build_parser(*commands: str | None) -> argparse.ArgumentParser:
    """The argument parser; only the modules of `commands` are imported: help stays quick."""
    from vinesexp import __version__

    parser = argparse.ArgumentParser(
        prog="vinesexp",
        description=(
            "Analysis of vibro-impact nonlinear energy sinks: from records to the best clearance."
        ),
    )
    parser.add_argument("--version", action="version", version=f"vinesexp {__version__}")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, purpose in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=purpose, description=purpose)
        if name in commands:
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
    warnings.showwarning = partial(_in_one_line, command, set(), warnings.showwarning)
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


def _in_one_line(
    command: str | None, said: set[str], others: Any, message: Any, category: Any, *more: Any
) -> None:
    """A warning about the user's own values, once, without the place in the code that gave it."""
    if not issubclass(category, RigWarning):
        others(message, category, *more)
    elif str(message) not in said:
        said.add(str(message))
        print(f"vinesexp {command}: warning: {message}", file=sys.stderr)


if __name__ == "__main__":
    raise SystemExit(main())
