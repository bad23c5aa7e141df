"""An answer of a design with made-up numbers, for what is drawn of one."""

from types import SimpleNamespace

import numpy as np


def made_up_advice(*, absorber: float = 0.012) -> SimpleNamespace:
    """What a figure takes of an answer; `absorber` is the amplitude of the tuned mass damper, m."""
    some = np.linspace(0.004, 0.007, 9) * np.ones((30, 1))
    tried = SimpleNamespace(
        mean=some, share=np.full(30, 0.5), weight=np.ones((30, 9)),
        average=lambda values: values.mean(axis=1),
    )  # fmt: skip
    one = SimpleNamespace(b=0.03)
    return SimpleNamespace(
        found=SimpleNamespace(grid=np.linspace(0.01, 0.06, 30), rest=tried, random=tried),
        least_mean=SimpleNamespace(b=0.033), least_max=one, robust=one, asked=None,
        bare=0.019, den_hartog=SimpleNamespace(amplitude=absorber), published=0.034, exact=0.0339,
    )  # fmt: skip
