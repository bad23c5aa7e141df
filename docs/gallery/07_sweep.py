"""A slow sweep with and without the ball.
The ball reduces the resonance peak: two impacts per cycle near the middle, modulated response
beside it, and no effect far away.
"""

import matplotlib.pyplot as plt
import numpy as np

from vinesexp import NES, Oscillator, Release, Rig, Sweep, simulate

host = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
base = Sweep(amplitude=0.25e-3, f_start=7.2, f_end=8.4, duration=100.0)
figure, axis = plt.subplots(figsize=(8, 4), layout="constrained")
t = np.linspace(0.0, 100.0, 40_000)
for b, colour in ((None, "grey"), (0.025, "tab:blue"), (0.034, "tab:orange")):
    balls = [] if b is None else [NES(m=0.032, b=b, r=0.6)]
    start = Release() if b is None else Release(y0=[0.999 * b])
    x, v = simulate(Rig(host, nes=balls), base, start, duration=100.0).at(t)
    name = "without ball" if b is None else f"b = {1e3 * b:g} mm"
    axis.plot(7.2 + 0.012 * t, 1e3 * np.hypot(x, v / host.w0), color=colour, lw=0.8, label=name)
axis.set(xlabel="frequency of the base (Hz)", ylabel="amplitude (mm)", xlim=(7.2, 8.4))
axis.legend()
