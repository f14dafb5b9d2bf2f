"""Causes outside the library that lie in how a wall is traced."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from virtual_cell.hidden import Hidden, Parameters, drawn_signed, drawn_size
from virtual_cell.units import MM, UM, Array
from virtual_cell.world.arm.cause import Cause, During
from virtual_cell.world.arm.robot import Robot


def _skidding(robot: Robot, p: Parameters) -> Robot:
    """Let the pick-up rest on a skid beside the stylus: what it reads is against the wall under the skid."""

    def traced(during: During, x: Array, z: Array) -> Array:
        del during
        behind = np.interp(x - p["behind_mm"] * MM, x, z)
        return np.asarray(z - p["share"] * behind)

    return robot.with_cause(Cause(traced=traced))


def _traverse(rng: np.random.Generator, _: Robot) -> Parameters:
    return {
        "um": drawn_size(rng, 1.0, 20.0),
        "at_mm": float(round(rng.uniform(25.0, 65.0))),
        "lead_mm": drawn_size(rng, 2.0, 6.0),
    }


def _worn(robot: Robot, p: Parameters) -> Robot:
    """Let the way of the traverse be worn: a hollow at one place, and waves of its screw about it."""

    def traced(during: During, x: Array, z: Array) -> Array:
        del during
        away = (x - p["at_mm"] * MM) / (14.0 * MM)
        hollow = -3.0 * np.exp(-(away**2))
        screw = np.sin(2.0 * math.pi * x / (p["lead_mm"] * MM)) * np.exp(-np.abs(away))
        return np.asarray(z + p["um"] * UM * (hollow + screw))

    return robot.with_cause(Cause(traced=traced))


def _warming(robot: Robot, p: Parameters) -> Robot:
    """Let the pick-up warm up over each trace: the zero runs off, quickly at first."""

    def traced(during: During, x: Array, z: Array) -> Array:
        size = p["um"] * UM * during.own().uniform(0.5, 1.3)
        return np.asarray(z + size * -np.expm1(-(x - x[0]) / (p["length_mm"] * MM)))

    return robot.with_cause(Cause(traced=traced))


def _chips(robot: Robot, p: Parameters) -> Robot:
    """Let chips be cut again and weld to the wall, at random: low, wide lumps of no certain place."""

    def traced(during: During, x: Array, z: Array) -> Array:
        own = during.own()
        count = own.poisson(p["per_m"] * float(x[-1] - x[0]))
        at, wide = own.uniform(x[0], x[-1], count), own.uniform(0.6, 2.2, count) * MM
        high = own.exponential(p["um"], count) * UM
        lumps = (high * np.exp(-(((x[:, None] - at) / wide) ** 2))).sum(axis=1)
        return np.asarray(z + lumps)

    return robot.with_cause(Cause(traced=traced))


TRACE_FAULTS: Mapping[str, Hidden[Robot]] = {
    "skid_beside_the_stylus": Hidden(
        "behind_mm share",
        lambda r, _: {"behind_mm": drawn_size(r, 0.8, 4.0), "share": round(float(r.uniform(0.25, 1.0)), 2)},
        _skidding,
    ),
    "worn_traverse": Hidden("um at_mm lead_mm", _traverse, _worn),
    "warming_pickup": Hidden(
        "um length_mm",
        lambda r, _: {"um": drawn_signed(r, 12.0, 150.0), "length_mm": drawn_size(r, 10.0, 50.0)},
        _warming,
    ),
    "welded_chips": Hidden(
        "um per_m",
        lambda r, _: {"um": drawn_size(r, 2.5, 25.0), "per_m": drawn_size(r, 60.0, 300.0)},
        _chips,
    ),
}
