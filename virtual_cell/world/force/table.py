"""The mechanics of a dynamometer: a plate on springs, with work on it, which sways and rocks.

A force above the plane of the springs pushes and tilts the plate: each lateral axis has two modes, whose
static shares add up to one. The modes' common motion along z is what one axis feels of another when it moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.hidden import drawn_signed, drawn_size
from virtual_cell.units import DEG, Array


@dataclass(frozen=True)
class Table:
    """A dynamometer as it is mounted.

    Attributes
    ----------
    bare : (3, 2) frequencies of the modes felt along x, y and z of the sensor without work, Hz. share : (3,)
        static share of the first of each pair; the z axis may have one (share 1). damping : (3, 2).
    plate, work : masses, kg, of the plate and of what is clamped on it.
    rocking : (3, 3) dynamic crosstalk: share of the second mode's motion that axis i feels of a force along
        j.
    gains : (3, 3) what each axis reads of a static force along each, near the unit matrix.
    yaw, pitch, roll : how it stands turned on the machine's table, about z, y and x, rad.
    """

    bare: Array
    share: Array
    damping: Array
    plate: float
    work: float
    rocking: Array
    gains: Array
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0

    @property
    def frequency(self) -> Array:
        """Frequencies of the modes with the work clamped on, (3, 2), Hz."""
        return np.asarray(self.bare * math.sqrt(self.plate / (self.plate + self.work)))

    def response(self, hz: Array) -> Array:
        """Return what the axes read per force along the sensor's axes, (n, 3, 3), at frequencies ``hz``."""
        s = 1j * hz[:, None, None]
        f, damping = self.frequency, self.damping
        modes = f**2 / (f**2 + 2.0 * damping * f * s + s**2)
        own = self.share * modes[:, :, 0] + (1.0 - self.share) * modes[:, :, 1]
        between = modes[:, :, 0] - modes[:, :, 1]
        moving = own[:, :, None] * np.eye(3) + self.rocking * between[:, None, :]
        return np.asarray(moving @ self.gains)

    @property
    def turned(self) -> Array:
        """Rotation (3, 3) that takes directions as declared to those in which the sensor's axes stand."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        yaw = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        c, s = math.cos(self.pitch), math.sin(self.pitch)
        pitch = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        c, s = math.cos(self.roll), math.sin(self.roll)
        return np.asarray(yaw @ pitch @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]]))


def drawn_table(rng: np.random.Generator) -> Table:
    """Draw a dynamometer well above the tooth passing, as a careful laboratory mounts it.

    With the work on it, its modes are between 1.7 and 4 kHz: lower ones are hidden on purpose.
    """
    plate = float(rng.uniform(2.0, 9.0))
    bare = np.exp(rng.uniform(math.log(2300.0), math.log(4200.0), (3, 1))) * np.array([[1.0, 1.45]])
    bare[:, 1] *= rng.uniform(0.9, 1.25, 3)
    share = rng.uniform(0.8, 0.97, 3)
    if rng.uniform() < 0.5:
        share[2] = 1.0
    off = ~np.eye(3, dtype=bool)
    cross = np.array([[drawn_signed(rng, 0.005, 0.03) for _ in range(3)] for _ in range(3)])
    own = np.array([drawn_signed(rng, 0.005, 0.02) for _ in range(3)])
    return Table(
        bare,
        share,
        np.array([[drawn_size(rng, 0.015, 0.06) for _ in range(2)] for _ in range(3)]),
        plate,
        plate * float(rng.uniform(0.1, 0.7)),
        off * rng.uniform(-0.05, 0.05, (3, 3)),
        np.eye(3) * (1.0 + own) + off * cross,
        yaw=drawn_signed(rng, 0.2, 2.0) * DEG,
        pitch=drawn_signed(rng, 0.02, 0.2) * DEG,
        roll=drawn_signed(rng, 0.02, 0.2) * DEG,
    )


def loaded(table: Table, lowest: float) -> Table:
    """Clamp so much work and fixture on the table that its lowest mode comes down to ``lowest`` Hz."""
    ratio = float(table.bare[:, 0].min()) / lowest
    return replace(table, work=table.plate * max(ratio**2 - 1.0, 0.0))


def single_modes(table: Table) -> tuple[Array, Array, float]:
    """Frequency (3,) and damping (3,) of one mode per axis in the place of two, and how far it is from them.

    Well below, a sum of modes magnifies as one at the mean of 1/f² by shares; the last value is the largest
    relative difference between that frequency and the first mode's.
    """
    f = table.frequency
    alike = 1.0 / np.sqrt(table.share / f[:, 0] ** 2 + (1.0 - table.share) / f[:, 1] ** 2)
    return f[:, 0].copy(), table.damping[:, 0].copy(), float(np.abs(alike / f[:, 0] - 1.0).max())
