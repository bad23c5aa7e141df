"""The slow invariant manifold.
Amplitude of the oscillator over that of the ball, stable between T1 and T2, for restitution 0.6.
"""

from vinesexp.figures.invariant_manifold import draw_sim
from vinesexp.figures.style import new_figure

figure, (axis,) = new_figure(height=4.0, width=5.6)
draw_sim(axis, r=0.6)
axis.set(xlabel="ball amplitude C (clearances)", ylabel="amplitude A (clearances)")
axis.set(xlim=(0, 2.1), ylim=(0, 1.05))
axis.legend(frameon=False, loc="lower left")
