"""`vinesexp init` on shuffled files: with the marked fields, the results are those of the names."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from vinesexp.cli import main
from vinesexp.pipeline import analyse_campaign
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.stored.result_paths import ResultPaths

TWIN = Path(__file__).resolve().parents[2] / "data/twin"
SMALL = """\
title: Small twin
seed: 7
rig: {mass: 4.7 kg, damping: 3.02 N s/m, stiffness: 1.147e4 N/m, nes_mass: 32 g, restitution: 0.6}
sensors:
  base: {sensitivity: 400 mV/mm, noise: 2 um, range: 2.5 mm}
  displacement: {sensitivity: 40 mV/mm, noise: 6 um, bandwidth: 5 kHz, range: 25 mm}
  acceleration: {sensitivity: 20 mV/g, noise: 0.3 m/s^2, pulse: 0.4 ms, range: 50 g}
oscilloscope: {sample_rate: 5 kHz, bits: 14, full_scale: 1 V}
groups:
  a:
    test: ringdown
    duration: 8 s
    oscilloscope: {format: oscilloscope-csv}
    records: {ring: {release: 20 mm}, added: {release: 20 mm, added_mass: 400 g}}
  b:
    test: transient
    duration: 8 s
    release: 20 mm
    ball_start: wall -1
    oscilloscope: {format: matlab}
    records: {release_b24: {clearance: 24 mm}}
  c:
    test: periodic
    duration: 10 s
    settle: 20 s
    base_amplitude: 0.25 mm
    frequency: 7.862 Hz
    ball_start: wall -1
    oscilloscope: {format: hdf5}
    records: {steady_b30: {clearance: 30 mm}, steady_b38: {clearance: 38 mm}}
  d:
    test: drop
    duration: 1.5 s
    oscilloscope: {format: wav}
    records: {drop_1: {height: 50 mm}}
"""
ASKED_FOR = ("clearance_mm", "added_mass_g")
#: What a shaker or a stop was set to: a record shows it, and no note asks for it.
SETTINGS = ("base_amplitude_mm", "frequency_hz", "release_mm")


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def shuffled(raw: Path, folder: Path, *, seed: int) -> dict[str, str]:
    """Copies of the files under new names and one another's suffixes; new name to old one."""
    files = sorted(raw.iterdir())
    rng = np.random.default_rng(seed)
    suffixes = [files[i].suffix for i in rng.permutation(len(files))]
    folder.mkdir(parents=True)
    meant = {}
    for k, i in enumerate(rng.permutation(len(files))):
        shutil.copy(files[i], folder / f"rec{k:02d}{suffixes[k]}")
        meant[f"rec{k:02d}"] = files[i].stem
    return meant


def fill_in(folder: Path, named: Path, meant: dict[str, str]) -> None:
    """What a person fills in: sensitivities, the ball, cells that a note asks for, and settings.

    How well these are known is as in the campaign with names.
    """
    stated = yaml.safe_load((named / "campaign.yaml").read_text(encoding="utf-8"))
    truth = rows_of(named / "records.csv")
    lines = (folder / "campaign.yaml").read_text(encoding="utf-8").splitlines()
    for k, line in enumerate(lines):
        role = line.strip().partition(":")[0]
        if role in stated["channels"]:
            assert '"? ' in line
            old = line.split('sensitivity: "')[1].split('"')[0]
            lines[k] = line.replace(old, stated["channels"][role]["sensitivity"])
        elif role in ("#known", "#  nes_mass"):
            lines[k] = line[1:]
    known = yaml.safe_dump({"uncertainties": stated["uncertainties"]})
    text = "\n".join([*lines, known])
    (folder / "campaign.yaml").write_text(text, encoding="utf-8")
    by_record = {row["record"]: row for row in truth}
    rows = rows_of(folder / "records.csv")
    for row in rows:
        asked = row["note"].partition("FILL IN")[2]
        for column in (*ASKED_FOR, *SETTINGS):
            if column in asked or column in SETTINGS:
                row[column] = by_record[meant[row["record"]]][column]
    with (folder / "records.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _key(row: dict[str, str], meant: dict[str, str]) -> tuple[str, ...]:
    """Of a row of identified.csv: what, how, and by which records, as they are named."""
    records = sorted(meant.get(id, id) for id in row["records"].split(";"))
    return row["parameter"], row["method"], *records


def compare(named: Path, folder: Path, out: Path, capsys, *, seed: int) -> None:
    """Analyse a campaign with its names and again from its shuffled files alone."""
    meant = shuffled(named / "raw", folder / "raw", seed=seed)
    assert main(["init", str(folder)]) == 0
    truth = rows_of(named / "records.csv")
    assert {meant[row["record"]]: row["test"] for row in rows_of(folder / "records.csv")} == {
        row["record"]: row["test"] for row in truth
    }
    fill_in(folder, named, meant)
    capsys.readouterr()
    assert main(["check", str(folder)]) == 0, capsys.readouterr().out
    results = [
        analyse_campaign(load_campaign(one), paths=ResultPaths(out / str(k)))
        for k, one in enumerate((named, folder))
    ]
    expected, found = ({_key(row, meant): row for row in one.rows("identified")} for one in results)
    assert set(found) == set(expected)
    assert ("M", "combined") in {key[:2] for key in expected}
    for key, row in expected.items():
        value, error = row["value"], row["std_error"]
        same = pytest.approx(value, rel=1e-6, abs=3e-3 * (error or 0.0))
        assert found[key]["value"] == same, key
        same = None if error is None else pytest.approx(error, rel=1e-3)
        assert found[key]["std_error"] == same, key
    outcomes = [sorted((c["check"], c["outcome"]) for c in one.rows("checks")) for one in results]
    assert outcomes[0] == outcomes[1]
    tables = [
        [{k: v for k, v in c.items() if k != "records"} for c in one.rows("clearances")]
        for one in results
    ]
    assert len(tables[0]) == len(tables[1])
    for one, other in zip(*tables, strict=True):
        for key, value in one.items():
            number = isinstance(value, float)
            same = pytest.approx(value, rel=1e-4, nan_ok=True) if number else value
            assert other[key] == same, (one, key)


@pytest.mark.long
def test_a_small_campaign_comes_to_the_same_results(tmp_path, capsys):
    named = tmp_path / "named"
    tmp_path.joinpath("scene.yaml").write_text(SMALL)
    assert main(["simulate", str(tmp_path / "scene.yaml"), str(named)]) == 0
    stated = named / "campaign.yaml"
    text = stated.read_text()
    if "uncertainties" not in text:
        stated.write_text(text + "uncertainties: exact\n")
    compare(named, tmp_path / "unnamed", tmp_path / "results", capsys, seed=1)


@pytest.mark.slow
def test_the_twin_comes_to_the_same_results(tmp_path, capsys):
    named = tmp_path / "named"
    assert main(["simulate", str(TWIN / "scene.yaml"), str(named)]) == 0
    for name in ("campaign.yaml", "records.csv", "published.csv"):
        shutil.copy(TWIN / name, named)
    compare(named, tmp_path / "unnamed", tmp_path / "results", capsys, seed=1)
