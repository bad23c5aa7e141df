"""Records on disk: what goes in comes out, other netCDF readers agree, nothing is half-written."""

import fcntl

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vinesexp.errors import RecordError
from vinesexp.records.stored.store import (
    RecordWriter,
    open_dataset,
    open_record,
    uniform_times,
    write_refused,
)

QUANTITIES = {"base": "displacement", "acceleration": "acceleration"}


def write(path, blocks, **options):
    options = {"sample_rate": 1e4, "start": 0.5, "quantities": QUANTITIES} | options
    with RecordWriter(path, **options) as writer:
        for block in blocks:
            writer.append({"base": block, "acceleration": -block})


@given(sizes=st.lists(st.integers(1, 200), min_size=1, max_size=5), seed=st.integers(0, 99))
@settings(max_examples=20, deadline=None)
def test_any_blocks_come_back_as_one_record(sizes, seed, tmp_path_factory):
    path = tmp_path_factory.mktemp("store") / "a.nc"
    rng = np.random.default_rng(seed)
    blocks = [rng.standard_normal(size) for size in sizes]
    write(path, blocks)
    whole = np.concatenate(blocks)
    with open_record(path) as record:
        assert record.n == len(whole)
        back = record.read("base")
        assert back.dtype == np.float64
        # float32: half a unit in the 24th bit.
        np.testing.assert_allclose(back, whole, rtol=2.0**-24)
        np.testing.assert_array_equal(record.read("acceleration"), -back)
        low, high = sorted(rng.integers(0, record.n + 1, 2))
        np.testing.assert_array_equal(record.read("base", low, high), back[low:high])


def test_other_readers_see_dimensions_units_and_times(tmp_path):
    path = tmp_path / "a.nc"
    write(path, [np.arange(5.0)], attributes={"test": "ringdown", "clearance_m": [0.02, 0.03]})
    with open_dataset(path) as data:
        assert dict(data.sizes) == {"time": 5}
        assert data["base"].attrs["units"] == "m"
        assert data["acceleration"].attrs["units"] == "m/s^2"
        assert data["time"].attrs["units"] == "s"
        np.testing.assert_array_equal(data["time"], [0.5, 0.5001, 0.5002, 0.5003, 0.5004])
        assert data.attrs["test"] == "ringdown"
        assert data.attrs["sample_rate_hz"] == 1e4
        np.testing.assert_array_equal(data.attrs["clearance_m"], [0.02, 0.03])
    with open_record(path) as record:
        assert record.roles == ("base", "acceleration")
        assert (record.sample_rate, record.start, record.refused) == (1e4, 0.5, None)
        assert record.quantity("acceleration") == "acceleration"
        np.testing.assert_array_equal(record.time(1, 3), [0.5001, 0.5002])


def interrupted(path):
    with RecordWriter(path, sample_rate=1.0, quantities=QUANTITIES) as writer:
        writer.append({"base": np.ones(3), "acceleration": np.ones(3)})
        raise RuntimeError("killed")


def test_an_interrupted_write_leaves_nothing(tmp_path):
    with pytest.raises(RuntimeError, match="killed"):
        interrupted(tmp_path / "a.nc")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_write_leaves_the_old_record(tmp_path):
    path = tmp_path / "a.nc"
    write(path, [np.arange(5.0)])
    with pytest.raises(RuntimeError, match="killed"):
        interrupted(path)
    assert list(tmp_path.iterdir()) == [path]
    with open_record(path) as record:
        assert record.n == 5


def test_a_refused_record_says_why(tmp_path):
    path = tmp_path / "sub/a.nc"
    write_refused(path, "raw/a.csv: is empty", {"record": "a", "note": None})
    with open_record(path) as record:
        assert record.refused == "raw/a.csv: is empty"
        assert record.attributes["record"] == "a"
        assert record.n == 0
        with pytest.raises(RecordError, match=r"cannot be used: raw/a\.csv: is empty"):
            record.read("base")
    with open_dataset(path) as data:
        assert data.attrs["refused"] == "raw/a.csv: is empty"


def test_an_absent_channel_is_reported(tmp_path):
    write(tmp_path / "a.nc", [np.ones(3)])
    with open_record(tmp_path / "a.nc") as record, pytest.raises(RecordError, match="no channel"):
        record.read("displacement")


def test_a_file_that_is_no_record_is_reported(tmp_path):
    (tmp_path / "a.nc").write_text("hello")
    with pytest.raises(RecordError, match="cannot be read as a record"):
        open_record(tmp_path / "a.nc")


def test_a_damaged_text_about_a_record_is_reported(tmp_path):
    path = tmp_path / "a.nc"
    attributes = {"test": "ringdown", "rows": 3}
    with RecordWriter(
        path, sample_rate=1.0, quantities={"base": "displacement"}, attributes=attributes
    ) as writer:
        writer.append({"base": np.ones(3)})
    with open_record(path) as record:
        assert record.attributes.get("none") is None
        assert attributes.items() <= dict(record.attributes).items()
        assert len(record.attributes) == len(dict(record.attributes))
    whole = path.read_bytes()
    assert b"GCOL" in whole  # where HDF5 keeps texts
    path.write_bytes(whole.replace(b"GCOL", b"gone"))
    with (
        pytest.raises(RecordError, match=r"cannot be read as a record.*remove it and run again"),
        open_record(path) as record,
    ):
        record.attributes.get("test")


def test_sampling_may_be_known_at_the_end_only(tmp_path):
    with RecordWriter(tmp_path / "a.nc", sample_rate=np.nan, quantities=QUANTITIES) as writer:
        writer.append({"base": np.ones(3), "acceleration": np.ones(3)})
        writer.sample_rate, writer.start = 100.0, 2.0
    with open_record(tmp_path / "a.nc") as record:
        np.testing.assert_array_equal(record.time(), [2.0, 2.01, 2.02])


@pytest.mark.parametrize(
    "block",
    [
        {"base": np.ones(3)},
        {"base": np.ones(3), "acceleration": np.ones(4)},
        {"base": np.ones((3, 1)), "acceleration": np.ones((3, 1))},
    ],
)
def test_blocks_that_do_not_fit_are_a_programmers_error(block, tmp_path):
    writing = RecordWriter(tmp_path / "a.nc", sample_rate=1.0, quantities=QUANTITIES)
    with pytest.raises(ValueError, match="equal length"), writing as writer:
        writer.append(block)


def test_times_do_not_drift_over_an_hour():
    # Each time is computed from its number: 3600 s is met to the last bits, not to 36e6 roundings.
    (last,) = uniform_times(1e4, 0.1, 36_000_000, 36_000_001)
    assert abs(last - 3600.1) <= np.spacing(3600.1)


def test_a_file_says_what_its_channels_are_and_which_conventions_it_follows(tmp_path):
    write(tmp_path / "a.nc", [np.arange(5.0)], state="bandpassed")
    with open_dataset(tmp_path / "a.nc") as data:
        assert data.attrs["Conventions"] == "CF-1.11"
        assert data["base"].attrs["long_name"] == "bandpassed displacement of the base"
        assert data["acceleration"].attrs["long_name"].endswith("acceleration of the oscillator")
        assert data["time"].attrs["axis"] == "T"


def test_a_record_is_read_while_another_process_holds_its_lock(tmp_path):
    """A copy of a process, made while it writes, holds the lock until it ends; NFS has none."""
    path = tmp_path / "record.nc"
    write(path, [np.arange(10.0)])
    with path.open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        with open_record(path) as record:
            assert record.n == 10
