"""The response of a dynamometer to the force on the tool: wrong axes, resonance, drift, and leaking charge.

It is computed in the order domain and in the frame of the comparison. In helical milling this frame turns
with the orbit and the sensor does not, so the sensor's matrix is averaged over the turn within a time block.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from metro.cutting.helical import turn
from metro.cutting.reading import responses
from metro.units import Array, ComplexArray

ORBIT_POINTS = 5  # within a time block, over which the turning frame is averaged
Triple = tuple[float, float, float]
Rows = tuple[tuple[float, ...], ...]
NO_CROSSTALK: Rows = ((0.0, 0.0, 0.0),) * 3
Mixing = tuple[Rows, float, Rows]  # axes, rotation and crosstalk of a sensor
WORK_AXES: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Resonance:
    """A resonance of one degree of freedom on each channel: frequency, Hz (infinite: rigid), and damping."""

    frequency: Triple
    damping: Triple


@dataclass(frozen=True)
class Dynamometer:
    """A sensor (SI): its deviations from what the manifest declares.

    Attributes
    ----------
    axes : declared rows that turn the force on the tool, work frame, into the channels (reversed if the
        sensor reads the force on the work).
    rotation : of the sensor about +z against the declared, rad.
    crosstalk : what each channel (row) reads of the force along each channel, beside its own.
    resonances : in series; none: rigid.
    slope : drift of each channel, N/s.
    discharge : reciprocal time constant of each channel's charge, 1/s.
    """

    axes: Rows = WORK_AXES
    rotation: float = 0.0
    crosstalk: Rows = NO_CROSSTALK
    resonances: tuple[Resonance, ...] = ()
    slope: Triple = (0.0, 0.0, 0.0)
    discharge: Triple = (0.0, 0.0, 0.0)

    @property
    def ideal(self) -> bool:
        """Whether it reads the force as it is, but for a drift."""
        mixed = self.rotation != 0.0 or self.crosstalk != NO_CROSSTALK
        return not self.resonances and not mixed and not any(self.discharge)

    @property
    def mixing(self) -> Mixing:
        """What the shares of the channels depend on."""
        return self.axes, self.rotation, self.crosstalk

    @property
    def drift(self) -> Array:
        """Drift of the force on the tool that it reads, work frame, (3,) N/s."""
        return np.asarray(np.linalg.inv(np.array(self.axes)) @ np.array(self.slope))


@dataclass(frozen=True)
class Recording:
    """When and how a run was recorded, in s from the record's start, rev/s and rad/s.

    ``middles`` and ``span`` of the time blocks; ``zero_at``: time at which the zero was read; ``contact``:
    start of the cut; ``speed`` of the tool against the feed; ``orbit``: rate at which the frame turns.
    ``slope``, ``slope_sd``: of the means of revolutions along the cut, N/s, work frame; None: not read.
    """

    middles: tuple[float, ...]
    span: float
    speed: float
    orbit: float = 0.0
    zero_at: float = 0.0
    contact: float = 0.0
    slope: Triple | None = None
    slope_sd: Triple | None = None

    @property
    def attenuation(self) -> float:
        """Remaining share of a constant vector, averaged over a block in the turning frame."""
        return float(np.sinc(self.orbit * self.span / (2.0 * math.pi)))


STANDING = Recording((0.0,), 0.0, 0.0)  # whose frame does not turn


@lru_cache(maxsize=1024)
def transfer(sensor: Dynamometer, recording: Recording, orders: int) -> ComplexArray:
    """Map of the force to the reading at the orders 0…, in the comparison's frame: (blocks, orders, 3, 3)."""
    if sensor.ideal:
        return np.broadcast_to(np.eye(3, dtype=complex), (len(recording.middles), orders, 3, 3))
    modes = np.array([(one.frequency, one.damping) for one in sensor.resonances]).reshape(-1, 2, 3)
    shape = len(recording.middles), orders, 3, 3
    if not recording.orbit:  # then nothing turns, and all time blocks read alike but for what leaks away
        shares = _by_channel(sensor.mixing, STANDING)
        seen = np.broadcast_to(responses(shares, recording.speed, modes, orders), shape)
        if not any(sensor.discharge):
            return seen
        seen = seen.copy()
    else:
        seen = responses(_by_channel(sensor.mixing, recording), recording.speed, modes, orders)
    seen[:, 0] = _steady(sensor.mixing, sensor.discharge, recording)
    seen.flags.writeable = False
    return seen


@lru_cache(maxsize=64)
def _channels(mixing: Mixing) -> tuple[Array, Array]:
    """Return the inverse of the declared channels (3, 3), and the channels that the sensor has."""
    axes, rotation, crosstalk = mixing
    declared = np.array(axes)
    return np.linalg.inv(declared), (np.eye(3) + crosstalk) @ declared @ turn(np.array(-rotation))


@lru_cache(maxsize=512)
def _by_channel(mixing: Mixing, recording: Recording) -> Array:
    """Share of each channel in that map, (blocks, channels, 3, 3), averaged over the turn within a block."""
    inverse, true = _channels(mixing)
    points = ORBIT_POINTS if recording.orbit else 1
    shares = (np.arange(points) + 0.5) / points - 0.5
    times = np.array(recording.middles)[:, None] + shares * recording.span
    frame = turn(recording.orbit * times)
    back = np.swapaxes(frame, -1, -2) @ inverse
    by_channel = np.einsum("bpic,bpcj->bcij", back, true @ frame) / points
    by_channel.flags.writeable = False
    return np.asarray(by_channel)


@lru_cache(maxsize=512)
def _steady(mixing: Mixing, discharge: Triple, recording: Recording) -> Array:
    """Map (blocks, 3, 3) of the mean force to its reading while the charge leaks away.

    A channel with discharge rate 1/τ reads y' = F' − y/τ, y = 0 before the contact. A force that turns with
    the orbit is the real part of a complex one times e^{iωt}.
    """
    inverse, true = _channels(mixing)
    orbit, middles = recording.orbit, np.array(recording.middles)
    rate, since = np.array(discharge), middles[:, None] - recording.contact
    plane = (true[:, 0] - 1j * true[:, 1]) * np.exp(1j * orbit * recording.contact)
    turning = plane * _leaked(rate, orbit, since)
    rows = np.stack(
        [turning.real, -turning.imag, true[:, 2] * _leaked(rate, 0.0, since).real], axis=-1
    )  # (blocks, channels, 3)
    steady = np.swapaxes(turn(orbit * middles), -1, -2) @ inverse @ rows
    steady.flags.writeable = False
    return np.asarray(steady)


def _leaked(rate: Array, orbit: float, since: Array) -> ComplexArray:
    """Return the remaining part of e^{iωt}, applied from t = 0 on, after a discharge at ``rate`` (3,)."""
    if not orbit:
        return np.asarray(np.exp(-rate * since), complex)
    wave = np.exp(1j * orbit * since) + np.zeros_like(rate)
    with np.errstate(divide="ignore", invalid="ignore"):  # without discharge all of it is left
        left = (1j * orbit * wave + rate * np.exp(-rate * since)) / (1j * orbit + rate)
    return np.asarray(np.where(rate == 0.0, wave, left))
