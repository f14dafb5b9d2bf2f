"""What a hidden cause can do to a run of an arm, and what it may know of the run to do so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array


@dataclass(frozen=True, eq=False)
class During:
    """A run of a line, at n even times.

    Attributes
    ----------
    t : (n,) s since the records began. x : (n,) m, of the axis from the face where the tool enters.
    q, rate : (n, 6) rad, rad/s. sliding : (n, 6) −1 … 1, dry friction over its level.
    force : (n, 3) N, on the tip, base frame. torque : (n, 6) N m, that it puts on the links.
    engaged : (n,) share of the full cut. jacobian : (n, 3, 6) of the tip, m/rad.
    normal : (3,) out of the wall, base frame. along : (3,) feed, base frame.
    length : m, of the wall. feed : m/s. turns : of the spindle per s. order : of the run in the session, of
        ``runs``. since : s, from the session's start. cutting : or in the air.
    seed : of what differs between runs.
    """

    t: Array
    x: Array
    q: Array
    rate: Array
    sliding: Array
    force: Array
    torque: Array
    engaged: Array
    jacobian: Array
    normal: Array
    along: Array
    length: float
    feed: float
    turns: float
    order: int
    runs: int
    since: float
    cutting: bool
    seed: int

    @property
    def dt(self) -> float:
        """Step, s."""
        return float(self.t[1] - self.t[0])

    @property
    def share(self) -> float:
        """Where the run is in the session, 0 … 1."""
        return (self.order - 1) / max(self.runs - 1, 1)

    def resisting(self, force: Array) -> Array:
        """Torque (n, 6), N m, that resists at the links where a force (n, 3), N, acts on the tip besides."""
        return np.asarray(-np.einsum("nai,na->ni", self.jacobian, force))

    def own(self) -> np.random.Generator:
        """Return the generator of what differs between runs, the same at every call."""
        return np.random.default_rng([self.seed, self.order, int(self.cutting)])


@dataclass(frozen=True, eq=False)
class Cause:
    """What a cause adds; None where it does nothing.

    Attributes
    ----------
    load : torque (n, 6), N m, that resists at the links: drives carry it, and springs are twisted by it.
    drive : torque (n, 6), N m, that resists at the motors.
    logged : torques (n, 6) as logged, of what they are. sensed : force (n, 3), as the dynamometer feels it,
        of what acts on the tool at times (n,) of its record: given (run, t, force).
    tip : motion (n, 3), m, of the tip, base frame. traced : heights (k,), m, as traced, of what they are at
        places (k,): given (run, x, z).
    """

    load: Callable[[During], Array] | None = None
    drive: Callable[[During], Array] | None = None
    logged: Callable[[During, Array], Array] | None = None
    sensed: Callable[[During, Array, Array], Array] | None = None
    tip: Callable[[During], Array] | None = None
    traced: Callable[[During, Array, Array], Array] | None = None


def on_joint(joint: int, values: Array) -> Array:
    """Put values (n,) on a joint, 1 … 6: (n, 6)."""
    whole = np.zeros((len(values), 6))
    whole[:, joint - 1] = values
    return whole


def smooth_step(t: Array, at: float, width: float) -> Array:
    """0 before, 1 after ``at``, within about ``width``."""
    return np.asarray(0.5 + 0.5 * np.tanh((t - at) / width))
