"""Records in several files, and records that differ in their channels."""

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.records.campaign.load import load_campaign, read_campaign
from vinesexp.records.instrument.ingest import ingest_or_refuse
from vinesexp.records.stored.store import open_record

RATE, N = 1000.0, 3000
T = np.arange(N) / RATE
RNG = np.random.default_rng(5)
X = 3.0 * np.sin(2 * np.pi * 8.0 * T) + 1e-3 * RNG.standard_normal(N)
A = -0.7 * np.sin(2 * np.pi * 8.0 * T) + 1e-3 * RNG.standard_normal(N)
YAML = """\
operator: Ada
channels:
  displacement: {column: CH1, quantity: displacement, sensitivity: 1 V/mm}
  acceleration: {column: CH2, quantity: acceleration, sensitivity: 1 V/g}
time: {column: t, unit: s}
setups:
  far: {channels: {displacement: {column: CH1, quantity: displacement, sensitivity: 0.1 V/mm}}}
"""


def write(path, name, values, rows=slice(None), shift=0.0):
    lines = [f"{t + shift:.6f},{v:.6f}" for t, v in zip(T[rows], values[rows], strict=True)]
    path.write_text("\n".join([f"t,{name}", *lines]) + "\n")


def run(folder, row="a,x.csv;a.csv,periodic,,Bob,21", header="record,file,test,setup,operator,x_t"):
    (folder / "campaign.yaml").write_text(YAML)
    (folder / "records.csv").write_text(f"{header}\n{row}\n")
    campaign = load_campaign(folder)
    return ingest_or_refuse(campaign, campaign.records[0], folder / "a.nc")


def test_files_are_laid_over_one_another_by_their_times(tmp_path):
    write(tmp_path / "x.csv", "CH1", X)
    write(tmp_path / "a.csv", "CH2", A, rows=slice(250, 2800))
    checks = run(tmp_path)
    assert [check.outcome for check in checks] == ["ok", "warning"]
    assert checks[1].detail == "samples left out where the files differ: x.csv 450"
    with open_record(tmp_path / "a.nc") as view:
        assert (view.n, view.start, view.sample_rate) == (2550, 0.25, RATE)
        np.testing.assert_allclose(view.read("displacement"), 1e-3 * X[250:2800], atol=1e-9)
        np.testing.assert_allclose(view.read("acceleration"), 9.80665 * A[250:2800], atol=1e-5)
        assert view.attributes["source"] == "x.csv;a.csv"
        assert view.attributes["people_operator"] == "Bob"
        assert view.attributes["people_x_t"] == "21" or view.attributes["people_x_t"] == 21


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda f: write(f / "a.csv", "CH1", A), "'CH1' is in several files"),
        (lambda f: write(f / "a.csv", "CH3", A), "no column 'CH2' in any of its 2 files"),
        (lambda f: write(f / "a.csv", "CH2", A, shift=100.0), "do not overlap in time"),
        (
            lambda f: write(f / "a.csv", "CH2", A, rows=np.arange(N) % 10 > 0),
            "different sample rat",
        ),
        (lambda f: (f / "a.csv").unlink(), "no such file"),
    ],
)
def test_files_that_do_not_go_together_are_reported(spoil, words, tmp_path):
    write(tmp_path / "x.csv", "CH1", X)
    write(tmp_path / "a.csv", "CH2", A)
    spoil(tmp_path)
    (check,) = run(tmp_path)
    assert check.outcome == "refused"
    assert words in check.detail


def rewrite(path, change):
    """Change the lines of a file; line k holds row k, from 1."""
    lines = path.read_text().splitlines()
    change(lines)
    path.write_text("\n".join(lines) + "\n")


def blank(lines, first, end):
    lines[first:end] = [line.split(",")[0] + "," for line in lines[first:end]]


@pytest.mark.parametrize(
    ("spoil", "check", "detail"),
    [
        (
            lambda f: write(f / "a.csv", "CH2", A, shift=3e-4),
            "files",
            "clocks of the files stand 0.3 samples apart",
        ),
        (
            lambda f: rewrite(f / "a.csv", lambda lines: lines.insert(9, lines[8])),
            "time",
            "1 row stands twice, times and all",
        ),
        (
            lambda f: rewrite(f / "x.csv", lambda lines: blank(lines, 1, 4)),
            "missing cells",
            "3 rows at the start left out, where cells are empty",
        ),
        (
            lambda f: rewrite(
                f / "a.csv", lambda lines: lines.__setitem__(7, lines[7].split(",")[0] + ",inf")
            ),
            "saturated",
            "acceleration is out of the instrument's range (an infinite sample or the instrument's "
            "mark of overload) at line 8, column CH2; measure with a wider range",
        ),
    ],
)
def test_what_is_odd_in_one_of_the_files_is_said_of_the_record(spoil, check, detail, tmp_path):
    write(tmp_path / "x.csv", "CH1", X)
    write(tmp_path / "a.csv", "CH2", A)
    spoil(tmp_path)
    assert (check, "warning", detail) in [(c.check, c.outcome, c.detail) for c in run(tmp_path)]


@pytest.mark.parametrize(("off", "outcomes"), [(5e-7, ["ok"]), (2e-6, ["refused"])])
def test_clocks_that_differ_by_the_digits_of_their_times_are_one(
    off, outcomes, tmp_path, monkeypatch
):
    write(tmp_path / "x.csv", "CH1", X)
    monkeypatch.setattr(f"{__name__}.T", T * (1.0 + off))
    write(tmp_path / "a.csv", "CH2", A)
    assert [check.outcome for check in run(tmp_path)] == outcomes


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda lines: blank(lines, 1001, 1003), "a.csv, line 1002, column CH2: empty or NaN"),
        (
            lambda lines: lines.__delitem__(slice(1001, 1101)),
            "cannot be joined with others, cut it",
        ),
    ],
)
def test_a_hole_in_one_of_the_files_refuses_the_record(spoil, words, tmp_path):
    """Laid over the other file without it, all that follows would be late, or made up."""
    write(tmp_path / "x.csv", "CH1", X)
    write(tmp_path / "a.csv", "CH2", A)
    rewrite(tmp_path / "a.csv", spoil)
    (check,) = run(tmp_path)
    assert check.outcome == "refused"
    assert words in check.detail


def test_empty_cells_of_one_channel_refuse_the_record(tmp_path, monkeypatch):
    """A record of one file has a gap there; over several the gap would be filled in silence."""
    base = "  base: {column: CH3, quantity: displacement, sensitivity: 1 V/mm}\n"
    monkeypatch.setattr(f"{__name__}.YAML", YAML.replace("channels:\n", f"channels:\n{base}", 1))
    write(tmp_path / "x.csv", "CH1", X)
    write(tmp_path / "a.csv", "CH2,CH3", A)
    cells = [line + ",0.1" for line in (tmp_path / "a.csv").read_text().splitlines()[1:]]
    cells[1000] = cells[1000].removesuffix("0.1")
    (tmp_path / "a.csv").write_text("\n".join(["t,CH2,CH3", *cells]) + "\n")
    (check,) = run(tmp_path)
    assert check.outcome == "refused"
    assert "a.csv, line 1002, column CH3: empty or NaN among the samples" in check.detail


def test_an_optional_channel_in_none_of_the_files_is_said(tmp_path, monkeypatch):
    optional = YAML.replace(", sensitivity: 1 V/g}", ", sensitivity: 1 V/g, optional: yes}")
    monkeypatch.setattr(f"{__name__}.YAML", optional)
    write(tmp_path / "x.csv", "CH1", X)
    write(tmp_path / "a.csv", "CH3", A)
    checks = run(tmp_path)
    assert [(c.check, c.detail) for c in checks[1:]] == [
        ("channels", "no column 'CH2' for acceleration")
    ]


def test_a_name_with_a_colon_may_be_that_of_a_column(tmp_path, monkeypatch):
    monkeypatch.setattr(f"{__name__}.YAML", YAML.replace("column: CH1,", 'column: "Dev1:CH1",', 1))
    write(tmp_path / "x.csv", "Dev1:CH1", X)
    write(tmp_path / "a.csv", "CH2", A)
    assert [check.outcome for check in run(tmp_path)] == ["ok"]


def test_a_column_of_one_name_in_both_files_is_named_by_its_file(tmp_path):
    write(tmp_path / "x.csv", "V", X)
    write(tmp_path / "a.csv", "V", A)
    (tmp_path / "records.csv").write_text("record,file,test\na,x.csv;a.csv,periodic\n")
    yaml = YAML.replace("column: CH1", 'column: "x*:V"').replace("column: CH2", 'column: "a:1"')
    (tmp_path / "campaign.yaml").write_text(yaml)
    campaign = load_campaign(tmp_path)
    checks = ingest_or_refuse(campaign, campaign.records[0], tmp_path / "a.nc")
    assert [check.outcome for check in checks] == ["ok"]
    with open_record(tmp_path / "a.nc") as view:
        np.testing.assert_allclose(view.read("acceleration"), 9.80665 * A, atol=1e-5)


@pytest.mark.parametrize("slower", ["CH1", "CH2"])
def test_the_clock_of_two_rates_is_that_of_the_acceleration(slower, tmp_path):
    """A slower displacement is held around its samples; a faster one is averaged."""
    every, whole = slice(None, None, 10), slice(None, N - 3)  # the last few are in one file alone
    rows = {one: every if one == slower else whole for one in ("CH1", "CH2")}
    write(tmp_path / "x.csv", "CH1", X, rows=rows["CH1"])
    write(tmp_path / "a.csv", "CH2", A, rows=rows["CH2"])
    assert [check.outcome for check in run(tmp_path)] == ["ok"]
    with open_record(tmp_path / "a.nc") as view:
        x, a, rate = view.read("displacement"), view.read("acceleration"), view.sample_rate
    assert rate == pytest.approx(RATE if slower == "CH1" else RATE / 10)
    assert 9.80665 * A[rows["CH2"]][: a.size] == pytest.approx(a, abs=1e-5)
    if slower == "CH1":
        assert 1e-3 * X[::10] == pytest.approx(x[::10], abs=1e-9)
        assert (np.diff(x) != 0.0).sum() == N // 10 - 1
    else:
        assert 1e-3 * X[6:-4].reshape(-1, 10).mean(axis=1) == pytest.approx(x[1:], abs=1e-9)


def test_a_setup_changes_the_channels_that_it_names(tmp_path):
    write(tmp_path / "x.csv", "CH1", X)
    write(tmp_path / "a.csv", "CH2", A)
    run(tmp_path, row="a,x.csv;a.csv,periodic,far,,")
    with open_record(tmp_path / "a.nc") as view:
        np.testing.assert_allclose(view.read("displacement"), 1e-2 * X, atol=1e-8)
        np.testing.assert_allclose(view.read("acceleration"), 9.80665 * A, atol=1e-5)
        assert view.attributes["setup"] == "far"


def test_unknown_setups_and_misspelled_columns_are_reported(tmp_path, capsys):
    with pytest.raises(Exception, match="unknown setup 'fra'; did you mean 'far'"):
        run(tmp_path, row="a,x.csv,periodic,fra,,")
    (tmp_path / "records.csv").write_text("record,file,test,clearence_mm\na,x.csv,periodic,3\n")
    campaign, (problem,) = read_campaign(tmp_path)
    assert campaign.records == ()
    assert "unknown column 'clearence_mm'; did you mean 'clearance_mm'" in str(problem)


def test_a_fault_that_nobody_foresaw_is_one_refused_row(tmp_path, monkeypatch, capsys):
    write(tmp_path / "x.csv", "CH1", X)
    write(tmp_path / "a.csv", "CH2", A)
    run(tmp_path)

    def broken(*_, **__):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("vinesexp.records.instrument.ingest.look_over", broken)
    assert main(["check", str(tmp_path)]) == 1
    printed = capsys.readouterr()
    assert "a: refused:" in printed.out
    assert "cannot be read (ZeroDivisionError: division by zero)" in printed.out
