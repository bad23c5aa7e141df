"""MATLAB files of every version: vectors are columns, single numbers the sampling."""

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.io.wavfile

from vinesexp.errors import RecordError
from vinesexp.records.readers import open_source

RNG = np.random.default_rng(4)
A, B = RNG.standard_normal(100), RNG.integers(-99, 99, 100).astype(np.int16)


def values(source, columns):
    return np.concatenate(list(source.blocks(columns, rows=33)))


@pytest.mark.parametrize("form", ["4", "5"])
@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("orient", ["row", "column"])
def test_vectors_are_columns(form, compress, orient, tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(
        path,
        {"CH1": A, "CH2": B, "fs": 1000.0, "title": "hello"},
        format=form,
        do_compression=compress and form == "5",
        oned_as=orient,
    )
    source = open_source(path)
    assert source.format == "MATLAB"
    names = [column.name for column in source.columns]
    assert set(names) == {"CH1", "CH2"}
    assert source.sample_interval == pytest.approx(1e-3)
    found = values(source, [names.index("CH2"), names.index("CH1")])
    np.testing.assert_array_equal(found, np.stack([B, A], axis=1))
    assert source.locate(0) == "sample 1"


@pytest.mark.parametrize("suffix", [".csv", ".wav", ".h5", ""])
def test_the_content_decides_and_not_the_suffix(suffix, tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"CH1": A, "dt": 0.5})
    other = (tmp_path / "a.mat").rename(tmp_path / f"b{suffix}")
    assert [column.name for column in open_source(other).columns] == ["CH1"]
    scipy.io.wavfile.write(tmp_path / "a.wav", 1000, B)
    source = open_source((tmp_path / "a.wav").rename(tmp_path / "c.mat"))
    assert source.format == "WAV"
    np.testing.assert_allclose(values(source, [0])[:, 0] * 2**15, B)


def test_a_matrix_is_columns_along_its_longer_axis(tmp_path):
    path = tmp_path / "a.mat"
    for data in (np.stack([A, B], axis=1), np.stack([A, B])):
        scipy.io.savemat(path, {"data": data, "dt": 0.5})
        source = open_source(path)
        assert [column.name for column in source.columns] == ["data/0", "data/1"]
        assert source.sample_interval == 0.5
        np.testing.assert_array_equal(values(source, [1])[:, 0], B)


def test_version_73_is_hdf5_inside(tmp_path):
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["CH1"] = A[None, :]  # MATLAB's n x 1, seen from here
        file["fs"] = [[1000.0]]
        file.create_group("#refs#")["x"] = A
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(128))
    source = open_source(path)
    assert [column.name for column in source.columns] == ["CH1"]
    assert source.sample_interval == pytest.approx(1e-3)
    np.testing.assert_array_equal(values(source, [0])[:, 0], A)


def test_complex_numbers_are_reported(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"CH1": A + 1j})
    with pytest.raises(RecordError, match=r"CH1 \(complex numbers\)"):
        values(open_source(path), [0])


def test_the_code_of_a_function_handle_is_no_channel(tmp_path):
    """MATLAB saves it as a vector of bytes without a name, which scipy calls by its own."""
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"x": np.arange(9.0), "A_function_workspace__": np.arange(200.0)})
    path.write_bytes(path.read_bytes().replace(b"A_function", b"__function"))
    assert [name for name, *_ in scipy.io.whosmat(path)][1] == "__function_workspace__"
    assert [column.name for column in open_source(path).columns] == ["x"]


def test_different_lengths_are_reported(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"CH1": A, "CH2": B[:50]})
    with pytest.raises(RecordError, match="'CH1' 100, 'CH2' 50 samples"):
        values(open_source(path), [0, 1])


def test_a_broken_file_is_reported(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"CH1": A})
    path.write_bytes(path.read_bytes()[:150])
    with pytest.raises(RecordError, match=r"a\.mat: "):
        values(open_source(path), [0])


def test_two_rates_are_reported(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"x": A, "fs": 1000.0, "Fs": 500.0})
    with pytest.raises(RecordError, match="fs = 1000, fs = 500"):
        open_source(tmp_path / "a.mat")


def written_73(path, write):
    """A file as MATLAB 7.3 writes it: HDF5 behind a user block, with MATLAB's attributes."""
    with h5py.File(path, "w", userblock_size=512) as file:
        write(file)
    with path.open("r+b") as stream:
        stream.write(
            b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: today HDF5 schema 1.00 ."
        )


def member(file, name, value):
    """One member of a structure or cell, among MATLAB's own references."""
    item = file.create_dataset(f"#refs#/{name}", data=np.atleast_2d(value).T)
    kind = "char" if item.dtype == np.uint16 else "double"
    item.attrs["MATLAB_class"] = np.bytes_(kind)
    return item.ref


def words(text):
    return np.array([ord(letter) for letter in text], dtype=np.uint16)


def test_arrays_of_structures_and_cells_of_version_73(tmp_path):
    x = np.cos(np.arange(50) / 5.0)

    def write(file):
        fields = {"y": [x, 2.0 * x], "fs": [1000.0, 1000.0], "unit": [words("mm"), words("g")]}
        group = file.create_group("ch")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for field, values in fields.items():
            found = [member(file, f"{field}{k}", value) for k, value in enumerate(values)]
            group.create_dataset(field, data=np.array([found]).T, dtype=h5py.ref_dtype)
        cell = [member(file, f"c{k}", (k + 3.0) * x) for k in range(2)]
        held = file.create_dataset("runs", data=np.array([cell]).T, dtype=h5py.ref_dtype)
        held.attrs["MATLAB_class"] = np.bytes_("cell")
        nothing = file.create_dataset("nothing", data=np.array([0, 0], dtype=np.uint64))
        nothing.attrs["MATLAB_empty"] = np.uint8(1)
        title = file.create_dataset("title", data=words("shaker")[:, None])
        title.attrs["MATLAB_class"] = np.bytes_("char")

    written_73(tmp_path / "a.mat", write)
    source = open_source(tmp_path / "a.mat")
    found = [(c.name, c.unit, c.interval) for c in source.columns]
    assert found == [
        ("ch/0/y", "mm", 1e-3),
        ("ch/1/y", "g", 1e-3),
        ("runs/0", None, None),
        ("runs/1", None, None),
    ]
    block = np.concatenate(list(source.blocks([0, 1, 2, 3])))
    np.testing.assert_array_equal(block, np.stack([x, 2 * x, 3 * x, 4 * x], axis=1))


def test_a_structure_of_version_73_that_holds_itself_ends(tmp_path):
    def write(file):
        held = file.create_dataset("loop", (1, 1), dtype=h5py.ref_dtype)
        held[0, 0] = held.ref
        held.attrs["MATLAB_class"] = np.bytes_("cell")
        file.create_dataset("x", data=np.arange(9.0)[:, None])

    written_73(tmp_path / "a.mat", write)
    assert [c.name for c in open_source(tmp_path / "a.mat").columns] == ["x"]


def opaque(name, kind):
    """A variable of version 5 that is an object of a class of MATLAB."""

    def element(code, data):
        padded = data + b"\0" * (-len(data) % 8)
        return np.array([code, len(data)], dtype="<u4").tobytes() + padded

    def array(code, dims, data):
        flags = np.array([code, 0], dtype="<u4").tobytes()
        size = np.array(dims, dtype="<i4").tobytes()
        return element(14, element(6, flags) + element(5, size) + element(1, b"") + data)

    words = b"".join(element(1, word.encode()) for word in (name, "MCOS", kind))
    flags = np.array([17, 0], dtype="<u4").tobytes()
    held = array(13, (2, 1), element(6, np.array([1, 2], dtype="<u4").tobytes()))
    return element(14, element(6, flags) + words + held)


def test_a_table_of_matlab_is_refused_with_what_to_type(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"fs": 1000.0})
    path.write_bytes(path.read_bytes()[:128] + opaque("runs", "table"))
    with pytest.raises(RecordError, match=r"found runs \(table, which only MATLAB .* table2struct"):
        open_source(path)


def test_an_object_that_is_none_is_refused_likewise(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"fs": 1000.0})
    broken = np.array([14, 16, 6, 8, 17, 0], dtype="<u4").tobytes()  # a matrix of class 17
    path.write_bytes(path.read_bytes()[:128] + broken)
    with pytest.raises(RecordError, match=r"found a variable \(object, which .* table2struct"):
        open_source(path)


def test_vectors_beside_an_object_are_read_and_the_object_named(tmp_path):
    """A workspace saved as a whole: a fitted model among the samples."""
    path = tmp_path / "a.mat"
    x = np.sin(np.arange(90.0))
    scipy.io.savemat(path, {"fs": 1000.0, "x": x})
    head, rest = path.read_bytes()[:128], path.read_bytes()[128:]
    path.write_bytes(head + opaque("model", "tf") + rest + opaque("more", "timeseries"))
    source = open_source(path)
    assert [(c.name, source.sample_interval) for c in source.columns] == [("x", 1e-3)]
    np.testing.assert_array_equal(np.concatenate(list(source.blocks([0])))[:, 0], x)
    assert source.losses == (
        "not read: model (tf, which only MATLAB reads), more (timeseries, which only MATLAB reads)",
    )
