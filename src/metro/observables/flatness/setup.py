"""Influences on a face other than the force: deviations of spindle, tool and work from the program.

All of them are zero in a base model; each part is set by one effect of the library.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from metro.observables.flatness.path import Pace, Passages
from metro.observables.waviness.model import Vibration
from metro.units import Array

MINUTE = 60.0  # s
LEFT = 400  # places behind the last chip at which the remainder of a step is computed, and
NODES = 24  # of the Gauss rule for each: both to better than 1e-3 of the step


@dataclass(frozen=True)
class Setup:
    """Deviations of spindle, tool and work.

    Attributes
    ----------
    tilt : of the spindle about work x and y through the tool's tip, rad.
    growth : of tool and spindle from the start of the first pass: for each part of it the length in the first
        minute, m, and the time constant with which it levels off, s; infinite: it does not.
    levels : heights of the passes, from the first to the last of a face: coefficients, m, of the Legendre
        polynomials of degree 1, 2, … over that order.
    bow : (xx, xy, yy) of the work, m: height xx u² + xy u v + yy v², with u, v from −1 to 1 over the work.
    cubic : (uuu, uuv, uvv, vvv) of work or scanner, m: height uuu u³ + uuv u² v + uvv u v² + vvv v³.
    entry : transients: for each the additional height of the tip when the axis reaches the block's edge, m,
        the way over which it decays to 1/e, m, and the additional height where the force ends, m, which
        decays alike.
    droops: what the tip gives way by per force, m/N, when the axis reaches the block's edge and the force is
        whole, and the way over which it comes back to 1/e, m.
    """

    tilt: tuple[float, float] = (0.0, 0.0)
    growth: tuple[tuple[float, float], ...] = ()
    levels: tuple[float, ...] = ()
    bow: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cubic: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    entry: tuple[tuple[float, float, float], ...] = ()
    droops: tuple[tuple[float, float], ...] = ()

    @property
    def cutting(self) -> Setup:
        """What of it :meth:`cuts` has: all but the form of the work."""
        return replace(self, bow=Setup.bow, cubic=Setup.cubic)

    def cuts(self, x: Array, y: Array, passages: Passages, pace: Pace, *, force: float) -> Array:
        """Additional height of the cut at the points ``x``, ``y`` (n,) at each passage, (n, k) m.

        ``force`` : on the tool in full engagement, N.
        """
        about_x, about_y = self.tilt
        higher = np.zeros_like(passages.along)
        if about_x or about_y:
            higher = (y[:, None] - passages.y) * about_x - (x[:, None] - passages.x) * about_y
        for length, settles in self.growth:
            higher = higher - length * grown(pace.time(passages), settles)
        if any(self.levels):
            place = np.linspace(-1.0, 1.0, len(pace.edge)) if len(pace.edge) > 1 else np.zeros(1)
            higher = higher + np.polynomial.legendre.legval(place, [0.0, *self.levels])[passages.number]
        for amplitude, length, exit_height in self.entry:
            higher = higher + amplitude * _entered(length, passages, pace)
            if exit_height:
                higher = higher + exit_height * _left(length, passages, pace)
        for give, length in self.droops:
            higher = higher + give * force * _drooped(length, passages, pace)
        return np.asarray(higher)

    @property
    def bowed(self) -> Array:
        """Coefficients of the work's form, (7,) m, of :func:`bow_shapes`."""
        return np.array([*self.bow, *self.cubic])


def grown(time: Array, settles: float) -> Array:
    """Return the growth at times, s, over that in the first minute; it levels off with a time constant, s."""
    if math.isinf(settles):
        return time / MINUTE
    return np.asarray(np.expm1(-time / settles) / math.expm1(-MINUTE / settles))


def bow_shapes(x: Array, y: Array, size: tuple[float, float]) -> Array:
    """Return u², u v, v², u³, u² v, u v², v³ at points, (n, 7).

    u and v go from −1 to 1 over the work of a ``size``, m, whose corner is zero.
    """
    u, v = 2.0 * x / size[0] - 1.0, 2.0 * y / size[1] - 1.0
    return np.stack([u * u, u * v, v * v, u**3, u * u * v, u * v * v, v**3], axis=-1)


# A search moves other effects on beside a transient, and its height more often than its length.
@lru_cache(maxsize=64)
def _entered(length: float, passages: Passages, pace: Pace) -> Array:
    """Return what remains of a step of one at the block's edge, at passages, (n, k)."""
    inside = pace.inside(passages)
    return np.where(inside >= 0.0, np.exp(-np.abs(inside) / length), 0.0)


@lru_cache(maxsize=64)
def _left(length: float, passages: Passages, pace: Pace) -> Array:
    """Return what remains of a step of one that comes as the cutter leaves the block, at passages, (n, k)."""
    return left(pace.outside(passages), pace.radius, length)


@lru_cache(maxsize=64)
def _drooped(length: float, passages: Passages, pace: Pace) -> Array:
    """Return what is left at passages, (n, k), of steps up and down with the force, over that at the edge."""
    risen = left(pace.inside(passages), pace.radius, length)
    return (risen - _left(length, passages, pace)) / left(np.zeros(1), pace.radius, length)


def left(outside: Array, radius: float, length: float) -> Array:
    """Return what remains of a step of one that comes as the force falls while a cutter leaves the block.

    A part of the rim at the angle θ from the direction aside leaves when the axis is R sin θ before the edge:
    of the force, the remainder is the share of the cutter's width that is still cut, 1 − sin θ with
    R (1 − cos θ) the way since the front left. Each part of the step decays over ``length`` (m) to 1/e. Where
    a cutter enters the block, the force rises as it falls there.

    Parameters
    ----------
    outside : distance of the axis past the edge, m.
    """
    way, since, share = _leaving(radius, max(float(outside.max(initial=0.0)) + radius, radius))
    remains = (share * np.exp(-since / length)).sum(axis=1)
    return np.asarray(np.interp((outside + radius).T, way, remains, left=0.0).T)


@lru_cache(maxsize=64)
def _leaving(radius: float, most: float) -> tuple[Array, Array, Array]:
    """Return ways (n,) of the front up to ``most``; for each, ways since parts left, and their shares."""
    way = np.linspace(0.0, most, LEFT)
    end = np.arccos(1.0 - np.minimum(way / radius, 1.0))[:, None]
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    theta = 0.5 * end * (1.0 + nodes)
    since = way[:, None] - radius * (1.0 - np.cos(theta))
    return way, since, np.cos(theta) * weights * 0.5 * end


def swung(vibration: Vibration, phase: float, passages: Passages, pace: Pace) -> Array:
    """Height of a vibrating tip, at passages (n, k), m; each face has its own ``phase``, rad."""
    if not vibration.amplitude:
        return np.zeros_like(passages.along)
    ahead, aside = _waves(vibration.frequency, passages, pace)
    along, across = vibration.amplitude * math.cos(phase), vibration.amplitude * math.sin(phase)
    return np.asarray(along * ahead + across * aside)


# A search asks for one frequency at many phases: each run's own, and for each of them its derivatives.
@lru_cache(maxsize=64)
def _waves(frequency: float, passages: Passages, pace: Pace) -> tuple[Array, Array]:
    """Return sine and cosine of a frequency in time at passages, (n, k) each."""
    turn = 2.0 * math.pi * frequency * pace.time(passages)
    return np.sin(turn), np.cos(turn)
