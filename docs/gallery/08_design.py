"""Which clearance to build for which base amplitude.
Mean amplitude from random starts as a share of that without a ball; the line is the exact b_c.
"""

import matplotlib.pyplot as plt
import numpy as np

from vinesexp import response_map
from vinesexp.theory.optimal_clearance import b_c_exact

host = {"M": 4.7, "c1": 3.02, "k1": 1.147e4}
b, G = np.linspace(0.010, 0.050, 17), np.linspace(0.10e-3, 0.35e-3, 11)
grid = response_map({"b": b, "G": G}, m=0.032, r=0.6, starts=4, **host)
w0 = np.sqrt(host["k1"] / host["M"])
bare = G * np.hypot(host["k1"], host["c1"] * w0) / (host["c1"] * w0)  # at resonance
mean = grid.mean_amplitude.transpose("G", "b").to_numpy() / bare[:, None]
figure, axis = plt.subplots(figsize=(8, 4), layout="constrained")
shown = axis.pcolormesh(1e3 * b, 1e3 * G, mean, cmap="viridis", shading="nearest")
figure.colorbar(shown, label="mean amplitude over that without ball")
axis.plot(1e3 * b_c_exact(G=G, m=0.032, r=0.6, **host), 1e3 * G, color="white", linewidth=2)
axis.set(xlabel="clearance b (mm)", ylabel="base amplitude G (mm)")
