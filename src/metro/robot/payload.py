"""Gravity of a mass on the flange."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.statics import Flange
from metro.units import Array

GRAVITY = 9.81  # m/s², along −z of the base


@dataclass(frozen=True)
class Payload:
    """A mass, kg, and its centre in the flange frame, m."""

    mass: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def moments(self) -> Array:
        """Mass, kg, and mass times each coordinate of its centre, kg m, (4,)."""
        return self.mass * np.array([1.0, *self.centre])


def gravity_torque(flange: Flange) -> Array:
    """Torque of the motors that holds a mass on the flange, (m, n, 4): per kg, and per kg m along each axis.

    It is linear in the mass and in the mass times its centre: those in the flange frame multiply the columns.
    ``flange`` along m points. The base stands upright.
    """
    vertical, (about_x, about_y) = flange.jacobian[:, 2], np.moveaxis(flange.jacobian[:, 3:5], 1, 0)
    x, y = flange.axes[:, 0, None, :], flange.axes[:, 1, None, :]
    raised = about_x[..., None] * y - about_y[..., None] * x
    return GRAVITY * np.concatenate([vertical[..., None], raised], axis=-1)
