"""Waves that come with a joint's angle, as the tip shows them behind the first mode of the arm."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.units import Array, ComplexArray


@dataclass(frozen=True)
class Structure:
    """The first mode of an arm, by which its tip follows its joints: Hz, and share of critical damping."""

    frequency: float
    damping: float

    def gain(self, frequency: Array) -> ComplexArray:
        """Motion of the tip over that of the joints at frequencies (…), Hz, below zero where time runs back.

        An oscillator on a moving support whose damper is to the ground, e^{iωt}: 1 / (1 − r² + 2iζr).
        """
        ratio = frequency / self.frequency
        return np.asarray(1.0 / (1.0 - ratio**2 + 2j * self.damping * ratio))


@dataclass(frozen=True)
class Shape:
    """What a ripple does at each place, but for its size.

    ``joint`` from 0; ``order`` in cycles per revolution of the joint; ``structure`` that follows it.
    """

    joint: int
    order: float
    structure: Structure

    def following(self, q: Array, pace: Array, times: int) -> ComplexArray:
        """Complex amplitude (m,), of the cosine, of what the tip makes of 1 N m at so many times the order.

        It is of the torque that would twist the joint without masses as far as the tip goes with them. Where
        the speed changes little within a cycle of the structure, each place has the gain of its own
        frequency.

        Parameters
        ----------
        q, pace : (m, n) angles of the joints, rad, and their mean speeds around each place, rad/s.
        """
        angle = self.order * q[:, self.joint]
        frequency = self.order * pace[:, self.joint] / (2.0 * math.pi)
        return np.asarray(np.exp(1j * times * angle) * self.structure.gain(times * frequency))


@dataclass(frozen=True)
class AmplifiedRipple:
    """A gear's ripple, and how the structure follows it: twice an order has another frequency and gain.

    Attributes
    ----------
    joint : from 0. order : cycles per revolution of the joint.
    first, second : torque of the order and of its double, N m: (of the sine, of the cosine) of the angle.
    """

    joint: int
    order: float
    first: tuple[float, float]
    second: tuple[float, float]
    structure: Structure

    @property
    def shape(self) -> Shape:
        """What it does at each place, but for its size."""
        return Shape(self.joint, self.order, self.structure)

    @property
    def multiples(self) -> tuple[tuple[int, tuple[float, float]], ...]:
        """The multiples of the order that there are, each with its torques, N m."""
        return tuple(
            (times, torque) for times, torque in enumerate((self.first, self.second), start=1) if any(torque)
        )

    def at(self, q: Array, pace: Array) -> Array:
        """Torque (m,), N m, as of :meth:`Shape.following`."""
        torque = np.zeros(len(q))
        for times, (sine, cosine) in self.multiples:
            torque += ((cosine - 1j * sine) * self.shape.following(q, pace, times)).real
        return torque
