"""A record and its replay.
The record (black) is of a rig whose restitution is 0.58; the same release is simulated with 0.58
and with 0.65, the ball started at twelve places in its cavity: a ball that is captured at once
dissipates the energy as in the record, but only with the right restitution; other balls are never
captured.
"""

import matplotlib.pyplot as plt
import numpy as np

from vinesexp import NES, Oscillator, Release, Rig, simulate

host = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
t = np.linspace(0.0, 6.0, 3000)


def amplitude(r: float, place: float) -> np.ndarray:
    rig = Rig(host, nes=[NES(m=0.032, b=0.030, r=r)])
    start = Release(x0=0.020, y0=[0.020 + 0.029 * place])
    x, v = simulate(rig, None, start, duration=6.0).at(t)
    return 1e3 * np.hypot(x, v / host.w0)


figure, axis = plt.subplots(figsize=(8, 4), layout="constrained")
for r, colour in ((0.58, "tab:green"), (0.65, "tab:red")):
    for place in np.linspace(-1.0, 1.0, 12):
        axis.plot(t, amplitude(r, place), color=colour, linewidth=0.6, alpha=0.7)
    axis.plot([], [], color=colour, label=f"replayed with r = {r}")
measured = amplitude(0.58, 1.0) + np.random.default_rng(2).normal(0.0, 0.02, t.size)
axis.plot(t, measured, color="black", linestyle="--", linewidth=1.4, label="record", zorder=3)
axis.set(xlabel="time after the release (s)", ylabel="amplitude (mm)")
axis.legend()
