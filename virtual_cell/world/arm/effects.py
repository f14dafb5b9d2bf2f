"""Effects of the contract's library in an arm, made as they come about, and translated to its parameters.

Each is drawn by the contract's parameters and a few of its own. It is made of a bearing, a wheel, a bolt or a
pump, which do not follow the contract's formula to the letter; after the runs are made, the parameters are
taken from what it did in them, and the error of that translation is stated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from virtual_cell.arm_cell import payload_torque
from virtual_cell.hidden import JOINT, Parameters, drawn_angle, drawn_signed, drawn_size
from virtual_cell.units import DEG, MM, MS, UM, Array
from virtual_cell.world.arm.cause import Cause, During, on_joint
from virtual_cell.world.arm.give import GIVE
from virtual_cell.world.arm.made import Made, Translated, drawn_joint, leading, moving
from virtual_cell.world.arm.robot import Robot
from virtual_cell.world.draws import digits


def _likely(rng: np.random.Generator, robot: Robot) -> int:
    """Draw a joint that moves, mostly one that turns round in the cuts, where there is any.

    Of these it is one whose friction is much at the tip: that of a small one is lost in the noise of others.
    """
    turning = robot.moves.turning
    some = turning if turning and rng.uniform() < 0.9 else moving(robot)
    return drawn_joint(rng, leading(robot.joints.coulomb / np.array(robot.moves.lever), some))


def _more_or_less(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw by how much a friction changes, over its level: it may grow beyond, but not fall below none."""
    more = rng.uniform() < 0.6
    return float(f"{drawn_size(rng, low, high) if more else -rng.uniform(low, 0.94):.3g}")


def _clock(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"offset_ms": drawn_signed(rng, 90.0, 1700.0)}


def _late(robot: Robot, p: Parameters) -> Robot:
    return replace(robot, clock_offset=p["offset_ms"] * MS)


def _clock_read(robot: Robot, _: Sequence[During], p: Parameters) -> Translated:
    return p, {"offset_ms": robot.recorder.slip / MS}


def _seal(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = _likely(rng, robot)
    level = float(robot.joints.coulomb[joint - 1])
    return {"joint": joint, "torque_nm": digits(level * _more_or_less(rng, 0.74, 3.2))}


def _sealed(robot: Robot, p: Parameters) -> Robot:
    """Let a seal behind the gear drag more (or less) once the joint carries the cut: as all friction does."""
    joint = p["joint"] - 1
    share = p["torque_nm"] / float(robot.joints.coulomb[joint])

    def load(during: During) -> Array:
        speed = during.rate[:, joint] / robot.joints.creep[joint]
        peak = 1.0 + robot.joints.breakaway[joint] * np.exp(-(speed**2))
        level = share * robot.joints.coulomb[joint] * peak * during.cutting
        return on_joint(joint + 1, level * during.sliding[:, joint])

    return robot.with_cause(Cause(load=load))


def _seal_read(robot: Robot, cuts: Sequence[During], p: Parameters) -> Translated:
    """Level of the seal's friction where the joint slides: it is above the Coulomb level where it creeps."""
    joint = p["joint"] - 1
    sliding = np.concatenate([np.abs(run.rate[:, joint]) for run in cuts]) / robot.joints.creep[joint]
    levels = p["torque_nm"] * (1.0 + robot.joints.breakaway[joint] * np.exp(-(sliding**2)))
    return {**p, "torque_nm": digits(float(levels.mean()))}, {"torque_nm": digits(float(levels.std()))}


def _grease(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = _likely(rng, robot)
    level = float(robot.joints.coulomb[joint - 1]) / robot.moves.seconds
    settles = drawn_size(rng, 0.8, 6.0) * robot.moves.seconds
    slope = digits(level * _more_or_less(rng, 0.66, 3.4))
    return {"joint": joint, "slope_nm_s": slope, "settles_s": digits(settles)}


def _warmed(robot: Robot, p: Parameters) -> Robot:
    """Let a joint's friction tend to another level with the heat that the cut puts into it."""
    joint, settles = p["joint"], p.get("settles_s", 2.0 * robot.moves.seconds)

    def drive(during: During) -> Array:
        warmed = settles * -np.expm1(-np.maximum(during.t, 0.0) / settles) * during.cutting
        return on_joint(joint, p["slope_nm_s"] * warmed * during.sliding[:, joint - 1])

    return robot.with_cause(Cause(drive=drive))


def _warmth_read(robot: Robot, cuts: Sequence[During], p: Parameters) -> Translated:
    settles = p.get("settles_s", 2.0 * robot.moves.seconds)
    slopes = []
    for run in cuts:
        t = run.t[run.t > 0.0]
        level = -p["slope_nm_s"] * settles * np.expm1(-t / settles)
        slopes.append(float(t @ level / (t @ t)))
    error = digits(float(np.std(slopes)) + 0.1 * abs(p["slope_nm_s"] - float(np.mean(slopes))))
    return {**p, "slope_nm_s": digits(float(np.mean(slopes)))}, {"slope_nm_s": error}


def _wheel(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = drawn_joint(rng, moving(robot))
    wave = drawn_size(rng, 3.5, 7.5) * MM * robot.moves.travel[joint - 1]
    level = float(robot.joints.coulomb[joint - 1])
    return {
        "joint": joint,
        "order": float(round(2.0 * math.pi / wave)),
        "torque_nm": drawn_size(rng, 0.26 * level, 0.85 * level),
        "phase_deg": drawn_angle(rng),
        "squeezed": round(float(rng.uniform(0.15, 0.6)), 2),
    }


def _eccentric(robot: Robot, p: Parameters) -> Robot:
    """Let a wheel whose pitch circle is eccentric be squeezed in its mesh by the load of the cut.

    The mesh stores U = ½ k (c + e cos θ)², whose slope is a torque: sin θ, and half of e/c of that at
    twice the order. ``squeezed`` is e/c.
    """
    joint, order = p["joint"], p["order"]
    twice = 0.5 * p.get("squeezed", 0.3)

    def load(during: During) -> Array:
        angle = order * during.q[:, joint - 1] + p.get("phase_deg", 0.0) * DEG
        wave = np.sin(angle) + twice * np.sin(2.0 * angle)
        return on_joint(joint, p["torque_nm"] * during.cutting * wave)

    return robot.with_cause(Cause(load=load))


def _carried(rng: np.random.Generator, _: Robot) -> Parameters:
    at = [float(round(v)) for v in rng.uniform([-180.0, -180.0, -50.0], [180.0, 180.0, 250.0])]
    return {"mass_kg": drawn_size(rng, 0.8, 20.0), "com_mm": at}


def _laden(robot: Robot, p: Parameters) -> Robot:
    """Leave a probe with its cable on the flange: two masses, whose sum and centre are the parameters."""
    centre, mass = np.array(p["com_mm"]) * MM, p["mass_kg"]
    cable, aside = 0.25, np.array([0.0, 0.06, -0.03])
    places = (centre - cable * aside / (1.0 - cable), centre + aside)

    def drive(during: During) -> Array:
        some = np.linspace(0, len(during.t) - 1, 12).astype(int)
        held = [
            sum(
                payload_torque(robot.arm, during.q[i], share * mass, place)
                for share, place in zip((1.0 - cable, cable), places, strict=True)
            )
            for i in some
        ]
        columns = np.array(held).T
        return (
            np.stack([np.interp(during.t, during.t[some], one) for one in columns], axis=1) * during.cutting
        )

    return robot.with_cause(Cause(drive=drive))


def _pump(rng: np.random.Generator, robot: Robot) -> Parameters:
    """Draw a vibration whose waves on the wall are 0.9 to 7 mm long at every feed."""
    slow, fast = robot.moves.speed
    ends = sorted((fast / (6.5 * MM), slow / (1.0 * MM)))
    return {
        "frequency_hz": drawn_size(rng, *ends),
        "amplitude_um": drawn_size(rng, 0.5, 8.0),
        "phase_deg": drawn_angle(rng),
        "unsteady": round(float(rng.uniform(0.02, 0.2)), 3),
    }


def _pumped(robot: Robot, p: Parameters) -> Robot:
    """Let a pump that the program starts with the log shake spindle and work against each other.

    Its speed and its stroke wander by a few per cent about their means, and it starts a little late.
    """

    def tip(during: During) -> Array:
        return np.outer(_stroke(during, p) * during.cutting, during.normal)

    return robot.with_cause(Cause(tip=tip))


def _stroke(during: During, p: Parameters) -> Array:
    """Motion (n,), m, that a pump makes of itself in a run."""
    own, unsteady = during.own(), p.get("unsteady", 0.1)
    wander = np.stack([_slow(own, during.t, unsteady) for _ in range(2)])
    start = own.normal(0.0, 2.0 * unsteady)
    turned = 2.0 * math.pi * p["frequency_hz"] * during.t + p.get("phase_deg", 0.0) * DEG + start
    return np.asarray(p["amplitude_um"] * UM * (1.0 + wander[0]) * np.sin(turned + 2.0 * wander[1]))


def _slow(rng: np.random.Generator, t: Array, size: float) -> Array:
    """Return a slow wander (n,) of some standard deviation about zero: three waves over a few seconds."""
    seconds, phase = rng.uniform(3.0, 12.0, 3), rng.uniform(0.0, 2.0 * math.pi, 3)
    waves = np.sin(2.0 * math.pi * t[:, None] / seconds + phase)
    return np.asarray(size * math.sqrt(2.0 / 3.0) * waves.sum(axis=1))


def _pump_read(_: Robot, cuts: Sequence[During], p: Parameters) -> Translated:
    """Sine of one frequency and amplitude, and of a phase for each run, closest to what the pump did.

    Its errors are those of a mean over the runs, by how much single runs have another one; that of the phase
    is how far it wanders in a run.
    """
    from scipy.optimize import minimize_scalar

    unsteady = p.get("unsteady", 0.1)
    on = [(during.t[during.engaged > 0.5], _stroke(during, p)[during.engaged > 0.5]) for during in cuts]
    span = max(float(np.ptp(t)) for t, _ in on)

    def amplitudes(hz: float) -> Array:
        return np.array([2.0 * abs(np.mean(z * np.exp(-2j * math.pi * hz * t))) for t, z in on])

    def best(runs: slice) -> float:
        near, apart = p["frequency_hz"], 0.5 / span
        return float(
            minimize_scalar(
                lambda hz: -float((amplitudes(hz)[runs] ** 2).sum()),
                bounds=(near - apart, near + apart),
                method="bounded",
            ).x
        )

    hz, alone = best(slice(None)), [best(slice(i, i + 1)) for i in range(len(on))]
    found, runs = amplitudes(hz) / UM, math.sqrt(len(on))
    return {**p, "frequency_hz": float(f"{hz:.6g}"), "amplitude_um": digits(float(found.mean()))}, {
        "frequency_hz": digits(float(np.std(alone)) / runs),
        "amplitude_um": digits(float(np.std(found)) / runs),
        "phase_deg": digits(2.0 * unsteady / DEG),
    }


LIBRARY: Mapping[str, Made] = {
    "clock_offset": Made("offset_ms", _clock, _late, _clock_read),
    "friction_reversal": Made(f"{JOINT} torque_nm", _seal, _sealed, _seal_read),
    "friction_warmup": Made(f"{JOINT} slope_nm_s settles_s?", _grease, _warmed, _warmth_read),
    "gear_ripple": Made(f"{JOINT} order torque_nm phase_deg? squeezed?", _wheel, _eccentric),
    "payload_error": Made("mass_kg com_mm[3]", _carried, _laden),
    **GIVE,
    "path_vibration": Made("frequency_hz amplitude_um phase_deg? unsteady?", _pump, _pumped, _pump_read),
}
