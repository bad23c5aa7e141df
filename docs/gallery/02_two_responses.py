"""Permanent and modulated response.
The published rig at 0.25 mm of base amplitude: at b = 30 mm there are two impacts per cycle
permanently, at 40 mm the ball is lost and captured again and again.
"""

import matplotlib.pyplot as plt
import numpy as np

from vinesexp import NES, Harmonic, Oscillator, Release, Rig, simulate

host = Oscillator(M=4.7, c1=3.02, k1=1.147e4)
base = Harmonic(amplitude=0.25e-3, frequency=7.862)
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(8, 4), layout="constrained")
for axis, b in zip(axes, (0.030, 0.040), strict=True):
    rig = Rig(host, nes=[NES(m=0.032, b=b, r=0.6)])
    motion = simulate(rig, base, Release(y0=[0.999 * b]), duration=60.0)
    t = np.linspace(20.0, 60.0, 20_000)
    axis.plot(t, 1e3 * motion.at(t)[0], linewidth=0.4)
    axis.set_title(f"b = {1e3 * b:g} mm", loc="left", fontsize=10)
    axis.set_ylabel("x (mm)")
axes[-1].set_xlabel("time (s)")
