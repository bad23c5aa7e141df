"""Every kind of base motion: the oscillator's response against Duhamel's integral in 20 digits."""

import itertools

import mpmath as mp
import numpy as np
import pytest

from vinesexp import Harmonic, Measured, Oscillator, Release, Rig, Sweep, simulate
from vinesexp.errors import ParameterError
from vinesexp.excitation import SteppedSweep
from vinesexp.solver.arrays import drive_table

TABLE2 = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
G = 0.25e-3


def duhamel(o, base, t, breaks=()):
    """x(t) from rest: the integral of the impulse response times what the base pulls with.

    `base` gives x_e and x_e' in mpmath numbers; `breaks` are times where it is not smooth.
    """
    with mp.workdps(20):
        w0sq, two_alpha = mp.mpf(o.k1) / mp.mpf(o.M), mp.mpf(o.c1) / mp.mpf(o.M)
        alpha = two_alpha / 2
        wd = mp.sqrt(w0sq - alpha**2)

        def pull(s):
            x_e, v_e = base(s)
            return mp.exp(-alpha * (t - s)) * mp.sin(wd * (t - s)) * (w0sq * x_e + two_alpha * v_e)

        inner = [mp.mpf(b) for b in breaks if b < t]
        ends = [mp.mpf(0), *inner, mp.mpf(t)]
        knots = [ends[0]]
        for a, b in itertools.pairwise(ends):
            n = max(1, int(mp.ceil((b - a) * 8)))
            knots += [a + (b - a) * k / n for k in range(1, n + 1)]
        return float(mp.quad(pull, knots, method="gauss-legendre", maxdegree=5) / wd)


def sine(phase, f):
    def base(s):
        turn = mp.mpf(phase) + 2 * mp.pi * mp.mpf(f) * s
        return G * mp.sin(turn), G * 2 * mp.pi * mp.mpf(f) * mp.cos(turn)

    return base


def chirp(sweep):
    def base(s):
        f0, f1, T = (mp.mpf(a) for a in (sweep.f_start, sweep.f_end, sweep.duration))
        s_, rest = min(s, T), max(s - T, mp.mpf(0))
        turn = mp.mpf(sweep.phase) + 2 * mp.pi * (f0 * s_ + (f1 - f0) * s_**2 / (2 * T) + f1 * rest)
        return G * mp.sin(turn), G * 2 * mp.pi * (f0 + (f1 - f0) * s_ / T) * mp.cos(turn)

    return base


def steps(stepped):
    def base(s):
        cycles, f = mp.mpf(0), mp.mpf(stepped.frequencies[0])
        ends = [*stepped.starts[1:], float("inf")]
        for f_, begin, end in zip(stepped.frequencies, stepped.starts, ends, strict=True):
            if s < begin:
                break
            f = mp.mpf(f_)
            cycles += f * (min(s, mp.mpf(end)) - mp.mpf(begin))
        turn = mp.mpf(stepped.phase) + 2 * mp.pi * cycles
        return G * mp.sin(turn), G * 2 * mp.pi * f * mp.cos(turn)

    return base


HARMONIC = Harmonic(G, 7.9, phase=0.4)
SWEEP = Sweep(G, 7.2, 8.4, duration=2.0, phase=0.3)
STEPPED = SteppedSweep(G, [7.2, 7.9, 7.7], dwell=[0.9, 1.3, 0.5], phase=0.2)
CASES = [
    (HARMONIC, sine(0.4, 7.9), ()),
    (SWEEP, chirp(SWEEP), (2.0,)),
    (STEPPED, steps(STEPPED), STEPPED.starts[1:]),
]


@pytest.mark.parametrize(("base", "exact", "breaks"), CASES, ids=["harmonic", "sweep", "stepped"])
def test_response_is_duhamels_integral(base, exact, breaks):
    """To 1e-14 of the resonant amplitude, within a step, at its end and after the last."""
    loops = [simulate(Rig(TABLE2), base, Release(), 3.0, general=one) for one in (False, True)]
    for t in (0.37, 1.5, 2.95):
        x = duhamel(TABLE2, exact, t, breaks)
        # 3 s at 8 Hz are 150 rad, each rounding of the phase 3e-14 rad, of 10 mm.
        assert [motion.at(t)[0] for motion in loops] == pytest.approx([x, x], abs=1e-15)


def test_measured_base_that_its_spline_meets_exactly_gives_the_exact_response():
    """A polynomial of degree 5 is its own quintic spline."""
    c = [0.0, 3e-4, -5e-4, 2e-4, 1e-4, -4e-5]
    t = np.arange(0.0, 2.0001, 0.01)
    record = Measured(np.polynomial.polynomial.polyval(t, c), sample_rate=100.0)
    motion = simulate(Rig(TABLE2), record, Release(), 2.0)

    def base(s):
        return (
            mp.fsum(mp.mpf(a) * s**n for n, a in enumerate(c)),
            mp.fsum(n * mp.mpf(a) * s ** (n - 1) for n, a in enumerate(c) if n),
        )

    for time in (0.335, 1.204, 1.99):
        # The samples are rounded to 1e-16 of 1e-3, and so is x.
        assert motion.at(time)[0] == pytest.approx(duhamel(TABLE2, base, time), abs=1e-15)


def test_no_base_motion_is_the_free_decay():
    o = TABLE2
    motion = simulate(Rig(o), None, Release(x0=0.02, v0=0.1), 3.0)
    t, a = np.linspace(0.0, 3.0, 50), o.zeta * o.w0
    wd = np.sqrt(o.w0**2 - a**2)
    exact = np.exp(-a * t) * (0.02 * np.cos(wd * t) + (0.1 + a * 0.02) / wd * np.sin(wd * t))
    np.testing.assert_allclose(motion.at(t)[0], exact, rtol=0, atol=1e-15)


def test_phase_of_late_steps_carries_no_rounding():
    """A thousand steps: the phase at the start of the last is right to one rounding."""
    stepped = SteppedSweep(G, [7.1 + 1e-3 * n for n in range(1000)], dwell=0.7)
    with mp.workdps(40):
        pairs = zip(stepped.frequencies, stepped.starts, stepped.starts[1:], strict=False)
        run = mp.fsum(mp.mpf(f) * (mp.mpf(b) - mp.mpf(a)) for f, a, b in pairs)
        exact = float(2 * mp.pi * (run - mp.floor(run)))
    assert drive_table(stepped)[1][-1, 2] == pytest.approx(exact, abs=2e-15)


def test_the_spline_of_a_record_is_made_once():
    record = Measured(np.sin(np.arange(50.0)), sample_rate=10.0)
    assert drive_table(record)[1] is drive_table(record)[1]
    assert drive_table(Measured(np.zeros(50), 10.0))[1] is not drive_table(record)[1]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SteppedSweep(G, [], 1.0), "frequencies is empty"),
        (lambda: SteppedSweep(G, [7.0, 8.0], [1.0]), "dwell has 1 times, expected 2"),
        (lambda: SteppedSweep(G, [7.0, -8.0], 1.0), "base frequency = -8.0"),
        (lambda: SteppedSweep(G, [7.0], 0.0), "dwell = 0.0"),
        (lambda: SteppedSweep(G, [7.0, 8.0], [1.0, float("nan")]), "dwell = nan"),
        (lambda: Measured([0.0] * 5, 10.0), "at least 6 samples"),
        (lambda: Measured([], 10.0), "at least 6 samples"),
        (lambda: Measured([[0.0] * 9] * 2, 10.0), r"shape \(2, 9\): expected one channel"),
        (lambda: Measured([0.0, 1.0, float("nan"), 0.0, 0.0, 0.0], 10.0), "sample 2: nan"),
        (lambda: Measured([0.0] * 9, 0.0), "sample rate = 0.0"),
        (lambda: Sweep(G, 7.0, 8.0, 0.0), "sweep duration = 0.0"),
        (lambda: simulate(Rig(TABLE2), Measured([0.0] * 9, 10.0), Release(), 1.0), "lasts 0.8 s"),
    ],
)
def test_bad_input_is_one_clear_line(make, message):
    with pytest.raises(ParameterError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
