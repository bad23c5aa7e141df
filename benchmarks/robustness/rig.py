"""The rig of Table 2 and the ways in which a real one departs from it; SI throughout."""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Relative speed at an impact, m/s, at which a restitution that depends on speed is `r`.
WORKING_SPEED = 1.3
#: Amplitude of the mass, m, at which damping and stiffness that depend on it count.
WORKING_AMPLITUDE = 5.3e-3


@dataclass(frozen=True)
class Body:
    """What moves: oscillator, ball, contact and floor.

    Attributes
    ----------
    M, c1, k1, m, r : the rig of the model.
    r_minus : restitution of the wall at x - y = -b; None: `r`, as of the other.
    r_slope : change of r per m/s of relative speed, around `WORKING_SPEED`.
    friction : mu g of the ball on its floor, m/s^2.
    tilt : acceleration along the cavity that its slope gives the ball, m/s^2.
    contact : duration of a contact at the working speed, s; 0: an instant.
    shorter : power of the speed by which it is shorter: 1/5 of a ball on a plane.
    quadratic, coulomb, cubic : forces quadratic v |v|, coulomb sign(v), cubic x^3.
    roll : share of the floor's acceleration that a ball takes which rolls and does not slip: 2/7
        of a solid one.
    pull : 1/s^2, of a magnet or a hollow that draws the ball to the middle of its cavity.
    drag : 1/m, of the air in the cavity, times the square of the ball's speed beside it.
    scatter : of the restitution from one impact to the next, as a share.
    """

    M: float = 4.7
    c1: float = 3.02
    k1: float = 1.147e4
    m: float = 0.032
    r: float = 0.6
    r_minus: float | None = None
    r_slope: float = 0.0
    friction: float = 0.0
    tilt: float = 0.0
    contact: float = 0.0
    shorter: float = 0.0
    quadratic: float = 0.0
    coulomb: float = 0.0
    cubic: float = 0.0
    roll: float = 0.0
    pull: float = 0.0
    drag: float = 0.0
    scatter: float = 0.0

    def truth(self) -> dict[str, float]:
        """M, c1, k1 and r that a linear model of this rig should have where it works.

        Damping and stiffness are those of one harmonic at `WORKING_AMPLITUDE`; r is the mean of
        both walls at `WORKING_SPEED`.
        """
        A, k1 = WORKING_AMPLITUDE, self.k1 + 0.75 * self.cubic * WORKING_AMPLITUDE**2
        w = math.sqrt(k1 / self.M)
        c1 = self.c1 + 8.0 / (3.0 * math.pi) * self.quadratic * w * A
        c1 += 4.0 * self.coulomb / (math.pi * w * A)
        other = self.r if self.r_minus is None else self.r_minus
        return {"M": self.M, "c1": c1, "k1": k1, "r": 0.5 * (self.r + other)}


@dataclass(frozen=True)
class Drive:
    """Base motion amplitude sin(2 pi frequency t), and a second component beside it.

    Attributes
    ----------
    drift : Hz/s, by which the frequency changes.
    """

    amplitude: float = 0.0
    frequency: float = 7.862
    second_share: float = 0.0
    second_frequency: float = 11.3
    drift: float = 0.0


@dataclass(frozen=True)
class Sensors:
    """How the motion is seen.

    Attributes
    ----------
    rate : samples a second.
    pulse : s, how long the accelerometer shows an instantaneous contact.
    pulse_area : shown over true momentum of an impact, beside the gain of the accelerometer.
    ring, ring_damping : resonance of the sensor's mount, Hz; None: none.
    mode, mode_share, mode_damping : a local mode (Hz) that answers each impact with this share of
        the jump, in both channels.
    corner : Hz, of an accelerometer that passes no steady acceleration.
    laser_gain : measured over true displacement.
    cross_axis : share of a motion across, a quarter of a cycle late, in the acceleration.
    noise : in units of 6 um (mass), 2 um (base) and 0.3 m/s^2.
    accelerometer_gain, base_gain : measured over true.
    late, low_pass : s and Hz, delay and first-order low-pass of the laser.
    limit, laser_limit : m/s^2 and m, at which accelerometer and laser saturate.
    hum : of 50 Hz in both channels, in units of their noise.
    base_hum : of 50 Hz in the base channel, m.
    offset : of both channels, in units of 1 mm and 10 m/s^2.
    vibrometer : whether it is a velocity in the place of the displacement, in m/s, with noise of
        3e-4 m/s.
    laser_corner : Hz, of a vibrometer that is AC-coupled.
    bits : of the converter, over a range a little wider than each channel's; None: ideal.
    """

    rate: float = 1e4
    pulse: float = 4e-4
    pulse_area: float = 1.0
    ring: float | None = None
    ring_damping: float = 0.03
    mode: float | None = None
    mode_share: float = 0.0
    mode_damping: float = 0.02
    corner: float | None = None
    laser_gain: float = 1.0
    cross_axis: float = 0.0
    noise: float = 1.0
    accelerometer_gain: float = 1.0
    base_gain: float = 1.0
    late: float = 0.0
    low_pass: float | None = None
    limit: float | None = None
    laser_limit: float | None = None
    hum: float = 0.0
    base_hum: float = 0.0
    offset: float = 0.0
    vibrometer: bool = False
    laser_corner: float | None = None
    bits: int | None = None
    base: bool = True
    laser: bool = True
    accelerometer: bool = True


@dataclass(frozen=True)
class Sheet:
    """Where the sheet of a campaign differs from what was done.

    Attributes
    ----------
    base : true over stated base amplitude.
    frequency : true over stated frequency.
    clearance, one_clearance : m, true less stated, of all records or of one.
    added, one_added : kg, true less stated, of all loads or of the first.
    ball : kg, true less stated.
    warming : share by which k1 falls from the first record to the last.
    copied : whether the file of the third periodic test was saved again as that of the fourth.
    """

    base: float = 1.0
    frequency: float = 1.0
    clearance: float = 0.0
    one_clearance: float = 0.0
    added: float = 0.0
    one_added: float = 0.0
    ball: float = 0.0
    warming: float = 0.0
    copied: bool = False
