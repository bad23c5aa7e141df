"""Files of several records: each is named behind the file, and none is taken unasked."""

import bz2
import gzip
import lzma
import struct
import zipfile

import numpy as np
import pytest
from scipy.io import wavfile

from vinesexp.cli import main
from vinesexp.errors import RecordError
from vinesexp.records.campaign.schema import Channel, Setup, TimeColumn
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.records.readers import open_source
from vinesexp.records.readers.source import file_of, part_of, require_one

N = 40
NAMES = "Time (s),CH1 (V)\n"


def rows(k, n=N):
    return "".join(f"{i / 1000},{k + i / 100}\n" for i in range(n))


def segment(k, n=N):
    """One segment of a LabVIEW file, as LabVIEW writes each."""
    return (
        f"Channels\t2\t\t\nSamples\t{n}\t{n}\t\nY_Unit_Label\tV\tg\t\nX0\t{k}\t{k}\t\n"
        f"Delta_X\t0.001\t0.001\t\n***End_of_Header***\t\t\t\nX_Value\tLaser\tAcc\tComment\n"
        + "".join(f"{i / 1000:.6f}\t{k + i / 100}\t{-i}\n" for i in range(n))
    )


LABVIEW = (
    "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tYes\n"
    "X_Columns\tOne\n***End_of_Header***\t\n\t\n"
)
TEXTS = {
    "names repeated": NAMES + rows(1) + NAMES + rows(2) + NAMES + rows(3),
    "a blank line and a remark": NAMES + rows(1) + "\nrun 2\n" + rows(2) + "\nrun 3\n" + rows(3),
    "comments": "# rate\n" + NAMES + rows(1) + "\n# 2\n# b\n" + rows(2) + "\n# 3\n# c\n" + rows(3),
    "returns": (NAMES + rows(1) + NAMES + rows(2) + NAMES + rows(3)).replace("\n", "\r\n"),
}


def values(path):
    source = open_source(path)
    return source, np.concatenate(list(source.blocks([0, 1], rows=17)))


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_blocks_one_after_another_are_records(text, tmp_path):
    (tmp_path / "a.csv").write_text(text, newline="")
    assert open_source(tmp_path / "a.csv").parts == ("1", "2", "3")
    for k in (1, 2, 3):
        source, block = values(tmp_path / f"a.csv#{k}")
        np.testing.assert_allclose(block[:, 1], k + np.arange(N) / 100)
        assert [(c.name, c.unit) for c in source.columns] == [
            ("Time (s)", "s"),
            ("CH1 (V)", "V"),
        ]


def test_a_block_of_fewer_columns_has_its_own_names(tmp_path):
    """The spectrum that an oscilloscope writes below the record: its axis was a column of times."""
    times = "".join(f"{i / 1000},{i % 7},{i % 5}\n" for i in range(N))
    lines = "".join(f"{10 * i},{i % 3}\n" for i in range(N))
    (tmp_path / "a.csv").write_text(
        f"x-axis,1,2\nsecond,Volt,Volt\n{times}x-axis,F1\nHertz,Volt\n{lines}"
    )
    columns = open_source(tmp_path / "a.csv#2").columns
    assert [(c.name, c.unit) for c in columns] == [("x-axis", "Hz"), ("F1", "V")]


def test_a_block_with_empty_cells_has_its_own_names(tmp_path):
    """Cells are empty where a channel has no spectrum: hertz were seconds, and amperes a name."""
    times = "".join(f"{i / 1000},{i % 7},{i % 5}\n" for i in range(N))
    lines = "".join(f"{10 * i - 100},{i % 3 if i > 10 else ''},\n" for i in range(N))
    (tmp_path / "a.csv").write_text(
        f"x-axis,1,2\nsecond,Ampere,Volt\n{times}x-axis,F1,\nHertz,Ampere,\n{lines}"
    )
    columns = open_source(tmp_path / "a.csv#2").columns[:2]
    assert [(c.name, c.unit) for c in columns] == [("x-axis", "Hz"), ("F1", "A")]


def test_segments_of_a_labview_file_have_their_own_headers(tmp_path):
    (tmp_path / "a.lvm").write_text(
        LABVIEW + segment(1) + "\n" + segment(2, 30) + "\n" + segment(3)
    )
    source, block = values(tmp_path / "a.lvm#2")
    assert source.parts == ("1", "2", "3")
    assert [(c.name, c.unit) for c in source.columns] == [
        ("X_Value", "s"),
        ("Laser", "V"),
        ("Acc", "g"),
    ]
    np.testing.assert_allclose(block[:, 1], 2 + np.arange(30) / 100)
    line = int(source.locate(0).removeprefix("line ")) - 1
    assert (tmp_path / "a.lvm").read_text().splitlines()[line].startswith("0.000000\t2.0\t")


def test_a_bad_cell_is_reported_with_its_line_in_the_whole_file(tmp_path):
    text = NAMES + rows(1) + NAMES + rows(2).replace("2.05", "2.05x")
    (tmp_path / "a.csv").write_text(text)
    line = next(k for k, row in enumerate(text.splitlines(), 1) if "x" in row)
    with pytest.raises(RecordError, match=f"line {line}, .*'2.05x'"):
        values(tmp_path / "a.csv#2")


@pytest.mark.parametrize(
    "text",
    [
        NAMES + rows(1) + "bad,bad\n" + rows(2),
        NAMES + rows(1) + "\nend of file\nsaved\n",
        NAMES + rows(1) + "OVERFLOW,OVERFLOW\n" + rows(2),
        "state,x\n" + "on,1\noff,2\n" * 30,
    ],
)
def test_one_bad_row_or_words_at_the_end_are_no_second_record(text, tmp_path):
    (tmp_path / "a.csv").write_text(text)
    assert open_source(tmp_path / "a.csv").parts == ()


def sequence(segments, *, interval=1e-3, order="<"):
    """A LeCroy sequence: the descriptor, the table of triggers, the segments' codes."""
    codes = np.concatenate(segments).astype("i1")
    head = bytearray(346)
    head[:8] = b"WAVEDESC"
    table = b"".join(struct.pack(order + "dd", 0.5 * k, -0.01 * k) for k in range(len(segments)))
    for place, form, number in (
        *((34, "h", 1), (36, "i", 346), (48, "i", len(table)), (60, "i", codes.nbytes)),
        *((116, "i", len(codes)), (144, "i", len(segments)), (156, "f", 0.5), (160, "f", 0.0)),
        *((176, "f", interval), (180, "d", 9.0), (344, "h", 0)),
    ):
        struct.pack_into(order + form, head, place, number)
    head[196:197] = b"V"
    return bytes(head) + table + codes.tobytes()


def test_segments_of_a_lecroy_sequence(tmp_path):
    segments = [np.arange(k, k + N) for k in range(4)]
    (tmp_path / "a.trc").write_bytes(sequence(segments))
    assert open_source(tmp_path / "a.trc").parts == ("1", "2", "3", "4")
    for k, expected in enumerate(segments):
        source = open_source(tmp_path / f"a.trc#{k + 1}")
        block = np.concatenate(list(source.blocks([0])))[:, 0]
        np.testing.assert_allclose(block, 0.5 * expected)
        assert source.start == pytest.approx(-0.01 * k)  # of its first sample before its trigger
    (tmp_path / "b.trc").write_bytes(sequence(segments)[:-1])
    with pytest.raises(RecordError, match="bytes of samples"):
        open_source(tmp_path / "b.trc")


@pytest.mark.long
def test_sheets_of_a_workbook(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for title, k, n in (("Run 1", 1, N), ("Run 2", 2, N - 4)):
        sheet = book.create_sheet(title)
        for row in ("Time (s)", "x (mm)"), *((i / 1000, k + i / 100) for i in range(n)):
            sheet.append(row)
    del book["Sheet"]
    book.save(tmp_path / "a.xlsx")
    source, block = values(tmp_path / "a.xlsx#Run 2")
    np.testing.assert_allclose(block[:, 1], 2 + np.arange(N - 4) / 100)
    assert source.format == "Excel, sheet 'Run 2' of 2"
    assert open_source(tmp_path / "a.xlsx").parts == ("Run 1", "Run 2")
    with pytest.raises(RecordError, match=r"no sheet 'Run 3'; there are 'Run 1', 'Run 2'"):
        open_source(tmp_path / "a.xlsx#Run 3")
    book["Run 2"]["B1"] = "y (mm)"  # another quantity, no second record of the same
    book.save(tmp_path / "b.xlsx")
    assert open_source(tmp_path / "b.xlsx").parts == ()


def test_of_several_records_one_has_to_be_named(tmp_path):
    (tmp_path / "a.csv").write_text(NAMES + rows(1) + NAMES + rows(2))
    channels = {"displacement": Channel("displacement", "CH1*", "displacement", 1.0, unit="V")}
    time = TimeColumn("Time*", "s", 1.0)
    with pytest.raises(RecordError, match=r"holds 2 records; .* a.csv#1, a.csv#2"):
        read_channels(tmp_path / "a.csv", Setup(channels, time=time))
    _, _, found = read_channels(tmp_path / "a.csv#2", Setup(channels, time=time))
    assert len(found["displacement"]) == N


def test_what_stands_behind_a_mark_is_a_part_only_of_a_file_that_has_some(tmp_path):
    (tmp_path / "run#1.csv").write_text(NAMES + rows(1))
    assert values(tmp_path / "run#1.csv")[1].shape == (N, 2)
    assert part_of(tmp_path / "run#1.csv") == ""
    assert file_of(tmp_path / "none.csv#2").name == "none.csv"
    (tmp_path / "a.csv").write_text(NAMES + rows(1))
    with pytest.raises(RecordError, match="one block of rows"):
        open_source(tmp_path / "a.csv#1")
    with pytest.raises(RecordError, match="no such file"):
        open_source(tmp_path / "none.csv#1")


def zipped(path, members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in members.items():
            archive.writestr(name, text)


def test_files_of_a_zip_are_records(tmp_path):
    zipped(
        tmp_path / "a.zip",
        {"day/run 1.csv": NAMES + rows(1), "day/run 2.csv": NAMES + rows(2), "meta/x.csv": "a,b\n"},
    )
    assert open_source(tmp_path / "a.zip").parts == ("run 1.csv", "run 2.csv")
    for k in (1, 2):
        source, block = values(tmp_path / f"a.zip#run {k}.csv")
        np.testing.assert_allclose(block[:, 1], k + np.arange(N) / 100)
        assert [c.name for c in source.columns] == ["Time (s)", "CH1 (V)"]
    with pytest.raises(RecordError, match=r"no file 'run 3.csv' .* run 1.csv, run 2.csv"):
        open_source(tmp_path / "a.zip#run 3.csv")


@pytest.mark.parametrize("pack", [gzip, bz2, lzma])
def test_a_packed_file_is_read_as_what_is_in_it(pack, tmp_path):
    for name, content in (("a.csv", NAMES + rows(1)), ("b.csv", (NAMES + rows(1) + "\n") * 2)):
        with pack.open(tmp_path / f"{name}.gz", "wb") as stream:
            stream.write(content.encode())
    source, block = values(tmp_path / "a.csv.gz")
    assert source.format == "packed text"
    np.testing.assert_array_equal(block, values(tmp_path / "b.csv.gz#2")[1])
    with pytest.raises(RecordError, match=r"b\.csv\.gz#1, b\.csv\.gz#2"):
        require_one(open_source(tmp_path / "b.csv.gz"))


def test_other_formats_than_text_are_read_out_of_an_archive(tmp_path):
    samples = np.arange(-400, 400, dtype=np.int16).reshape(-1, 2)
    wavfile.write(tmp_path / "a.wav", 1000, samples)
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(tmp_path / "a.wav", "a.wav")
        archive.writestr("b.csv", NAMES + rows(1))
    source, block = values(tmp_path / "a.zip#a.wav")
    assert source.sample_interval == 0.001
    np.testing.assert_allclose(block * 32768.0, samples)
    with gzip.open(tmp_path / "swollen.csv.gz", "wb") as stream:
        stream.write(b"0,1\n" * 1_000_000)
    with pytest.raises(RecordError, match="unpacks to more than 200 times its size"):
        open_source(tmp_path / "swollen.csv.gz")


def test_files_of_one_name_in_a_zip_are_told_apart_by_number(tmp_path):
    zipped(tmp_path / "a.zip", {f"{k}/scope.csv": NAMES + rows(k) for k in (1, 2)})
    _, block = values(tmp_path / "a.zip#2")
    assert block[0, 1] == 2.0
    with pytest.raises(RecordError, match=r"1 \(1/scope.csv\), 2 \(2/scope.csv\)"):
        open_source(tmp_path / "a.zip#scope.csv")


def decay(f, n=8000):
    t = np.arange(n) / 1e3
    noise = np.random.default_rng(3).standard_normal(n)
    x = 10 * np.exp(-0.3 * t) * np.cos(2 * np.pi * f * t) + 0.01 * noise
    return "Time (s),Laser (mm)\n" + "".join(
        f"{a:.4f},{b:.5f}\n" for a, b in zip(t, x, strict=True)
    )


@pytest.mark.long
def test_init_and_check_take_every_file_of_a_zip(tmp_path, capsys):
    members = {"readme.txt": "Two decays, rig of the basement.\n"}
    members |= {"x0_20.csv": decay(7.0), "x0_10.csv": decay(8.0)}
    zipped(tmp_path / "day.zip", members)
    assert main(["look", str(tmp_path / "day.zip#x0_20.csv")]) == 0
    assert main(["look", str(tmp_path / "day.zip")]) == 0
    assert "Laser" in capsys.readouterr().out  # the largest, not the remark
    assert main(["init", str(tmp_path)]) == 0
    assert "readme.txt" in capsys.readouterr().out
    sheet = (tmp_path / "records.csv").read_text()
    assert "day_x0_20,day.zip#x0_20.csv,ringdown,,,,,20" in sheet
    assert "day_x0_10,day.zip#x0_10.csv,ringdown,,,,,10" in sheet
    assert main(["check", str(tmp_path)]) == 0
    assert "2 records: 2 good" in capsys.readouterr().out


def test_init_and_check_take_every_record_of_a_file(tmp_path, capsys):
    folder = tmp_path / "tests"
    folder.mkdir()
    (folder / "runs.csv").write_text(decay(7.0) + decay(8.0))
    assert main(["look", str(folder / "runs.csv")]) == 0
    assert "runs.csv#1 to runs.csv#2" in capsys.readouterr().out
    assert main(["init", str(folder)]) == 0
    sheet = (folder / "records.csv").read_text()
    assert "runs_1,runs.csv#1,ringdown" in sheet
    assert "runs_2,runs.csv#2,ringdown" in sheet
    assert main(["check", str(folder)]) == 0
    assert "2 records: 2 good" in capsys.readouterr().out


def test_headings_that_count_divide_tracks(tmp_path):
    """As programs that track particles write them."""
    tracks = "".join(f"%% Trajectory {k}\n" + rows(k).replace(",", " ") for k in (1, 2, 3))
    (tmp_path / "a.txt").write_text(tracks + "%% end\n")
    assert open_source(tmp_path / "a.txt").parts == ("1", "2", "3")
    for k in (1, 2, 3):
        block = np.concatenate(list(open_source(tmp_path / f"a.txt#{k}").blocks([0, 1])))
        np.testing.assert_allclose(block[:, 1], k + np.arange(N) / 100)
