"""Several results folders of one rig: does each value repeat?"""

import csv

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.records.stored.result_columns import CLEARANCES, IDENTIFIED, RECORD_REGIMES
from vinesexp.records.stored.store import RecordWriter
from vinesexp.records.stored.tables import write_rows
from vinesexp.results_differences import Repeated, repeatability_of


def write_results(folder, *, M, error=0.02, b=34.0, source):
    row = {"parameter": "M", "value": M, "std_error": error, "unit": "kg", "method": "combined"}
    write_rows(folder / "identified.csv", IDENTIFIED, [row])
    row = {"test": "periodic", "level": "G = 0.25 mm", "measured_mm": b}
    row |= {"measured_low_mm": b - 0.5, "measured_high_mm": b + 0.5}
    row |= {"exact_mm": 33.9, "predicted_low_mm": 33.8, "predicted_high_mm": 34.0}
    write_rows(folder / "clearances.csv", CLEARANCES, [row])
    regimes = {"record": "b34", "regime": "two symmetric"}
    write_rows(folder / "regimes.csv", RECORD_REGIMES, [regimes])
    (folder / "records").mkdir(exist_ok=True)
    with RecordWriter(
        folder / "records/b34.nc", sample_rate=10.0, quantities={"base": "displacement"},
        attributes={"source_sha256": source},
    ) as writer:  # fmt: skip
        writer.append({"base": np.zeros(3)})
    return folder


@pytest.fixture
def year(tmp_path):
    """Four campaigns; M of the third is 6 errors off."""
    masses = {"spring": 4.70, "summer": 4.71, "autumn": 4.82, "winter": 4.69}
    return [
        write_results(tmp_path / name, M=M, b=34.0 + 0.1 * k, source=name)
        for k, (name, M) in enumerate(masses.items())
    ]


def test_what_scatters_and_what_repeats(year):
    found = repeatability_of(year)
    assert found.names == ("spring", "summer", "autumn", "winter")
    by_name = {one.what: one for one in found.series}
    M = by_name["M"]
    assert M.verdict == "scatters"
    assert M.scatter == pytest.approx(np.std([4.70, 4.71, 4.82, 4.69], ddof=1))
    assert M.mean_error == pytest.approx(0.01 * M.ratio)  # 0.02/sqrt(4), wider by the ratio
    measured = by_name["measured clearance, periodic, G = 0.25 mm"]
    assert measured.verdict == "repeats"
    assert measured.errors == pytest.approx(1.0 / np.sqrt(12.0))
    assert by_name["predicted clearance, periodic, G = 0.25 mm"].ratio == 0.0
    assert found.shared == ()


def test_a_mean_of_many_does_not_reduce_errors_that_all_share():
    """A sensitivity that is off by 1 % is off in the hundredth campaign too."""
    many = Repeated("M", "kg", ("x",) * 100, np.full(100, 4.7), np.full(100, 0.05))
    assert many.mean_error == pytest.approx(0.05)
    better = Repeated("M", "kg", ("a", "b"), np.full(2, 4.7), np.array([0.05, 0.005]))
    assert 0.005 < better.mean_error < 0.006


def test_each_prediction_counts_once(tmp_path):
    """One b_c a base amplitude and one b_t a release, however many rows hold them."""
    folder = write_results(tmp_path / "a", M=4.7, source="a")
    predicted = {"exact_mm": 33.9, "predicted_low_mm": 33.8, "predicted_high_mm": 34.0}
    rows = [
        {"test": "periodic", "level": "G = 0.25 mm", "stated_base_mm": 0.25},
        {"test": "periodic", "level": "G = 0.25 mm, end", "stated_base_mm": 0.25},
        {"test": "periodic", "level": "G = 0.2 mm", "stated_base_mm": 0.2},
        *({"test": "transient", "level": f"20 mm to {x} mm", "release_mm": 20.0} for x in (2, 5)),
    ]
    write_rows(folder / "clearances.csv", CLEARANCES, [row | predicted for row in rows])
    names = [one.what for one in repeatability_of([folder]).series]
    assert names == [
        "M",
        "predicted clearance, periodic, G = 0.25 mm",
        "predicted clearance, periodic, G = 0.2 mm",
        "predicted clearance, transient, from 20 mm",
    ]


def test_the_false_alarm_is_one_in_twenty():
    rng = np.random.default_rng(3)
    errors = np.array([0.01, 0.02, 0.05, 0.02])
    verdicts = [
        Repeated("M", "kg", tuple("abcd"), 4.7 + errors * rng.standard_normal(4), errors).verdict
        for _ in range(1000)
    ]
    assert 25 < verdicts.count("scatters") < 80


def test_folders_with_the_same_files_are_named(year, tmp_path):
    again = write_results(tmp_path / "again", M=4.70, source="spring")
    assert repeatability_of([*year, again]).shared == (("spring", "again"),)


@pytest.mark.long
def test_the_command_prints_a_line_a_value_and_writes_page_and_table(year, tmp_path, capsys):
    page, table = tmp_path / "page.html", tmp_path / "table.csv"
    assert main(["compare", *map(str, year), "--html", str(page), "--csv", str(table)]) == 0
    printed = capsys.readouterr().out
    assert "Of 3 values, 1 scatters by more than the errors explain: M." in printed
    assert page.read_text().count("<svg") == 3
    with table.open(newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["what"] == "M"]
    assert [row["folder"] for row in rows] == ["spring", "summer", "autumn", "winter"]
    assert {row["verdict"] for row in rows} == {"scatters"}
    assert main(["compare", str(year[0]), str(year[1]), str(tmp_path / "none")]) == 1
    assert "none" in capsys.readouterr().err
