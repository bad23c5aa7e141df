"""Speed against error of every method of the identification, in units of the Cramer-Rao bound.

    python -m benchmarks.identification            # about three minutes, one core

Records of the published rig (Table 2) by the virtual bench with nominal sensors (laser 6 um rms and
14 bits over 50 mm, slow drift of 0.05 mm, accelerometer 0.3 m/s^2 rms, 10 kHz), at three noise
levels and three lengths each. A method's error is the root mean square of estimate minus truth over
fresh seeds; the bound is the least that any unbiased method can have with that noise, a constant
offset unknown and nothing else wrong. Writes docs/benchmarks/identification.md and the figure.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
import timeit
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, Sweep, simulate
from vinesexp.figures.style import COLOURS, label, new_figure, save
from vinesexp.identification.bounces import restitution_of_bounces
from vinesexp.identification.decrement import log_decrement
from vinesexp.identification.flights import flights_of, mass_ratio
from vinesexp.identification.oscillation import POINTS
from vinesexp.identification.phasors import demodulate
from vinesexp.identification.ringdown import envelope, kept, likelihood, ring_down
from vinesexp.identification.sweep_record import half_power, transmissibility
from vinesexp.laboratory.oscilloscope import Oscilloscope, acquire
from vinesexp.laboratory.sensors import Accelerometer, Laser
from vinesexp.records.stored.store import RecordWriter
from vinesexp.signals.condition import condition
from vinesexp.signals.impacts.find import impacts_of_record
from vinesexp.signals.means import block_means
from vinesexp.solver.motion import Motion

FloatArray = NDArray[np.float64]

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "benchmarks" / "identification.md"
FIGURE = PAGE.with_suffix(".svg")

TABLE_2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
RATE, STEP_OF_CONVERTER = 1e4, 0.05 / 2**14
NOISE = {"a third": 1 / 3, "nominal": 1.0, "three times": 3.0}
SCOPE = Oscilloscope(RATE, bits=14, full_scale=1.0)


@dataclass(frozen=True)
class Row:
    """One method at one noise level and length: errors over the bound, bias, time."""

    stage: str
    method: str
    noise: str
    seconds: float
    parameter: str
    error: float  # rms error over the bound
    bias: float  # over the standard deviation
    stated: float  # rms of stated over actual error
    milliseconds: float


def lasers(noise: float) -> dict[str, Laser]:
    return {
        "base": Laser(sensitivity=1 / 2.5e-3, noise=2e-6 * noise),
        "displacement": Laser(sensitivity=1 / 25e-3, noise=6e-6 * noise, drift=5e-5),
    }


def records(
    motion: Motion, level: str, seconds: float, seeds: range, k: int
) -> Iterator[dict[str, FloatArray]]:
    """Block means of the channels for every seed; the motion is the same, its sensors are not."""
    sensors, name = lasers(NOISE[level]), f"{level} {seconds}"
    for seed in seeds:
        trace = acquire(motion, sensors, SCOPE, start=0.0, duration=seconds, seed=seed, record=name)
        yield {
            role: block_means(trace.codes[i] * (SCOPE.step / sensor.sensitivity), k)
            for i, (role, sensor) in enumerate(sensors.items())
        }


def timed(work: Callable[[], object], repeat: int = 3) -> float:
    """Milliseconds of the processor, the least of a few."""
    return 1e3 * min(timeit.repeat(work, timer=time.process_time, number=1, repeat=repeat))


def variance(noise: float, full: float, sigma: float) -> float:
    """Of one sample: sensor and converter."""
    return (sigma * noise) ** 2 + (full / 2**14) ** 2 / 12


def ringdown_bound(seconds: float, A: float, noise: float) -> tuple[float, float]:
    """Least standard deviations of f0 and zeta; amplitude, phase and offset unknown too."""
    t = np.arange(round(seconds * RATE)) / RATE
    w0, zeta = TABLE_2.w0, TABLE_2.zeta

    def model(p: FloatArray) -> FloatArray:
        w, z = p[2], p[3]
        return np.asarray(
            p[0] * np.exp(-z * w * t) * np.cos(w * math.sqrt(1 - z * z) * t + p[1]) + p[4]
        )

    return bound(model, np.array([A, 0.0, w0, zeta, 0.0]), variance(noise, 0.05, 6e-6), (2, 3))


def bound(
    model: Callable[[FloatArray], FloatArray], p: FloatArray, variance: float, at: tuple[int, int]
) -> tuple[float, float]:
    """Cramer-Rao bound of w0 (as Hz) and zeta by central differences of the model."""
    steps = np.array([max(abs(v), 1e-3) * 1e-6 for v in p])
    columns = []
    for i, step in enumerate(steps):
        up, down = p.copy(), p.copy()
        up[i] += step
        down[i] -= step
        columns.append((model(up) - model(down)) / (2 * step))
    J = np.stack(columns, axis=1)
    scale = np.sqrt((J**2).sum(axis=0))
    covariance = np.linalg.inv((J / scale).T @ (J / scale)) / np.outer(scale, scale) * variance
    sigma = np.sqrt(np.diag(covariance))
    return float(sigma[at[0]] / (2 * math.pi)), float(sigma[at[1]])


def summary(
    stage: str, method: str, noise: str, seconds: float, found: FloatArray,
    bounds: tuple[float, float], milliseconds: float,
) -> list[Row]:  # fmt: skip
    """Rows for f0 and zeta; `found` (seeds, 4) holds f0, its error, zeta, its error."""
    rows = []
    for name, truth, column, least in (
        ("f0", TABLE_2.f0, 0, bounds[0]),
        ("zeta", TABLE_2.zeta, 2, bounds[1]),
    ):
        off = found[:, column] - truth
        rows.append(
            Row(
                *(stage, method, noise, seconds, name),
                float(np.sqrt(np.mean(off**2)) / least),
                float(off.mean() / off.std(ddof=1)),
                float(np.sqrt(np.mean(found[:, column + 1] ** 2)) / off.std(ddof=1)),
                milliseconds,
            )
        )
    return rows


def ringdowns(seeds: range) -> list[Row]:
    """Log decrement, envelope, likelihood."""
    rows, A = [], 0.02
    k = int(RATE / (POINTS * TABLE_2.f0))
    step = k / RATE
    for seconds in (6.0, 18.0, 60.0):
        motion = simulate(Rig(TABLE_2), None, Release(A), duration=seconds)
        for name, noise in NOISE.items():
            fits, last = [], np.empty(0)
            for channels in records(motion, name, seconds, seeds, k):
                last = channels["displacement"]
                fits.append(ring_down(last, step, frequency=7.8, resolution=STEP_OF_CONVERTER))
            phasors = kept(demodulate(last, step, TABLE_2.f0, rate=0.32), STEP_OF_CONVERTER)
            law = envelope(phasors, log_decrement(phasors).decay)
            # Everything starts with two demodulations; each method stands on the cheaper ones.
            base = 2 * timed(lambda x=last: demodulate(x, step, TABLE_2.f0, rate=0.32))
            costs = np.cumsum(
                [
                    base + timed(lambda p=phasors: log_decrement(p)),
                    timed(lambda p=phasors: envelope(p, log_decrement(p).decay))
                    + timed(
                        lambda x=last, p=phasors, e=law: likelihood(
                            x, step * np.arange(x.size), p, e
                        )
                    ),
                ]
            )
            bounds = ringdown_bound(seconds, A, noise)
            for i, method in enumerate(("log decrement", "likelihood")):
                found = np.array(
                    [[f[i].f0, f[i].f0_error, f[i].zeta, f[i].zeta_error] for f in fits]
                )
                rows += summary("ring-down", method, name, seconds, found, bounds, float(costs[i]))
    return rows


def sweep_bound(motion: Motion, seconds: float, noise: float) -> tuple[float, float]:
    """As of ring-downs, but base and mass are both measured; gain and lag between them unknown.

    A Fourier line of x - H b has the noise of both, that of the base |H| times as loud.
    """
    k = 50
    t = (np.arange(round(seconds * RATE / k)) + 0.5) * k / RATE
    B = np.fft.rfft(motion.base(t)[0])
    w = 2 * np.pi * np.fft.rfftfreq(t.size, k / RATE)
    near = (w > 0.7 * TABLE_2.w0) & (w < 1.3 * TABLE_2.w0)
    B, w = B[near], w[near]

    def response(p: FloatArray) -> NDArray[np.complex128]:
        w0, zeta, gain, lag = p
        s = 2j * zeta * w0 * w
        turned = gain * np.exp(-1j * w * lag)
        return np.asarray(turned * (w0 * w0 + s) / (w0 * w0 - w * w + s))

    p = np.array([TABLE_2.w0, TABLE_2.zeta, 1.0, 0.0])
    each = variance(noise, 0.05, 6e-6) + np.abs(response(p)) ** 2 * variance(noise, 5e-3, 2e-6)
    part = np.sqrt(0.5 * t.size * each / k)

    def model(p: FloatArray) -> FloatArray:
        lines = response(p) * B / part
        return np.concatenate([lines.real, lines.imag])

    return bound(model, p, 1.0, (0, 1))


def sweeps(seeds: range) -> list[Row]:
    """Half-power width and likelihood."""
    rows = []
    k = int(RATE / (POINTS * TABLE_2.f0))
    step = k / RATE
    for seconds in (60.0, 100.0, 200.0):
        base = Sweep(0.25e-3, 7.2, 8.4, seconds)
        motion = simulate(Rig(TABLE_2), base, Release(), duration=seconds)
        for name, noise in NOISE.items():
            cheap, best, last = [], [], {}
            for channels in records(motion, name, seconds, seeds, k):
                b, x = channels["base"], channels["displacement"]
                h = half_power(b, x, step, swept=(7.2, 8.4))
                full = transmissibility(b, x, step, frequency=7.862, swept=(7.2, 8.4))
                cheap.append([h.f0, h.f0_error, h.zeta, h.zeta_error])
                best.append([full.f0, full.f0_error, full.zeta, full.zeta_error])
                last = channels
            b, x = last["base"], last["displacement"]
            costs = (
                timed(lambda b=b, x=x: half_power(b, x, step, swept=(7.2, 8.4))),
                timed(
                    lambda b=b, x=x: transmissibility(b, x, step, frequency=7.862, swept=(7.2, 8.4))
                ),
            )
            bounds = sweep_bound(motion, seconds, noise)
            for method, found, cost in zip(
                ("half power", "likelihood"), (cheap, best), costs, strict=True
            ):
                rows += summary("sweep", method, name, seconds, np.array(found), bounds, cost)
    return rows


#: Drop test: true impact times of a ball with r = 0.6, and the contact pulse's standard error.
FIRST_FLIGHT, BOUNCES, PULSE = 0.153, 9, 4e-4


def drops(seeds: range) -> list[Row]:
    """r from the times of bounces, as sure as pulses in the accelerometer's noise allow."""
    rows = []
    r = 0.6
    for name, noise in NOISE.items():
        speed = 9.80665 * FIRST_FLIGHT / 2 * r ** np.arange(BOUNCES)
        sigma = time_bound((1 + r) / r * speed, 0.3 * noise)
        t = FIRST_FLIGHT * np.concatenate([[0.0], np.cumsum(r ** np.arange(BOUNCES - 1))])
        found = []
        for seed in seeds:
            measured = t + sigma * np.random.default_rng(seed).standard_normal(BOUNCES)
            b = restitution_of_bounces(measured, sigma)
            found.append([b.r, b.error])
        values, stated = np.array(found).T

        def model(p: FloatArray, sigma: FloatArray = sigma) -> FloatArray:
            flights = p[1] * p[2] ** np.arange(BOUNCES - 1)
            return np.asarray((p[0] + np.concatenate([[0.0], np.cumsum(flights)])) / sigma)

        least = bound(model, np.array([0.0, FIRST_FLIGHT, r]), 1.0, (0, 2))[1]
        off = values - r
        cost = timed(lambda m=measured, s=sigma: restitution_of_bounces(m, s))
        rows.append(
            Row(
                *("drop", "likelihood", name, float(t[-1]), "r"),
                float(np.sqrt(np.mean(off**2)) / least),
                float(off.mean() / off.std(ddof=1)),
                float(np.sqrt(np.mean(stated**2)) / off.std(ddof=1)),
                cost,
            )
        )
    return rows


def masses(seeds: range) -> list[Row]:
    """M by momentum, from raw channels to the value: filters, detection, flights and all."""
    rows = []
    rig = Rig(TABLE_2, nes=[NES(m=0.032, b=0.03, r=0.6)])
    settle = 20.0
    for seconds in (5.0, 20.0):
        release = Release(y0=[-0.999 * 0.03])
        motion = simulate(rig, Harmonic(0.25e-3, 7.862), release, duration=settle + seconds)
        hits = motion.impacts
        jumps = (hits["v_after"] - hits["v_before"])[hits["time"] > settle]
        for name, noise in NOISE.items():
            least = TABLE_2.M / math.sqrt(float((jumps**2).sum())) * jump_bound(0.3 * noise)
            found, cost = [], math.inf
            for seed in seeds:
                begin = time.process_time()
                found.append(mass_of(motion, settle, seconds, name, seed))
                cost = min(cost, 1e3 * (time.process_time() - begin))
            values, stated = np.array(found).T
            off = values - TABLE_2.M
            rows.append(
                Row(
                    *("impacts", "momentum", name, seconds, "M"),
                    float(np.sqrt(np.mean(off**2)) / least),
                    float(off.mean() / off.std(ddof=1)),
                    float(np.sqrt(np.mean(stated**2)) / off.std(ddof=1)),
                    cost,
                )
            )
    return rows


def mass_of(
    motion: Motion, start: float, seconds: float, level: str, seed: int
) -> tuple[float, float]:
    """M and its error from one record, simulated anew."""
    noise, b = NOISE[level], 0.03
    sensors = {
        "displacement": lasers(noise)["displacement"],
        "acceleration": Accelerometer(sensitivity=1 / 500.0, pulse=PULSE, noise=0.3 * noise),
    }
    trace = acquire(
        *(motion, sensors, SCOPE), start=start, duration=seconds, seed=seed,
        record=f"{level} {seconds}",
    )  # fmt: skip
    channels = {
        role: trace.codes[i] * (SCOPE.step / sensor.sensitivity)
        for i, (role, sensor) in enumerate(sensors.items())
    }
    with tempfile.TemporaryDirectory() as folder:
        record, band, table = (Path(folder) / name for name in ("r.nc", "c.nc", "i.csv"))
        quantities = {role: role for role in sensors}
        with RecordWriter(record, sample_rate=RATE, quantities=quantities) as writer:
            writer.append(channels)
        condition(record, band, f0_hint=7.862)
        impacts = impacts_of_record(record, band, table, clearance=(b,))
    ratio = mass_ratio(flights_of(impacts, nes=1, b=b, period=1 / 7.862))
    return 0.032 / ratio.eps, 0.032 / ratio.eps * ratio.error / ratio.eps


def jump_bound(sigma: float) -> float:
    """Least error of the area of a half-sine contact of known form, time unknown, m/s."""
    t = np.arange(-20, 21) / RATE
    inside = np.abs(t) < PULSE / 2
    shape = np.where(inside, np.cos(np.pi * t / PULSE), 0.0) * np.pi / (2 * PULSE)
    return sigma / math.sqrt(float(shape @ shape))  # at the middle the slope is orthogonal to it


def time_bound(jump: FloatArray, sigma: float) -> FloatArray:
    """Least error of the time of a half-sine contact that changes the velocity by `jump`, s."""
    t = np.arange(-20, 21) / RATE
    inside = np.abs(t) < PULSE / 2
    slope = -np.where(inside, np.sin(np.pi * t / PULSE), 0.0) * (np.pi / PULSE) ** 2 / 2
    return np.asarray(sigma / (jump * math.sqrt(float(slope @ slope))))


def table(rows: list[Row]) -> str:
    lines = [
        "| test | method | noise | record (s) | value | rms error / bound | bias / sd | "
        "stated error / sd | ms |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        lines.append(
            f"| {row.stage} | {row.method} | {row.noise} | {row.seconds:.3g} | {row.parameter} | "
            f"{row.error:.2f} | {row.bias:+.2f} | {row.stated:.2f} | {row.milliseconds:.2f} |"
        )
    return "\n".join(lines)


METHODS = {
    ("ring-down", "log decrement"): COLOURS["published"],
    ("ring-down", "likelihood"): COLOURS["exact"],
    ("sweep", "half power"): COLOURS["published"],
    ("sweep", "likelihood"): COLOURS["exact"],
}
MARKS = {"a third": "v", "nominal": "o", "three times": "^"}


def draw(rows: list[Row]) -> None:
    """Time against error, a panel a test and value; a point a method, noise level and length."""
    figure, axes = new_figure(2, 2, height=5.6, sharey="row")
    for axis, (stage, parameter) in zip(
        axes,
        [("ring-down", "f0"), ("ring-down", "zeta"), ("sweep", "f0"), ("sweep", "zeta")],
        strict=True,
    ):
        axis.axhline(1.0, color="black", lw=0.8)
        for (own, method), colour in METHODS.items():
            points = [
                r for r in rows if (r.stage, r.method, r.parameter) == (own, method, parameter)
            ]
            if own != stage or not points:
                continue
            for point in points:
                axis.plot(point.milliseconds, point.error, MARKS[point.noise], color=colour, ms=4.5)
            best = method == "likelihood"
            at = (min if best else max)(points, key=lambda p: p.error)
            middle = float(np.median([point.milliseconds for point in points]))
            shift = (0, -10) if best else (0, 9)
            label(axis, method, (middle, at.error), colour=colour, shift=shift, ha="center")
        axis.set(
            xscale="log", yscale="log", title=f"{stage}: {parameter}",
            xlabel="time per record (ms)",
        )  # fmt: skip
        axis.margins(x=0.25, y=0.18)
        if stage == "ring-down":
            axis.set_yticks([1, 2, 4, 6], ["1", "2", "4", "6"])
            axis.minorticks_off()
    for axis in axes:
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_formatter(NullFormatter())
    for axis in axes[::2]:
        axis.set_ylabel("rms error / Cramér-Rao bound")
    handles = [
        axes[0].plot([], [], mark, color="black", ms=4.5, label=f"{name} noise")[0]
        for name, mark in MARKS.items()
    ]
    axes[0].legend(handles=handles, fontsize=7.5, loc="best", frameon=False)
    save(figure, FIGURE.with_suffix(""))
    FIGURE.with_suffix(".pdf").unlink()


def page(rows: list[Row], seeds: int) -> str:
    best = [r for r in rows if r.method == "likelihood" and r.noise == "nominal"]
    worst = max(best, key=lambda r: r.error)
    return f"""# Identification: time against error

`python -m benchmarks.identification`: {seeds} seeds a row, sensors as in its first lines. Error and
bound are of the same value; 1 is the least that any unbiased method can have. Times are of the
processor, for one record once its block means are made ({POINTS} a period); each method of a
ring-down includes the cheaper ones. The row of impacts is the whole way from samples to M,
simulation and files included; its bound is that of the pulses' areas in the accelerometer's noise,
their form known.
The base is measured with 2 um rms and 14 bits over 5 mm; for a sweep its noise is in the bound.
The stated error of a drop is that of what the air may do, far above the noise of the times.

![time against error](identification.svg)

At nominal noise the worst likelihood row is {worst.stage}, {worst.seconds:.3g} s,
{worst.parameter}: {worst.error:.2f} of the bound (target: standard deviation within 1.2).

{table(rows)}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description="time against error of the identification")
    parser.add_argument("--seeds", type=int, default=60)
    parser.add_argument("--dry", action="store_true", help="print, write nothing")
    args = parser.parse_args()
    seeds = range(1, args.seeds + 1)
    rows = [
        *ringdowns(seeds),
        *sweeps(seeds),
        *drops(range(1, 10 * args.seeds + 1)),
        *masses(range(1, args.seeds // 3 + 1)),
    ]
    print(table(rows))
    if not args.dry:
        draw(rows)
        PAGE.write_text(page(rows, args.seeds), encoding="utf-8")


if __name__ == "__main__":
    main()
