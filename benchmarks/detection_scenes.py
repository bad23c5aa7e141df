"""Acceleration records of the virtual rig with known impacts, and the limit of timing them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp import NES, Harmonic, Motion, Oscillator, Release, Rig, simulate
from vinesexp.laboratory.oscilloscope import Oscilloscope, acquire
from vinesexp.laboratory.sensors import Accelerometer, contact_acceleration, low_passed

FloatArray = NDArray[np.float64]

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
BASE = Harmonic(amplitude=0.25e-3, frequency=7.862)
PULSE = 4e-4  # s, of a contact
NOMINAL = 0.3  # m/s^2 rms in a sample at 10 kHz
START = 10.0  # s: the rig has run so long when the record begins
FINER = 8  # samples a sample, where the sensor's bandwidth is simulated


@dataclass(frozen=True)
class Scene:
    """One record: what the rig does and how it is measured.

    Attributes
    ----------
    group, name : str
        Section of the page and row in it.
    clearance : tuple of float
        One for each NES, m.
    release : float or None
        m: a transient instead of the driven base.
    rate, seconds : float
        Hz, s.
    snr : float or None
        Median pulse over the noise of a sample (highest sample of a contact centred on it); None:
        the noise density of `NOMINAL`.
    ring, ring_damping, limit, bandwidth : resonance (Hz), clipping as a share of the median pulse,
        corner of a first-order low-pass (Hz).
    """

    group: str
    name: str
    clearance: tuple[float, ...] = (0.030,)
    release: float | None = None
    rate: float = 1e4
    seconds: float = 40.0
    snr: float | None = None
    ring: float | None = None
    ring_damping: float = 0.02
    limit: float | None = None
    bandwidth: float | None = None
    seed: int = 1

    @property
    def lag(self) -> float:
        """By which the sensor itself is late: its pulse's centre of momentum beside the truth's."""
        return 0.5 / (np.pi * self.bandwidth) if self.bandwidth else 0.0


@dataclass(frozen=True)
class Record:
    """What the oscilloscope holds, and the truth: times from the first sample, jumps in m/s."""

    scene: Scene
    a: FloatArray
    clipped: NDArray[np.bool_]
    noise: float  # of a sample, m/s^2
    time: FloatArray
    jump: FloatArray


def record_of(scene: Scene) -> Record:
    """Simulate and measure a scene."""
    motion = _motion(scene.clearance, scene.release, scene.seconds)
    start = 0.5 if scene.release else START
    time, jump = (
        np.asarray(motion.impacts["time"]) - start,
        motion.impacts["v_after"] - motion.impacts["v_before"],
    )
    inside = (time > 0.0) & (time < scene.seconds)
    time, jump = time[inside], jump[inside]
    typical = float(np.median(np.abs(jump[jump != 0.0])))
    top = typical * _highest(scene.rate)
    noise = NOMINAL * np.sqrt(scene.rate / 1e4) if scene.snr is None else top / scene.snr
    a = _acquired(scene, motion, start, noise)
    limit = np.inf if scene.limit is None else scene.limit * typical * np.pi / (2.0 * PULSE)
    clipped = np.abs(a) >= limit
    return Record(scene, np.clip(a, -limit, limit), clipped, noise, time, jump)


@cache
def _motion(clearance: tuple[float, ...], release: float | None, seconds: float) -> Motion:
    rig = Rig(TABLE_2, [NES(m=0.032, b=b, r=0.6) for b in clearance])
    x0 = release or 0.0
    y0 = [x0 + (-1.0) ** (i + 1) * 0.999 * b for i, b in enumerate(clearance)]
    base = None if release else BASE
    return simulate(rig, base, Release(x0=x0, y0=y0), duration=START + seconds)


def _highest(rate: float) -> float:
    """Largest sample of a contact of unit jump centred on it."""
    return float(_contact(np.array([0.0]), rate).max())


def _contact(shift: FloatArray, rate: float, scene: Scene | None = None) -> FloatArray:
    """Samples of contacts of unit jump at `shift` s from sample 0; one row a contact."""
    reach = round(max(4.0 * PULSE, 4e-3 if scene and scene.ring else 0.0) * rate) + 4
    options = {"ring": scene.ring, "ring_damping": scene.ring_damping} if scene else {"ring": None}
    rows = [
        contact_acceleration(
            np.array([one]), np.array([1.0]), duration=PULSE,
            **({"ring_damping": 0.02} | options),
            start=-reach / rate, dt=1.0 / rate, n=2 * reach + 1,
        )
        for one in shift
    ]  # fmt: skip
    return np.array(rows)


def _acquired(scene: Scene, motion: Motion, start: float, noise: float) -> FloatArray:
    """Samples in m/s^2: 16 bits over +-1000 m/s^2; with a bandwidth, made finer and averaged."""
    full = 1000.0
    finer = FINER if scene.bandwidth else 1
    sensor = Accelerometer(
        sensitivity=1.0 / full, pulse=PULSE, noise=0.0 if scene.bandwidth else noise,
        ring=scene.ring, ring_damping=scene.ring_damping,
    )  # fmt: skip
    scope = Oscilloscope(finer * scene.rate, bits=16)
    first = start - 0.5 * (finer - 1) / scope.sample_rate
    trace = acquire(
        motion, {"acceleration": sensor}, scope, start=first, duration=scene.seconds,
        seed=scene.seed, record=scene.name,
    )  # fmt: skip
    a = trace.codes[0] * (scope.step * full)
    if scene.bandwidth:
        t = np.arange(a.size) / scope.sample_rate

        def shown(at: FloatArray) -> FloatArray:
            return np.asarray(np.interp(at, t, a))

        a = low_passed(shown, t, dt=1.0 / scope.sample_rate, bandwidth=scene.bandwidth)
        a = a.reshape(-1, finer).mean(axis=1)
        a = a + noise * np.random.default_rng(scene.seed).standard_normal(a.size)
    return a


def timing_limit(scene: Scene, noise: float, *, free_duration: bool = False) -> float:
    """Cramer-Rao limit of the time of a contact of jump 1 m/s, s; divide by the jump.

    Known: white noise, the form of the contact (half sine of known duration, resonance, sampling).
    Unknown for each impact: time, height and an offset of the samples around it; with
    `free_duration` the duration too. sigma_t^2 = sigma^2/(s'.P s'), P projecting off the
    unknowns; the mean of sigma_t^2 over all places of the contact between two samples. NaN where
    the contact may fall within one sample, whose value then says nothing of the time.
    """
    if PULSE * scene.rate < 2.0:
        return float("nan")
    shift = (np.arange(20) + 0.5) / 20.0 / scene.rate
    step = 1e-3 / scene.rate
    value = _through(scene, _contact(shift, scene.rate, scene))
    slope = _through(
        scene,
        (_contact(shift + step, scene.rate, scene) - _contact(shift - step, scene.rate, scene))
        / (2.0 * step),
    )
    variances = []
    for v, s in zip(value, slope, strict=True):
        others = [v, np.ones_like(v)]
        if free_duration:
            others.append((np.arange(v.size) - v.size // 2) * s)
        if scene.limit is not None:  # clipped samples say nothing
            seen = np.abs(v) < scene.limit * np.pi / (2.0 * PULSE)
            s, others = s[seen], [other[seen] for other in others]
        q, _ = np.linalg.qr(np.stack(others, axis=1))
        own = s - q @ (q.T @ s)
        if float(own @ own) < 1e-6 * float(s @ s):
            return float("nan")
        variances.append(noise**2 / float(own @ own))
    return float(np.sqrt(np.mean(variances)))


def visibility(scene: Scene, noise: float, time: FloatArray) -> FloatArray:
    """Standard deviations by which a contact of jump 1 m/s at each time stands out.

    After the filter matched to it, wherever it falls between two samples.
    """
    steps = 20
    shift = (np.arange(steps) + 0.5) / steps / scene.rate
    rows = _through(scene, _contact(shift, scene.rate, scene))
    at = np.minimum((np.mod(time * scene.rate, 1.0) * steps).astype(np.int64), steps - 1)
    return np.asarray(np.sqrt((rows**2).sum(axis=1))[at] / noise)


def _through(scene: Scene, rows: FloatArray) -> FloatArray:
    """The sensor's low-pass, sample by sample: enough for a limit."""
    if not scene.bandwidth:
        return rows
    from scipy import signal

    a = np.exp(-2.0 * np.pi * scene.bandwidth / scene.rate)
    return np.asarray(signal.lfilter([1.0 - a], [1.0, -a], rows, axis=1))


def scenes(*, quick: bool = False) -> list[Scene]:
    """All scenes of the benchmark; `quick`: a few short ones."""
    if quick:
        return list(_quick())
    return [*_noises(), *_rates(), *_sensors(), *_rigs()]


def _quick() -> Iterable[Scene]:
    for snr in (7.0, 20.0, 200.0):
        yield Scene("signal to noise", f"S/N {snr:g}", snr=snr, seconds=6.0)
    yield Scene("sample rate", "2 kHz", rate=2e3, seconds=6.0)
    yield Scene("sensor", "rings at 3 kHz", ring=3e3, seconds=6.0)
    yield Scene("rig", "two NESs", clearance=(0.023, 0.034), seconds=6.0)


def _noises() -> Iterable[Scene]:
    for snr in (3.0, 5.0, 6.0, 7.0, 8.0, 10.0, 20.0, 50.0, 200.0):
        yield Scene("signal to noise", f"S/N {snr:g}", snr=snr, seconds=60.0)


def _rates() -> Iterable[Scene]:
    for rate in (1e3, 2e3, 5e3, 1e4, 5e4, 2e5):
        seconds = 60.0 if rate < 2e4 else 20.0
        name = f"{rate / 1e3:g} kHz"
        yield Scene("sample rate", name, rate=rate, seconds=seconds)
    for rate in (1e3, 2e3, 5e3, 5e4, 2e5):
        seconds = 60.0 if rate < 2e4 else 20.0
        yield Scene("sample rate", f"{rate / 1e3:g} kHz, S/N 10", rate=rate, seconds=seconds,
                    snr=10.0)  # fmt: skip


def _sensors() -> Iterable[Scene]:
    for ring, damping in ((8e3, 0.02), (3e3, 0.02), (2e3, 0.02), (2e3, 0.1)):
        name = f"rings at {ring / 1e3:g} kHz, damping {damping:g}"
        yield Scene("sensor", name, ring=ring, ring_damping=damping)
    yield Scene("sensor", "rings at 3 kHz, S/N 20", ring=3e3, snr=20.0)
    for limit in (0.8, 0.5, 0.25):
        yield Scene("sensor", f"clipped at {100 * limit:g} % of a pulse", limit=limit)
    yield Scene("sensor", "clipped at 50 %, rings at 3 kHz", limit=0.5, ring=3e3)
    for bandwidth in (5e3, 2e3, 1e3):
        yield Scene("sensor", f"bandwidth {bandwidth / 1e3:g} kHz", bandwidth=bandwidth)


def _rigs() -> Iterable[Scene]:
    for b in (0.010, 0.020, 0.034, 0.045):
        yield Scene("rig", f"one NES, b = {1e3 * b:g} mm", clearance=(b,))
    for pair in ((0.023, 0.034), (0.023, 0.023), (0.010, 0.030)):
        name = " + ".join(f"{1e3 * b:g}" for b in pair)
        yield Scene("rig", f"two NESs, b = {name} mm", clearance=pair)


def twin_records() -> Iterable[Record]:
    """The records with impacts of the shipped campaign, as their instruments would hold them."""
    from vinesexp.laboratory.experiment import motion_of
    from vinesexp.laboratory.scene import load_scene

    twin = load_scene(Path(__file__).resolve().parent.parent / "data" / "twin" / "scene.yaml")
    for test in twin.tests:
        if test.kind not in ("periodic", "transient", "sweep") or not test.clearance:
            continue
        motion = motion_of(twin, test)
        sensor = test.sensors["acceleration"]
        trace = acquire(
            motion, {"acceleration": sensor}, test.oscilloscope, start=test.settle,
            duration=test.duration, seed=twin.seed, record=test.record,
        )  # fmt: skip
        codes = trace.codes[0]
        # As the clock of the instrument would have shown them.
        clock = 1.0 + test.oscilloscope.clock_error
        time = (np.asarray(motion.impacts["time"]) - test.settle) / clock
        jump = motion.impacts["v_after"] - motion.impacts["v_before"]
        inside = (time > 0.0) & (time < test.duration)
        scene = Scene("twin", test.record, test.clearance, rate=test.oscilloscope.sample_rate,
                      seconds=test.duration)  # fmt: skip
        yield Record(
            scene, codes * (test.oscilloscope.step / sensor.sensitivity),
            np.abs(codes) >= 2 ** (test.oscilloscope.bits - 1) - 1, sensor.noise,
            time[inside], jump[inside],
        )  # fmt: skip
