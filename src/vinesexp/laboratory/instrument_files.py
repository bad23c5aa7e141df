"""Export formats of the simulated oscilloscope: one writer a format.

Every writer is exact about its bytes: no date, no library's version, so that the same scene and
seed give the same file. Records are written in blocks.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import IntArray
from vinesexp.errors import ParameterError
from vinesexp.laboratory.oscilloscope import Capture

_BLOCK = 1 << 16


@dataclass(frozen=True)
class TextStyle:
    """How one make of instrument writes text.

    Parameters
    ----------
    delimiter, decimal : str
    encoding : str
        ``utf-8-sig`` writes a byte-order mark.
    preamble : tuple of str
        Lines before the column names; ``{interval}`` and ``{points}`` are filled in.
    time_name, channel_name : str
        Names of the columns; ``{name}`` is the channel.
    units : bool
        A row of units under the names.
    newline : str
    """

    delimiter: str = ","
    decimal: str = "."
    encoding: str = "ascii"
    preamble: tuple[str, ...] = ()
    time_name: str = "Time"
    channel_name: str = "{name}"
    units: bool = False
    newline: str = "\r\n"


TEXT_STYLES = {
    "oscilloscope-csv": TextStyle(
        preamble=(
            "Model,Digital Oscilloscope",
            "Record Length,{points}",
            "Sample Interval,{interval},s",
            "",
        ),
        units=True,
    ),
    "daq-csv": TextStyle(
        delimiter=";",
        decimal=",",
        encoding="utf-8-sig",
        time_name="Time (s)",
        channel_name="{name} (V)",
    ),
    "tab": TextStyle(
        delimiter="\t",
        encoding="latin-1",
        preamble=("# Messstelle: Stoßtilger, 20 °C",),
        time_name="Time [s]",
        channel_name="{name} [V]",
        newline="\n",
    ),
}


def write_text(path: Path, trace: Capture, style: TextStyle) -> None:
    """Times and volts as text, with one digit more than the converter resolves."""
    interval = 1.0 / trace.scope.sample_rate
    decimals = _decimals_of(interval)
    volts = [v.replace(".", style.decimal) for v in _volts(trace.scope.bits, trace.scope.step)]
    lowest = -(2 ** (trace.scope.bits - 1))
    with path.open("w", encoding=style.encoding, newline=style.newline) as out:
        out.write(_text_head(trace, style, interval))
        for ticks, codes in _blocks(trace):
            times = np.rint(ticks * (interval * 10.0**decimals)) / 10.0**decimals
            columns = [[f"{t:.{decimals}f}".replace(".", style.decimal) for t in times.tolist()]]
            columns += [[volts[code - lowest] for code in row.tolist()] for row in codes]
            rows = zip(*columns, strict=True)
            out.writelines(f"{style.delimiter.join(row)}\n" for row in rows)


def _volts(bits: int, step: float) -> list[str]:
    """Volts of every converter code, from the lowest, with one digit more than a step shows.

    Examples
    --------
    >>> _volts(2, 0.5)
    ['-1.00', '-0.50', '0.00', '0.50']
    """
    half = 2 ** (bits - 1)
    decimals = max(1, int(np.ceil(-np.log10(step))) + 1)
    volts = np.rint(np.arange(-half, half) * step * 10.0**decimals) / 10.0**decimals
    return [f"{v:z.{decimals}f}" for v in volts.tolist()]


def _text_head(trace: Capture, style: TextStyle, interval: float) -> str:
    number = f"{interval:.9g}".replace(".", style.decimal)
    lines = [line.format(interval=number, points=trace.codes.shape[1]) for line in style.preamble]
    channels = [style.channel_name.format(name=name) for name in trace.names]
    lines.append(style.delimiter.join([style.time_name, *channels]))
    if style.units:
        lines.append(style.delimiter.join(["s", *("V" for _ in channels)]))
    return "".join(f"{line}\n" for line in lines)


def write_hdf5(path: Path, trace: Capture) -> None:
    """Codes of each channel as int16, with `scale` (V a code) and `offset`; rate on the root."""
    import h5py

    with h5py.File(path, "w", libver="earliest", track_order=True) as file:
        file.attrs["sample_rate_hz"] = trace.scope.sample_rate
        for name, row in zip(trace.names, trace.codes, strict=True):
            data = file.create_dataset(name, data=row, track_times=False)
            data.attrs["scale"] = trace.scope.step
            data.attrs["offset"] = 0.0
            data.attrs["unit"] = "V"


def write_matlab(path: Path, trace: Capture) -> None:
    """MATLAB level 5: a column of volts (single) for each channel, and `sample_rate_hz`."""
    from scipy.io import savemat

    step = np.float32(trace.scope.step)
    channels = {name: codes * step for name, codes in zip(trace.names, trace.codes, strict=True)}
    held = {"sample_rate_hz": trace.scope.sample_rate, **channels}
    savemat(path, held, appendmat=False, oned_as="column")
    with path.open("r+b") as out:  # in place of the date of writing: equal records, equal files
        out.write(b"MATLAB 5.0 MAT-file, Digital Oscilloscope".ljust(116))


def write_wav(path: Path, trace: Capture) -> None:
    """RIFF WAVE, 16-bit PCM: codes as fraction of full scale; channel names in an iXML chunk."""
    rate = trace.scope.sample_rate
    if rate != int(rate):
        raise ParameterError(f"a WAV file has a whole number of samples a second, found {rate} Hz")
    channels, n = trace.codes.shape
    tracks = "".join(
        f"<TRACK><CHANNEL_INDEX>{i}</CHANNEL_INDEX><NAME>{name}</NAME></TRACK>"
        for i, name in enumerate(trace.names, start=1)
    )
    ixml = (
        '<?xml version="1.0" encoding="UTF-8"?><BWFXML><TRACK_LIST>'
        f"<TRACK_COUNT>{channels}</TRACK_COUNT>{tracks}</TRACK_LIST></BWFXML>"
    ).encode()
    ixml += b" " * (len(ixml) % 2)
    fmt = struct.pack("<HHIIHH", 1, channels, int(rate), int(rate) * 2 * channels, 2 * channels, 16)
    size = 2 * channels * n
    with path.open("wb") as out:
        whole = 4 + 8 + len(fmt) + 8 + len(ixml) + 8 + size
        out.write(struct.pack("<4sI4s4sI", b"RIFF", whole, b"WAVE", b"fmt ", len(fmt)) + fmt)
        out.write(struct.pack("<4sI", b"iXML", len(ixml)) + ixml)
        out.write(struct.pack("<4sI", b"data", size))
        for _, codes in _blocks(trace):
            shifted = codes.T << (16 - trace.scope.bits)
            out.write(np.ascontiguousarray(shifted, dtype="<i2").tobytes())


def _blocks(trace: Capture) -> Iterator[tuple[IntArray, NDArray[np.int16]]]:
    """Numbers of the samples and their codes, so many at a time."""
    n = trace.codes.shape[1]
    for first in range(0, n, _BLOCK):
        end = min(first + _BLOCK, n)
        ticks = np.arange(first, end) if trace.ticks is None else trace.ticks[first:end]
        yield ticks, trace.codes[:, first:end]


def _decimals_of(interval: float) -> int:
    """Decimals that write every multiple of `interval` exactly, at most 9.

    Examples
    --------
    >>> _decimals_of(1e-4), _decimals_of(1 / 3000)
    (4, 9)
    """
    for decimals in range(1, 9):
        scaled = interval * 10**decimals
        if round(scaled) and abs(scaled - round(scaled)) < 1e-9 * scaled:
            return decimals
    return 9


#: Format name -> (file suffix, writer).
FORMATS: dict[str, tuple[str, Callable[[Path, Capture], None]]] = {
    **{name: (".csv", partial(write_text, style=style)) for name, style in TEXT_STYLES.items()},
    "tab": (".txt", partial(write_text, style=TEXT_STYLES["tab"])),
    "hdf5": (".h5", write_hdf5),
    "matlab": (".mat", write_matlab),
    "wav": (".wav", write_wav),
}
