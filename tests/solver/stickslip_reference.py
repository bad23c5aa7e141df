"""One ball that rubs, by an integrator that shares nothing with the package: DOP853 and modes.

The ball slides forwards or backwards, sticks to the floor, or rests on a wall; scipy integrates
each mode at rtol 1e-12 to the first of its events. Chatter is not followed: the run ends where a
flight becomes short.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp


def bare(event):
    """An event that ends the integration and does not ask for the mode."""

    def ends(t, s, _mode):
        return event(t, s)

    ends.terminal, ends.direction = True, getattr(event, "direction", 0.0)
    return ends


def reference_impacts(rig, base, release, duration, *, shortest):
    """(time, side) of the impacts, up to the end or to a flight shorter than `shortest` s."""
    o, nes = rig.oscillator, rig.nes[0]
    w, G, phase = 2.0 * np.pi * base.frequency, base.amplitude, base.phase
    mu, tilt, top, bottom = nes.friction, nes.tilt, nes.b, -nes.clearance(-1)

    def force(t, x, v):
        z = x - G * np.sin(w * t + phase)
        return -o.k1 * z - o.k3 * z**3 - o.c1 * (v - G * w * np.cos(w * t + phase))

    def held(t, s):
        return (force(t, s[0], s[1]) + nes.m * tilt) / (o.M + nes.m)

    def field(t, s, mode):
        x, v, _, u = s
        if mode == 0:
            a = held(t, s)
            return [v, a, v, a]
        return [v, (force(t, x, v) - nes.m * mu * mode) / o.M, u, tilt + mu * mode]

    def settled(t, s):
        """Mode of a ball without relative speed, and whether the wall holds it."""
        gap = s[0] - s[2]
        p = held(t, s) - tilt
        low, high = -mu, mu
        if top - gap < 1e-12:
            high = np.inf
        if gap - bottom < 1e-12:
            low = -np.inf
        if low <= p <= high:
            return 0, low, high
        return (1 if p > high else -1), low, high

    t, s = 0.0, [release.x0, release.v0, release.y0[0], release.vy0[0]]
    hits, low, high = [], -mu, mu
    mode = int(np.sign(s[1] - s[3]))
    if mode == 0:
        mode, low, high = settled(t, s)
    while t < duration:
        events = []
        if mode == 0:
            for bound in (low, high):
                if np.isfinite(bound):
                    events.append(lambda t, s, bound=bound: held(t, s) - tilt - bound)
        else:
            events = [
                lambda t, s: s[0] - s[2] - top,
                lambda t, s: s[0] - s[2] - bottom,
                lambda t, s: s[1] - s[3],
            ]
            for event, direction in zip(events, (1.0, -1.0, -float(mode)), strict=True):
                event.direction = direction
        run = solve_ivp(
            field, (t, duration), s, "DOP853", args=(mode,), events=[bare(e) for e in events],
            rtol=1e-12, atol=1e-14, max_step=0.02 / o.f0,
        )  # fmt: skip
        t, s = float(run.t[-1]), run.y[:, -1].copy()
        if t >= duration:
            break
        which = next(i for i, found in enumerate(run.t_events) if len(found))
        if mode == 0:
            mode = 1 if [b for b in (low, high) if np.isfinite(b)][which] == high else -1
            continue
        if which == 2:
            s[3] = s[1]
            mode, low, high = settled(t, s)
            continue
        side, rho = (1 if which == 0 else -1), s[1] - s[3]
        if hits and t - hits[-1][0] < shortest:
            break
        hits.append((t, side))
        r = nes.restitution(side, abs(rho))
        dv = -nes.m * (1.0 + r) * rho / (o.M + nes.m)
        s[1] += dv
        s[3] = s[1] + r * rho
        s[2] = s[0] - (top if side > 0 else bottom)
        mode = -int(np.sign(rho))
    return hits
