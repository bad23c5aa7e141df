"""`vinesexp impacts`: impacts in instrument files, without a campaign around them.

The file goes through the same ingest, bandpass and detection as a record of a campaign, so the
numbers are the same.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from vinesexp.commands.options import add_force, add_options, refuse_existing, writing
from vinesexp.errors import ParameterError, VinesexpError, say
from vinesexp.identification.bounces import bounces_heard
from vinesexp.pipeline import condition_record, find_impacts, ingest_record
from vinesexp.proposal.kind_of_test import oscillates
from vinesexp.records.campaign.schema import Campaign, Channel, Record, Setup, TimeColumn
from vinesexp.records.instrument.ingest import (
    channel_of,
    instrument_rate,
    read_channels,
    time_column,
)
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.signals.impacts.impact_table import Impacts, read_impacts
from vinesexp.units import counted
from vinesexp.whole_files import write_whole

#: Probability that a repetition would find the impact again, from which on it is certain.
_CERTAIN = 0.9


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Files, how to find the channels in them, and what the numbers mean."""
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="instrument files")
    column = "column of the acceleration: name, pattern such as 'CH3*', or number from 0"
    parser.add_argument("--acceleration", "-a", required=True, metavar="COLUMN", help=column)
    unit = (
        "m/s^2 or g if the file has physical units, else a sensitivity such as '100 mV/g'; "
        "leave it out for a channel without calibration, such as a microphone: then only the "
        "bounces of a ball are found"
    )
    add_options(parser, ("--acceleration-unit UNIT", unit))
    column = "column of the displacement, if there is one"
    parser.add_argument("--displacement", "-x", metavar="COLUMN", help=column)
    add_options(
        parser,
        ("--displacement-unit UNIT", "mm, or '0.5 V/mm'"),
        ("--time COLUMN", "default: as the file says, or Time*"),
    )
    add_options(parser, ("--time-unit UNIT", "default: that of its header, else s"))
    add_options(parser, ("--sample-rate RATE", "'10 kHz', where the file has no times"))
    parser.add_argument(
        "--test",
        choices=("periodic", "drop"),
        help="periodic: a mass that moves; drop: a bouncing ball or single shocks (default: judged "
        "from the signal)",
    )
    add_options(parser, ("--out FOLDER", "write FOLDER/<file>.impacts.csv"))
    add_force(parser)


def run(args: argparse.Namespace) -> int:
    """Find and print the impacts of every file; 1 if one of them could not be used."""
    channels = _channels(args)
    failed = 0
    for path in args.files:
        try:
            table = None if args.out is None else _table_for(path, args)
            text, found = _impacts_of(path, channels, args)
        except VinesexpError as error:
            say(f"vinesexp impacts: {error}")
            failed += 1
            continue
        if table is None:
            if len(args.files) > 1:
                print(f"# {path}")
            sys.stdout.write(text)
        else:
            with writing(table):
                write_whole(table, text)
            print(f"{path}: {counted(found.n, 'impact')}")
        if remark := _reservation(found):
            say(f"vinesexp impacts: {path}: {remark}")
    return 1 if failed else 0


def _reservation(found: Impacts) -> str:
    """What a person should know of these impacts; empty where most of them are certain."""
    if not found.n:
        return (
            "no impacts found; vinesexp look shows what is in the file, and with --test you state "
            "whether a mass moves in it or a ball drops"
        )
    certain = int((found.confidence > _CERTAIN).sum())
    if certain > found.n / 2:
        return ""
    return (
        f"{certain} of {found.n} impacts are certain (confidence above {_CERTAIN:g}): the "
        "others may be vibration"
    )


def _table_for(path: Path, args: argparse.Namespace) -> Path:
    """Where the impacts of a file go: never over an instrument file, over others by --force."""
    table: Path = args.out / f"{path.stem}.impacts.csv"
    given = table.resolve() in map(Path.resolve, args.files)
    refuse_existing(table, force=args.force and not given)
    return table


def _impacts_of(
    path: Path, channels: dict[str, Channel], args: argparse.Namespace
) -> tuple[str, Impacts]:
    """The table of impacts as it is handed on, and the same as columns."""
    rate = instrument_rate(args.sample_rate, where="--sample-rate") if args.sample_rate else None
    time = time_column(path, args.time, args.time_unit) if rate is None else None
    # The clearance only says that there is a ball; without it nothing is looked for.
    test = args.test or _test(path, channels, time, rate)
    record = Record(id="record", file=path, test=test, clearance=(1.0,))
    campaign = Campaign(
        folder=path.parent,
        name=path.stem,
        title=path.name,
        channels=channels,
        time=time,
        sample_rate=rate,
        records=(record,),
    )
    with tempfile.TemporaryDirectory(prefix="vinesexp-impacts-") as folder:
        paths = ResultPaths(Path(folder))
        for check in ingest_record(campaign, record, paths=paths, strict=True):
            if check.outcome == "warning":
                say(f"vinesexp impacts: {path}: {check.detail}")
        condition_record(campaign, record, paths=paths, strict=True)
        find_impacts(campaign, record, paths=paths, strict=True)
        table = paths.impacts(record.id)
        return table.read_text(encoding="utf-8"), read_impacts(table)


def _test(
    path: Path, channels: dict[str, Channel], time: TimeColumn | None, rate: float | None
) -> str:
    """A ball that bounces, or a motion with impacts; shocks alone count as dropped, too."""
    if "sound" in channels:
        return "drop"
    if "displacement" in channels:
        return "periodic"
    only = {"acceleration": channels["acceleration"]}
    found_rate, _, values = read_channels(path, Setup(only, time=time, sample_rate=rate))
    if bounces_heard(values["acceleration"], found_rate) is not None:
        return "drop"
    return "periodic" if oscillates(values["acceleration"]) else "drop"


def _channels(args: argparse.Namespace) -> dict[str, Channel]:
    if args.acceleration_unit is None:
        if args.displacement is not None or args.test == "periodic":
            raise ParameterError(
                "--acceleration needs --acceleration-unit, such as m/s^2 or '100 mV/g'; without it "
                "only the bounces of a ball are found"
            )
        only = Channel("sound", args.acceleration, "sound", 1.0, unit="1", file_size=1.0)
        return {"sound": only}
    found = {"acceleration": channel_of("acceleration", args.acceleration, args.acceleration_unit)}
    if args.displacement is not None:
        if args.displacement_unit is None:
            raise ParameterError("--displacement needs --displacement-unit, such as mm or '1 V/mm'")
        found["displacement"] = channel_of(
            "displacement", args.displacement, args.displacement_unit
        )
    return found
