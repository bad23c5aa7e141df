"""The law of a free decay is integrated as it stands."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vinesexp.identification.damping_law import NAMES, logs_and_phases


@pytest.mark.parametrize(
    "law",
    [
        {"alpha": 0.3, "beta": 40.0},
        {"alpha": 0.2, "gamma": 1e-4},
        {"alpha": 0.1, "beta": 20.0, "gamma": 1e-4, "mu": -2.0, "kappa": 100.0},
    ],
    ids=lambda law: " ".join(law),
)
def test_amplitude_and_phase_are_those_of_the_equation(law):
    w, A0, end = 50.0, 10e-3, 6.0
    vector = np.array(
        [{"log_A": np.log(A0), "phase": 0.4, "w": w, **law}.get(n, 0.0) for n in NAMES]
    )
    alpha, beta, gamma, mu, kappa = (
        law.get(n, 0.0) for n in ("alpha", "beta", "gamma", "mu", "kappa")
    )

    def slope(_, s):
        A = s[0]
        return [-(gamma + alpha * A + beta * A * A), w * (1.0 + (mu + kappa * A) * A)]

    t = np.linspace(0.0, end, 40)
    true = solve_ivp(slope, (0.0, end), [A0, 0.4], t_eval=t, rtol=1e-11, atol=1e-14).y
    log_A, phase = logs_and_phases(np.stack([vector, vector]), t, start=0.0)
    assert np.exp(log_A[1]) == pytest.approx(true[0], rel=2e-5)
    assert phase[1] == pytest.approx(true[1], abs=2e-4)
    assert (log_A[0] == log_A[1]).all()
