"""The slow invariant manifold.
Amplitude of the oscillator over that of the ball, stable between T1 and T2, for restitution 0.6.
"""

from vinesexp.figures.invariant_manifold import sim_figure

figure = sim_figure(r=0.6)
