"""The controller of an arm: how its servos stray, and what arrives of what it logs.

Torques are currents times constants that are off by 1 to 5 % and fall as motors warm (0.1 to 0.2 % per
kelvin of NdFeB magnets), in the steps of the current loop. Packets over UDP come late, twice or not at all,
by a clock of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.noise import quantised, sensor_noise
from virtual_cell.units import DEG, Array
from virtual_cell.world.draws import between, per_joint, signed

_HANDED = 4e-5  # s between packets that come out of a queue


@dataclass(frozen=True, eq=False)
class Servo:
    """Position loops: ``stiffness`` (6,) N m/rad; ``reset`` s of the integral; ``band`` Hz; ``lag`` s.

    ``interpolation`` (6,) rad: error of the encoders, ``periods`` (6,) per turn of the joint; the loop makes
    the joint follow it, and the log does not show it.
    """

    stiffness: Array
    reset: float
    band: float
    lag: float
    interpolation: Array
    periods: Array

    def strayed(self, torque: Array, rate: Array, dt: float) -> Array:
        """Angle (n, 6), rad, by which the joints miss their set-points under torques of the drives (n, 6)."""
        from scipy import signal

        omega, slow = 2.0 * math.pi * self.band, 1.0 / self.reset
        num, den, _ = signal.cont2discrete(
            ([omega**2, 0.0], np.polymul([1.0, slow], [1.0, 1.6 * omega, omega**2]).tolist()),
            dt,
            method="foh",
        )
        given = signal.lfilter(np.ravel(num), den, torque - torque[0], axis=0)
        return np.asarray(-given / self.stiffness - self.lag * rate)

    def misread(self, q: Array) -> Array:
        """Error (n, 6), rad, of the encoders at joint angles (n, 6)."""
        return np.asarray(self.interpolation * np.sin(self.periods * q))


@dataclass(frozen=True, eq=False)
class Recorder:
    """What a log is made of.

    Attributes
    ----------
    period : s. set_step, read_step : of the logged angles, deg. noise : of the encoders, rad.
    torque_noise, current_step : N m, all joints' and (6,). gain : (6,) relative error of the torques, and
        ``fading`` that of warm motors beyond it.
    jitter : s, of the stamps. late, lost, doubled : shares of the packets.
    skew : of the clock against that of the dynamometer. slip : s, by which its offset differs between runs.
    """

    period: float
    set_step: float
    read_step: float
    noise: float
    torque_noise: float
    current_step: Array
    gain: Array
    fading: float
    jitter: float
    late: float
    lost: float
    doubled: float
    skew: float
    slip: float

    def arrivals(self, duration: float, rng: np.random.Generator) -> tuple[Array, Array]:
        """Return times (n,), s, of what packets hold, and of their stamps, from the start of the log."""
        due = np.arange(int(duration / self.period)) * self.period
        delay = rng.exponential(self.jitter, len(due))
        delay += (rng.uniform(size=len(due)) < self.late) * rng.uniform(1.0, 4.0, len(due)) * self.period
        stamp = np.maximum.accumulate(due + delay)
        here = rng.uniform(size=len(due)) >= self.lost
        due, stamp = due[here], stamp[here]
        again = np.flatnonzero(rng.uniform(size=len(due)) < self.doubled)
        due = np.concatenate([due, due[again]])
        stamp = np.concatenate([stamp, stamp[again] + 0.2 * self.period])
        order = np.argsort(stamp, kind="stable")
        due, stamp = due[order], stamp[order]
        queued = np.arange(len(stamp)) * _HANDED  # packets that wait for one another come out one by one
        return due, np.maximum.accumulate(stamp - queued) + queued

    def read(self, torque: Array, warmth: float, rng: np.random.Generator) -> Array:
        """Torques (n, 6), N m, as they are logged."""
        wandering = float(rng.uniform(0.1, 0.8))
        noise = [sensor_noise(len(torque), self.torque_noise, rng, pink=wandering) for _ in range(6)]
        felt = torque * (1.0 + self.gain) * (1.0 + self.fading * warmth)
        felt = felt + np.stack(noise, axis=1)
        return np.asarray(np.round(felt / self.current_step) * self.current_step)

    def angles(self, wanted: Array, strayed: Array, rng: np.random.Generator) -> dict[str, Array]:
        """Columns of set-points and of what the encoders read, deg, of angles (n, 6), rad."""
        actual = wanted + strayed + rng.normal(0.0, self.noise, wanted.shape)
        columns = {f"q{i}_set_deg": quantised(wanted[:, i - 1] / DEG, self.set_step) for i in range(1, 7)}
        read = {f"q{i}_deg": quantised(actual[:, i - 1] / DEG, self.read_step) for i in range(1, 7)}
        return columns | read


def servo(rng: np.random.Generator, stiffness: Array, ratio: Array) -> Servo:
    """Draw the position loops of joints of some ``stiffness`` (6,) and motor turns per turn (6,)."""
    return Servo(
        stiffness * per_joint(rng, 1.5, 6.0),
        reset=between(rng, 0.08, 0.5),
        band=between(rng, 7.0, 18.0),
        lag=between(rng, 0.002, 0.03),
        interpolation=per_joint(rng, 3e-8, 6e-7),
        periods=ratio * rng.choice([3.0, 4.0, 8.0]),
    )


def recorder(rng: np.random.Generator, periods: tuple[float, ...]) -> Recorder:
    """Draw how the log is taken, at one of some periods, s."""
    step = np.array([0.5, 0.5, 0.4, 0.15, 0.15, 0.1]) * per_joint(rng, 0.5, 3.0)
    return Recorder(
        period=float(rng.choice(periods)),
        set_step=float(rng.choice([2e-5, 1e-4])),
        read_step=float(rng.choice([1e-5, 5e-5, 1e-4])),
        noise=between(rng, 8e-7, 6e-6),
        torque_noise=round(between(rng, 0.8, 5.0), 1),
        current_step=step,
        gain=np.array([signed(rng, 0.004, 0.04) for _ in range(6)]) + signed(rng, 0.004, 0.03),
        fading=-between(rng, 0.003, 0.03),
        jitter=between(rng, 2e-5, 6e-4),
        late=between(rng, 1e-4, 8e-3),
        lost=between(rng, 1e-4, 4e-3),
        doubled=between(rng, 5e-5, 2e-3),
        skew=signed(rng, 2e-6, 1e-4),
        slip=between(rng, 1.5e-4, 3e-3),
    )
