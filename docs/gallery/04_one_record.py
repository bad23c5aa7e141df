"""One record in a notebook.
A free decay with noise, as an array: `vinesexp.analyse` gives frequency and damping with errors.
"""

import matplotlib.pyplot as plt
import numpy as np

import vinesexp

t = np.arange(8000) / 1000.0
x = 5e-3 * np.exp(-0.32 * t) * np.cos(2.0 * np.pi * 7.862 * t)
x += np.random.default_rng(0).normal(0.0, 6e-6, t.size)
found = vinesexp.analyse({"displacement": x}, "1 kHz", test="ringdown")
best = found.identified[found.identified["method"] == "combined"].set_index("parameter")
f0, zeta = best.loc["f0", "value"], best.loc["zeta", "value"]
figure, axis = plt.subplots(figsize=(8, 3), layout="constrained")
axis.plot(t, 1e3 * x, linewidth=0.4)
axis.plot(t, 5.0 * np.exp(-2.0 * np.pi * f0 * zeta * t))
axis.set(xlabel="time (s)", ylabel="x (mm)", title=f"f0 = {f0:.4f} Hz, zeta = {zeta:.5f}")
