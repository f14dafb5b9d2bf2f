"""What the controller of a cutting arm logs: angles and torques of the idle run and of the cut."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtual_cell.arm_cell import ArmCell
from virtual_cell.arm_line import Line, Statics, strayed
from virtual_cell.noise import quantised, sensor_noise
from virtual_cell.units import DEG, Array

_ENCODER = 2e-6  # rad, noise of the encoders


@dataclass(frozen=True)
class Pass:
    """One pass along a line: ``speed`` m/s, ``begin`` m of the line where its records begin, and statics."""

    along: Line
    loads: Statics
    speed: float
    begin: float

    def seconds(self, spare: float = 0.0) -> float:
        """How long it is recorded, s: to the end of the line less what ``spare`` (s) keeps free."""
        return (self.along.length - self.begin) / self.speed - spare


def idle_log(cell: ArmCell, one: Pass, period: float, rng: np.random.Generator) -> dict[str, Array]:
    """Log of the pass in the air, columns of the contract; ``period`` s."""

    def torque(t: Array) -> Array:
        s = one.begin + t * one.speed
        return np.asarray(one.loads.gravity(s) + cell.friction(one.along.rate(s, one.speed)))

    return _log(cell, one, torque, period, rng, late=0.0)


def cut_log(
    cell: ArmCell, one: Pass, force: Callable[[Array], Array], period: float, rng: np.random.Generator
) -> dict[str, Array]:
    """Log of the cut; ``force(s)`` (n, 3), N, base frame, acts on the tip at lengths ``s``."""

    def torque(t: Array) -> Array:
        s = one.begin + (t - cell.clock_offset) * one.speed
        rate = one.along.rate(s, one.speed)
        held = one.loads.gravity(s) + one.loads.payload(s) - one.loads.torque(s, force(s))
        drives = cell.friction(rate) + cell.more_friction(rate, t) + cell.gears(one.along.spline(s))
        return np.asarray(held + drives)

    return _log(cell, one, torque, period, rng, late=cell.clock_offset)


def _log(
    cell: ArmCell,
    one: Pass,
    torque: Callable[[Array], Array],
    period: float,
    rng: np.random.Generator,
    *,
    late: float,
) -> dict[str, Array]:
    """Log ``torque(t)`` (n, 6), N m, at times by the log's clock, which is ``late``, s."""
    t = np.arange(int(one.seconds(spare=abs(late)) / period)) * period
    s = one.begin + (t - late) * one.speed
    wanted = one.along.spline(s)
    actual = wanted + strayed(cell, one.along, s, one.speed) + rng.normal(0.0, _ENCODER, wanted.shape)
    read = torque(t)
    for joint, delay in enumerate(cell.delay):
        if delay:
            read[:, joint] = torque(t - delay)[:, joint]
    read = read * (1.0 + np.array(cell.torque_gain))
    read += np.stack([sensor_noise(len(t), cell.drives.torque_noise, rng) for _ in range(6)], axis=1)
    columns = {"t_s": t}
    columns |= {f"q{i}_set_deg": wanted[:, i - 1] / DEG for i in range(1, 7)}
    columns |= {f"q{i}_deg": quantised(actual[:, i - 1] / DEG, 1e-5) for i in range(1, 7)}
    return columns | {f"tau{i}_nm": quantised(read[:, i - 1], 0.1) for i in range(1, 7)}
