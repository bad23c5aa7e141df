"""Campaigns drawn as laboratories produce them, analysed by the whole pipeline, held to the truth.

What the benchmark of robustness leaves out: sheets, gains, clearances and mountings scatter by what
is stated of them, so that intervals can be counted, and people make mistakes. The rig moves in the
simulator of `benchmarks.robustness.motion`; nothing of the package's solver is used.
"""

from vinesexp.environment import one_thread_each

one_thread_each()  # before numpy is loaded: two campaigns run side by side
