"""Minimum of the amplitude over clearance.
The exact orbit of two impacts per cycle for three base amplitudes, up to where it ends (b_c); the
lowest amplitude lies a little below.
"""

import matplotlib.pyplot as plt

from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.planning.expected_valley import expected_valley
from vinesexp.units import Quantity

values = {"M": 4.7, "c1": 3.02, "k1": 1.147e4, "r": 0.6, "m": 0.032}
rig = IdentifiedRig({name: Quantity(value) for name, value in values.items()})
figure, axis = plt.subplots(figsize=(8, 4), layout="constrained")
for G in (0.15e-3, 0.20e-3, 0.25e-3):
    valley = expected_valley(rig, G=Quantity(G), frequency=7.8623, draws=0)
    axis.plot(1e3 * valley.b, 1e3 * valley.amplitude, label=f"G = {1e3 * G:.2f} mm")
    axis.axvline(1e3 * valley.lowest, linestyle=":", color="grey")
axis.set(xlabel="clearance b (mm)", ylabel="amplitude (mm)")
axis.legend()
