"""Effects of the contract's library in an arm, made as they come about, and translated to its parameters.

Each is drawn by the contract's parameters and a few of its own. It is made of a bearing, a wheel, a bolt or a
pump, which do not follow the contract's formula to the letter; after the runs are made, the parameters are
taken from what it did in them, and the error of that translation is stated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from virtual_cell.arm_cell import payload_torque
from virtual_cell.hidden import JOINT, Hidden, Parameters, drawn_angle, drawn_signed, drawn_size
from virtual_cell.units import DEG, MM, MS, UM, Array
from virtual_cell.world.cause import Cause, During, on_joint
from virtual_cell.world.robot import Robot

_MDEG = 1e-3 * DEG
Translated = tuple[Parameters, dict[str, float]]


@dataclass(frozen=True)
class Made(Hidden[Robot]):
    """An effect with its translation: the contract's parameters by what it did in the cuts, and their errors.

    ``translate(robot, cuts, parameters)``; errors are in the unit of their parameter. None: it is exact.
    """

    translate: Callable[[Robot, Sequence[During], Parameters], Translated] | None = None


def drawn_joint(rng: np.random.Generator, among: Sequence[int]) -> int:
    """Draw a joint, 1 … 6, among indices 0 … 5; of none, any."""
    some = list(among) or list(range(6))
    return some[int(rng.integers(len(some)))] + 1


def moving(robot: Robot) -> list[int]:
    """Joints (0 … 5) that move by a third of what the one that moves most does."""
    travel = robot.moves.travel
    return [joint for joint in range(6) if travel[joint] > 0.33 * max(travel)]


def _likely(rng: np.random.Generator, robot: Robot) -> int:
    """Draw a joint that moves, mostly one that turns round in the cuts, where there is any."""
    turning = robot.moves.turning
    return drawn_joint(rng, turning if turning and rng.uniform() < 0.9 else moving(robot))


def _put(values: Array, joint: int, value: float | Array) -> Array:
    changed = np.array(values)
    changed[joint - 1] = value
    return changed


def _clock(rng: np.random.Generator, _: Robot) -> Parameters:
    return {"offset_ms": drawn_signed(rng, 25.0, 300.0)}


def _late(robot: Robot, p: Parameters) -> Robot:
    return replace(robot, clock_offset=p["offset_ms"] * MS)


def _clock_read(robot: Robot, _: Sequence[During], p: Parameters) -> Translated:
    return p, {"offset_ms": robot.recorder.slip / MS}


def _seal(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = _likely(rng, robot)
    level = float(robot.joints.coulomb[joint - 1])
    return {"joint": joint, "torque_nm": drawn_signed(rng, 0.2 * level, 1.2 * level)}


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
    return {**p, "torque_nm": _digits(float(levels.mean()))}, {"torque_nm": _digits(float(levels.std()))}


def _grease(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = _likely(rng, robot)
    level = float(robot.joints.coulomb[joint - 1]) / robot.moves.seconds
    settles = drawn_size(rng, 0.8, 6.0) * robot.moves.seconds
    slope = drawn_signed(rng, 0.08 * level, 0.8 * level)
    return {"joint": joint, "slope_nm_s": slope, "settles_s": _digits(settles)}


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
    error = _digits(float(np.std(slopes)) + 0.1 * abs(p["slope_nm_s"] - float(np.mean(slopes))))
    return {**p, "slope_nm_s": _digits(float(np.mean(slopes)))}, {"slope_nm_s": error}


def _wheel(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = drawn_joint(rng, moving(robot))
    wave = drawn_size(rng, 2.0, 7.5) * MM * robot.moves.travel[joint - 1]
    level = float(robot.joints.coulomb[joint - 1])
    return {
        "joint": joint,
        "order": float(round(2.0 * math.pi / wave)),
        "torque_nm": drawn_size(rng, 0.05 * level, 0.5 * level),
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


def _other_tool(rng: np.random.Generator, _: Robot) -> Parameters:
    """Draw the row of another tool: another length along the flange's x, in a holder that is turned."""
    length = drawn_signed(rng, 8.0, 150.0)
    lateral = rng.uniform(-0.45, 0.45, 2) * length
    d = (length, lateral[0], lateral[1])
    return {name: float(round(v, 2)) for name, v in zip(("dx_mm", "dy_mm", "dz_mm"), d, strict=True)}


def _elsewhere(robot: Robot, p: Parameters) -> Robot:
    return replace(robot, tip_offset=tuple(p[f"d{axis}_mm"] * MM for axis in "xyz"))


def _gap(rng: np.random.Generator, robot: Robot) -> Parameters:
    joint = drawn_joint(rng, robot.moves.swaying or (0,))
    return {"joint": joint, "angle_mdeg": drawn_size(rng, 0.8, 12.0)}


def _worn(robot: Robot, p: Parameters) -> Robot:
    gap = _put(robot.springs.gap, p["joint"], p["angle_mdeg"] * _MDEG)
    return replace(robot, springs=replace(robot.springs, gap=gap))


def _preload(rng: np.random.Generator, _: Robot) -> Parameters:
    """Draw a loss (or a gain) of preload, of every joint or of one that gives way along the walls."""
    every = rng.uniform() < 0.6
    size = drawn_signed(rng, 0.03, 0.5) if every else drawn_signed(rng, 0.08, 0.8)
    return {
        "factor": float(round(math.exp(size), 3)),
        "joint": "all" if every else drawn_joint(rng, (0, 1, 2, 4, 5)),
        "uneven": round(float(rng.uniform(-0.15, 0.15)), 3),
    }


def _eased(robot: Robot, p: Parameters) -> Robot:
    """Let bearings carry with one row less (or more) than in the load tests: it depends on the torque a bit.

    Two springs side by side, one of which the preload holds: below some torque the stiffness is another than
    beyond it.
    """
    joint = p.get("joint", "all")
    eased = np.array(robot.springs.eased)
    uneven = p.get("uneven", 0.0)
    eased[slice(None) if joint == "all" else joint - 1] = p["factor"] * np.array([1.0 - uneven, 1.0 + uneven])
    return replace(robot, springs=replace(robot.springs, eased=eased))


def _ease_read(robot: Robot, cuts: Sequence[During], p: Parameters) -> Translated:
    """Factor by which walls would give way more (one joint: the joint) by the springs of the load tests."""
    joint = p.get("joint", "all")
    some = np.arange(6) if joint == "all" else np.array([joint - 1])
    factors, weights = [], []
    for run in cuts:
        full = run.engaged > 0.9
        held = -np.array([robot.arm.gravity(q) for q in run.q[full][:: max(full.sum() // 8, 1)]])
        torque = run.torque[full][:: max(full.sum() // 8, 1)]
        turns = np.einsum("nai,a->ni", run.jacobian[full][:: max(full.sum() // 8, 1)], run.normal)
        tested = robot.springs.elastic(held + torque) - robot.springs.elastic(held)
        cut = robot.springs.in_cut(held + torque) - robot.springs.in_cut(held)
        soft, softer = ((turns * one)[:, some].sum() for one in (tested, cut))
        factors.append(float(soft / softer))
        weights.append(float(softer**2))
    mean = float(np.average(factors, weights=weights))
    spread = float(np.sqrt(np.average((np.array(factors) - mean) ** 2, weights=weights)))
    return {**p, "factor": round(mean, 4)}, {"factor": round(spread, 4)}


def _hard(rng: np.random.Generator, robot: Robot) -> Parameters:
    """Draw how much stiffer a spring is in its last pieces, by the cubic that lies closest to it."""
    joint = drawn_joint(rng, (0, 1, 2, 4, 5))
    torque = 600.0 * robot.moves.lever[joint - 1]
    k = float(robot.springs.stiffness[joint - 1])
    return {"joint": joint, "cubic": drawn_size(rng, 0.4, 8.0) * k**3 / torque**2}


def _hardened(robot: Robot, p: Parameters) -> Robot:
    """Let a flexspline come to bear in three pieces that follow the cubic over the loads of the tests."""
    joint = p["joint"] - 1
    k, most = float(robot.springs.stiffness[joint]), 600.0 * robot.moves.lever[joint]
    x = np.linspace(0.0, 1.0, 200) * most / k
    torque = k * x + p["cubic"] * x**3
    x, torque = x[torque <= 1.3 * most], torque[torque <= 1.3 * most]
    ends = [0, len(x) // 3, 2 * len(x) // 3, len(x) - 1]
    slopes = [float(np.polyfit(x[a : b + 1], torque[a : b + 1], 1)[0]) for a, b in pairwise(ends)]
    springs = replace(
        robot.springs,
        stiffness=_put(robot.springs.stiffness, p["joint"], slopes[1]),
        knees=_put(robot.springs.knees, p["joint"], torque[[ends[1], ends[2]]]),
        ratio=_put(robot.springs.ratio, p["joint"], np.array([slopes[0], slopes[2]]) / slopes[1]),
    )
    return replace(robot, springs=springs)


def _hard_read(robot: Robot, _: Sequence[During], p: Parameters) -> Translated:
    """T = k x + c x³ closest to the three pieces; its error: how far c goes with the range of torque."""
    joint = p["joint"] - 1
    found = []
    for share in (0.8, 1.0, 1.25):
        torque = np.linspace(0.0, share * 600.0 * robot.moves.lever[joint], 100)
        x = robot.springs.elastic(np.outer(torque, np.eye(6)[joint]))[:, joint]
        found.append(float(np.linalg.lstsq(np.stack([x, x**3], axis=1), torque, rcond=None)[0][1]))
    return {**p, "cubic": _digits(found[1])}, {"cubic": _digits(float(np.ptp(found)) / 2.0)}


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
    unsteady = p.get("unsteady", 0.1)

    def tip(during: During) -> Array:
        own = during.own()
        wander = np.stack([_slow(own, during.t, unsteady) for _ in range(2)])
        start = own.normal(0.0, 2.0 * unsteady)
        turned = 2.0 * math.pi * p["frequency_hz"] * during.t + p.get("phase_deg", 0.0) * DEG + start
        moved = p["amplitude_um"] * UM * (1.0 + wander[0]) * np.sin(turned + 2.0 * wander[1])
        return np.outer(moved * during.cutting, during.normal)

    return robot.with_cause(Cause(tip=tip))


def _slow(rng: np.random.Generator, t: Array, size: float) -> Array:
    """Return a slow wander (n,) of some standard deviation about zero: three waves over a few seconds."""
    seconds, phase = rng.uniform(3.0, 12.0, 3), rng.uniform(0.0, 2.0 * math.pi, 3)
    waves = np.sin(2.0 * math.pi * t[:, None] / seconds + phase)
    return np.asarray(size * math.sqrt(2.0 / 3.0) * waves.sum(axis=1))


def _pump_read(_: Robot, __: Sequence[During], p: Parameters) -> Translated:
    unsteady = p.get("unsteady", 0.1)
    return p, {
        "frequency_hz": _digits(unsteady / 3.0 / math.pi),
        "amplitude_um": _digits(unsteady * p["amplitude_um"]),
        "phase_deg": _digits(2.0 * unsteady / DEG),
    }


def _digits(value: float) -> float:
    return float(f"{value:.3g}")


LIBRARY: Mapping[str, Made] = {
    "clock_offset": Made("offset_ms", _clock, _late, _clock_read),
    "friction_reversal": Made(f"{JOINT} torque_nm", _seal, _sealed, _seal_read),
    "friction_warmup": Made(f"{JOINT} slope_nm_s settles_s?", _grease, _warmed, _warmth_read),
    "gear_ripple": Made(f"{JOINT} order torque_nm phase_deg? squeezed?", _wheel, _eccentric),
    "payload_error": Made("mass_kg com_mm[3]", _carried, _laden),
    "tool_offset_error": Made("dx_mm dy_mm dz_mm", _other_tool, _elsewhere),
    "joint_backlash": Made(f"{JOINT} angle_mdeg", _gap, _worn),
    "stiffness_scale": Made(f"factor {JOINT}|all? uneven?", _preload, _eased, _ease_read),
    "stiffness_hardening": Made(f"{JOINT} cubic", _hard, _hardened, _hard_read),
    "path_vibration": Made("frequency_hz amplitude_um phase_deg? unsteady?", _pump, _pumped, _pump_read),
}
