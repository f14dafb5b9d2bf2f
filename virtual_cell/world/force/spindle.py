"""A spindle that does not turn evenly: it wanders, droops when the tool enters, and ripples with its poles.

The angle is a nonlinear function of time. It is integrated once per run on a fine grid, and the times at
which earlier teeth stood where one stands now are found by inverting it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import drawn_signed, drawn_size
from virtual_cell.units import Array

GRID = 1e-4  # s; between its points the angle is taken as straight: pole ripple bends it by 1e-6 rad
BEFORE = 0.25  # s of turning known before a record begins: several revolutions of a slow spindle


@dataclass(frozen=True)
class Spindle:
    """How a spindle departs from its programmed speed; all shares are of that speed.

    Attributes
    ----------
    off : constant error of the speed. wander, wander_s : standard deviation and correlation time (s) of a
        slow wander. droop, recovery_s : loss when the tool enters, and the time (s) in which the drive makes
        it good. ripple, poles : amplitude of the ripple of its torque, and how often it comes in a
        revolution.
    """

    off: float = 0.0
    wander: float = 0.0
    wander_s: float = 1.0
    droop: float = 0.0
    recovery_s: float = 0.2
    ripple: float = 0.0
    poles: int = 4


def drawn_spindle(rng: np.random.Generator) -> Spindle:
    """Draw a spindle over what is measured of motor spindles."""
    return Spindle(
        off=drawn_signed(rng, 0.0002, 0.005),
        wander=drawn_size(rng, 0.0001, 0.003),
        wander_s=drawn_size(rng, 0.2, 5.0),
        droop=drawn_size(rng, 0.0005, 0.005),
        recovery_s=drawn_size(rng, 0.04, 0.6),
        ripple=drawn_size(rng, 0.00002, 0.0004),
        poles=int(rng.choice([2, 4, 6, 8, 12])),
    )


@dataclass(frozen=True)
class Turning:
    """Angle of the spindle, rad, on a grid of times, s, both rising."""

    t: Array
    angle: Array

    def at(self, t: Array) -> Array:
        """Angle (rad) at times ``t``."""
        return np.asarray(np.interp(t, self.t, self.angle))

    def when(self, angle: Array) -> Array:
        """Return the times (s) at which the spindle stands at ``angle``."""
        return np.asarray(np.interp(angle, self.angle, self.t))


def turning(
    spindle: Spindle,
    nominal: float,
    until: float,
    contact: tuple[float, float],
    *,
    rng: np.random.Generator,
    change: Array | float = 0.0,
) -> Turning:
    """Turn the spindle, programmed to ``nominal`` rad/s, from before t = 0 to ``until`` (s).

    ``contact``: when the tool enters and when it has left the work, s. ``change`` of the speed, as a share,
    on :func:`grid`, of other causes.
    """
    t = grid(until)
    rate = 1.0 + spindle.off + change + _wander(spindle, len(t), rng)
    # The drive meets the torque of the cut late: it sags within a tenth of the time in which it recovers.
    since, after = (np.maximum(t - moment, 0.0) / spindle.recovery_s for moment in contact)
    rate = rate - spindle.droop * (_sag(since) - _sag(after))
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))]) * nominal
    angle += rng.uniform(0.0, 2.0 * math.pi)
    rippled = spindle.ripple / spindle.poles * np.sin(spindle.poles * angle)
    return Turning(t, angle + rippled)


def grid(until: float) -> Array:
    """Return times (s) at which the turning of a record that ends at ``until`` is known."""
    return np.asarray(np.arange(-BEFORE, until + BEFORE, GRID))


def _sag(since: Array) -> Array:
    return np.asarray((1.0 - np.exp(-10.0 * since)) * np.exp(-since))


def _wander(spindle: Spindle, count: int, rng: np.random.Generator) -> Array:
    """First-order Gauss–Markov wander (count,), which has been going on before."""
    from scipy import signal

    keep = math.exp(-GRID / spindle.wander_s)
    start = float(rng.standard_normal())
    drive = math.sqrt(1.0 - keep**2) * rng.standard_normal(count)
    series, _ = signal.lfilter([1.0], [1.0, -keep], drive, zi=[keep * start])
    return np.asarray(spindle.wander * series)
