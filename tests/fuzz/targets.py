"""The public code that meets hostile input: it answers, or refuses in one line.

A target takes a case's own random numbers and an empty folder, and returns a word of what happened;
anything that a person should not meet is an exception.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vinesexp.errors import RecordError, VinesexpError
from vinesexp.pipeline import analyse_campaign, analyse_record
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.load import campaign_problems
from vinesexp.records.campaign.schema import Campaign, Channel, Known, Record, TimeColumn
from vinesexp.records.instrument.ingest import ingest
from vinesexp.records.readers import open_source
from vinesexp.records.stored.checks import Check, read_checks
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordWriter, open_record

from . import commands, folders, scenes, seeds, signals
from .mutations import damaged, reworded

#: Slips of the code, which no record can be refused for.
_SLIPS = ("AttributeError", "NameError", "UnboundLocalError")


class FoundError(AssertionError):
    """Input that was answered wrongly: infinity called good, a message of several lines."""


def text_file(rng: random.Random, folder: Path) -> str:
    """A text file of an instrument, damaged."""
    names = seeds.files("text")
    name = rng.choice(sorted(names))
    raw = names[name]
    if rng.random() < 0.6:
        encoding = "utf-16" if name.startswith("utf16") else "latin-1"
        raw = reworded(raw.decode(encoding), rng).encode(encoding, "replace")
    else:
        raw = damaged(raw, rng, list(names.values()))
    return _read(folder / name, raw, rng)


def binary_file(rng: random.Random, folder: Path) -> str:
    """A binary instrument file, damaged."""
    names = seeds.files("binary")
    name = rng.choice(sorted(names))
    return _read(folder / name, damaged(names[name], rng, list(names.values())), rng)


def wrong_length(rng: random.Random, folder: Path) -> str:
    """A file that is whole but for its end: cut, or longer than it says."""
    names = seeds.files("binary")
    name = rng.choice(sorted(names))
    path, raw = folder / name, names[name]
    path.write_bytes(raw)
    try:
        whole = _lengths(path)[0]
        path.write_bytes(raw[: rng.randrange(1, len(raw))] if rng.random() < 0.7 else raw + raw[9:])
        found, said = _lengths(path)
    except RecordError as error:
        return _one_line(error)
    if sum(found) < sum(whole) and not said and not name.endswith((".mat", ".uff")):
        raise FoundError(f"{name} of {path.stat().st_size} bytes: {found} of {whole}, and no word")
    return "ok"


def _lengths(path: Path) -> tuple[list[int], bool]:
    """Samples of each column, and whether anything is said about what is missing."""
    view = view_file(path)
    return [len(one.values) for one in view.columns], bool(view.remarks or view.problems)


def indirect(rng: random.Random, folder: Path) -> str:
    """An HDF5 file whose links and virtual datasets lead to one another and out of it."""
    seeds.write_indirect(folder, rng)
    try:
        source = open_source(folder / rng.choice(("a.h5", "a.mat")))
        for column in range(len(source.columns)):
            for block in source.blocks([column]):
                if (block == seeds.OUTSIDE).any():
                    raise FoundError(f"'{source.columns[column].name}' is of another file")
    except RecordError as error:
        return _one_line(error)
    if source.sample_interval == 1.0 / seeds.OUTSIDE:
        raise FoundError("its sample rate is of another file")
    return "ok"


def _read(path: Path, raw: bytes, rng: random.Random) -> str:
    path.write_bytes(raw)
    try:
        if rng.random() < 0.3:
            view = view_file(path)
            for column in view.signals:
                column.peak()
            return "looked at"
        record = Record(id="a", file=path, test=rng.choice(signals.TESTS))
        checks = ingest(_any_campaign(path.parent, rng), record, path.parent / "a.nc")
    except RecordError as error:
        return _one_line(error)
    _require_finite(path.parent / "a.nc", checks)
    return "ok"


def _any_campaign(folder: Path, rng: random.Random) -> Campaign:
    column = rng.choice((0, 1, 1, 1))
    accept = frozenset({"frozen", "saturated"})
    laser = Channel("displacement", column, "displacement", 1e-3, unit="mm", accept=accept)
    time, rate = rng.choice(((None, None), (None, 1000.0), (TimeColumn(0, "s", 1.0), None)))
    return _campaign(folder, {"displacement": laser}, time, rate)


def _campaign(
    folder: Path, channels: dict[str, Channel], time: TimeColumn | None, rate: float | None
) -> Campaign:
    return Campaign(folder, "fuzz", "fuzz", Known(), channels, time, rate, None)


def _require_finite(path: Path, checks: Sequence[Check]) -> None:
    """Every sample is a number, but for those that the checks say are left out."""
    said = [check.detail for check in checks if check.check in ("gaps", "clock")]
    said += [one.detail for one in checks if "nothing is known there" in one.detail]  # pauses
    with open_record(path) as view:
        for role in view.roles:
            values = view.read(role)
            good = np.abs(values) <= 1e9
            own = role == "displacement" or any(one.startswith(role) for one in said)
            if said and own and good.any():
                good |= np.isnan(values)
            if not good.all():
                raise FoundError(f"{role} called good: {values[~good][:3]}")
        if not 0.0 < view.sample_rate < np.inf:
            raise FoundError(f"sample rate {view.sample_rate} called good")


def _one_line(error: VinesexpError) -> str:
    if "\n" in str(error) or not str(error).isprintable():
        raise FoundError(f"a message that is not one line: {error!r}")
    return "refused"


def campaign_yaml(rng: random.Random, folder: Path) -> str:
    """campaign.yaml, reworded or damaged."""
    text = rng.choice((seeds.CAMPAIGN, seeds.FULL_CAMPAIGN))
    return _described(folder, _spoiled(text, rng), seeds.RECORDS.encode())


def records_csv(rng: random.Random, folder: Path) -> str:
    """records.csv, reworded or damaged."""
    return _described(folder, seeds.FULL_CAMPAIGN.encode(), _spoiled(seeds.RECORDS, rng))


def _spoiled(text: str, rng: random.Random) -> bytes:
    if rng.random() < 0.3:
        return damaged(text.encode(), rng)
    return reworded(text, rng).encode(errors="replace")


def _described(folder: Path, yaml: bytes, table: bytes) -> str:
    (folder / "campaign.yaml").write_bytes(yaml)
    (folder / "records.csv").write_bytes(table)
    (folder / "published.csv").write_bytes(seeds.PUBLISHED)
    problems = campaign_problems(folder)
    for problem in problems:
        _one_line(problem)
    return "refused" if problems else "ok"


def scene_yaml(rng: random.Random, folder: Path) -> str:
    """scene.yaml, reworded or damaged; not simulated."""
    from vinesexp.laboratory.scene import load_scene

    text = seeds.SCENE
    if rng.random() < 0.1:
        text = (seeds.REPOSITORY / "data/twin/scene.yaml").read_text(encoding="utf-8")
    (folder / "scene.yaml").write_bytes(_spoiled(text, rng))
    try:
        load_scene(folder / "scene.yaml")
    except VinesexpError as error:
        return _one_line(error)
    return "ok"


def signal(rng: random.Random, folder: Path) -> str:
    """A hostile signal through every step on records, and sometimes those on a campaign."""
    rate, channels = signals.hostile(rng)
    kinds = {r: "acceleration" if r == "acceleration" else "displacement" for r in channels}
    with RecordWriter(
        folder / "raw.h5",
        sample_rate=rate,
        quantities=kinds,
    ) as writer:
        writer.append(channels)
    accept = frozenset({"frozen", "saturated"} if rng.random() < 0.7 else ())
    units = {"acceleration": "m/s^2", "displacement": "m"}
    roles = {
        role: Channel(role, role, kind, 1.0, unit=units[kind], accept=accept)
        for role, kind in kinds.items()
    }
    campaign = _campaign(folder, roles, None, rate)
    test = rng.choice(signals.TESTS)
    driven = test in ("sweep", "periodic")
    record = Record(
        id="a",
        file=folder / "raw.h5",
        test=test,
        clearance=rng.choice(((), (0.03,), (0.03, 0.02))) if test != "drop" else (),
        frequency=(7.9, 7.9) if driven and rng.random() < 0.5 else None,
        base_amplitude=2.5e-4 if driven and rng.random() < 0.5 else None,
        release=0.02 if test in ("ringdown", "transient") else None,
    )
    paths = ResultPaths(folder / "results")
    if rng.random() < 0.05:
        analyse_campaign(replace(campaign, records=(record,)), paths=paths)
    else:
        analyse_record(campaign, record, paths=paths)
    for path in (paths.record("a"), paths.conditioned("a")):
        with open_record(path) as view:
            if view.refused is not None:
                if any(word in view.refused for word in _SLIPS):
                    raise FoundError(view.refused)
                return "refused"
        _require_finite(path, read_checks(paths.ingest_checks("a")))
    return "ok"


TARGETS: dict[str, Callable[[random.Random, Path], str]] = {
    "text": text_file,
    "binary": binary_file,
    "length": wrong_length,
    "indirect": indirect,
    "campaign": campaign_yaml,
    "records": records_csv,
    "scene": scene_yaml,
    "signal": signal,
    "folder": folders.folder_of_others,
    "motion": scenes.motion,
    "command": commands.command,
}
