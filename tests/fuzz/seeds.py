"""Small files of every format and every description, as bytes, to be damaged."""

from __future__ import annotations

import io
import random
import struct
import tempfile
import warnings
import zipfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import scipy.io
import scipy.io.wavfile

REPOSITORY = Path(__file__).resolve().parents[2]
REAL = REPOSITORY.parent / "shared/real"
_LARGEST = 80_000  # bytes of a real file: larger ones only take longer
_BEGINNING = 8_000  # bytes of a measured text file: its head, and rows to see what they are

N, RATE = 300, 1000.0
T = np.arange(N) / RATE
X, A = 5.0 * np.cos(40.0 * T), -8.0 * np.cos(40.0 * T) + 0.1

CAMPAIGN = (REPOSITORY / "data/twin/campaign.yaml").read_text(encoding="utf-8")
PUBLISHED = (REPOSITORY / "data/twin/published.csv").read_bytes()
FULL_CAMPAIGN = """\
title: Shaker tests, summer
operator: A. Person
known: {mass: 4.7 +- 0.05 kg, nes_mass: [32 g, 0.03 kg]}
channels:
  base: {column: CH1, quantity: displacement, sensitivity: 0.5 V/mm, offset: 2.5 V}
  displacement: {column: "Laser*", quantity: displacement, unit: mm, accept: [frozen]}
  acceleration: {column: 3, quantity: acceleration, sensitivity: 100 mV/g, optional: yes}
setups:
  far:
    channels:
      displacement: {column: 2, quantity: displacement, unit: um}
time: {column: "Time*", unit: s}
bandpass: {low: 2 Hz, high: 40 Hz}
settings: {filter: {order: 4}}
allow_outside: no
"""
#: Most keys of a scene; the twin has the others.
SCENE = """\
title: Bench
seed: 7
rig: {mass: 4.7 kg, damping: 3.02 N s/m, quadratic_damping: 0.1 N s^2/m^2, coulomb_damping: 0.01 N,
  stiffness: 1.147e4 N/m, cubic_stiffness: 5e5 N/m^3, nes_mass: [32 g, 30 g],
  restitution: [0.65, 0.6], restitution_minus: 0.55, restitution_slope: -0.1 s/m,
  friction: 0.3 m/s^2, tilt: 5 mg}
sheet: {seed: 1, nes_mass: 0.05 g, added_mass: 0.2 g, clearance: 0.03 mm, release: 0.1 mm,
  clock: 0.002 %}
sensors:
  base: {sensitivity: 400 mV/mm, gain_uncertainty: 0.5 %, noise: 2 um, range: 2.5 mm, bias: 0.1 mm}
  displacement: {sensitivity: 40 mV/mm, offset: 0.5 V, gain_error: 3 %, noise: 6 um,
    drift: 0.05 mm,
    drift_time: 60 s, bandwidth: 5 kHz, range: 25 mm}
  acceleration: {sensitivity: 20 mV/g, noise: 0.3 m/s^2, pulse: 0.4 ms, ring: 5 kHz,
    ring_damping: 0.02, ac_corner: 0.5 Hz, cross_axis: 2 %,
    mode: {frequency: 110 Hz, share: 30 %, damping: 2 %},
    range: 50 g}
oscilloscope: {sample_rate: 10 kHz, bits: 14, full_scale: 1 V, format: tab,
  skew: {acceleration: 20 us}, clock_error: 0.01 %, dropped_samples: 3}
groups:
  one:
    test: periodic
    duration: 5 s
    settle: 2 s
    base_amplitude: 0.25 mm
    frequency: 7.862 Hz
    records:
      a: {clearance: 34 mm, ball_start: wall -1, note: "first: one"}
      b: {clearance: [34 mm, 20 mm], clearance_minus: [30 mm, 20 mm], ball_start: [middle, 5 mm]}
  two:
    records:
      c: {test: sweep, base_amplitude: 0.2 mm,
        frequency: {start: 7.2 Hz, stop: 8.4 Hz, step: 0.4 Hz}, dwell: 5 s}
      d: {test: ringdown, duration: 5 s, release: 20 mm, added_mass: 200 g,
        oscilloscope: {format: wav}}
      e: {test: drop, duration: 1 s, height: 50 mm}
      f: {test: transient, duration: 5 s, release: 20 mm, clearance: 20 mm, ball_start: wall +1}
"""
RECORDS = """\
record,file,test,clearance_mm,base_amplitude_mm,frequency_hz,added_mass_g,release_mm,exclude,note
a,raw/a.csv,periodic,34;20,0.25,7.9,,,,
b,raw/b.csv,ringdown,,,,200,20,,"a, b"
c,raw/c.csv;raw/d.csv,sweep,,0.2,7.2:8.4,,,yes,broken
d,raw/a.csv,drop,,,,,,,
"""


def texts() -> Iterator[tuple[str, bytes]]:
    """Text as oscilloscopes, loggers and programs write it."""
    rows = [f"{t:.4f},{x:.5f},{a:.4f}" for t, x, a in zip(T, X, A, strict=True)]
    yield "plain.csv", "\n".join(["Time (s),Laser (mm),CH3", *rows]).encode()
    comma = [row.replace(",", ";").replace(".", ",") for row in rows]
    yield "comma.csv", "\r\n".join(["Zeit [s];Weg [mm];Acc", *comma]).encode("cp1252")
    tabs = [row.replace(",", "\t") for row in rows]
    yield "utf16.txt", "\n".join(["Time\tLaser\tAcc", "s\tmm\tg", *tabs]).encode("utf-16")
    head = "Record Length,300\nSample Interval,1e-3,s\nVertical Units,V\nModel,X\nTIME,CH1,CH2\n"
    yield "scope.csv", (head + "\n".join(rows)).encode()
    rigol = "X,CH1,CH2,Start,Increment\nSequence,Volt,Volt,-0.1,1e-3\n"
    numbered = [f"{k},{x:.5f},{a:.4f}," for k, (x, a) in enumerate(zip(X, A, strict=True))]
    yield "sequence.csv", (rigol + "\n".join(numbered)).encode()
    lvm = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\t\n"
    lvm += "Channels\t2\nSamples\t300\t300\nDelta_X\t1e-3\t1e-3\n***End_of_Header***\t\n"
    yield "labview.lvm", (lvm + "X_Value\tA\tB\tComment\n" + "\n".join(tabs)).encode()
    stamped = [f"2024-03-05 10:00:{t:09.6f},{x:.4f}" for t, x in zip(T, X, strict=True)]
    yield "stamps.csv", "\n".join(["Date,Laser", *stamped]).encode()


def isf() -> bytes:
    """A Tektronix waveform."""
    words = "BYT_NR 2;BIT_NR 16;ENCDG BIN;BN_FMT RI;BYT_OR MSB;NR_PT 300;WFID "
    words += '"Ch1, DC coupling, 2.0E0 V/div";PT_F Y;XIN 1.0E-3;PT_O 0;XZE -2.0E-1;'
    words += 'XUN "s";YMU 1.0E-3;YZE 0.0;YOF 2.0;YUN "V";:CURVE #3600'
    return f":WFMPRE:{words}".encode() + np.round(X / 1e-3).astype(">i2").tobytes()


def trc() -> bytes:
    """A LeCroy waveform."""
    codes = np.round(X / 1e-3).astype("<i2")
    head = bytearray(346)
    head[0:8], head[16:26] = b"WAVEDESC", b"LECROY_2_3"
    for place, form, number in (
        (32, "h", 1), (34, "h", 1), (36, "i", 346), (60, "i", codes.nbytes), (116, "i", N),
        (144, "i", 1), (156, "f", 1e-3), (176, "f", 1e-3), (180, "d", -0.2), (344, "h", 1),
    ):  # fmt: skip
        struct.pack_into("<" + form, head, place, number)
    return b"#9%09d" % (len(head) + codes.nbytes) + bytes(head) + codes.tobytes()


def _hdf5(**options: object) -> bytes:
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        scope = file.create_group("scope")
        scope.attrs["sample_rate_hz"] = RATE
        for name, values in (("Laser", X), ("Acc", A.astype("f4"))):
            scope.create_dataset(name, data=values, **options).attrs["units"] = "mm"
        codes = file.create_dataset("codes", data=np.round(np.stack([X, A]) * 100).astype("i2"))
        codes.attrs["scale"], codes.attrs["columns"] = 0.01, ["x", "a"]
    return stream.getvalue()


#: What stands in the file that must not be read.
OUTSIDE = 54321.0


def write_indirect(folder: Path, rng: random.Random) -> None:
    """a.h5 and a.mat, alike, of links of every kind; other.h5 beside them is full of `OUTSIDE`."""
    with h5py.File(folder / "other.h5", "w") as other:
        other["x"] = np.full(N, OUTSIDE)
        other["g/x"] = np.full(N, OUTSIDE)
        other["fs"] = OUTSIDE
    with h5py.File(folder / "a.h5", "w") as file:
        file["x"] = X
        targets = ["x"]
        cells = file.create_dataset("cells", (3,), h5py.ref_dtype)
        cells.attrs["MATLAB_class"] = np.bytes_("cell")
        for k in range(rng.randrange(1, 8)):
            name = rng.choice((f"n{k}", f"s/n{k}", f"s/fs{k}", "fs", "s/unit"))
            if name not in file:
                _add_link(file, name, rng.choice(targets), rng, folder, cells)
                targets += [name, f"{name}/x"]
    (folder / "a.mat").write_bytes((folder / "a.h5").read_bytes())


def _add_link(
    file: h5py.File, name: str, aim: str, rng: random.Random, folder: Path, cells: h5py.Dataset
) -> None:
    try:
        there = file.get(aim)
    except (KeyError, OSError, RuntimeError):  # links in a circle
        there = None
    match rng.randrange(6):
        case 0:
            file[name] = h5py.SoftLink(f"/{aim}")
        case 1:
            file[name] = h5py.ExternalLink("other.h5", rng.choice(("x", "g", "/", "fs")))
        case 2:
            layout = h5py.VirtualLayout(shape=(N,), dtype="f8")
            where = ("other.h5", "x") if rng.random() < 0.2 else (".", aim)
            part = rng.choice((N, N, N // 2))
            layout[:part] = h5py.VirtualSource(*where, shape=(N,))[:part]
            file.create_virtual_dataset(name, layout)
        case 3:
            stored = [(str(folder / "other.h5"), 0, 8 * N)]
            kept = file.create_dataset(name, (N,), "f8", external=stored)
            kept.attrs["MATLAB_class"] = np.bytes_(rng.choice(("char", "double", "cell")))
        case 4 if isinstance(there, h5py.Dataset):
            cells[rng.randrange(3)] = there.ref
        case _ if there is not None and there.file == file:
            file[name] = there


def _in_memory(write: Callable[[io.BytesIO], object]) -> bytes:
    stream = io.BytesIO()
    write(stream)
    return stream.getvalue()


def _xlsx() -> bytes:
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["Time (s)", "x (mm)"])
    for t, x in zip(T[:60], X[:60], strict=True):
        book.active.append([float(t), float(x)])
    return _in_memory(book.save)


def _tdms() -> bytes:
    import nptdms

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.tdms"
        with nptdms.TdmsWriter(str(path)) as writer:
            for _ in range(2):
                more = {"wf_increment": 1 / RATE, "unit_string": "mm"}
                writer.write_segment([nptdms.ChannelObject("g", "x", X, properties=more)])
        return path.read_bytes()


def _mdf() -> bytes:
    import asammdf

    with tempfile.TemporaryDirectory() as folder, asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(X, T, name="Laser", unit="mm")])
        return Path(file.save(Path(folder) / "a.mf4")).read_bytes()


def _parquet() -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as parquet

    return _in_memory(lambda stream: parquet.write_table(pa.table({"time": T, "x": X}), stream))


def _uff() -> bytes:
    import pyuff

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.uff"
        one = pyuff.prepare_58(
            binary=1, id1="Laser", func_type=1, rsp_node=1, rsp_dir=3, abscissa_spec_data_type=17,
            ordinate_axis_units_lab="mm", x=T, data=X, return_full_dict=True,
        )  # fmt: skip
        one = {k: 0 if v is None else v for k, v in one.items()}
        numbers = {"abscissa_spacing": 1, "abscissa_min": 0.25, "abscissa_inc": 1 / RATE}
        pyuff.UFF(str(path)).write_sets({**one, **numbers, "ord_data_type": 4, "num_pts": N}, "add")
        return path.read_bytes()


def _zip() -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("Accelerometer.csv", dict(texts())["plain.csv"])
        archive.writestr("meta/device.csv", '"property","value"\n')
    return stream.getvalue()


def binaries() -> Iterator[tuple[str, bytes]]:
    """Binary formats, of those whose packages are installed."""
    yield "tek.isf", isf()
    yield "lecroy.trc", trc()
    yield "plain.h5", _hdf5()
    yield "packed.h5", _hdf5(compression="gzip", fletcher32=True, chunks=(64,))
    held = {"x": X, "fs": RATE, "s": {"y": A, "unit": "mm"}}
    yield "five.mat", _in_memory(lambda stream: scipy.io.savemat(stream, held))
    packed = {"x": X, "y": A}
    yield "packed.mat", _in_memory(lambda s: scipy.io.savemat(s, packed, do_compression=True))
    yield "four.mat", _in_memory(lambda s: scipy.io.savemat(s, packed, format="4"))
    codes = np.stack([X, A], axis=1) / 16.0
    yield "a.wav", _in_memory(lambda s: scipy.io.wavfile.write(s, 8000, codes.astype("f4")))
    yield "a.npy", _in_memory(lambda stream: np.save(stream, np.stack([T, X])))
    yield "a.npz", _in_memory(lambda stream: np.savez_compressed(stream, x=X, fs=RATE))
    yield "one.zip", _zip()
    for name, make in (
        ("a.xlsx", _xlsx), ("a.tdms", _tdms), ("a.mf4", _mdf), ("a.parquet", _parquet),
        ("a.uff", _uff),
    ):  # fmt: skip
        try:
            yield name, make()
        except ImportError:
            continue


def real() -> Iterator[tuple[str, bytes]]:
    """Measured files, where they lie beside the repository; the beginning of long text files."""
    for path in sorted(REAL.rglob("*.*")) if REAL.is_dir() else ():
        if path.suffix.lower() in (".csv", ".lvm", ".tdms", ".uff") and path.name != "records.csv":
            raw = path.read_bytes()
            if len(raw) <= _LARGEST or path.suffix.lower() in (".csv", ".lvm"):
                text = path.suffix.lower() != ".tdms" and path.suffix.lower() != ".uff"
                yield f"real_{path.name.replace(' ', '_')}", raw[: _BEGINNING if text else _LARGEST]


@cache
def files(kind: str) -> dict[str, bytes]:
    """Seeds by name: ``text`` or ``binary`` instrument files."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = {**dict(texts() if kind == "text" else binaries()), **dict(real())}
    is_text = (".csv", ".txt", ".lvm")
    return {name: raw for name, raw in found.items() if name.endswith(is_text) == (kind == "text")}
