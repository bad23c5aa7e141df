"""What the error of a predicted clearance is made of.
Derivatives of the exact b_c by each value of the rig, times the error of the value: measure the
value with the longest bar better first.
"""

import matplotlib.pyplot as plt

from vinesexp.theory.intervals import gradient_exact

values = {"G": 0.25e-3, "M": 4.7, "c1": 3.02, "k1": 1.147e4, "r": 0.6, "m": 0.032}
known_to = {"G": 0.01, "M": 0.005, "c1": 0.01, "k1": 0.005, "r": 0.01, "m": 0.003}  # relative
b_c, slopes = gradient_exact(**values)
derivative = {**slopes, "G": b_c / values["G"]}  # b_c is proportional to G
parts = {
    name: 1e3 * abs(derivative[name]) * share * values[name] for name, share in known_to.items()
}
names = sorted(parts, key=parts.get)
figure, axis = plt.subplots(figsize=(8, 3.2), layout="constrained")
axis.barh([f"{name}, known to {100 * known_to[name]:g} %" for name in names],
          [parts[name] for name in names])  # fmt: skip
axis.set(xlabel="standard error that it gives b_c (mm)")
total = sum(part**2 for part in parts.values()) ** 0.5
axis.set_title(f"exact b_c = {1e3 * b_c:.2f} ± {total:.2f} mm", loc="left")
