"""Records on disk: channels on a uniform time axis, as netCDF. The only place that knows netCDF.

A netCDF-4 file is an HDF5 file with dimension scales, and h5py writes those directly: importing
it takes 0.03 s where xarray takes 0.3 s, which counts in a step that runs once a record.
`open_dataset` gives the same file to xarray for whoever wants labels.

Samples are stored as float32. Instruments convert with 8 to 16 bits (24 at best, of which the
last four are noise), and float32 keeps 24: its rounding, 6e-8 of the value, is below every
sensor here. They come back as float64, in which everything is computed. Times are float64.

Samples are not compressed: a third off the disk would cost twice the ingest (docs/decisions.md).

Each file says where it comes from, when, by what; names follow the CF conventions
(cfconventions.org) where these have one: ``Conventions``, ``title``, ``source``, ``long_name``.
Everything follows from the campaign and its files alone: the same input gives the same file, on any
day and any machine.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray
from vinesexp.codedigest import version_of
from vinesexp.errors import RecordError
from vinesexp.records.campaign.schema import SI_UNITS, Campaign, Record
from vinesexp.records.readers.source import file_of
from vinesexp.whole_files import digest_of_file, whole_file

if TYPE_CHECKING:
    import xarray

CONVENTIONS = "CF-1.11"

#: Attribute: roles of the channels of each file that a record was joined from, `a,b;c`.
RECORDERS = "recorders"

#: Attribute: the record was cut to where its base begins to move.
FROM_REST = "base_from_rest"

#: Attributes of a record that its conditioned file has too.
CARRIED = (
    FROM_REST,
    *("title", "record", "test", "source", "source_sha256", "source_format", "setup", "note"),
    *("clearance_m", "base_amplitude_m", "frequency_hz", "added_mass_kg", "release_m"),
    "vinesexp_version",
)


def long_name(role: str, quantity: str, state: str = "") -> str:
    """What a channel is, in words.

    Examples
    --------
    >>> long_name("base", "acceleration"), long_name("displacement", "displacement", "bandpassed")
    ('acceleration of the base', 'bandpassed displacement of the oscillator')
    """
    of = "base" if role == "base" else "oscillator"
    return f"{state} {quantity} of the {of}".strip()


def record_attributes(campaign: Campaign, record: Record) -> dict[str, Any]:
    """About a record, from the campaign; paths relative, so that folders can move."""
    return {
        "title": f"record {record.id} of a {record.test} test",
        "record": record.id,
        "test": record.test,
        "source": ";".join(campaign.inside(path) for path in record.files),
        "clearance_m": list(record.clearance) or None,
        "base_amplitude_m": record.base_amplitude,
        "frequency_hz": list(record.frequency) if record.frequency else None,
        "added_mass_kg": record.added_mass,
        "release_m": record.release,
        "note": record.note or None,
        "setup": record.setup or None,
        "vinesexp_version": version_of("vinesexp"),
        # Who measured it when with what, as far as campaign.yaml or records.csv say it.
        **{f"people_{key}": text for key, text in record.people.items()},
        "date": record.people.get("date"),
        "instrument": record.people.get("instrument"),
    }


def source_digest(record: Record) -> str:
    """SHA-256 of each instrument file of a record, separated by semicolons."""
    return ";".join(digest_of_file(file_of(path)) for path in record.files)


def carried(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """What a conditioned file says of the record that it was made from."""
    return {
        name: value
        for name, value in attributes.items()
        if name in (*CARRIED, "date", "instrument") or name.startswith("people_")
    }


def write_attributes(file: Any, attributes: Mapping[str, Any]) -> None:
    """Attributes of an open HDF5 file; None values are left out."""
    for name, value in attributes.items():
        if value is not None:
            # netCDF has no booleans.
            file.attrs[name] = np.int8(value) if isinstance(value, bool) else value


def write_refused(path: Path, reason: str, attributes: Mapping[str, Any] | None = None) -> None:
    """Write the placeholder of a record that cannot be used, so that the workflow goes on."""
    import h5py

    with whole_file(Path(path)) as growing, h5py.File(growing, "w", track_order=True) as file:
        stated = {"Conventions": CONVENTIONS, **(attributes or {}), "refused": reason}
        write_attributes(file, stated)


_MEASURED = "as_measured"  # group: samples at their true times, where these are uneven
_CHUNK = 65536  # samples: 256 kB of one channel, small enough to read a few cycles cheaply
_AT_ONCE = 1 << 20  # samples made or converted at once: 8 MB

# Displacement from a sensor of velocity, such as a laser Doppler vibrometer: its integral.
#
# The zero of such a sensor is not known to the precision that an integral asks for, so the mean
# velocity is left out: motion in the band of the oscillator is right, slow drift and the place
# about which it moves are not measured. Weights of this mean vanish at its ends: the plain mean is
# also how far the mass went from first to last, and turned a release into a drift of the middle.
_POINTS = 6
_POWERS = np.arange(_POINTS)[:, np.newaxis]
#: Integrals between neighbours of six samples as sums of them: exact for fifth-order polynomials.
_WEIGHTS = np.array([
    np.linalg.solve(
        np.arange(float(_POINTS)) ** _POWERS,
        ((j + 1.0) ** (_POWERS[:, 0] + 1) - float(j) ** (_POWERS[:, 0] + 1)) / (_POWERS[:, 0] + 1),
    )
    for j in range(_POINTS - 1)
])  # fmt: skip
#: Samples that an interval needs before and behind its own two.
REACH = 2


def integrated(velocity: FloatArray, step: float) -> FloatArray:
    """Displacement, 0 at the first sample; NaN where the velocity is, bridged by a straight line.

    Parameters
    ----------
    velocity : array (n,)
        m/s, `step` s apart. Of a motion of ten samples a period the integral is right to 2e-4.

    Examples
    --------
    >>> t = np.arange(200) / 100.0
    >>> x = integrated(np.cos(20.0 * t), 0.01)
    >>> bool(np.abs(x - np.sin(20.0 * t) / 20.0).max() < 2e-8)
    True
    """
    known = np.isfinite(velocity)
    index = np.arange(velocity.size)
    bridged = velocity if known.all() else np.interp(index, index[known], velocity[known])
    out = np.concatenate([[0.0], np.cumsum(increments(bridged))])[: velocity.size] * step
    out[~known] = np.nan
    return np.asarray(out, dtype=np.float64)


def zero_of(velocity: Any, *, released: bool = False) -> float:
    """What a sensor of velocity shows at rest, m/s; an array, or a dataset on disk read by blocks.

    The mean with weights sin^4: an oscillation of some cycles, or one that decays, adds nothing to
    it wherever it begins and ends. Of a mass that was `released` from where it is first fast on,
    so that none of its way to rest counts. NaN, and bursts of the sensor, count for nothing.

    Examples
    --------
    >>> v = 0.002 + 0.5 * np.cos(np.arange(1000) / 10.0)
    >>> round(zero_of(v), 4), round(float(v.mean()), 4)
    (0.002, -0.0005)
    """
    n = len(velocity)
    begins = range(0, n, _AT_ONCE)
    speeds = (np.abs(velocity[k : k + _AT_ONCE]) for k in begins)
    usual = max((float(np.nanquantile(v, 0.99)) for v in speeds if np.isfinite(v).any()), default=0)
    first: int | None = None if released else 0
    total = weights = 0.0
    for begin in begins:
        part = np.asarray(velocity[begin : begin + _AT_ONCE], dtype=np.float64)
        counts = np.abs(part) <= 2.0 * usual  # NaN does not
        if first is None:
            fast = np.flatnonzero(counts & (np.abs(part) >= 0.5 * usual))
            if not fast.size:
                continue
            first = begin + int(fast[0])
        index = np.arange(begin, begin + part.size) + 0.5 - first
        weight = np.where(counts & (index > 0), np.sin(np.pi * index / (n - first)) ** 4, 0.0)
        total += float(weight[counts] @ part[counts])
        weights += float(weight.sum())
    return total / weights if weights else 0.0


def increments(velocity: FloatArray) -> FloatArray:
    """Integrals from each sample to the next, in steps; array (n - 1,)."""
    n = velocity.size
    if n < _POINTS:
        return np.asarray(0.5 * (velocity[1:] + velocity[:-1]))
    middle = np.convolve(velocity, _WEIGHTS[REACH][::-1], mode="valid")
    first, last = _WEIGHTS[:REACH] @ velocity[:_POINTS], _WEIGHTS[REACH + 1 :] @ velocity[-_POINTS:]
    return np.concatenate([first, middle, last])


@dataclass
class RecordWriter:
    """Writes one record by blocks; the file appears under its name only when complete.

    `sample_rate` and `start` may be set until the writer closes, for a source whose true sampling
    is known only after its last row.

    Parameters
    ----------
    path : Path
        Where it goes; folders are made.
    sample_rate, start : float
        Hz; time of the first sample, s.
    quantities : mapping
        Role of each channel to what it measures (``displacement``, ``acceleration``).
    attributes : mapping, optional
        About the record: text, numbers, or sequences of numbers; None values are left out.
    state : str
        What was done to the samples, in a word, such as ``bandpassed``.

    Examples
    --------
    >>> import tempfile; folder = Path(tempfile.mkdtemp())
    >>> with RecordWriter(folder / "a.nc", sample_rate=10.0, quantities={"base": "displacement"},
    ...                   attributes={"test": "ringdown"}) as writer:
    ...     writer.append({"base": np.array([0.0, 0.5, 1.0])})
    >>> with open_record(folder / "a.nc") as record:
    ...     record.roles, record.n, record.read("base", 1), record.time(1)
    (('base',), 3, array([0.5, 1. ]), array([0.1, 0.2]))
    """

    path: Path
    _: KW_ONLY
    sample_rate: float
    start: float = 0.0
    quantities: Mapping[str, str]
    attributes: Mapping[str, Any] = field(default_factory=dict)
    state: str = ""
    n: int = field(default=0, init=False)
    _data: dict[str, Any] = field(default_factory=dict, init=False)
    _open: ExitStack = field(default_factory=ExitStack, init=False)
    _file: Any = field(default=None, init=False)

    def append(self, block: Mapping[str, FloatArray]) -> None:
        """Add one block: for every role, the same number of further samples (SI)."""
        lengths = {np.shape(values) for values in block.values()}
        if set(block) != set(self.quantities) or len(lengths) != 1 or len(min(lengths)) != 1:
            raise ValueError(
                f"expected 1-D blocks of equal length for {sorted(self.quantities)}, "
                f"found { {role: np.shape(values) for role, values in block.items()} }"
            )
        for role, values in block.items():
            if role not in self._data:
                data = _dataset(self._file, role, np.float32, chunk=len(values))
                _say_quantity(data, role, self.quantities[role], self.state)
                self._data[role] = data
            _extend(self._data[role], _rounded(values))
        self.n += min(lengths)[0]

    def append_measured(self, times: FloatArray, block: Mapping[str, FloatArray]) -> None:
        """Add samples as they were measured, with their true times (s), where these are uneven."""
        group = self._file.require_group(_MEASURED)
        for name, values in {"time": times, **block}.items():
            if name not in group:
                _dataset(group, name, np.float64 if name == "time" else np.float32)
            _extend(group[name], values if name == "time" else _rounded(values))

    def __enter__(self) -> RecordWriter:
        import h5py

        growing = self._open.enter_context(whole_file(self.path))
        # netCDF readers want the order in which things were made.
        self._file = self._open.enter_context(h5py.File(growing, "w", track_order=True))
        write_attributes(self._file, {"Conventions": CONVENTIONS, **self.attributes})
        return self

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if error is None:
            with self._open:
                self._write_time()
                self._file.attrs["sample_rate_hz"] = float(self.sample_rate)
                self._file.attrs["start_s"] = float(self.start)
        self._open.__exit__(kind, error, trace)

    def _write_time(self) -> None:
        # a ramp shrinks to a sixth
        packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
        time = _dataset(self._file, "time", np.float64, size=self.n, chunk=self.n, **packed)
        for begin in range(0, self.n, _AT_ONCE):
            end = min(begin + _AT_ONCE, self.n)
            time[begin:end] = uniform_times(self.sample_rate, self.start, begin, end)
        time.attrs["units"] = "s"
        time.attrs["long_name"] = "time from the instrument's zero"
        time.attrs["axis"] = "T"
        time.make_scale("time")
        for data in self._data.values():
            data.dims[0].attach_scale(time)


def _dataset(
    place: Any, name: str, kind: type, *, size: int = 0, chunk: int = _CHUNK, **packed: Any
) -> Any:
    """A new array that can grow, in pieces of at most 65536 samples."""
    chunks = (min(_CHUNK, max(chunk, 1)),)
    return place.create_dataset(name, (size,), kind, maxshape=(None,), chunks=chunks, **packed)


def _say_quantity(data: Any, role: str, quantity: str, state: str) -> None:
    """Have a channel say what it measures, and what was done to it."""
    data.attrs["units"], data.attrs["quantity"] = SI_UNITS[quantity], quantity
    data.attrs["long_name"] = long_name(role, quantity, state)


def _extend(data: Any, values: NDArray[np.floating[Any]]) -> None:
    begin = len(data)
    data.resize((begin + len(values),))
    data[begin:] = values


def _rounded(values: FloatArray) -> NDArray[np.float32]:
    """Samples as they are stored; HDF5 would round alike, in as much time as it writes them."""
    with np.errstate(over="ignore"):  # beyond the range is infinite, as HDF5 has it
        return values.astype(np.float32)


def _unreadable(path: Path, error: Exception) -> RecordError:
    return RecordError(f"cannot be read as a record ({error}); remove it and run again", file=path)


class _Attributes(Mapping[str, Any]):
    """Attributes of an open record, read when asked for: to read all was half of an opening."""

    def __init__(self, path: Path, stored: Any) -> None:
        self._path, self._stored = path, stored
        self._read: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        try:
            if name not in self._read and name in self._stored:
                one = self._stored[name]
                self._read[name] = one.item() if isinstance(one, np.generic) else one
        except (OSError, KeyError, RuntimeError) as error:
            raise _unreadable(self._path, error) from None
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._stored)

    def __len__(self) -> int:
        return len(self._stored)


class RecordView:
    """A record on disk, read by slices. Made by `open_record`, whose `with` closes it.

    Attributes
    ----------
    roles : tuple of str
        Channels it has.
    sample_rate, start : float
        Hz; time of the first sample, s.
    n : int
        Samples.
    attributes : mapping
        What was stored about the record; they are read while it is open.
    refused : str or None
        Why the record cannot be used; such a record has no channels.
    oscillation : float or None
        Of a conditioned record, Hz; None where nothing oscillates.
    """

    def __init__(self, path: Path) -> None:
        import h5py

        self.path = Path(path)
        try:
            # a record is written elsewhere and moved here whole: no lock, which network disks lack
            self._file: Any = h5py.File(self.path, "r", locking=False)
            held = dict(self._file)
        except (OSError, KeyError, RuntimeError) as error:
            raise _unreadable(self.path, error) from None
        self.attributes: Mapping[str, Any] = _Attributes(self.path, self._file.attrs)
        self.refused: str | None = self.attributes.get("refused")
        self.oscillation: float | None = self.attributes.get("oscillation_hz")
        self.sample_rate = float(self.attributes.get("sample_rate_hz", np.nan))
        self.start = float(self.attributes.get("start_s", 0.0))
        self.n = len(held.pop("time", ()))
        self._measured = held.pop(_MEASURED, {})
        self._channels: dict[str, Any] = held
        self.roles = tuple(held)

    def read(self, role: str, start: int = 0, stop: int | None = None) -> FloatArray:
        """Samples [start, stop) of one channel, SI, float64.

        Raises
        ------
        RecordError
            The record was refused, or has no such channel.
        """
        if self.refused is not None:
            raise RecordError(f"cannot be used: {self.refused}", file=self.path)
        if role not in self.roles:
            raise RecordError(
                f"has no channel '{role}', only {', '.join(self.roles)}", file=self.path
            )
        begin, end, _ = slice(start, stop).indices(self.n)
        raw: NDArray[np.float32] = self._channels[role][begin : max(end, begin)]
        return raw.astype(np.float64)  # numpy converts, not HDF5

    def blocks(
        self, role: str, begin: int = 0, end: int | None = None, *,
        size: int = _AT_ONCE, before: int = 0, more: int = 0,
    ) -> Iterator[tuple[int, FloatArray]]:  # fmt: skip
        """Samples [begin, end) of one channel, `size` at once, with the number of the first.

        Each with some of its neighbours: `before` it, and `more` behind it.
        """
        stop = self.n if end is None else end
        for first in range(begin, stop, size):
            low = max(first - before, 0)
            yield low, self.read(role, low, min(first + size, stop) + more)

    def time(self, start: int = 0, stop: int | None = None) -> FloatArray:
        """Times of samples [start, stop), s: computed, so no file is read."""
        begin, end, _ = slice(start, stop).indices(self.n)
        return uniform_times(self.sample_rate, self.start, begin, end)

    def moment(self, sample: int) -> str:
        """Time of a sample in words, to the sample also where clocks count from 1970: ``2.5 s``."""
        digits = max(math.ceil(math.log10(self.sample_rate)), 0)
        seconds = f"{float(self.time(sample, sample + 1)[0]):.{digits}f}"
        return f"{seconds.rstrip('0').rstrip('.') if '.' in seconds else seconds} s"

    def as_measured(self, role: str) -> tuple[FloatArray, FloatArray] | None:
        """True times (s) of a channel and its samples at them; None where the clock is even.

        `read` gives such a channel interpolated onto an even clock, for all that needs one.
        """
        if role not in self._measured:
            return None
        t, x = (self._measured[name][()].astype(np.float64) for name in ("time", role))
        known = np.isfinite(x)
        return t[known], x[known]

    def quantity(self, role: str) -> str:
        """What the channel measures: ``displacement``, ``acceleration``."""
        return str(self._channels[role].attrs["quantity"])

    def __enter__(self) -> RecordView:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


def uniform_times(sample_rate: float, start: float, begin: int, end: int) -> FloatArray:
    """Times of samples [begin, end), s: start + i/sample_rate, each rounded once.

    Examples
    --------
    >>> uniform_times(10.0, 5.0, 0, 3)
    array([5. , 5.1, 5.2])
    """
    return np.arange(begin, end, dtype=np.float64) / sample_rate + start


def leave_out(
    path: Path, role: str, stretches: Sequence[tuple[int, int]], *,
    paused: Sequence[tuple[int, int]] = (),
) -> None:  # fmt: skip
    """Make gaps of stretches of one channel of a record on disk: their samples become NaN.

    Those over which the logger `paused` hold none at true times.
    """
    import h5py

    with h5py.File(path, "r+") as file:
        for first, end in stretches:
            file[role][first:end] = np.nan
        if _MEASURED in file and role in file[_MEASURED]:
            place = (file[_MEASURED]["time"][()] - file.attrs["start_s"]) * file.attrs[
                "sample_rate_hz"
            ]
            for first, end in set(stretches) - set(paused):
                file[_MEASURED][role][(place > first - 0.5) & (place < end - 0.5)] = np.nan


def integrate(path: Path, role: str, *, released: bool = False) -> None:
    """Make the displacement of a velocity, in a record on disk; NaN stays where it was.

    The velocity that the sensor shows at rest is left out (see `zero_of`).
    """
    import h5py

    with h5py.File(path, "r+") as file:
        data, step = file[role], 1.0 / float(file.attrs["sample_rate_hz"])
        n = len(data)
        parts = [(begin, min(begin + _AT_ONCE, n)) for begin in range(0, n, _AT_ONCE)]
        zero, place = zero_of(data, released=released), 0.0
        before = np.empty(0)  # the last samples of the block before, which are written over
        for begin, end in parts:
            more = data[begin : min(end + REACH, n)].astype(np.float64) - zero
            both = np.concatenate([before, more])
            x = integrated(both, step)
            seen = np.flatnonzero(np.isfinite(x))
            if not seen.size:
                continue
            last = seen[seen < before.size]
            x += place - x[last[-1] if last.size else seen[0]]
            done = before.size + end - begin
            data[begin:end] = x[before.size : done]
            known_at = np.flatnonzero(np.isfinite(both[:done]))
            if known_at.size:  # a gap at the end is bridged with what follows
                place = float(x[known_at[-1]])
                before = both[max(int(known_at[-1]) - 2 * REACH, 0) : done]
        if _MEASURED in file:
            del file[_MEASURED][role]  # the integral needs an even clock
        _say_quantity(data, role, "displacement", "integrated")


def open_record(path: Path) -> RecordView:
    """Open a record for reading by slices; RecordError where it is no record."""
    return RecordView(path)


def open_dataset(path: Path) -> xarray.Dataset:
    """The record as a lazy `xarray.Dataset`, for interactive work; RecordError where it is none."""
    import xarray

    try:
        return xarray.open_dataset(path, engine="h5netcdf")
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise _unreadable(path, error) from None
