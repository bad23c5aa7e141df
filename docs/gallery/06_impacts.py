"""Impacts found among the noise of an accelerometer.
A simulated record with contacts of 1 ms and the noise of a laboratory goes through the detection
of a campaign; the true times of the impacts are known.
"""

import matplotlib.pyplot as plt
import numpy as np

import vinesexp
from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate

rig = Rig(Oscillator(M=4.7, c1=3.02, k1=1.147e4), nes=[NES(m=0.032, b=0.038, r=0.6)])
base, start = Harmonic(amplitude=0.25e-3, frequency=7.862), Release(y0=[0.0379])
motion = simulate(rig, base, start, duration=40.0)
noise, rate, contact = np.random.default_rng(1), 10_000.0, 1e-3
t = np.arange(20.0, 40.0, 1.0 / rate)
x, v = motion.at(t)
a = -(3.02 * v + 1.147e4 * x) / 4.7 + noise.normal(0.0, 0.3, t.size)
jumps = motion.impacts["v_after"] - motion.impacts["v_before"]
for time, jump in zip(motion.impacts["time"], jumps, strict=True):
    near = (t >= time) & (t < time + contact)
    a[near] += jump * 0.5 * np.pi / contact * np.sin(np.pi * (t[near] - time) / contact)
found = vinesexp.analyse(
    {"displacement": x + noise.normal(0.0, 5e-6, t.size), "acceleration": a}, rate,
    test="periodic", clearance="38 mm", nes_mass="32 g", base_amplitude="0.25 mm", frequency=7.862,
).impacts  # fmt: skip
true = motion.impacts["time"] + 0.5 * contact - 20.0
true = true[(true > 0.0) & (true < 20.0)]
off = (found["time_s"].to_numpy()[:, None] - true)[range(len(found)), [
    np.abs(true - own).argmin() for own in found["time_s"]]]  # fmt: skip
figure, (above, below) = plt.subplots(2, 1, figsize=(8, 5), layout="constrained")
shown = t < 21.0
above.plot(t[shown] - 20.0, a[shown], color="0.3", linewidth=0.7)
for side, colour in ((1, "tab:orange"), (-1, "tab:blue")):
    own = found[(found["side"] == side) & (found["time_s"] < 1.0)]
    level = np.full(len(own), -70.0 * side)
    above.plot(own["time_s"], level, "^v"[side > 0], color=colour, label=f"wall {side:+d}")
above.set(xlabel="time (s)", ylabel="acceleration (m/s²)")
above.legend(loc="upper right", ncols=2)
below.hist(1e6 * off, bins=40)
below.set(xlabel="time found minus middle of the true contact (µs)", ylabel="impacts")
below.set_title(f"{len(found)} found of {true.size} true ones", loc="left", fontsize=10)
