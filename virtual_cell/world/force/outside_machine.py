"""Causes outside any library of effects, in machine and signal: each made as it happens."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.units import Array
from virtual_cell.world.force.cause import Cause, Moment
from virtual_cell.world.force.cutting import Change
from virtual_cell.world.force.spindle import Turning
from virtual_cell.world.force.travel import Wobble

_SAG, _CABLE, _JET, _STICK = 4, 5, 6, 7  # streams of a run's random numbers


@dataclass(frozen=True)
class LooseBolt(Cause):
    """A loose bolt: beyond ``preload`` (N) of one sign, a share of an axis' force goes past the quartz."""

    axis: int
    sign: float
    preload: float
    share: float

    def signal(self, moment: Moment, t: Array, read: Array) -> Array:
        """Bend the characteristic of the axis."""
        del moment, t
        out = read.copy()
        beyond = np.maximum(self.sign * read[:, self.axis] - self.preload, 0.0)
        out[:, self.axis] -= self.sign * self.share * beyond
        return out


@dataclass(frozen=True)
class CoolantJet(Cause):
    """A jet is opened in mid-run: it pushes the work by ``push`` (3,), N, and eases the rubbing."""

    push: tuple[float, float, float]
    eased: float
    from_share: float

    def metal(self, moment: Moment) -> Change | None:
        """Less friction while it runs."""
        return lambda points: (1.0, 1.0 - self.eased * self._open(moment, points.t))

    def load(self, moment: Moment, t: Array, force: Array) -> Array:
        """Push the work: on the tool it would be the other way."""
        rough = 1.0 + 0.15 * moment.rng(_JET).standard_normal(len(t))
        return np.asarray(force - (self._open(moment, t) * rough)[:, None] * np.array(self.push))

    def _open(self, moment: Moment, t: Array) -> Array:
        since = (moment.share - self.from_share) * 25.0 + t / moment.duration - 0.5
        return np.asarray(1.0 / (1.0 + np.exp(-np.clip(25.0 * since, -50.0, 50.0))))


@dataclass(frozen=True)
class PowerSag(Cause):
    """The supply sags in some runs: the spindle loses a share of its speed for a while."""

    share: float
    seconds: float
    chance: float

    def speed(self, moment: Moment, t: Array) -> Array | float:
        """Return a dip with soft ends, somewhere in the record."""
        rng = moment.rng(_SAG)
        if rng.uniform() > self.chance:
            return 0.0
        middle = moment.duration * rng.uniform(0.4, 0.9)
        return np.asarray(-self.share * np.exp(-(((t - middle) / (0.5 * self.seconds)) ** 4)))


@dataclass(frozen=True)
class WornWay(Cause):
    """A worn way: along it the feed runs uneven by a share, and the table dips by ``dip`` m."""

    wave: float
    share: float
    dip: float
    at: float

    def feed(self, moment: Moment, t: Array, x: Array) -> tuple[Array | float, Array | float]:
        """Return the same at each place of the way, whatever the run."""
        del moment, t
        return self.share * np.sin(2.0 * math.pi * x / self.wave + self.at), 0.0

    def depth(self, moment: Moment, t: Array, x: Array) -> Array | float:
        """Where the table dips, less is cut."""
        del moment, t
        return np.asarray(-self.dip * (0.5 + 0.5 * np.cos(2.0 * math.pi * x / self.wave + self.at)))


@dataclass(frozen=True)
class MovingResonance(Cause):
    """A wall of the work swings, at a frequency that rises as it is cut away: ``rise`` over the session."""

    axis: int
    hz: float
    rise: float
    damping: float
    share: float

    def signal(self, moment: Moment, t: Array, read: Array) -> Array:
        """Lead a share of the force to the sensor through the wall."""
        del t
        natural = self.hz * (1.0 + self.rise * moment.share)
        through = filtered(read[:, self.axis], moment.rate, natural, self.damping)
        out = read.copy()
        out[:, self.axis] += self.share * (through - read[:, self.axis])
        return out


@dataclass(frozen=True)
class SaggingGain(Cause):
    """A plug that corrodes: one channel reads ever less of its force as the session goes on."""

    axis: int
    share: float

    def signal(self, moment: Moment, t: Array, read: Array) -> Array:
        """Scale one channel."""
        del t
        scaled = read.copy()
        scaled[:, self.axis] *= 1.0 - self.share * moment.share
        return scaled


def filtered(load: Array, rate: float, hz: float, damping: float) -> Array:
    """Response (n,) of a mode, or low pass of second order, to a load (n,) at ``rate``."""
    f = np.fft.rfftfreq(len(load), 1.0 / rate)
    response = hz**2 / (hz**2 + 2.0j * damping * hz * f - f**2)
    return np.asarray(np.fft.irfft(np.fft.rfft(load) * response, len(load)))


@dataclass(frozen=True)
class CableMicrophonics(Cause):
    """A cable that is shaken makes charge of its own on one channel, while and because it is cut."""

    axis: int
    size: float
    hz: float

    def signal(self, moment: Moment, t: Array, read: Array) -> Array:
        """Swing of the cable, and charge that stays until it is moved again."""
        rng = moment.rng(_CABLE)
        shaken = np.abs(read).sum(axis=1) > 0.1 * float(np.abs(read).sum(axis=1).max())
        swing = filtered(rng.standard_normal(len(t)), moment.rate, self.hz, 0.15)
        left = float(rng.uniform(-1.5, 1.5)) * np.cumsum(shaken) / moment.rate / 0.2
        out = read.copy()
        out[:, self.axis] += self.size * shaken * swing / max(float(swing.std()), 1e-9)
        out[:, self.axis] += self.size * np.tanh(left)
        return out


@dataclass(frozen=True)
class RaceOvality(Cause):
    """Oval or three-lobed races: the spindle's axis goes round ``lobes`` times in a revolution."""

    lobes: int
    size: float
    angle: float

    def wobble(self, moment: Moment, turning: Turning) -> Wobble | None:
        """Follow the races, fixed in the housing."""
        del moment

        def moved(t: Array) -> Array:
            phase = self.lobes * turning.at(t) + self.angle
            return self.size * np.stack([np.cos(phase), 0.6 * np.sin(phase)])

        return moved


@dataclass(frozen=True)
class CornerBlending(Cause):
    """The controller blends a corner: over a length about a place the feed drops, and the path bows aside."""

    place: float
    length: float
    drop: float
    aside: float

    def feed(self, moment: Moment, t: Array, x: Array) -> tuple[Array | float, Array | float]:
        """About the same place of each cut."""
        del moment, t
        bell = np.exp(-0.5 * ((x - self.place) / self.length) ** 2)
        return -self.drop * bell, self.aside * bell


@dataclass(frozen=True)
class StickSlip(Cause):
    """The feed axis sticks and slips: its speed creeps up and drops, so many times per second."""

    share: float
    hz: float

    def feed(self, moment: Moment, t: Array, x: Array) -> tuple[Array | float, Array | float]:
        """Return a saw tooth of some phase."""
        del x
        phase = np.mod(t * self.hz + moment.rng(_STICK).uniform(), 1.0)
        return self.share * (2.0 * phase - 1.0), 0.0
