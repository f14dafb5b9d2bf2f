"""Causes outside the library that move tip and work against each other, and which no motor knows of."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from virtual_cell.hidden import Hidden, Parameters, drawn_angle, drawn_signed, drawn_size
from virtual_cell.units import DEG, MM, MS, UM, Array
from virtual_cell.world.arm.cause import Cause, During, smooth_step
from virtual_cell.world.arm.robot import Robot


def _along(during: During, height: Array) -> Array:
    """Motion (n, 3) out of the wall by heights (n,), in the cut."""
    return np.outer(height * during.cutting, during.normal)


def _bolt(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"um_n": drawn_size(rng, 0.05, 1.2), "bearing_deg": drawn_angle(rng)}


def _loose(robot: Robot, p: Parameters) -> Robot:
    """Let a bolt of the base be loose: the base tilts where it is pulled one way, and not the other."""
    angle = p["bearing_deg"] * DEG
    axis = math.cos(angle) * robot.turn[:, 0] + math.sin(angle) * robot.turn[:, 1]

    def tip(during: During) -> Array:
        pulled = np.maximum(during.force @ axis, 0.0)
        return np.outer(p["um_n"] * UM * pulled * during.cutting, axis)

    return robot.with_cause(Cause(tip=tip))


def _belt(rng: np.random.Generator, robot: Robot) -> Parameters:
    fast = robot.moves.speed[1]
    return {
        "joint": int(rng.integers(1, 4)),
        "delay_ms": float(f"{drawn_size(rng, 0.02, 0.5) * MM / fast / MS:.3g}"),
    }


def _stretched(robot: Robot, p: Parameters) -> Robot:
    """Let the belt of an encoder stretch and creep: the joint runs ahead by speed and by way."""
    joint = p["joint"] - 1

    def tip(during: During) -> Array:
        ahead = p["delay_ms"] * MS * during.rate[:, joint]
        crept = 0.6 * (during.q[:, joint] - during.q[0, joint]) * p["delay_ms"] * MS / float(during.t[-1])
        off = during.jacobian[:, :, joint] * (ahead + crept)[:, None]
        return np.asarray(off * during.cutting)

    return robot.with_cause(Cause(tip=tip))


def _blending(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"height_um": drawn_signed(rng, 12.0, 250.0), "radius_mm": drawn_size(rng, 14.0, 45.0)}


def _blended(robot: Robot, p: Parameters) -> Robot:
    """Let the controller blend approach and exit into the line: it cuts the corner behind its set-points."""

    def tip(during: During) -> Array:
        radius = p["radius_mm"] * MM
        ends = np.maximum(radius - during.x, 0.0), np.maximum(radius - (during.length - during.x), 0.0)
        return _along(during, p["height_um"] * UM * ((ends[0] / radius) ** 2 + 0.5 * (ends[1] / radius) ** 2))

    return robot.with_cause(Cause(tip=tip))


def _sun(rng: np.random.Generator, _: Robot) -> Parameters:
    return {
        "um": drawn_size(rng, 10.0, 120.0),
        "bearing_deg": drawn_angle(rng),
        "clouds": int(rng.integers(2, 5)),
    }


def _bent(robot: Robot, p: Parameters) -> Robot:
    """Let the sun bend the forearm from one side while it shines: it comes and goes with the clouds."""
    angle = p["bearing_deg"] * DEG
    axis = math.cos(angle) * robot.turn[:, 0] + math.sin(angle) * robot.turn[:, 1]

    def tip(during: During) -> Array:
        warm = 0.5 - 0.5 * math.cos(2.0 * math.pi * p["clouds"] * 0.5 * (during.share + 0.15))
        growth = warm * (1.0 + 0.1 * during.t / float(during.t[-1]))
        return np.outer(p["um"] * UM * growth * during.cutting, axis)

    return robot.with_cause(Cause(tip=tip))


def _shim(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"um_n": drawn_size(rng, 0.04, 0.9), "seconds": drawn_size(rng, 2.0, 15.0)}


def _creeping(robot: Robot, p: Parameters) -> Robot:
    """Let a shim under the work creep under the cut, and recover before the next: the wall runs off."""

    def tip(during: During) -> Array:
        from scipy import signal

        keep = math.exp(-during.dt / p["seconds"])
        crept = signal.lfilter([1.0 - keep], [1.0, -keep], during.force @ during.normal)
        return _along(during, p["um_n"] * UM * crept)

    return robot.with_cause(Cause(tip=tip))


def _slip(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"um": drawn_size(rng, 7.0, 100.0)}


def _slipping(robot: Robot, p: Parameters) -> Robot:
    """Let the work slip in its clamps, once or twice in a run, anywhere; it is set back after it."""

    def tip(during: During) -> Array:
        own = during.own()
        height = np.zeros_like(during.t)
        for _ in range(int(own.integers(1, 3))):
            at, size = own.uniform(0.15, 0.85) * during.length, own.uniform(0.5, 1.5)
            height += size * smooth_step(during.x, at, 0.3 * MM)
        return _along(
            during, p["um"] * UM * height * np.sign(float(during.force.sum(axis=0) @ during.normal))
        )

    return robot.with_cause(Cause(tip=tip))


def _clamp(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"gap_um": drawn_size(rng, 15.0, 250.0), "holds_n": drawn_size(rng, 40.0, 250.0)}


def _clamped(robot: Robot, p: Parameters) -> Robot:
    """Let the dynamometer's bolts be loose: it gives way beyond a force, until it meets its stop."""

    def tip(during: During) -> Array:
        across = during.force @ during.normal
        beyond = np.maximum(np.abs(across) - p["holds_n"], 0.0)
        return _along(during, p["gap_um"] * UM * np.sign(across) * -np.expm1(-beyond / 60.0))

    return robot.with_cause(Cause(tip=tip))


def _resonant(rng: np.random.Generator, robot: Robot) -> Parameters:
    slow, fast = robot.moves.speed
    return {
        "frequency_hz": drawn_size(rng, *sorted((fast / (5.0 * MM), slow / (1.3 * MM)))),
        "rise": round(float(rng.uniform(0.25, 0.7)), 2),
        "amplitude_um": drawn_size(rng, 0.5, 6.0),
    }


def _resonating(robot: Robot, p: Parameters) -> Robot:
    """Let the work, lighter after each cut, ring at a frequency that rises over the session, in bursts."""

    def tip(during: During) -> Array:
        own = during.own()
        hz = p["frequency_hz"] * (1.0 + p["rise"] * during.share)
        bursts = np.abs(np.sin(math.pi * during.t / own.uniform(1.5, 4.0) + own.uniform(0.0, 3.0)))
        wave = np.sin(2.0 * math.pi * hz * during.t + own.uniform(0.0, 6.3))
        return _along(during, p["amplitude_um"] * UM * 1.4 * bursts * wave * (during.engaged > 0.5))

    return robot.with_cause(Cause(tip=tip))


def _thin(robot: Robot, p: Parameters) -> Robot:
    """Let a wall that stands free at one end flutter: quicker where it is held, larger where it is free."""

    def tip(during: During) -> Array:
        share = np.clip(during.x / during.length, 0.0, 1.0)
        hz = p["frequency_hz"] * (1.0 + p["rise"] * (1.0 - share) ** 2)
        turned = 2.0 * math.pi * np.cumsum(hz) * during.dt + during.own().uniform(0.0, 6.3)
        return _along(
            during, p["amplitude_um"] * UM * 1.5 * (0.3 + share) * np.sin(turned) * (during.engaged > 0.5)
        )

    return robot.with_cause(Cause(tip=tip))


def _bands(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"um": drawn_size(rng, 2.5, 25.0), "place_seed": int(rng.integers(1000))}


def _banded(robot: Robot, p: Parameters) -> Robot:
    """Let hard bands lie in the bar at uneven places, the same for every cut: the tool rides up on them."""
    places = np.random.default_rng(p["place_seed"])
    at, wide = np.cumsum(places.uniform(3.0, 16.0, 24)) * MM, places.uniform(0.6, 2.5, 24) * MM

    def tip(during: During) -> Array:
        forward = float((during.along @ robot.turn).sum()) > 0.0
        x = during.x if forward else during.length - during.x
        return _along(during, p["um"] * UM * np.exp(-(((x[:, None] - at) / wide) ** 2)).sum(axis=1))

    return robot.with_cause(Cause(tip=tip))


def _stuck(rng: np.random.Generator, _: Robot) -> Parameters:
    return {
        "joint": int(rng.integers(1, 7)),
        "um": drawn_size(rng, 5.0, 60.0),
        "pitch_mm": drawn_size(rng, 1.5, 5.0),
    }


def _sticking(robot: Robot, p: Parameters) -> Robot:
    """Let a joint stick and slip where it is slowest in a run: a burst of saw teeth there, none elsewhere."""
    joint = p["joint"] - 1

    def tip(during: During) -> Array:
        own, on = during.own(), (during.x > 0.0) & (during.x < during.length)
        slow = np.abs(during.rate[:, joint])
        at = float(during.x[on][np.argmin(slow[on])])
        at = float(np.clip(at, 0.2 * during.length, 0.8 * during.length))
        pitch = p["pitch_mm"] * MM * (1.0 + 0.15 * np.sin(during.x / (7.0 * MM)))
        saw = np.mod(during.x / pitch + own.uniform(), 1.0) - 0.5
        return _along(during, p["um"] * UM * saw * np.exp(-(((during.x - at) / (12.0 * MM)) ** 2)))

    return robot.with_cause(Cause(tip=tip))


def _knock(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"um": drawn_size(rng, 5.0, 60.0), "period_s": drawn_size(rng, 0.5, 2.2)}


def _knocking(robot: Robot, p: Parameters) -> Robot:
    """Let the valve of a clamp knock every so often, a little unevenly: the tip rings after each."""

    def tip(during: During) -> Array:
        own = during.own()
        knocks = np.cumsum(own.uniform(0.8, 1.2, 80) * p["period_s"]) - p["period_s"]
        since = during.t - knocks[np.maximum(np.searchsorted(knocks, during.t) - 1, 0)]
        ring = np.where(since > 0.0, np.exp(-since / 0.09) * np.sin(2.0 * math.pi * 8.7 * since), 0.0)
        return _along(during, p["um"] * UM * ring)

    return robot.with_cause(Cause(tip=tip))


def _beat(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"share_of_turn": drawn_size(rng, 0.05, 0.16), "um": drawn_size(rng, 0.5, 6.0)}


def _beating(robot: Robot, p: Parameters) -> Robot:
    """Let the belt of the spindle have a hard joint: a wave whose frequency goes with the spindle's speed."""

    def tip(during: During) -> Array:
        wave = np.sin(
            2.0 * math.pi * p["share_of_turn"] * during.turns * during.t + during.own().uniform(0.0, 6.3)
        )
        return _along(during, p["um"] * UM * (wave + 0.4 * wave**3))

    return robot.with_cause(Cause(tip=tip))


BODY_FAULTS: Mapping[str, Hidden[Robot]] = {
    "loose_base_bolt": Hidden("um_n bearing_deg", _bolt, _loose),
    "stretched_encoder_belt": Hidden("joint=1|2|3 delay_ms", _belt, _stretched),
    "blended_corners": Hidden("height_um radius_mm", _blending, _blended),
    "sun_on_the_forearm": Hidden("um bearing_deg clouds", _sun, _bent),
    "creeping_shim": Hidden("um_n seconds", _shim, _creeping),
    "slipping_work": Hidden("um", _slip, _slipping),
    "loose_dynamometer": Hidden("gap_um holds_n", _clamp, _clamped),
    "lighter_work_rings": Hidden("frequency_hz rise amplitude_um", _resonant, _resonating),
    "fluttering_wall": Hidden("frequency_hz rise amplitude_um", _resonant, _thin),
    "hard_bands": Hidden("um place_seed", _bands, _banded),
    "sticking_joint": Hidden("joint=1|2|3|4|5|6 um pitch_mm", _stuck, _sticking),
    "knocking_valve": Hidden("um period_s", _knock, _knocking),
    "beating_belt": Hidden("share_of_turn um", _beat, _beating),
}
