"""Orbits of two impacts per cycle, and where they lose stability.
Two orbits exist at each clearance and merge in a saddle-node; the lower one is stable until a
pair of multipliers leaves the unit circle (Neimark-Sacker): that clearance is the exact b_c.
"""

import matplotlib.pyplot as plt
import numpy as np

from vinesexp.theory.floquet import symmetric_orbits
from vinesexp.theory.optimal_clearance import b_c_exact

values = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "m": 0.032, "r": 0.6}
figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(8, 5), layout="constrained")
rows = [
    (1e3 * b, 1e3 * orbit.amplitude, np.abs(orbit.multipliers).max(), orbit.stable, upper)
    for b in np.linspace(0.0165, 0.0381, 217)
    for upper, orbit in enumerate(symmetric_orbits(G=0.25e-3, b=b, **values))
]
b, amplitude, largest, stable, upper = np.array(rows).T
for branch, colour in ((0, "tab:blue"), (1, "tab:orange")):
    on = upper == branch
    for axis, y in ((above, amplitude), (below, largest)):
        axis.plot(b[on], np.where(stable[on] == 1, y[on], np.nan), color=colour, linewidth=2)
        axis.plot(b[on], np.where(stable[on] == 1, np.nan, y[on]), "--", color=colour)
end = 1e3 * b_c_exact(G=0.25e-3, **values)
for axis in (above, below):
    axis.axvline(end, color="tab:green", linewidth=1)
above.annotate(f"$b_c$ = {end:.2f} mm", (end, 17.0), (5, -4), textcoords="offset points")
above.set_ylabel("amplitude (mm)")
above.set_title("solid: stable, dashed: unstable", loc="left", fontsize=10)
below.axhline(1.0, color="grey", linewidth=0.8)
below.set(xlabel="clearance b (mm)", ylabel="largest multiplier", ylim=(0, 3))
