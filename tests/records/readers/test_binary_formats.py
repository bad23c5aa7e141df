"""Files as instruments and programs write them: names, units, sampling and numbers come back."""

import io
import struct
import sys
import zipfile
from datetime import datetime, timedelta

import numpy as np
import pytest
import scipy.io

from vinesexp.errors import RecordError
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.schema import Channel, Setup
from vinesexp.records.instrument.samples import Samples
from vinesexp.records.readers import open_source
from vinesexp.records.readers import parquet as parquet_reader
from vinesexp.records.readers.guard import GuardedSource, Limits
from vinesexp.records.readers.source import require_one

N, RATE = 400, 1000.0
T = np.arange(N) / RATE
X, A = 5.0 * np.cos(40.0 * T), -8.0 * np.cos(40.0 * T) + 0.1


def values(source, name):
    (index,) = [j for j, column in enumerate(source.columns) if column.name == name]
    return np.concatenate(list(source.blocks([index], rows=150)))[:, 0]


def rate_of(source, name):
    """The rate that a campaign gets which names neither times nor a rate."""
    channel = Channel("displacement", name, "displacement", 1e-3, unit="mm", file_size=1.0)
    samples = Samples(source, Setup({"displacement": channel}))
    assert sum(len(block["displacement"]) for block in samples.blocks()) == N
    return samples.sample_rate


def test_excel_xlsx_as_phyphox_writes_it(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "Raw Data"
    sheet.append(["Time (s)", "Linear Acceleration x (m/s^2)"])
    for t, a in zip(T, A, strict=True):
        sheet.append([float(t), float(a)])
    device = book.create_sheet("Metadata Device")
    device.append(["property", "value"])
    book.save(tmp_path / "a.xlsx")
    source = open_source(tmp_path / "a.xlsx")
    assert [c.unit for c in source.columns] == ["s", "m/s^2"]
    np.testing.assert_allclose(values(source, "Linear Acceleration x (m/s^2)"), A, rtol=1e-15)
    assert rate_of(source, 1) == RATE
    assert source.locate(0) == "sheet 'Raw Data', row 2"


def test_a_sheet_of_words_is_no_record_however_long(tmp_path):
    """An app's short list of hits stands before what it says of the phone."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.title = "All"
    for row in [("Event time (s)", "Interval (s)"), (3.19, 0.51), (3.7, 0.38), (4.08, 0.31)]:
        book.active.append(row)
    device = book.create_sheet("Metadata Device")
    for k in range(90):
        device.append([f"property {k}", f"1.{k}.0"])
    book.save(tmp_path / "a.xlsx")
    source = open_source(tmp_path / "a.xlsx")
    assert source.format == "Excel, sheet 'All' of 2"
    np.testing.assert_allclose(values(source, "Interval (s)"), [0.51, 0.38, 0.31])


def test_numbers_in_cells_of_text_are_rows_of_numbers(tmp_path):
    """Three numbers of another sheet were taken for the record."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [("count",), (1,), (2,), (3,)]:
        book.active.append(row)
    samples = book.create_sheet("samples")
    samples.append(["t", "x"])
    for k in range(60):
        samples.append([f"{0.01 * k:.2f}".replace(".", ","), f"{k},5"])
    book.save(tmp_path / "a.xlsx")
    source = open_source(tmp_path / "a.xlsx")
    assert source.format == "Excel, sheet 'samples' of 2"
    np.testing.assert_allclose(values(source, "x"), np.arange(60) + 0.5)


def test_a_bad_cell_of_a_sheet_is_reported_with_sheet_and_row(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for k, x in enumerate(["x (mm)", *map(float, X)]):
        book.active.append(["t (s)" if not k else T[k - 1], "?" if k == 50 else x])
    book.save(tmp_path / "a.xlsx")
    with pytest.raises(RecordError) as caught:
        values(open_source(tmp_path / "a.xlsx"), "x (mm)")
    assert f"{tmp_path / 'a.xlsx'}, sheet 'Sheet', row 51, column x (mm): found '?'" in str(
        caught.value
    )


def test_dates_in_a_sheet_are_times(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Date", "x (mm)"])
    begin = datetime(2024, 3, 5, 23, 59, 59)
    for k in range(N):
        book.active.append([begin + timedelta(milliseconds=10 * k), float(X[k])])
    book.save(tmp_path / "a.xlsx")
    assert rate_of(open_source(tmp_path / "a.xlsx"), "x (mm)") == pytest.approx(100.0, rel=1e-4)


def test_old_excel(tmp_path):
    pytest.importorskip("xlrd")
    xlwt = pytest.importorskip("xlwt")
    book = xlwt.Workbook()
    sheet = book.add_sheet("Data")
    for j, (name, column) in enumerate((("t (s)", T), ("x (mm)", X))):
        for i, cell in enumerate([name, *column]):
            sheet.write(i, j, cell)
    book.save(str(tmp_path / "a.xls"))
    source = open_source(tmp_path / "a.xls")
    np.testing.assert_array_equal(values(source, "x (mm)"), X)
    assert rate_of(source, "x (mm)") == RATE


def test_a_zip_of_csvs_as_phyphox_writes_it(tmp_path):
    text = "\n".join(
        ['"Time (s)","x (m/s^2)"', *(f"{t:.6E},{a:.9E}" for t, a in zip(T, A, strict=True))]
    )
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("Accelerometer.csv", text)
        archive.writestr("meta/device.csv", '"property","value"\n"version","1.1"\n')
    source = open_source(tmp_path / "a.zip")
    np.testing.assert_allclose(values(source, "x (m/s^2)"), A, rtol=1e-9)
    assert rate_of(source, "x (m/s^2)") == RATE
    with zipfile.ZipFile(tmp_path / "a.zip", "a") as archive:
        archive.writestr("Gyroscope.csv", text)
    with pytest.raises(RecordError, match=r"a\.zip#Accelerometer\.csv, a\.zip#Gyroscope\.csv"):
        require_one(open_source(tmp_path / "a.zip"))


def test_tdms(tmp_path):
    nptdms = pytest.importorskip("nptdms")

    def channel(group, name, data, unit, rate=RATE):
        more = {"wf_increment": 1 / rate, "wf_start_offset": 0.5, "unit_string": unit}
        return nptdms.ChannelObject(group, name, data, properties=more)

    with nptdms.TdmsWriter(str(tmp_path / "a.tdms")) as writer:
        writer.write_segment(
            [
                channel("fast", "Laser", X, "mm"),
                channel("fast", "Acc", A.astype(np.float32), "g"),
                channel("slow", "Acc", A[::2], "g", RATE / 2),
            ]
        )
    source = open_source(tmp_path / "a.tdms")
    assert [(c.name, c.unit) for c in source.columns] == [
        ("Laser", "mm"),
        ("fast/Acc", "g"),
        ("slow/Acc", "g"),
    ]
    np.testing.assert_array_equal(values(source, "Laser"), X)
    assert rate_of(source, "Laser") == RATE
    roles = {"displacement": "Laser", "acceleration": "slow/Acc"}
    channels = {r: Channel(r, n, r, 1.0, file_size=1.0) for r, n in roles.items()}
    with pytest.raises(RecordError, match="'Laser' 1000 Hz, 'slow/Acc' 500 Hz"):
        Samples(source, Setup(channels))


def test_a_tdms_file_with_the_high_byte_first_is_whole(tmp_path):
    pytest.importorskip("nptdms")
    name = b"/'group'/'x'"
    about = struct.pack(">II", 1, len(name)) + name
    about += struct.pack(">IIIQI", 20, 10, 1, X.size, 0)  # doubles, one dimension, no properties
    body = about + X.astype(">f8").tobytes()
    flags = 2 | 4 | 8 | 64  # what it is, a new list, samples, high byte first
    head = b"TDSm" + struct.pack("<I", flags) + struct.pack(">IQQ", 4713, len(body), len(about))
    (tmp_path / "a.tdms").write_bytes(head + body)
    source = open_source(tmp_path / "a.tdms")
    np.testing.assert_array_equal(values(source, "x"), X)
    assert source.losses == ()


def test_an_increment_of_one_in_tdms_is_nobodys_interval(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    blank = {"wf_increment": 1.0, "wf_start_offset": 0.0}
    laser = nptdms.ChannelObject("g", "Laser", X, properties=blank)
    with nptdms.TdmsWriter(str(tmp_path / "a.tdms")) as writer:
        writer.write_segment([laser])
    assert open_source(tmp_path / "a.tdms").columns[0].interval is None
    other = {**blank, "wf_increment": 0.25}
    with nptdms.TdmsWriter(str(tmp_path / "b.tdms")) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("g", "t", T, properties={"unit_string": "s"}),
                nptdms.ChannelObject("g", "Laser", X, properties=other),
            ]
        )
    view = view_file(tmp_path / "b.tdms")
    assert view.signals[0].rate == view.rate == pytest.approx(RATE)


@pytest.mark.parametrize("binary", [False, True])
def test_universal_files(binary, tmp_path):
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "a.uff"
    file = pyuff.UFF(str(path))
    for name, data, unit in (("Laser", X, "mm"), ("Acc", A, "m/s^2")):
        dataset = pyuff.prepare_58(
            binary=int(binary),
            id1=name,
            func_type=1,
            rsp_node=1,
            rsp_dir=3,
            abscissa_spec_data_type=17,
            ordinate_axis_units_lab=unit,
            x=T + 0.25,
            data=data,
            return_full_dict=True,
        )
        sampling = {"abscissa_spacing": 1, "abscissa_min": 0.25, "abscissa_inc": 1 / RATE}
        numbers = {"ord_data_type": 4, "num_pts": N}
        dataset = {k: 0 if v is None else v for k, v in dataset.items()}
        file.write_sets({**dataset, **sampling, **numbers}, "add")
    source = open_source(path)
    assert [(c.name, c.unit, c.start) for c in source.columns] == [
        ("Laser", "mm", 0.25),
        ("Acc", "m/s^2", 0.25),
    ]
    np.testing.assert_allclose(values(source, "Laser"), X, rtol=1e-10)
    assert rate_of(source, "Laser") == pytest.approx(RATE)


def test_mdf(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append(
            [
                asammdf.Signal(X, T, name="Laser", unit="mm"),
                asammdf.Signal(A, T, name="Acc", unit="g"),
            ]
        )
        path = file.save(tmp_path / "a.mf4")
    source = open_source(path)
    assert {(c.name, c.unit) for c in source.columns} == {
        ("time", "s"),
        ("Laser", "mm"),
        ("Acc", "g"),
    }
    np.testing.assert_array_equal(values(source, "Laser"), X)
    assert rate_of(source, "Laser") == RATE


def test_parquet(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    stamps = np.datetime64("2024-03-05T10:00:00", "us") + (T * 1e6).astype("timedelta64[us]")
    parquet.write_table(pyarrow.table({"stamp": stamps, "x (mm)": X}), tmp_path / "a.parquet")
    source = open_source(tmp_path / "a.parquet")
    np.testing.assert_array_equal(values(source, "x (mm)"), X)
    assert rate_of(source, "x (mm)") == pytest.approx(RATE)


def test_a_small_parquet_file_needs_little_memory(tmp_path):
    """Arrow's allocator takes 1 GiB of addresses at once, which is not the file's."""
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pyarrow.table({"t (s)": T, "x (mm)": X}), tmp_path / "a.parquet")
    source = GuardedSource(tmp_path / "a.parquet", parquet_reader, Limits(8, 60.0, 1 << 28))
    np.testing.assert_array_equal(values(source, "x (mm)"), X)


@pytest.mark.parametrize("name", ["a.npz", "a.npy"])
def test_numpy_files(name, tmp_path):
    if name == "a.npz":
        np.savez(tmp_path / name, x=X, both=np.stack([X, A]), fs=RATE, title="hello")
        wanted = {"x": X, "both/1": A}
    else:
        table = np.zeros(N, dtype=[("time (s)", float), ("x", "f4")])
        table["time (s)"], table["x"] = T, X
        np.save(tmp_path / name, table)
        wanted = {"x": X.astype("f4")}
    source = open_source(tmp_path / name)
    for column, numbers in wanted.items():
        np.testing.assert_array_equal(values(source, column), numbers)
    assert rate_of(source, "x") == RATE


def test_an_array_of_several_records_is_named_as_such(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((3, 4, 200)))
    with pytest.raises(RecordError, match="an array of 3 x 4 x 200: probably several records"):
        open_source(tmp_path / "a.npy")


def test_pickled_objects_are_never_opened(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{"x": 1}, 2], dtype=object), allow_pickle=True)
    with pytest.raises(RecordError, match="holds Python objects, which are not read"):
        open_source(tmp_path / "a.npy")


def test_matlab_structures_at_any_depth(tmp_path):
    channels = np.zeros((1, 2), dtype=[("y", object), ("unit", object)])
    for k, (data, unit) in enumerate(((X, "mm"), (A, "g"))):
        channels[0, k]["y"], channels[0, k]["unit"] = data, unit
    deep = {"test": {"laser": {"x": X, "fs": RATE}, "ch": channels, "slow": {"dt": 0.5, "z": A}}}
    scipy.io.savemat(tmp_path / "a.mat", deep)
    source = open_source(tmp_path / "a.mat")
    found = {c.name: (c.unit, c.interval) for c in source.columns}
    assert found == {
        "test/laser/x": (None, pytest.approx(1e-3)),
        "test/ch/0/y": ("mm", None),
        "test/ch/1/y": ("g", None),
        "test/slow/z": (None, 0.5),
    }
    np.testing.assert_array_equal(values(source, "test/ch/1/y"), A)
    assert rate_of(source, "test/laser/x") == RATE


def test_matlab_sizes_that_no_file_can_hold_are_reported(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"x": X}, oned_as="row")
    raw = (tmp_path / "a.mat").read_bytes()
    right, wrong = struct.pack("<ii", 1, N), struct.pack("<ii", 2**31 - 1, 2**31 - 1)
    assert right in raw
    (tmp_path / "a.mat").write_bytes(raw.replace(right, wrong, 1))
    with pytest.raises(RecordError, match="more than the file can hold"):
        open_source(tmp_path / "a.mat")


@pytest.mark.parametrize("order", ["MSB", "LSB"])
@pytest.mark.parametrize("long", [False, True])
def test_tektronix_isf(order, long, tmp_path):
    codes = np.round(X / 1e-3).astype(">i2" if order == "MSB" else "<i2")
    words = (
        "BYT_NR 2;BIT_NR 16;ENCDG BIN;BN_FMT RI;BYT_OR {o};NR_PT {n};WFID "
        if long
        else ("BYT_N 2;BIT_N 16;ENC BIN;BN_F RI;BYT_O {o};NR_P {n};WFI ")
    )
    words += '"Ch1, DC coupling, 2.0E0 V/div; 4.0E-2 s/div";PT_F Y;XIN 1.0E-3;PT_O 0;XZE -2.0E-1;'
    words += 'XUN "s";YMU 1.0E-3;YZE 0.0;YOF 2.0;YUN "V";:CURVE #3'
    header = (":WFMPRE:" if long else ":WFMP:") + words.format(o=order, n=N)
    (tmp_path / "a.isf").write_bytes(header.encode() + b"%d" % (2 * N) + codes.tobytes())
    source = open_source(tmp_path / "a.isf")
    assert (source.columns[0].name, source.columns[0].unit) == ("Ch1", "V")
    assert source.start == pytest.approx(-0.2)
    np.testing.assert_allclose(values(source, "Ch1"), X - 2e-3, atol=0.51e-3)
    assert rate_of(source, "Ch1") == RATE
    (tmp_path / "a.isf").write_bytes(header.encode() + b"%d" % (2 * N) + codes.tobytes()[:-9])
    with pytest.raises(RecordError, match="states 800 bytes of samples, 791 are there"):
        open_source(tmp_path / "a.isf")


@pytest.mark.parametrize("words", [False, True])
@pytest.mark.parametrize("order", ["<", ">"])
def test_lecroy_trc(words, order, tmp_path):
    step = 1e-3 if words else 0.05
    codes = np.round((X + 0.5) / step).astype(f"{order}i{2 if words else 1}")
    head = bytearray(346)
    head[0:8], head[16:26] = b"WAVEDESC", b"LECROY_2_3"
    for place, form, number in (
        (32, "h", int(words)), (34, "h", int(order == "<")), (36, "i", 346),
        (60, "i", codes.nbytes), (116, "i", N), (144, "i", 1), (156, "f", step),
        (160, "f", 0.5), (176, "f", 1e-3), (180, "d", -0.2), (344, "h", 1),
    ):  # fmt: skip
        struct.pack_into(order + form, head, place, number)
    head[196:197] = b"V"
    body = bytes(head) + codes.tobytes()
    (tmp_path / "a.trc").write_bytes(b"#9%09d" % len(body) + body)
    source = open_source(tmp_path / "a.trc")
    assert (source.columns[0].name, source.columns[0].unit, source.start) == ("C2", "V", -0.2)
    np.testing.assert_allclose(values(source, "C2"), X, atol=0.51 * step)
    assert rate_of(source, "C2") == RATE
    (tmp_path / "a.trc").write_bytes(body[:-10])
    with pytest.raises(RecordError, match="bytes of samples"):
        open_source(tmp_path / "a.trc")


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of asammdf
@pytest.mark.parametrize(
    ("content", "extra", "module"),
    [
        (b"TDSm" + bytes(100), "tdms", "nptdms"),
        (b"    -1\n    58\nMic\n", "uff", "pyuff"),
        (b"MDF     4.10    " + bytes(100), "mdf", "asammdf"),
        (b"PAR1" + bytes(100), "parquet", "pyarrow.parquet"),
        (b"\xd0\xcf\x11\xe0" + bytes(100), "excel", "xlrd"),
        (b"PK\x03\x04" + bytes(26) + b"[Content_Types].xml", "excel", "openpyxl"),
    ],
)
def test_a_missing_package_is_named_and_broken_files_are_no_traceback(
    content, extra, module, tmp_path, monkeypatch
):
    path = tmp_path / "a.bin"
    path.write_bytes(content)
    with pytest.raises(RecordError):
        open_source(path)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(RecordError, match=rf'pip install "vinesexp\[{extra}\]"'):
        open_source(path)


@pytest.mark.parametrize("cut", [0.2, 0.5, 0.9])
@pytest.mark.parametrize("kind", ["npz", "mat", "zip"])
def test_a_file_that_was_cut_is_reported(kind, cut, tmp_path):
    stream = io.BytesIO()
    if kind == "npz":
        np.savez(stream, x=X)
    elif kind == "mat":
        scipy.io.savemat(stream, {"x": X, "s": {"y": A}})
    else:
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("a.csv", "\n".join(f"{x:.6f}" for x in X))
    path = tmp_path / f"a.{kind}"
    path.write_bytes(stream.getvalue()[: int(cut * len(stream.getvalue()))])
    with pytest.raises(RecordError):
        values(open_source(path), "x")


def test_a_pipe_is_no_file(tmp_path):
    import os

    os.mkfifo(tmp_path / "a.csv")
    with pytest.raises(RecordError, match="not a regular file"):
        open_source(tmp_path / "a.csv")
