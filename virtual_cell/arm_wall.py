"""The wall that a cutting arm leaves: how far it gives way and strays, seen by its encoders or not."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from virtual_cell.arm_cell import ArmCell
from virtual_cell.arm_line import given_way, strayed
from virtual_cell.arm_log import Pass
from virtual_cell.units import Array


def height(
    cell: ArmCell,
    one: Pass,
    force: Callable[[Array], Array],
    normal: Array,
    x: Array,
    *,
    entry: float,
    seconds: float,
) -> Array:
    """How far (n,), m, the wall stands proud of the programmed one, without marks of the teeth.

    Parameters
    ----------
    force : (n, 3), N, base frame, on the tip at lengths along the line. normal : (3,) out of the material,
        base frame.
    x : places (n,), m, from the face where the tool enters; it lies at length ``entry`` of the line.
    seconds : since the start of the session.
    """
    s = x + entry
    moved = given_way(cell, one.loads, s, force(s))
    rate = one.along.rate(s, one.speed)
    joints = strayed(cell, one.along, s, one.speed) + cell.unseen_torsion(one.along.spline(s), rate)
    moved = moved + np.einsum("nai,ni->na", one.loads.jacobian(s), joints)
    moved = moved + np.array(cell.drift) * seconds
    t = (s - one.begin) / one.speed
    return np.asarray(moved @ normal + _shaken(cell, t + cell.clock_offset, x / one.speed) + _traced(cell, x))


def _shaken(cell: ArmCell, t: Array, since: Array) -> Array:
    """Vibration at times ``t`` (n,), s, by the clock of the log, and ringing ``since`` the entry, s."""
    hz, amplitude, phase = cell.vibration
    turned = 2.0 * math.pi * hz * (t + 0.5 * cell.chirp * t * t)
    rings, damping, first = cell.ringing
    omega = 2.0 * math.pi * rings
    return np.asarray(
        amplitude * np.sin(turned + phase) + first * np.exp(-damping * omega * since) * np.cos(omega * since)
    )


def _traced(cell: ArmCell, x: Array) -> Array:
    """Height (n,), m, that goes with the place: a wave of its own, and the tilt of the traced block."""
    length, amplitude, phase = cell.wave
    return np.asarray(amplitude * np.sin(2.0 * math.pi * x / length + phase) + cell.tilt * x)
