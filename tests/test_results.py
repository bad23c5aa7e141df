"""A results folder opened as data."""

from pathlib import Path

import h5py
import numpy as np
import pytest

import vinesexp
from vinesexp.errors import RecordError, VinesexpError
from vinesexp.identification.estimate import Estimate, nothing, write_estimates
from vinesexp.records.stored.checks import Check, write_checks
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.records.stored.store import RecordWriter
from vinesexp.signals.condition import condition

IDENTIFIED = """parameter,value,std_error,ci95_low,ci95_high,unit,method,records
M,4.71,0.02,4.67,4.75,kg,added mass,decay
M,4.70,0.01,4.68,4.72,kg,combined,decay;b34
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "identified.csv").write_text(IDENTIFIED)
    (tmp_path / "regimes.csv").write_text(
        "record,regime,amplitude_mean_m\ndecay,,0.003\nb34,two symmetric,0.005\nlost,,\n"
    )
    write_checks(
        tmp_path / "checks.csv",
        [
            Check("b34", "ingest", "ok", "100 samples"),
            Check("lost", "ingest", "refused", "raw/lost.csv: no such file"),
        ],
    )
    (tmp_path / "impacts").mkdir()
    (tmp_path / "impacts/b34.csv").write_text("time_s,nes,side\n0.5,1,1\n0.6,1,-1\n")
    found = [Estimate("r", 0.6, 0.01, "1", "flights", ("b34",)), nothing("b34", "no beat")]
    write_estimates(ResultPaths(tmp_path).estimates("b34"), found)
    x = np.linspace(0.0, 1e-3, 100)
    for kind in ("records", "conditioned"):
        with RecordWriter(
            tmp_path / kind / "b34.nc",
            sample_rate=100.0,
            start=0.25,
            quantities={"displacement": "displacement"},
        ) as writer:
            writer.append({"displacement": x})
    return tmp_path


def test_a_record_is_its_channels_its_impacts_and_its_regime(folder: Path):
    record = vinesexp.open_results(folder).record("b34")
    channel = record["displacement"]
    assert channel.attrs["units"] == "m"
    assert float(channel.sel(time=0.25)) == 0.0
    assert float(channel[-1]) == pytest.approx(1e-3)
    assert list(record.impacts["time_s"]) == [0.5, 0.6]
    assert record.regime["regime"] == "two symmetric"
    assert list(record.checks["detail"]) == ["100 samples"]
    assert list(record.estimates["parameter"].fillna("")) == ["r", ""]
    assert list(record.estimates["note"]) == ["", "no beat"]


def test_the_combined_value_is_the_one_of_that_method(folder: Path):
    assert float(vinesexp.open_results(folder).combined("M")["value"]) == 4.70


@pytest.mark.parametrize(
    ("ask", "answer"),
    [
        (lambda results: results.record("b33"), "did you mean 'b34'"),
        (lambda results: results.record("lost"), "raw/lost.csv: no such file"),
        (lambda results: results.combined("r"), "no combined value of 'r'"),
        (lambda results: results.table("regime"), "did you mean 'regimes'"),
        (lambda results: results.record("b34")["base"], "it has: displacement"),
    ],
)
def test_what_is_not_there_is_said_with_what_is(folder: Path, ask, answer: str):
    with pytest.raises(RecordError, match=answer):
        ask(vinesexp.open_results(folder))


def test_a_folder_without_results_says_what_to_do(tmp_path: Path):
    with pytest.raises(RecordError, match="run snakemake"):
        vinesexp.open_results(tmp_path)


def test_a_record_without_its_estimates_says_which_step_makes_them(folder: Path):
    ResultPaths(folder).estimates("b34").unlink()
    with pytest.raises(RecordError, match="run the estimate step"):
        vinesexp.open_results(folder).record("b34")


def test_a_record_is_a_mapping_of_its_channels(folder: Path):
    record = vinesexp.open_results(folder).record("b34")
    assert "displacement" in record
    assert "base" not in record
    assert list(record) == list(record.keys()) == ["displacement"]
    assert len(record) == 1
    assert record.get("base") is None
    assert [name for name, channel in record.items() if channel.size == 100] == ["displacement"]
    table = record.to_dataframe()
    assert list(table.columns) == ["displacement", "displacement_filtered"]
    assert table.index.name == "time"
    assert len(table) == 100


def test_arrays_and_tables_of_a_record_hold_the_numbers_of_its_files(folder: Path):
    """Of a rate and a start whose times no binary number hits, after the step that filters."""
    paths, rng = ResultPaths(folder), np.random.default_rng(4)
    x = 1e-3 * np.sin(2.0 * np.pi * 8.0 * np.arange(20_011) / 3333.3) + 1e-6 * rng.normal(
        size=20_011
    )
    with RecordWriter(
        paths.record("b34"),
        sample_rate=3333.3,
        start=12.3456789,
        quantities={"displacement": "displacement", "acceleration": "acceleration"},
    ) as writer:
        writer.append({"displacement": x, "acceleration": 9.0 * rng.normal(size=x.size)})
    condition(paths.record("b34"), paths.conditioned("b34"), f0_hint=8.0)
    record = vinesexp.open_results(folder).record("b34")
    array, table = record.to_xarray(), record.to_dataframe()
    held = set()
    for path, ending in ((paths.record("b34"), ""), (paths.conditioned("b34"), "_filtered")):
        with h5py.File(path) as file:
            for role in ("displacement", "acceleration"):
                numbers = file[role][()]
                assert np.isfinite(numbers).all()
                np.testing.assert_array_equal(array[role + ending], numbers)
                np.testing.assert_array_equal(table[role + ending], numbers)
                held.add(numbers.tobytes())
            np.testing.assert_array_equal(array["time"], file["time"][()])
            np.testing.assert_array_equal(table.index, file["time"][()])
    assert len(held) == len(table.columns) == len(array.data_vars) == 4  # none stands twice
    np.testing.assert_allclose(table["displacement"], x, atol=1e-9)  # m


def test_results_records_rigs_and_motions_show_themselves(folder: Path):
    results = vinesexp.open_results(folder)
    assert "4.7" in results._repr_html_()
    assert "2 impacts" in results.record("b34")._repr_html_()
    rig = vinesexp.Rig(vinesexp.Oscillator(4.7, 3.02, 1.147e4), [vinesexp.NES(0.032, 0.034, 0.6)])
    motion = vinesexp.simulate(rig, None, vinesexp.Release(x0=0.01), duration=2.0)
    assert "b = 34 mm" in rig._repr_html_()
    assert "<polyline" in motion._repr_html_()


@pytest.mark.parametrize("table", ["regimes", "identified", "checks", "impacts/b34"])
@pytest.mark.parametrize("damage", [b"", b"\x00\xff\xfe", b"no,such\n1,2,3\n"])
def test_a_damaged_table_is_one_line(folder, table, damage):
    (folder / f"{table}.csv").write_bytes(damage)
    with pytest.raises(VinesexpError, match=r"\.csv"):
        vinesexp.open_results(folder).record("b34") if "/" in table else (
            vinesexp.open_results(folder).table(table)
        )


def test_a_damaged_record_is_one_line(folder):
    path = folder / "records/b34.nc"
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(RecordError, match=r"b34\.nc.*remove it and run again"):
        vinesexp.open_results(folder).record("b34")
