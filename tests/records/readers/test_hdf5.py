"""HDF5 files: columns wherever they stand, codes made volts, sampling from attributes."""

import h5py
import numpy as np
import pytest

from vinesexp.errors import RecordError
from vinesexp.proposal.roles import guess_roles
from vinesexp.proposal.survey import view_file
from vinesexp.records.campaign.schema import Channel, Setup
from vinesexp.records.instrument.ingest import read_channels
from vinesexp.records.readers import open_source

RNG = np.random.default_rng(3)
A, B = RNG.standard_normal(100), RNG.standard_normal(100)


def make(path, fill):
    with h5py.File(path, "w") as file:
        fill(file)
    return open_source(path)


def values(source, columns, rows=17):
    return np.concatenate(list(source.blocks(columns, rows=rows)))


def test_datasets_in_groups_are_columns_by_path(tmp_path):
    def fill(file):
        file["time"] = np.arange(100) * 1e-3
        file["scope/CH1"] = A
        file["scope/CH1"].attrs["units"] = "Volts"
        file["scope/CH2 (mm)"] = B.astype(np.float32)
        file["note"] = "hello"
        file["number"] = 5.0

    source = make(tmp_path / "a.h5", fill)
    assert [(c.name, c.unit) for c in source.columns] == [
        ("scope/CH1", "V"),
        ("scope/CH2 (mm)", "mm"),
        ("time", None),
    ]
    np.testing.assert_array_equal(values(source, [2, 0])[:, 1], A)
    assert source.sample_interval is None
    assert source.format == "HDF5"


def test_integer_codes_have_scale_and_offset(tmp_path):
    codes = np.arange(-50, 50, dtype=np.int16)

    def fill(file):
        file["CH1"] = codes
        file["CH1"].attrs.update(scale=0.5, offset=2.0)

    source = make(tmp_path / "a.h5", fill)
    np.testing.assert_array_equal(values(source, [0])[:, 0], codes * 0.5 + 2.0)


@pytest.mark.parametrize("stored", [np.int16, np.float32])
def test_a_keysight_oscilloscope_says_scale_and_sampling_in_the_group(stored, tmp_path):
    codes = np.arange(-50, 50)

    def fill(file):
        group = file.create_group("Waveforms/CH 1\n")
        group.attrs.update(XInc=2e-4, XUnits=b"Second", YInc=0.5, YOrg=2.0, YUnits=b"Volt")
        group["CH 1\n Data"] = codes.astype(stored)  # single precision holds volts
        group = file.create_group("Waveforms/FFT")
        group.attrs.update(XInc=10.0, XUnits=b"Hertz")
        group["FFT Data"] = codes.astype(np.float32)

    source = make(tmp_path / "a.h5", fill)
    column = source.columns[0]
    assert (column.name, column.unit) == ("Waveforms/CH 1 /CH 1 Data", "V")
    assert (column.interval, source.columns[1].interval) == (2e-4, None)
    volts = codes * 0.5 + 2.0 if stored == np.int16 else codes
    np.testing.assert_array_equal(values(source, [0])[:, 0], volts)


def test_a_table_is_a_column_for_each_field_of_numbers(tmp_path):
    """As PyTables and sensor nodes write: it was a file without columns of numbers."""
    fields = [("counter", "u1"), ("time_us", "<u8"), ("note", "S4"), ("x", "<f4"), ("y", "<i2")]
    table = np.zeros(300, dtype=fields)
    table["time_us"], table["x"] = 200 * np.arange(300), np.sin(np.arange(300))
    table["y"] = np.round(30.0 * np.cos(np.arange(300)))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["acceleration"] = table
    source = open_source(tmp_path / "a.h5")
    assert [(c.name.rpartition("/")[2], c.unit) for c in source.columns] == [
        *(("counter", None), ("time_us", "us"), ("x", None), ("y", None))
    ]
    samples = np.concatenate(list(source.blocks([2, 3], rows=70)))
    np.testing.assert_array_equal(samples, np.stack([table["x"], table["y"]], axis=1))
    view = view_file(tmp_path / "a.h5")
    assert view.rate == 5000.0
    # The bare axes of a table that is called after a sensor.
    assert guess_roles([view])["y"].role == "acceleration"


@pytest.mark.parametrize("transposed", [False, True])
def test_a_matrix_is_columns_along_its_longer_axis(transposed, tmp_path):
    def fill(file):
        both = np.stack([A, B], axis=1)
        file["data"] = both.T if transposed else both
        file["data"].attrs["columns"] = ["CH1", "CH2"]

    source = make(tmp_path / "a.h5", fill)
    assert [column.name for column in source.columns] == ["data/CH1", "data/CH2"]
    np.testing.assert_array_equal(values(source, [1, 0]), np.stack([B, A], axis=1))


@pytest.mark.parametrize(
    ("attribute", "value", "where"),
    [("sample_rate_hz", 1000.0, "/"), ("sample_interval_s", 1e-3, "CH1"), ("dt", 1e-3, "/")],
)
def test_the_sampling_is_an_attribute(attribute, value, where, tmp_path):
    def fill(file):
        file["CH1"] = A
        file[where].attrs[attribute] = value

    assert make(tmp_path / "a.h5", fill).columns[0].interval == pytest.approx(1e-3)


def test_contradicting_attributes_are_reported(tmp_path):
    def fill(file):
        file["CH1"] = A
        file.attrs["sample_rate_hz"] = 1000.0
        file["CH1"].attrs["sample_interval_s"] = 0.5

    with pytest.raises(RecordError, match=r"sample_rate_hz = 1000, sample_interval_s = 0\.5"):
        make(tmp_path / "a.h5", fill)


def test_columns_of_different_lengths_are_reported_when_both_are_wanted(tmp_path):
    def fill(file):
        file["CH1"], file["CH2"] = A, B[:50]

    source = make(tmp_path / "a.h5", fill)
    assert len(values(source, [1])) == 50
    with pytest.raises(RecordError, match="'CH1' 100, 'CH2' 50 samples"):
        values(source, [0, 1])


def test_a_file_without_columns_is_reported(tmp_path):
    with pytest.raises(RecordError, match="no columns of numbers"):
        make(tmp_path / "a.h5", lambda file: file.create_group("empty"))


def test_the_content_decides_not_the_name(tmp_path):
    path = tmp_path / "a.csv"
    source = make(path, lambda file: file.create_dataset("CH1", data=A))
    assert source.format == "HDF5"


def test_a_broken_file_is_reported(tmp_path):
    path = tmp_path / "a.h5"
    make(path, lambda file: file.create_dataset("CH1", data=A))
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(RecordError, match="cannot be read as HDF5"):
        open_source(path)


def test_the_rate_of_another_dataset_is_not_that_of_the_channels(tmp_path):
    def fill(file):
        file["scope/CH1"], file["camera/frames"] = A, B
        file["camera/frames"].attrs["fs"] = 30.0
        file["camera"].attrs["dt"] = 1 / 30.0

    source = make(tmp_path / "a.h5", fill)
    assert source.sample_interval is None
    assert {c.name: c.interval for c in source.columns} == {
        "scope/CH1": None,
        "camera/frames": pytest.approx(1 / 30.0),
    }


def test_channels_of_two_rates_come_to_one_clock(tmp_path):
    def fill(file):
        for name, values, rate in (("x", A[::2], 500.0), ("a", B, 1000.0)):
            file[name] = values
            file[name].attrs["sample_rate_hz"] = rate

    make(tmp_path / "a.h5", fill)
    roles = {"displacement": "x", "acceleration": "a"}
    channels = {r: Channel(r, n, r, 1.0, unit="V") for r, n in roles.items()}
    rate, _, found = read_channels(tmp_path / "a.h5", Setup(channels))
    assert rate == 1000.0
    assert list(found["acceleration"]) == pytest.approx(list(B))
    assert list(found["displacement"][::2]) == pytest.approx(list(A[::2]))
    one = Setup({"displacement": channels["displacement"]})
    assert read_channels(tmp_path / "a.h5", one)[0] == 500.0


def test_attributes_of_any_form_are_no_traceback(tmp_path):
    def several(file):
        file["x"] = A
        file["x"].attrs["scale"] = [1.0, 2.0]

    def tiny(file):
        file["x"] = A
        file.attrs["dt"] = 1e-320

    with pytest.raises(RecordError, match="scale or offset that is not one number"):
        make(tmp_path / "a.h5", several)
    with pytest.raises(RecordError, match=r"states its sampling as dt = 9\.99"):
        make(tmp_path / "b.h5", tiny)


def test_a_flipped_bit_under_a_checksum_is_reported(tmp_path):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=A, chunks=(100,), fletcher32=True)
        (chunk,) = [file["x"].id.get_chunk_info(0)]
    raw = bytearray(path.read_bytes())
    raw[chunk.byte_offset + 40] ^= 1
    path.write_bytes(raw)
    with pytest.raises(RecordError, match="sample 0: cannot be read as HDF5"):
        values(open_source(path), [0])


def other_file(folder):
    with h5py.File(folder / "other.h5", "w") as file:
        file["x"] = A
        file["fs"] = 1000.0
        file["g/x"] = A


def virtual(*source):
    def fill(file):
        file["y"] = A
        layout = h5py.VirtualLayout(shape=(100,), dtype="f8")
        layout[:] = h5py.VirtualSource(*source, shape=(100,))
        file["out"] = h5py.ExternalLink("other.h5", "x")
        file.create_virtual_dataset("x", layout)

    return fill


def keeps_samples_outside(file):
    file.create_dataset("x", (100,), "f8", external=[("other.h5", 0, 800)])


@pytest.mark.parametrize("suffix", ["h5", "mat"])
@pytest.mark.parametrize(
    "fill",
    [
        virtual("other.h5", "x"),
        virtual(".", "out"),  # a link that leaves the file
        virtual(".", "y"),
        keeps_samples_outside,
    ],
)
def test_samples_that_stand_elsewhere_are_refused(fill, suffix, tmp_path):
    other_file(tmp_path)
    with pytest.raises(RecordError, match="dataset 'x' keeps its samples in another file or"):
        make(tmp_path / f"a.{suffix}", fill)


@pytest.mark.parametrize("suffix", ["h5", "mat"])
def test_links_to_other_files_are_not_followed_and_reported(suffix, tmp_path):
    other_file(tmp_path)

    def fill(file):
        file["y"] = B
        file["fs"] = h5py.ExternalLink("other.h5", "fs")
        file["g/x"] = h5py.ExternalLink("other.h5", "x")
        file["all"] = h5py.ExternalLink("other.h5", "/")
        file["soft"] = h5py.SoftLink("/all/x")

    source = make(tmp_path / f"a.{suffix}", fill)
    assert [column.name for column in source.columns] == ["y"]
    assert source.sample_interval is None
    assert source.losses == ("links to other files are not followed: all, fs, g/x",)


def test_words_and_references_of_another_file_are_not_read(tmp_path):
    """As MATLAB writes them: a unit in 16-bit codes, a cell of references."""
    (tmp_path / "secret").write_bytes("root".encode("utf-16-le"))

    def fill(file):
        file["s/x"] = B
        unit = file.create_dataset(
            "s/unit", (4,), "u2", external=[(str(tmp_path / "secret"), 0, 8)]
        )
        unit.attrs["MATLAB_class"] = np.bytes_("char")

    with pytest.raises(RecordError, match="keeps its samples in another file"):
        make(tmp_path / "a.mat", fill)


def test_links_inside_the_file_are_other_names_of_one_dataset(tmp_path):
    def fill(file):
        file["data/x"] = A
        file["y"] = h5py.SoftLink("/data/x")
        file["z"] = file["data/x"]

    source = make(tmp_path / "a.h5", fill)
    assert [column.name for column in source.columns] == ["data/x"]
    np.testing.assert_array_equal(values(source, [0])[:, 0], A)
    assert source.losses == ()


def test_samples_that_were_stated_and_never_written_are_reported(tmp_path):
    def fill(file):
        file["whole"] = A
        file.create_dataset("none", (100,), "f8")
        half = file.create_dataset("half", (100,), "f8", chunks=(10,))
        half[:50] = A[:50]

    source = make(tmp_path / "a.h5", fill)
    assert source.losses == (
        "dataset 'half' states 100 samples, 50 of them were never written and are read as 0",
        "dataset 'none' states 100 samples, 100 of them were never written and are read as 0",
    )
