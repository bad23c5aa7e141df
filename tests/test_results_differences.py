"""Two results folders: what differs, against its error."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.records.stored.checks import Check, write_checks
from vinesexp.records.stored.result_columns import CLEARANCES, IDENTIFIED, RECORD_REGIMES
from vinesexp.records.stored.store import RecordWriter
from vinesexp.records.stored.tables import write_rows
from vinesexp.results_differences import compare_results


def write_results(
    folder: Path, *, M: float = 4.7, error: float = 0.02, b: float = 34.0, source: str = "s",
    regime: str = "two symmetric",
) -> Path:  # fmt: skip
    write_rows(
        folder / "identified.csv",
        IDENTIFIED,
        [
            {"parameter": "M", "value": M, "std_error": error, "unit": "kg", "method": method}
            for method in ("added mass", "combined")
        ],
    )
    row = {"test": "periodic", "level": "G = 0.25 mm", "measured_mm": b}
    row |= {"measured_low_mm": b - 0.5, "measured_high_mm": b + 0.5}
    row |= {"exact_mm": 33.9, "predicted_low_mm": 33.8, "predicted_high_mm": 34.0}
    write_rows(folder / "clearances.csv", CLEARANCES, [row])
    regimes = {"record": "b34", "regime": regime, "amplitude_mean_m": 3e-3}
    write_rows(folder / "regimes.csv", RECORD_REGIMES, [regimes])
    write_checks(folder / "checks.csv", [Check("b34", "ingest", "ok", "fine")])
    with RecordWriter(
        folder / "records/b34.nc", sample_rate=10.0, quantities={"base": "displacement"},
        attributes={"source_sha256": source},
    ) as writer:  # fmt: skip
        writer.append({"base": np.zeros(3)})
    return folder


def verdicts(a: Path, b: Path) -> dict[str, str]:
    return {row.what: row.verdict for row in compare_results(a, b).rows}


LEVEL = "periodic, G = 0.25 mm"


def test_other_records_differ_where_the_difference_is_beyond_both_errors(tmp_path):
    a = write_results(tmp_path / "a")
    near = write_results(tmp_path / "near", M=4.75, b=34.6, source="t")
    far = write_results(tmp_path / "far", M=4.80, b=36.0, source="t")
    assert verdicts(a, near)["M"] == "within error"
    assert verdicts(a, near)[f"measured, {LEVEL}"] == "within error"
    found = compare_results(a, far)
    assert not found.same_data
    rows = {row.what: row for row in found.rows}
    assert rows["M"].verdict == "differs"
    assert rows["M"].errors_apart == pytest.approx(0.1 / (0.02 * np.sqrt(2)))
    assert rows[f"measured, {LEVEL}"].verdict == "differs"
    assert rows[f"predicted, {LEVEL}"].verdict == "same"


def test_the_same_records_have_the_same_error_and_a_smaller_difference_counts(tmp_path):
    a = write_results(tmp_path / "a")
    for M, verdict in ((4.7, "same"), (4.71, "within error"), (4.73, "differs")):
        b = write_results(tmp_path / f"b{M}", M=M)
        assert compare_results(a, b).same_data
        assert verdicts(a, b)["M"] == verdict


def test_only_records_of_the_tables_count_as_sources(tmp_path):
    """What a person left in the folder of the records is no record of the campaign."""
    a, b = (write_results(tmp_path / name) for name in "ab")
    (b / "records/mine.nc").write_text("notes of a person", encoding="utf-8")
    found = compare_results(a, b)
    assert found.same_data
    assert (found.shared, found.of_b) == (1, 1)


def test_numbers_that_are_alike_are_the_same_and_a_bound_is_a_change(tmp_path):
    a = write_results(tmp_path / "a")
    b = write_results(tmp_path / "b", source="t")
    assert {row.verdict for row in compare_results(a, b).rows} == {"same"}
    text = (b / "clearances.csv").read_text(encoding="utf-8").replace(",34.5,", ",,")
    (b / "clearances.csv").write_text(text, encoding="utf-8")
    row = {row.what: row for row in compare_results(a, b).rows}[f"measured, {LEVEL}"]
    assert row.verdict == "changed"
    assert "bound" in row.note


def test_levels_are_matched_by_the_base_that_was_found(tmp_path):
    """0.3669 mm typed once, 0.30 mm once, of the same tests: b_c of both was compared nowhere."""

    def results(name: str, *levels: tuple[float, float, float]) -> Path:
        folder = write_results(tmp_path / name, source=name)
        rows = [
            {"test": "periodic", "level": f"G = {stated:g} mm{end}", "kind": kind,
             "stated_base_mm": stated, "base_amplitude_mm": G, "exact_mm": b_c,
             "predicted_low_mm": b_c - 0.1, "predicted_high_mm": b_c + 0.1}
            for stated, G, b_c in levels
            for kind, end in (("lowest amplitude", ""), ("end", ", end"))
        ]  # fmt: skip
        write_rows(folder / "clearances.csv", CLEARANCES, rows)
        return folder

    a = results("a", (0.25, 0.2501, 20.0), (0.3669, 0.36658, 24.8), (0.5, 0.5, 40.0))
    b = results("b", (0.25, 0.2499, 20.0), (0.30, 0.36660, 25.8))
    found = {r.what: r for r in compare_results(a, b).rows if r.kind == "clearance"}
    level = found["predicted, periodic, G = 0.3669 mm"]
    assert (level.verdict, level.difference) == ("differs", pytest.approx(1.0))
    assert level.note == "in B it is called G = 0.3 mm"
    assert found["predicted, periodic, G = 0.3669 mm, end"].difference == pytest.approx(1.0)
    assert found["predicted, periodic, G = 0.25 mm"].verdict == "same"
    assert found["predicted, periodic, G = 0.25 mm"].note == ""
    assert (found["predicted, periodic, G = 0.5 mm"].verdict) == "only in A"
    assert all(row.a or row.b for row in found.values()), "what neither has is no difference"
    assert not any("0.3 mm" in what for what in found)
    again = {r.what for r in compare_results(b, a).rows if r.verdict == "only in B"}
    assert again == {"predicted, periodic, G = 0.5 mm", "predicted, periodic, G = 0.5 mm, end"}


def test_a_value_without_an_error_is_shown_without_one(tmp_path):
    a = write_results(tmp_path / "a")
    b = write_results(tmp_path / "b", M=4.71)
    text = (b / "identified.csv").read_text(encoding="utf-8").replace("0.02", "")
    (b / "identified.csv").write_text(text, encoding="utf-8")
    row = {row.what: row for row in compare_results(a, b).rows}["M"]
    assert (row.verdict, row.a, row.b) == ("changed", "4.700 +- 0.039", "4.71")


def test_regimes_checks_and_what_only_one_has(tmp_path):
    a = write_results(tmp_path / "a")
    b = write_results(tmp_path / "b", regime="chaotic", error=0.1)
    write_checks(b / "checks.csv", [Check("b34", "clipped", "warning", "3 samples")])
    rows = {row.what: row for row in compare_results(a, b).rows}
    assert rows["b34"].verdict == "changed"
    assert (rows["b34: clipped"].verdict, rows["b34: clipped"].note) == ("only in B", "3 samples")
    assert "5 times" in rows["M"].note


def test_a_record_without_a_regime_that_only_one_has_is_no_dash(tmp_path):
    a, b = write_results(tmp_path / "a", regime=""), write_results(tmp_path / "b")
    write_rows(b / "regimes.csv", RECORD_REGIMES, [])
    row = {row.what: row for row in compare_results(a, b).rows}["b34"]
    assert (row.verdict, row.a, row.b) == ("only in A", "no regime", "")


def test_the_command_prints_and_writes_page_and_table(tmp_path, capsys):
    a = write_results(tmp_path / "a <1>")
    b = write_results(tmp_path / "b", M=4.8)
    page, table = tmp_path / "out/page.html", tmp_path / "out/table.csv"
    assert main(["compare", str(a), str(b), "--html", str(page), "--csv", str(table)]) == 0
    printed = capsys.readouterr().out
    assert "What differs: M (5.0 errors apart)." in printed
    assert "same instrument files (1)" in printed
    text = page.read_text(encoding="utf-8")
    assert "a &lt;1&gt;" in text
    assert "5.0 errors apart" in text
    with table.open(encoding="utf-8", newline="") as stream:
        rows = {row["what"]: row for row in csv.DictReader(stream)}
    assert rows["M"]["verdict"] == "differs"
    assert float(rows["M"]["difference"]) == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("break_it", "message"),
    [
        (lambda b: shutil.rmtree(b), "holds no results"),
        (lambda b: (b / "clearances.csv").unlink(), "is missing; run the compare step"),
    ],
)
def test_a_folder_without_results_is_one_line(tmp_path, capsys, break_it, message):
    a, b = write_results(tmp_path / "a"), write_results(tmp_path / "b")
    break_it(b)
    assert main(["compare", str(a), str(b)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line


def test_a_place_that_cannot_be_written_is_one_line(tmp_path, capsys):
    a = write_results(tmp_path / "a")
    assert main(["compare", str(a), str(a), "--html", str(a / "identified.csv/x.html")]) == 1
    assert "cannot be written" in capsys.readouterr().err
