"""Every kind of bad input gets one line: where, what, and what to do; nothing half-written.

The command `vinesexp check` is run as a user would, on a good campaign with one thing spoiled.
"""

import re
from pathlib import Path

import numpy as np
import pytest

from vinesexp.cli import main
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.instrument.ingest import ingest_or_refuse
from vinesexp.records.stored.store import open_record

YAML = """\
title: Bench
known:
  mass: 4.7 +- 0.05 kg
  nes_mass: 32 g
channels:
  base: {column: CH1, quantity: displacement, sensitivity: 0.5 V/mm, offset: 2.5 V}
  displacement: {column: "Laser*", quantity: displacement, unit: mm}
time: {column: "Time*", unit: s}
bandpass: {low: 2 Hz, high: 40 Hz}
"""
CSV = """\
record,file,test,clearance_mm,base_amplitude_mm,frequency_hz,added_mass_g,release_mm,exclude,note
good,raw/good.csv,periodic,34,0.25,7.9,,,,
bad,raw/bad.csv,periodic,34,0.25,7.9,,,,
"""
RATE, N = 1000.0, 1000


def signals():
    """Time, base voltage and displacement of one second at 7.9 Hz, with noise and quanta."""
    rng = np.random.default_rng(7)
    t = np.arange(N) / RATE
    base = 2.5 + 0.125 * np.sin(2 * np.pi * 7.9 * t) + 1e-4 * rng.standard_normal(N)
    laser = 5.0 * np.sin(2 * np.pi * 7.9 * t - 1.0) + 2e-3 * rng.standard_normal(N)
    return t, base, laser


def text(t, base, laser, header="Time (s),CH1,Laser (mm)"):
    rows = (f"{a:.4f},{b:.5f},{c:.4f}" for a, b, c in zip(t, base, laser, strict=True))
    return "\n".join([header, *rows]) + "\n"


@pytest.fixture
def folder(tmp_path):
    """A good campaign of two records."""
    path = tmp_path / "bench"
    (path / "raw").mkdir(parents=True)
    (path / "campaign.yaml").write_text(YAML)
    (path / "records.csv").write_text(CSV)
    for name in ("good", "bad"):
        (path / f"raw/{name}.csv").write_text(text(*signals()))
    return path


def check(folder, capsys):
    """Exit code and printed lines of `vinesexp check`."""
    code = main(["check", str(folder)])
    printed = capsys.readouterr()
    assert printed.err == ""
    lines = printed.out.splitlines()
    return code, [line for line in lines if ": ok: " not in line and not line.startswith("next:")]


@pytest.mark.long
def test_the_good_campaign_passes(folder, capsys):
    code, lines = check(folder, capsys)
    assert code == 0
    assert lines == ["2 records: 2 good, 0 refused, 0 excluded; 0 warnings"]


# What is wrong in campaign.yaml or records.csv: (file, old, new, words of the message).
CAMPAIGN_MISTAKES = {
    "misspelled key": (
        "campaign.yaml",
        "known:",
        "knwon:",
        ["campaign.yaml, line 2, key knwon", "did you mean 'known'?"],
    ),
    "unknown key inside": (
        "campaign.yaml",
        "column: CH1",
        "colum: CH1",
        ["line 6, key channels.base.colum", "did you mean 'column'?"],
    ),
    "unknown role": (
        "campaign.yaml",
        "  displacement:",
        "  displacment:",
        ["line 7, key channels.displacment", "did you mean 'displacement'?"],
    ),
    "key twice": (
        "campaign.yaml",
        "bandpass:",
        "title: Again\nbandpass:",
        ["line 9, key title", "first in line 1"],
    ),
    "missing unit of a channel": (
        "campaign.yaml",
        ", unit: mm",
        "",
        ["line 7, key channels.displacement", "no unit", "'sensitivity'"],
    ),
    "unit and sensitivity": (
        "campaign.yaml",
        "unit: mm",
        "unit: mm, sensitivity: 1 V/mm",
        ["key channels.displacement", "exactly one"],
    ),
    "missing unit of a mass": (
        "campaign.yaml",
        "32 g",
        "0.032",
        ["line 4, key known.nes_mass", "the unit is missing", "kg"],
    ),
    "volts where millimetres are meant": (
        "campaign.yaml",
        "unit: mm",
        "unit: V",
        ["key channels.displacement.unit", "'V' is a unit of voltage", "displacement"],
    ),
    "sensitivity without an output": (
        "campaign.yaml",
        "0.5 V/mm",
        "2 mm/s",
        ["key channels.base.sensitivity", "'mm' is a unit of displacement", "voltage"],
    ),
    "wrong quantity": (
        "campaign.yaml",
        "quantity: displacement, unit",
        "quantity: acceleration, unit",
        ["key channels.displacement.quantity", "quantity: displacement"],
    ),
    "negative mass": (
        "campaign.yaml",
        "4.7 +- 0.05 kg",
        "-4.7 kg",
        ["line 3, key known.mass", "found '-4.7 kg'", "above zero"],
    ),
    "band upside down": (
        "campaign.yaml",
        "low: 2 Hz",
        "low: 200 Hz",
        ["key bandpass", "not below"],
    ),
    "time twice": (
        "campaign.yaml",
        "bandpass:",
        "sample_rate: 1 kHz\nbandpass:",
        ["key sample_rate", "both 'time' and 'sample_rate'"],
    ),
    "no YAML": (
        "campaign.yaml",
        "title: Bench",
        "title: [Bench",
        ["campaign.yaml, line", "expected"],
    ),
    "empty campaign.yaml": ("campaign.yaml", YAML, "", ["campaign.yaml: is empty"]),
    "duplicate record": (
        "records.csv",
        "\nbad,",
        "\nGood,",
        ["records.csv, line 3, column record", "already in line 2"],
    ),
    "unsafe record name": (
        "records.csv",
        "\nbad,",
        "\n../bad,",
        ["line 3, column record", "found '../bad'"],
    ),
    "unknown column": (
        "records.csv",
        "clearance_mm",
        "clearence_mm",
        ["records.csv, line 1", "did you mean 'clearance_mm'?"],
    ),
    "missing column": ("records.csv", ",test,", ",note2,", ["line 1", "no column 'test'"]),
    "unknown test": (
        "records.csv",
        "bad.csv,periodic",
        "bad.csv,periodc",
        ["line 3, column test", "did you mean 'periodic'?"],
    ),
    "negative clearance": (
        "records.csv",
        "bad.csv,periodic,34",
        "bad.csv,periodic,-34",
        ["line 3, column clearance_mm", "found '-34'", "above zero"],
    ),
    "clearance with a unit": (
        "records.csv",
        "bad.csv,periodic,34",
        "bad.csv,periodic,34 mm",
        ["line 3, column clearance_mm", "found '34 mm'", "without a unit"],
    ),
    "decimal comma between commas": (
        "records.csv",
        "bad.csv,periodic,34",
        'bad.csv,periodic,"34,5"',
        ["line 3, column clearance_mm", "decimal point"],
    ),
    "negative frequency": (
        "records.csv",
        "bad.csv,periodic,34,0.25,7.9",
        "bad.csv,periodic,34,0.25,-7.9",
        ["line 3, column frequency_hz", "above zero"],
    ),
    "a cell too many": (
        "records.csv",
        "bad.csv,periodic,34,0.25,7.9,,,,",
        "bad.csv,periodic,34,0.25,7.9,,,,a note, with a comma",
        ["line 3", "quotes"],
    ),
    "path that leaves the folder": (
        "records.csv",
        "raw/bad.csv",
        "../bad.csv",
        ["line 3, column file", "leaves the campaign folder", "allow_outside: yes"],
    ),
    "absolute path": (
        "records.csv",
        "raw/bad.csv",
        "/etc/hostname",
        ["line 3, column file", "leaves the campaign folder"],
    ),
    "amplitude that no rig has": (
        "records.csv",
        "0.25,7.9,,,,\nbad",
        "1e303,7.9,,,,\nbad",
        ["line 2, column base_amplitude_mm", "found '1e303'", "to 1000 m"],
    ),
    "clearance that no rig has": (
        "records.csv",
        "34,0.25,7.9,,,,\nbad",
        "1e-320,0.25,7.9,,,,\nbad",
        ["line 2, column clearance_mm", "found '1e-320'", "1e-09"],
    ),
    "frequency that no rig has": (
        "records.csv",
        "7.9,,,,\nbad",
        "1e300,,,,\nbad",
        ["line 2, column frequency_hz", "found '1e300'", "Hz"],
    ),
    "mass that no rig has": (
        "campaign.yaml",
        "4.7 +- 0.05 kg",
        "1e300 kg",
        ["line 3, key known.mass", "found '1e300 kg'", "kg"],
    ),
    "no records": ("records.csv", CSV, CSV.splitlines()[0], ["records.csv", "no records"]),
    "empty table": ("records.csv", CSV, "", ["records.csv: is empty"]),
}


@pytest.mark.parametrize("mistake", CAMPAIGN_MISTAKES)
def test_a_mistake_in_the_campaign_is_one_line(mistake, folder, capsys):
    name, old, new, words = CAMPAIGN_MISTAKES[mistake]
    before = (folder / name).read_text()
    assert old in before
    (folder / name).write_text(before.replace(old, new, 1))
    code, lines = check(folder, capsys)
    assert code == 1
    reported = [line for line in lines[:-1] if all(word in line for word in words)]
    assert len(reported) == 1, lines
    assert lines[-1].endswith("the records were not read")


@pytest.mark.parametrize("name", ["campaign.yaml", "records.csv"])
def test_a_missing_file_of_the_campaign_is_reported(name, folder, capsys):
    (folder / name).unlink()
    code, lines = check(folder, capsys)
    assert code == 1
    assert any(f"{name}: is missing" in line for line in lines)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: &a [x, x]\nb: &b [*a, *a]\n", "an alias"),
        ("a: " + "[" * 3000 + "]" * 3000, "larger than any description"),
        ("a: " + "9" * 5000 + "\nchannels: {}\n", "unknown key 'a'"),
        ("a: &a\n  b: *a\n", "an alias"),
        ("#" * 2_000_000, "larger than any description"),
    ],
)
def test_a_description_that_swells_is_reported(text, words, folder, capsys):
    (folder / "campaign.yaml").write_text(text)
    code, lines = check(folder, capsys)
    assert code == 1
    assert any(words in line for line in lines)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (",,,\n,,,\n", "holds no text"),
        (f'record,file,test\n"{"x" * 200_000}",a,b\n', "cannot be read as a table"),
        ("record,file,test\na\0b,raw/good.csv,periodic\n", "records.csv"),
    ],
)
def test_a_table_of_any_bytes_is_reported(text, words, folder, capsys):
    (folder / "records.csv").write_text(text)
    code, lines = check(folder, capsys)
    assert code == 1
    assert any(words in line for line in lines)


def test_a_frequency_above_half_the_sample_rate_is_reported(folder, capsys):
    table = folder / "records.csv"
    table.write_text(CSV.replace("bad.csv,periodic,34,0.25,7.9", "bad.csv,periodic,34,0.25,790"))
    code, lines = check(folder, capsys)
    assert code == 1
    assert "frequency_hz is 790 Hz, the record is sampled at 1000 Hz" in lines[0]


def test_a_missing_folder_is_reported(tmp_path, capsys):
    code, lines = check(tmp_path / "nowhere", capsys)
    assert code == 1
    assert "nowhere: no such folder" in lines[0]


def test_a_folder_without_a_description_is_led_to_init(tmp_path, capsys):
    code, lines = check(tmp_path, capsys)
    assert code == 1
    assert f"type: vinesexp init {tmp_path}" in lines[0]


def test_all_mistakes_are_listed_at_once(folder, capsys):
    (folder / "campaign.yaml").write_text(YAML.replace("4.7 +-", "-4.7 +-").replace("mm}", "V}"))
    (folder / "records.csv").write_text(CSV.replace(",34,", ",-34,"))
    code, lines = check(folder, capsys)
    assert code == 1
    assert len(lines) == 5  # two and two, and the summary
    assert lines[-1].startswith("4 problems")


# What is wrong in an instrument file: (its bytes, words of the message).
def _spoiled(change):
    t, base, laser = signals()
    return change(t, base, laser)


def _cell(row, column, value):
    lines = text(*signals()).splitlines()
    cells = lines[row].split(",")
    cells[column] = value
    lines[row] = ",".join(cells)
    return "\n".join(lines) + "\n"


def _frozen(t, base, laser):
    laser[100:] = laser[100]
    return text(t, base, laser)


def _clipped(t, base, laser):
    return text(t, base, np.clip(laser, -4.5, 4.5))


def _wrapped(t, base, laser):
    return text(t, base, (laser + 2.0) % 4.0 - 2.0)


def _gap(t, base, laser):
    keep = np.abs(np.arange(N) - 0.5 * N) > 0.3 * N  # most of the record is missing
    return text(t[keep], base[keep], laser[keep])


def _backward(t, base, laser):
    t[500] = 0.4
    return text(t, base, laser)


def _short(t, base, laser):
    return text(t[:200], base[:200], laser[:200])


RECORD_MISTAKES = {
    "missing file": (None, ["no such file"]),
    "empty file": ("", ["is empty"]),
    "blank file": (" \n\n", ["is empty"]),
    "unknown format": (b"\x00\x01\x02\x03" * 100, ["unknown format", "HDF5"]),
    "foreign format": (b"CDF\x01" + bytes(100), ["netCDF-3", "HDF5"]),
    "broken archive called csv": (
        b"PK\x03\x04" + bytes(100),
        ["packed files", "content is damaged"],
    ),
    "no numbers": ("hello\nworld\n", ["no row of numbers"]),
    "channel not found": (
        text(*signals(), header="Time (s),CH2 (V),Laser (mm)"),
        ["channel base", "no column 'CH1'", "0: 'Time (s)', 1: 'CH2 (V)', 2: 'Laser (mm)'"],
    ),
    "several fit": (
        text(*signals(), header="Laser 2 (mm),CH1,Laser (mm)"),
        ["'Laser*' fits several", "'Laser 2 (mm)'", "'Laser (mm)'"],
    ),
    "unit in the header": (
        text(*signals(), header="Time (s),CH1,Laser (V)"),
        ["column 'Laser (V)'", "voltage", "'mm'", "sensitivity"],
    ),
    "other unit in the header": (
        text(*signals(), header="Time (s),CH1,Laser (m)"),
        ["column 'Laser (m)'", "'m'", "'mm'"],
    ),
    "time in volts": (
        text(*signals(), header="Time (V),CH1,Laser (mm)"),
        ["column 'Time (V)'", "'V'", "time in 's'"],
    ),
    "word among numbers": (_cell(501, 1, "LOST"), ["line 502, column CH1", "found 'LOST'"]),
    "word in the first row": (_cell(1, 1, "LOST"), ["line 2, column CH1", "found 'LOST'"]),
    "word of overload": (
        _cell(501, 1, "OVER"),
        ["line 502, column CH1", "out of the instrument's range"],
    ),
    "mark of overload": (
        _cell(501, 2, "9.9E+37"),
        ["line 502, column Laser (mm)", "mark of overload"],
    ),
    "largest float": (
        _cell(501, 2, "3.402823e38"),
        ["line 502, column Laser (mm)", "mark of overload"],
    ),
    "no measurement": (
        _cell(501, 2, "1e36"),
        ["line 502, column Laser (mm)", "1e+33 m, which no instrument measures"],
    ),
    "surplus cell": (
        _cell(501, 2, "1,5"),
        ["line 502", "4 cells under 3 names", "decimal commas"],
    ),
    "surplus cell in the first row": (_cell(1, 2, "1,5"), ["line 2", "4 cells", "rows have 3"]),
    "open quote": (_cell(501, 1, '"2.5'), ["line 502", "quote that is not closed"]),
    "zero bytes": (_cell(N, 2, "1\n\0\0\0"), ["line 1002", "zero bytes"]),
    "word in the last row": (_cell(N, 2, "?"), ["line 1001, column Laser (mm)", "found '?'"]),
    "infinite": (_cell(501, 2, "inf"), ["line 502, column Laser (mm)", "infinite"]),
    "gap in time": (_spoiled(_gap), ["line", "time steps by", "expected 0.001"]),
    "time goes backward": (_spoiled(_backward), ["line 502", "backward", "0.499 to 0.4"]),
    "time stands still": (
        text(np.round(signals()[0], 1), *signals()[1:]),
        ["line 3", "time does not advance", "sample_rate"],
    ),
    "frozen": (_spoiled(_frozen), ["displacement shows nothing for 0.9 s", "no two periods"]),
    "saturated": (_spoiled(_clipped), ["displacement is clipped at the end", "line"]),
    "starts anew": (_spoiled(_wrapped), ["displacement jumps by", "its phase starts anew", "line"]),
    "too short": (_spoiled(_short), ["0.2 s hold 1.6 periods", "record longer"]),
}


@pytest.mark.parametrize("mistake", RECORD_MISTAKES)
def test_a_record_that_cannot_be_used_is_one_line_and_the_others_go_on(mistake, folder, capsys):
    content, words = RECORD_MISTAKES[mistake]
    path = folder / "raw/bad.csv"
    if content is None:
        path.unlink()
    elif isinstance(content, bytes):
        path.write_bytes(content)
    else:
        path.write_text(content)
    code, lines = check(folder, capsys)
    assert code == 1
    assert len(lines) == 2, lines
    assert lines[0].startswith(f"bad: refused: {path}")
    assert all(word in lines[0] for word in words), lines[0]
    assert lines[1] == "2 records: 1 good, 1 refused, 0 excluded; 0 warnings"


def test_a_refused_record_leaves_a_placeholder_with_the_reason_and_no_other_file(folder, tmp_path):
    (folder / "raw/bad.csv").write_text(_cell(900, 1, "LOST"))
    campaign = load_campaign(folder)
    out = tmp_path / "out/bad.nc"
    (found,) = ingest_or_refuse(campaign, campaign.record("bad"), out)
    assert (found.record, found.outcome) == ("bad", "refused")
    assert [path.name for path in out.parent.iterdir()] == ["bad.nc"]
    with open_record(out) as record:
        assert record.refused == found.detail
        assert record.roles == ()


def test_a_clock_that_wanders_is_resampled_and_reported(folder, tmp_path, capsys):
    rng = np.random.default_rng(7)
    t = np.arange(N) / RATE + 2e-4 * np.sin(20 * np.arange(N) / RATE)
    base = 2.5 + 0.125 * np.sin(2 * np.pi * 7.9 * t) + 1e-4 * rng.standard_normal(N)
    laser = 5.0 * np.sin(2 * np.pi * 7.9 * t - 1.0) + 2e-3 * rng.standard_normal(N)
    rows = (f"{a:.6f},{b:.5f},{c:.4f}" for a, b, c in zip(t, base, laser, strict=True))
    (folder / "raw/bad.csv").write_text("\n".join(["Time (s),CH1,Laser (mm)", *rows]) + "\n")
    code, lines = check(folder, capsys)
    assert code == 0
    assert "bad: warning: times stray by up to 0.36 samples" in lines[0]
    assert "resampled to" in lines[0]
    # The polynomials at the ends of the record are asked for nothing that lies beyond it.
    shares = re.findall(r"([\d.e-]+) % of (\w+)", lines[0])
    assert {role for _, role in shares} == {"base", "displacement"}
    assert all(float(share) < 0.3 for share, _ in shares)
    campaign = load_campaign(folder)
    ingest_or_refuse(campaign, campaign.record("bad"), tmp_path / "bad.nc")
    with open_record(tmp_path / "bad.nc") as record:
        even, x = record.time(), record.read("displacement")
    truth = 5e-3 * np.sin(2 * np.pi * 7.9 * even - 1.0)
    assert np.sqrt(np.mean((x - truth) ** 2)) < 3e-6


def test_an_unreadable_file_is_reported(folder, capsys):
    path = folder / "raw/bad.csv"
    path.unlink()
    path.mkdir()
    code, lines = check(folder, capsys)
    assert code == 1
    assert "is a folder" in lines[0]


@pytest.mark.parametrize("allowed", [False, True])
def test_a_link_to_itself_is_told(allowed, folder, capsys):
    (folder / "raw/bad.csv").unlink()
    (folder / "raw/bad.csv").symlink_to("bad.csv")
    if allowed:
        (folder / "campaign.yaml").write_text(YAML + "allow_outside: yes\n")
    code, lines = check(folder, capsys)
    assert code == 1
    assert "line 3, column file: found 'raw/bad.csv', which leads to no file" in lines[0]


def test_a_channel_without_motion_is_told(folder, capsys):
    """A row without frequency_hz: nothing says how long a period is."""
    rows = CSV.splitlines()
    rows[2] = "bad,raw/bad.csv,ringdown,,,,,,,"
    (folder / "records.csv").write_text("\n".join(rows) + "\n")
    t, base, laser = signals()
    (folder / "raw/bad.csv").write_text(text(t, base, 0.0 * laser + 3.0))
    code, lines = check(folder, capsys)
    assert code == 1
    assert "displacement shows no motion" in lines[0]


def test_a_link_that_leaves_the_folder_is_refused_and_can_be_allowed(folder, tmp_path, capsys):
    target = tmp_path / "elsewhere.csv"
    target.write_text(text(*signals()))
    (folder / "raw/bad.csv").unlink()
    (folder / "raw/bad.csv").symlink_to(target)
    code, lines = check(folder, capsys)
    assert code == 1
    assert "leaves the campaign folder" in lines[0]
    (folder / "campaign.yaml").write_text(YAML + "allow_outside: yes\n")
    assert check(folder, capsys)[0] == 0


def test_exclude_is_honoured_and_shown(folder, capsys):
    (folder / "raw/bad.csv").unlink()
    row = "bad,raw/bad.csv,periodic,34,0.25,7.9,,,"
    (folder / "records.csv").write_text(CSV.replace(f"{row},", f"{row}yes,cable loose"))
    code, lines = check(folder, capsys)
    assert code == 0
    assert lines[0] == "bad: excluded: cable loose"
    assert lines[1].startswith("2 records: 1 good, 0 refused, 1 excluded")


def test_a_frequency_in_rad_per_second_is_refused(folder, capsys):
    """The base channel knows better; b_c was a thousandth of the true one."""
    (folder / "raw/bad.csv").write_text(text(*signals()))
    row = "bad,raw/bad.csv,periodic,34,0.25,7.9"
    (folder / "records.csv").write_text(CSV.replace(row, row.replace("7.9", "49.64")))
    code, lines = check(folder, capsys)
    assert code == 1
    assert re.search(r"frequency_hz is 49.64 Hz, the base moves at [78]", lines[0])


@pytest.mark.long
@pytest.mark.parametrize(("defect", "change"), [("frozen", _frozen), ("saturated", _clipped)])
def test_a_defect_can_be_accepted_and_is_a_warning_then(defect, change, folder, capsys):
    (folder / "raw/bad.csv").write_text(_spoiled(change))
    (folder / "campaign.yaml").write_text(YAML.replace("mm}", f"mm, accept: {defect}}}"))
    code, lines = check(folder, capsys)
    assert code == 0
    assert lines[0].startswith("bad: warning: displacement")


@pytest.mark.long
def test_no_message_has_a_line_break_or_a_traceback(folder, capsys):
    for content, _ in RECORD_MISTAKES.values():
        if isinstance(content, str):
            (folder / "raw/bad.csv").write_text(content)
            lines = check(folder, capsys)[1]
            assert len(lines) == 2
            assert not re.search(r"Traceback|Error\(|numpy|pandas", lines[0])


def test_missing_cells_at_the_ends_are_trimmed_with_a_warning(folder, capsys):
    lines = text(*signals()).splitlines()
    for row in (1, 2, N):
        lines[row] = lines[row].rsplit(",", 1)[0] + ","
    (folder / "raw/bad.csv").write_text("\n".join(lines) + "\n")
    code, printed = check(folder, capsys)
    assert code == 0
    assert printed[0] == (
        "bad: warning: 2 rows at the start and 1 row at the end left out, where cells are empty"
    )
    campaign = load_campaign(folder)
    out = Path(folder.parent / "bad.nc")
    ingest_or_refuse(campaign, campaign.record("bad"), out)
    with open_record(out) as record:
        assert (record.n, record.start) == (N - 3, 0.002)
