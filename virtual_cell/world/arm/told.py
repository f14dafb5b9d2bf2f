"""What an arm did in a run, and things that it did in the form of the contract's effects of one joint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import Parameters
from virtual_cell.units import Array
from virtual_cell.world.arm.robot import Done, Robot
from virtual_cell.world.draws import digits
from virtual_cell.world.present import Term


@dataclass(frozen=True, eq=False)
class Run:
    """What an arm did in a cut and, where there is a log of it, in the air; ``late`` s of the log's clock.

    ``warmth`` of the joints in the cut and in the air.
    """

    cut: Done
    air: Done | None
    late: float
    warmth: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Gauges:
    """Errors of what measures: ``gains`` (3,) of the force along the work's axes, ``load`` of the load tests.

    ``noise`` of the trace, m, and ``zero``, m, of its height in each run.
    """

    gains: Array
    load: float
    noise: float
    zero: float


Told = tuple[Parameters, Array, Array]  # parameters, what the thing does, and what they make of it


def dry(robot: Robot, made: Done, warmth: float, joint: int) -> Array:
    """Dry friction (n,), N m, of a joint, of some ``warmth``, in a run."""
    level = robot.joints.level(made.during.rate, made.outside, warmth)
    return np.asarray((level * made.during.sliding)[:, joint])


def signs(runs: Sequence[Run], joint: int) -> Array:
    """Which way, −1 or 1, a joint turns in the cuts, one after another."""
    return np.concatenate([np.sign(run.cut.during.rate[:, joint]) for run in runs])


def along(name: str, joint: int, does: Array, unit: Array) -> Told:
    """Tell a thing by so many times a unit."""
    size = float(unit @ does) / max(float(unit @ unit), 1e-30)
    return {"joint": joint + 1, name: digits(size)}, does, size * unit


def wave(joint: int, order: float, q: Array, does: Array, unit: float) -> Told:
    """Tell a wave over the angle by the torque that makes it: ``unit`` of it per N m."""
    both = unit * np.stack([np.sin(order * q), np.cos(order * q)], axis=1)
    sine, cosine = np.linalg.lstsq(both, does, rcond=None)[0]
    parameters = {
        "joint": joint + 1,
        "order": round(order, 3),
        "torque_nm": digits(math.hypot(sine, cosine)),
        "phase_deg": round(math.degrees(math.atan2(cosine, sine)), 1),
    }
    return parameters, does, both @ np.array([sine, cosine])


def strongest(terms: Sequence[Term]) -> list[Term]:
    """Return the term of largest gain among those that are there, where there is any."""
    return sorted((one for one in terms if one.present), key=lambda one: -one.gain)[:1]
