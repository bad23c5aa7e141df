"""The slow flow on the SIM: its threshold F_c.

Amplitude A and phase rho follow docs/theory.md (17, 18), the paper's (23) with its slip corrected
(lambda A/2, not lambda C/2). Units: lengths in clearances b, time tau1 = eps w0 t.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vinesexp.arrays import FloatArray
from vinesexp.rig import checked
from vinesexp.theory.manifold import loss_parameter


def threshold(*, lam: ArrayLike, r: ArrayLike) -> FloatArray:
    """F_c, the least forcing with a folded singularity, whatever the detuning (docs/theory.md, 22).

    2 (Gamma lambda S + 4 pi)/S^(3/2), the paper's (34). Below it every motion that reaches the
    fold leaves the SIM there: strongly modulated response.

    Examples
    --------
    >>> round(float(threshold(lam=1.910, r=0.6)), 5)
    1.08093
    """
    damping = checked(lam, "reduced damping lambda", "a number, zero or above")
    Gamma = loss_parameter(r)
    S = np.pi**2 + 4.0 * Gamma**2
    F_c: FloatArray = 2.0 * (Gamma * damping * S + 4.0 * np.pi) / (S * np.sqrt(S))
    return F_c
