"""What the displacement around an impact is made of: a smooth motion and the response to a jump."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vinesexp.arrays import FloatArray


@dataclass(frozen=True)
class JumpResponse:
    """How the displacement answers a jump: exp(-rate s) sin(w_free s)/w_free.

    `w` is that of the oscillation around it, rad/s; `w_free` (None: the same) and `rate` (1/s) are
    the oscillator's own; `common` is the relative error that they leave to all jumps alike.
    """

    w: float
    w_free: float | None = None
    rate: float = 0.0
    common: float = 0.0

    def bend(self, s: FloatArray, step: float) -> FloatArray:
        """Displacement s after a unit jump of velocity, averaged over `step`."""
        w = self.w_free or self.w
        late = np.maximum(s, 0.0)
        value = np.sinc(0.5 * w * step / np.pi) * np.exp(-self.rate * late) * np.sin(w * late) / w
        inside = np.abs(s) < 0.5 * step
        return np.where(inside, (s + 0.5 * step) ** 2 / (2.0 * step), value)

    def since(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement and velocity s after a unit jump."""
        w = self.w_free or self.w
        fall = np.exp(-self.rate * s)
        x = fall * np.sin(w * s) / w
        return x, fall * np.cos(w * s) - self.rate * x


def smooth(s: FloatArray, w: float, *, full: bool) -> FloatArray:
    """What the motion without the jump is made of: drift, oscillation, its slow change."""
    columns = [np.ones_like(s), s * w, np.cos(w * s), np.sin(w * s)]
    if full:
        columns += [w * s * np.cos(w * s), w * s * np.sin(w * s)]
    return np.stack(columns, axis=-1)


def smooth_slope(s: FloatArray, w: float, *, full: bool) -> FloatArray:
    zero, one = np.zeros_like(s), np.ones_like(s)
    columns = [zero, one, -np.sin(w * s), np.cos(w * s)]
    if full:
        columns += [
            np.cos(w * s) - w * s * np.sin(w * s),
            np.sin(w * s) + w * s * np.cos(w * s),
        ]
    return w * np.stack(columns, axis=-1)
