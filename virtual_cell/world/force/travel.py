"""How the spindle axis really travels: up to its feed with a lag, along a way, and out of the block."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from virtual_cell.motion import Orbit, Straight
from virtual_cell.units import Array

GRID = 2.5e-4  # s; between its points the axis is taken to move evenly: it is off by 10 nm at 1 m/s²

Wobble = Callable[[Array], Array]  # times (n,) → displacement (2, n) of the axis against the slides, m


@dataclass(frozen=True)
class Travel(Straight):
    """A straight cut of which the slides make what they can.

    ``times`` (s) and ``along``, ``across`` (m) are where they are; ``wobble`` is what the spindle adds.
    """

    times: Array = field(default_factory=lambda: np.zeros(1))
    along: Array = field(default_factory=lambda: np.zeros(1))
    across: Array = field(default_factory=lambda: np.zeros(1))
    wobble: Wobble | None = None

    def centre(self, t: Array) -> tuple[Array, Array]:
        """Position of the axis."""
        x, y = np.interp(t, self.times, self.along), np.interp(t, self.times, self.across)
        if self.wobble is None:
            return x, y
        dx, dy = self.wobble(t)
        return x + dx, y + dy

    def reached(self, place: float) -> float:
        """Time (s) at which the axis comes to a place (m)."""
        return float(np.interp(place, self.along, self.times))


@dataclass(frozen=True)
class Circling(Orbit):
    """A helical path on which the spindle's axis may wobble, and the whole machine sways up and down.

    It stands too high by ``sway`` (m) times the cosine of the direction of feed less ``sway_phase`` (rad).
    """

    wobble: Wobble | None = None
    sway: float = 0.0
    sway_phase: float = 0.0

    def centre(self, t: Array) -> tuple[Array, Array]:
        """Position of the axis."""
        x, y = super().centre(t)
        if self.wobble is None:
            return x, y
        dx, dy = self.wobble(t)
        return x + dx, y + dy

    def too_high(self, direction: Array) -> Array:
        """By how much (m) the tool stands too high where it is fed along ``direction`` (rad)."""
        return np.asarray(self.sway * np.cos(direction - self.sway_phase))

    def drop(self, t: Array) -> Array:
        """Speed (n,), m/s, at which the tool goes down."""
        swaying = self.sway * np.sin(self.direction(t) - self.sway_phase) * self.rate
        return np.asarray(self.pitch * abs(self.rate) / (2.0 * math.pi) + swaying)

    def cut_below(self, t: Array) -> Array:
        """Speed (n,), m/s, at which the bottom cuts at rising times ``t``: none where it was lower before."""
        orbit = 2.0 * math.pi / abs(self.rate)
        step = float(t[-1] - t[0]) / (len(t) - 1)
        past = math.ceil(orbit / step)
        times = t[0] + step * np.arange(-past, len(t))
        height = self.too_high(self.direction(times)) - self.pitch * times / orbit
        floor = np.minimum.accumulate(height)
        return np.asarray(-np.gradient(floor, step)[past:])

    def ceiling(self, direction: Array, sine: Array, cosine: Array, reach: Array) -> Array:
        """Height (m) above the tip up to which there is material: the machine stood higher or lower then."""
        ago = 2.0 * math.copysign(1.0, self.rate) * self.covers(direction, sine, cosine, reach)
        even = super().ceiling(direction, sine, cosine, reach)
        return np.asarray(even + self.too_high(direction + ago) - self.too_high(direction))


def travelled(
    programmed: Straight,
    until: float,
    *,
    ramp_s: float,
    reached: float = 1.0,
    before: float = 0.3,
    change: Callable[[Array, Array], tuple[Array, Array]] | None = None,
) -> Travel:
    """Move along a programmed cut until a time (s): the feed comes up with a lag of ``ramp_s``.

    ``reached``: share of the programmed feed that is reached. A move that starts in the block has long come
    up to its feed. ``change(t, x)`` gives the relative change of the feed and the displacement across (m) at
    times and programmed places.
    """
    times = np.arange(-before, until + before, GRID)
    feed = np.full_like(times, reached * programmed.speed)
    if programmed.start < 0.0:
        feed *= 1.0 - np.exp(-np.maximum(times, 0.0) / ramp_s)
    across = np.zeros_like(times)
    if change is not None:
        relative, across = change(times, _place(times, feed, programmed.start))
        feed = feed * (1.0 + relative)
    place = _place(times, feed, programmed.start)
    return Travel(
        programmed.speed,
        programmed.start,
        programmed.length,
        programmed.side,
        programmed.edge,
        times=times,
        along=place,
        across=across,
    )


def _place(times: Array, feed: Array, start: float) -> Array:
    """Place (m) at times, ``start`` at t = 0."""
    gone = np.concatenate([[0.0], np.cumsum(0.5 * (feed[1:] + feed[:-1]) * np.diff(times))])
    return np.asarray(start + gone - np.interp(0.0, times, gone))


def wobbling(motion: Travel | Circling, wobble: Wobble | None) -> Travel | Circling:
    """Let the spindle's axis wobble on a motion."""
    return motion if wobble is None else replace(motion, wobble=wobble)
