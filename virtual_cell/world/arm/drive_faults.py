"""Causes outside the library that motors, gears and their measurement know of: seen in torques above all."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from virtual_cell.hidden import JOINT, Hidden, Parameters, drawn_angle, drawn_signed, drawn_size
from virtual_cell.units import DEG, MS, Array
from virtual_cell.world.arm.cause import Cause, During, on_joint, smooth_step
from virtual_cell.world.arm.made import drawn_joint, moving
from virtual_cell.world.arm.robot import Robot

_LOADED = (0, 1, 2, 4)  # joints on which the cut puts much torque


def _level(robot: Robot, joint: int) -> float:
    return float(robot.joints.coulomb[joint - 1])


def _bracket(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = drawn_joint(rng, moving(robot))
    return {
        "joint": joint,
        "torque_nm": drawn_signed(rng, 0.1 * _level(robot, joint), 0.9 * _level(robot, joint)),
        "from_share": round(float(rng.uniform(0.2, 0.7)), 2),
    }


def _torn(robot: Robot, p: Parameters) -> Robot:
    """Let the hoses, whose bracket is torn, catch on a corner of the arm: a pull one way beyond an angle."""
    joint = p["joint"]

    def load(during: During) -> Array:
        q = during.q[:, joint - 1]
        share = (q - q.min()) / max(float(np.ptp(q)), 1e-9)
        caught = np.maximum(share - p["from_share"], 0.0) / (1.0 - p["from_share"])
        slips = np.exp(-(((np.mod(caught * 3.0, 1.0) - 0.9) / 0.15) ** 2))
        return on_joint(joint, p["torque_nm"] * (np.sqrt(caught) - 0.4 * slips * caught) * during.cutting)

    return robot.with_cause(Cause(load=load))


def _saturated(robot: Robot, p: Parameters) -> Robot:
    """Let a motor whose magnets lost strength turn less of a large current into torque."""
    joint = p["joint"] - 1

    def logged(during: During, torque: Array) -> Array:
        del during
        read = np.array(torque)
        read[:, joint] *= 1.0 + p["share"] * np.abs(torque[:, joint]) / p["at_nm"]
        return read

    return robot.with_cause(Cause(logged=logged))


def _magnets(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = drawn_joint(rng, _LOADED)
    at = 300.0 * robot.moves.lever[joint - 1]
    return {"joint": joint, "share": drawn_size(rng, 0.05, 0.6), "at_nm": float(round(at))}


def _leak(rng: np.random.Generator, robot: Robot) -> Parameters:
    del robot
    return {"torque_nm": drawn_signed(rng, 15.0, 180.0), "minutes": drawn_size(rng, 3.0, 40.0)}


def _leaking(robot: Robot, p: Parameters) -> Robot:
    """Let the counterbalance of joint 2 lose its gas under the cut and be topped up in mid-session."""

    def drive(during: During) -> Array:
        filled = 0.0 if during.share < 0.5 else 0.5 * during.since / during.share
        since = during.since - filled
        lost = p["torque_nm"] * -math.expm1(-since / (60.0 * p["minutes"]))
        falling = lost * (1.0 + 0.3 * during.t / max(float(during.t[-1]), 1e-9))
        return on_joint(2, falling * during.cutting)

    return robot.with_cause(Cause(drive=drive))


def _brake(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = drawn_joint(rng, moving(robot))
    level = _level(robot, joint)
    return {"joint": joint, "torque_nm": drawn_size(rng, 0.15 * level, 1.2 * level)}


def _dragging(robot: Robot, p: Parameters) -> Robot:
    """Let a brake whose coil is failing close in the middle of a run, for some seconds, at any time."""
    joint = p["joint"]

    def drive(during: During) -> Array:
        own, whole = during.own(), float(during.t[-1])
        at = own.uniform(0.2, 0.6) * whole
        closed = smooth_step(during.t, at, 0.08) - smooth_step(
            during.t, at + own.uniform(0.15, 0.4) * whole, 0.08
        )
        chatter = 1.0 + 0.2 * np.sin(2.0 * math.pi * 7.3 * during.t)
        return on_joint(
            joint, p["torque_nm"] * closed * chatter * during.sliding[:, joint - 1] * during.cutting
        )

    return robot.with_cause(Cause(drive=drive))


def _sagging(robot: Robot, p: Parameters) -> Robot:
    """Let the supply of the drives sag while the spindle draws power: currents then stand for less torque."""

    def logged(during: During, torque: Array) -> Array:
        own, whole = during.own(), float(during.t[-1])
        sag = np.zeros_like(during.t)
        for _ in range(int(own.integers(1, 4))):
            at = own.uniform(0.1, 0.85) * whole
            sag = np.maximum(sag, np.where(during.t > at, np.exp(-(during.t - at) / (0.12 * whole)), 0.0))
        return np.asarray(torque * (1.0 + p["share"] * (sag * during.engaged * during.cutting)[:, None]))

    return robot.with_cause(Cause(logged=logged))


def _jet(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"force_n": drawn_size(rng, 5.0, 70.0), "from_share": round(float(rng.uniform(0.25, 0.7)), 2)}


def _jetted(robot: Robot, p: Parameters) -> Robot:
    """Switch a jet of coolant on in mid-run: it pushes the spindle's housing, not the tool."""

    def pushed(during: During) -> Array:
        on = smooth_step(during.x, p["from_share"] * during.length, 0.004) * during.cutting
        flutter = 1.0 + 0.08 * np.sin(2.0 * math.pi * 1.9 * during.t)
        return np.outer(p["force_n"] * on * flutter, 0.6 * during.normal - 0.8 * during.along)

    def load(during: During) -> Array:
        return during.resisting(pushed(during))

    return robot.with_cause(Cause(load=load))


def _rope(rng: np.random.Generator, _: Robot) -> Parameters:
    return {
        "n_mm": drawn_size(rng, 0.25, 4.0),
        "free_share": round(float(rng.uniform(0.2, 0.6)), 2),
        "bearing_deg": drawn_angle(rng),
    }


def _taut(robot: Robot, p: Parameters) -> Robot:
    """Let a cable become taut between the flange and a post: nothing, then a spring that pulls one way."""

    def load(during: During) -> Array:
        angle = p["bearing_deg"] * DEG
        away = math.cos(angle) * robot.turn[:, 0] + math.sin(angle) * robot.turn[:, 1]
        place = (during.x - 0.5 * during.length) * float(during.along @ away)
        beyond = np.maximum(place + (0.5 - p["free_share"]) * during.length, 0.0)
        pull = np.outer(-p["n_mm"] * 1e3 * beyond * during.cutting, 0.8 * away + 0.6 * robot.turn[:, 2])
        return during.resisting(pull)

    return robot.with_cause(Cause(load=load))


def _ranged(robot: Robot, p: Parameters) -> Robot:
    """Switch the range of the charge amplifier in mid-session to one whose calibration is off."""

    def sensed(during: During, t: Array, force: Array) -> Array:
        del t
        return np.asarray(force * (1.0 + p["share"] * (during.share > p["from_share"])))

    return robot.with_cause(Cause(sensed=sensed))


def _filtered(robot: Robot, p: Parameters) -> Robot:
    """Smooth the current of one drive by its own filter: it comes late and rounded, the others do not."""
    joint = p["joint"] - 1

    def logged(during: During, torque: Array) -> Array:
        from scipy import signal

        keep = math.exp(-during.dt / (p["time_constant_ms"] * MS))
        read = np.array(torque)
        column = read[:, joint]
        read[:, joint] = column[0] + signal.lfilter([1.0 - keep], [1.0, -keep], column - column[0])
        return read

    return robot.with_cause(Cause(logged=logged))


def _coupled(robot: Robot, p: Parameters) -> Robot:
    """Let the hollow shafts of the wrist rub: torque of one joint shows in the motor of the next."""
    first = p["joint"] - 1

    def drive(during: During) -> Array:
        carried = p["share"] * np.abs(during.torque[:, first])
        return on_joint(first + 2, carried * during.cutting)

    return robot.with_cause(Cause(drive=drive))


def _swing(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"force_n": drawn_size(rng, 15.0, 150.0), "frequency_hz": drawn_size(rng, 0.35, 1.2)}


def _swinging(robot: Robot, p: Parameters) -> Robot:
    """Let a hose bundle that hangs from the flange swing, from the entry on, each time another way."""

    def drive(during: During) -> Array:
        own = during.own()
        since = np.maximum(during.t, 0.0)
        wave = np.sin(2.0 * math.pi * p["frequency_hz"] * since + own.uniform(0.0, 2.0 * math.pi))
        wave = wave * (0.6 + 0.4 * np.sin(2.0 * math.pi * since / own.uniform(4.0, 9.0)))
        across = math.cos(own.uniform(0.0, math.pi)) * robot.turn[:, 0] + 0.7 * robot.turn[:, 1]
        pull = np.outer(p["force_n"] * wave * during.cutting, across)
        return during.resisting(pull)

    return robot.with_cause(Cause(drive=drive))


def _half(rng: np.random.Generator, low: float, high: float, *, either: bool = True) -> Parameters:
    share = drawn_signed(rng, low, high) if either else drawn_size(rng, low, high)
    return {"share": share, "from_share": round(float(rng.uniform(0.3, 0.65)), 2)}


DRIVE_FAULTS: Mapping[str, Hidden[Robot]] = {
    "torn_hose_bracket": Hidden(f"{JOINT} torque_nm from_share", _bracket, _torn),
    "weak_magnets": Hidden(f"{JOINT} share at_nm", _magnets, _saturated),
    "counterbalance_leak": Hidden("torque_nm minutes", _leak, _leaking),
    "dragging_brake": Hidden(f"{JOINT} torque_nm", _brake, _dragging),
    "power_sag": Hidden("share", lambda r, _: {"share": drawn_size(r, 0.02, 0.35)}, _sagging),
    "coolant_jet": Hidden("force_n from_share", _jet, _jetted),
    "taut_cable": Hidden("n_mm free_share bearing_deg", _rope, _taut),
    "amplifier_range": Hidden("share from_share", lambda r, _: _half(r, 0.03, 0.35), _ranged),
    "current_filter": Hidden(
        f"{JOINT} time_constant_ms",
        lambda r, _: {"joint": drawn_joint(r, _LOADED), "time_constant_ms": drawn_size(r, 60.0, 900.0)},
        _filtered,
    ),
    "wrist_coupling": Hidden(
        "joint=4|5 share",
        lambda r, _: {"joint": int(r.integers(4, 6)), "share": drawn_size(r, 0.15, 0.9)},
        _coupled,
    ),
    "swinging_hoses": Hidden("force_n frequency_hz", _swing, _swinging),
}
