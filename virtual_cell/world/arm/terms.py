"""What is always there of the library's effects in an arm's batch, in the contract's terms, joint by joint.

Each thing is taken by itself, from what its joint did in the runs: a torque of the drives, a height of the
wall, or a wave of it. The parameters are those of least squares over all runs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from virtual_cell.hidden import Parameters
from virtual_cell.units import DEG, MM, MS, Array
from virtual_cell.world.arm.gears import Springs
from virtual_cell.world.arm.robot import Robot
from virtual_cell.world.arm.told import Gauges, Run, Told, along, dry, signs, strongest, wave
from virtual_cell.world.draws import digits
from virtual_cell.world.present import Term, term

_MDEG = 1e-3 * DEG
_OWN_S = 0.11  # s of a torque, after which its noise is another
_OWN_M = 1.1 * MM  # of a trace, after which its noise is another
_WAVES = (0.8 * MM, 8.0 * MM)  # of a wall that are waviness: shorter is roughness, longer is form
_CYCLES = 2.0  # that a run must show of a wave
_LOADS = 640.0  # N, of usual load tests

Terms = dict[str, list[Term]]


def in_contract_terms(about: str, robot: Robot, runs: Sequence[Run], gauges: Gauges) -> Terms:
    """Return, by the contract's names, what there is of each effect in what an observable reads.

    ``about``: joint_force, deformation or waviness.
    """
    return {"joint_force": _of_torque, "deformation": _of_form, "waviness": _of_waves}[about](
        robot, runs, gauges
    )


def _of_torque(robot: Robot, runs: Sequence[Run], _: Gauges) -> Terms:
    logs = [run for run in runs if run.air is not None]
    joints = range(6)
    rubbing = joints if logs else range(0)
    return {
        "friction_reversal": [_torque(robot, logs, *_rubbing(robot, logs, joint)) for joint in rubbing],
        "friction_by_speed": [_torque(robot, logs, *_viscous(robot, logs, joint)) for joint in rubbing],
        "gear_ripple": [
            one
            for joint in joints
            for one in strongest([_torque(robot, runs, *line) for line in _ripples(robot, runs, joint)])
        ],
        "clock_offset": [_clock(robot, runs)],
    }


def _torque(robot: Robot, runs: Sequence[Run], parameters: Parameters, does: Array, told: Array) -> Term:
    step = robot.recorder.current_step
    joint = int(parameters.get("joint", 1)) - 1
    noise = math.hypot(robot.recorder.torque_noise, float(step[joint]) / math.sqrt(12.0))
    seconds = sum(float(np.ptp(run.cut.during.t)) for run in runs)
    return term(parameters, does, told, noise, seconds / _OWN_S)


def _rubbing(robot: Robot, runs: Sequence[Run], joint: int) -> Told:
    """Dry friction of the cut less that of the air: more under a load, less when warm."""
    does = np.concatenate([dry(robot, run.cut, run.warmth[0], joint) for run in runs])
    air = [dry(robot, run.air, run.warmth[1], joint) for run in runs if run.air is not None]
    does = does - np.concatenate(air)
    return along("torque_nm", joint, does, signs(runs, joint))


def _viscous(robot: Robot, runs: Sequence[Run], joint: int) -> Told:
    """Viscous friction of the cut less that of the air, which was made at another warmth."""
    lost = float(robot.joints.viscous[joint]) * robot.joints.thinning
    rates = [run.cut.during.rate[:, joint] for run in runs]
    does = [-lost * (run.warmth[0] - run.warmth[1]) * rate for run, rate in zip(runs, rates, strict=True)]
    return along("torque_nm_s", joint, np.concatenate(does), np.concatenate(rates))


def _ripples(robot: Robot, runs: Sequence[Run], joint: int) -> Iterator[Told]:
    """Waves of a gear's slope, by which the torque of the cut is more and less at the motor."""
    q, load = (
        np.concatenate([get(run)[:, joint] for run in runs]) for get in (lambda r: r.cut.during.q, _loads)
    )
    wheel = robot.transmission
    shown = max(float(np.ptp(run.cut.during.q[:, joint])) for run in runs)
    pace = max(float(np.abs(run.cut.during.rate[:, joint]).max()) for run in runs)
    for order, size, phase in zip(wheel.order[joint], wheel.size[joint], wheel.phase[joint], strict=True):
        if _CYCLES * 2.0 * math.pi < order * shown and order * pace * robot.recorder.period < 0.5 * math.pi:
            yield wave(joint, float(order), q, -load * size * order * np.cos(order * q + phase), 1.0)


def _loads(run: Run) -> Array:
    return run.cut.during.torque


def _clock(robot: Robot, runs: Sequence[Run]) -> Term:
    """Clocks that are apart by another time in each run, and drift: their mean, read by the first joints."""
    late = [np.full(len(run.cut.during.t), run.late) + robot.recorder.skew * run.cut.during.t for run in runs]
    mean = float(np.mean([one.mean() for one in late]))
    slopes = [np.gradient(run.cut.during.torque, run.cut.during.dt, axis=0) for run in runs]
    does = np.concatenate([-slope * one[:, None] for slope, one in zip(slopes, late, strict=True)])
    told = -mean * np.concatenate(slopes)
    each = math.sqrt(does.shape[1])  # joints are read apart: what they tell adds up
    return _torque(robot, runs, {"offset_ms": digits(mean / MS)}, each * does, each * told)


def _of_form(robot: Robot, runs: Sequence[Run], gauges: Gauges) -> Terms:
    def seen(told: Told) -> Term:
        return term(*told, gauges.zero, len(runs))

    return {
        "stiffness_scale": [seen(_softer(robot, runs, gauges))],
        "stiffness_hardening": [seen(_hardening(robot, runs, joint)) for joint in range(6)],
        "joint_backlash": [seen(_lost(robot, runs, joint, _same)) for joint in range(6)],
        "friction_reversal": [seen(_behind(robot, runs, joint, _same)) for joint in range(6)],
    }


def _of_waves(robot: Robot, runs: Sequence[Run], gauges: Gauges) -> Terms:
    metres = sum(run.cut.during.length for run in runs)

    def seen(told: Told) -> Term:
        return term(*told, gauges.noise, metres / _OWN_M)

    return {
        "gear_ripple": [
            one
            for joint in range(6)
            for one in strongest([seen(line) for line in _uneven(robot, runs, joint)])
        ],
        "joint_backlash": [seen(_lost(robot, runs, joint, _short)) for joint in range(6)],
        "friction_reversal": [seen(_behind(robot, runs, joint, _short)) for joint in range(6)],
    }


Filter = Callable[[Array, float], Array]  # of heights (n,), m, that many m apart


def _same(height: Array, step: float) -> Array:
    del step
    return height


def _short(height: Array, step: float) -> Array:
    """Heights without what is longer than the waves of a wall."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(
        height - uniform_filter1d(height, max(3, round(0.5 * _WAVES[1] / step)), mode="nearest")
    )


def _on_wall(run: Run) -> np.ndarray:
    during = run.cut.during
    return (during.x > 0.0) & (during.x < during.length)


def _levers(run: Run) -> Array:
    """By how much (n, 6), m/rad, the wall is higher for a twist of each joint."""
    during = run.cut.during
    return np.asarray(np.einsum("nai,a->ni", during.jacobian, during.normal))


def _heights(runs: Sequence[Run], joint: int, twists: Sequence[Array], sieve: Filter) -> Array:
    """Heights, m, of all walls by twists (n,), rad, of a joint in each run."""
    return np.concatenate(
        [
            sieve(_levers(run)[:, joint] * twist, run.cut.during.feed * run.cut.during.dt)[_on_wall(run)]
            for run, twist in zip(runs, twists, strict=True)
        ]
    )


def _lost(robot: Robot, runs: Sequence[Run], joint: int, sieve: Filter) -> Told:
    """Lost motion: the joint lies on the side to which the cut has pushed it, as in a gap of twice that."""
    twists = [robot.springs.hysteresis(run.cut.outside)[:, joint] for run in runs]
    sides = [0.5 * _MDEG * np.sign(run.cut.during.torque[:, joint]) for run in runs]
    does, unit = (_heights(runs, joint, some, sieve) for some in (twists, sides))
    told = along("angle_mdeg", joint, does, unit)
    gap = told[0]["angle_mdeg"]
    return told if gap > 0.0 else (told[0], does, 0.0 * does)


def _behind(robot: Robot, runs: Sequence[Run], joint: int, sieve: Filter) -> Told:
    """Friction behind the gear twists the spring, and no encoder sees it."""
    soft = 1.0 / float(robot.arm.stiffness[joint])
    share = float(robot.joints.behind[joint]) * soft
    twists = [-share * dry(robot, run.cut, run.warmth[0], joint) for run in runs]
    sides = [-soft * np.sign(run.cut.during.rate[:, joint]) for run in runs]
    does, unit = (_heights(runs, joint, some, sieve) for some in (twists, sides))
    return along("torque_nm", joint, does, unit)


def _softer(robot: Robot, runs: Sequence[Run], gauges: Gauges) -> Told:
    """Tell the gains of dynamometer and load cell: by them walls give way more than they are told to."""
    soft = 1.0 / robot.arm.stiffness
    true: list[Array] = []
    expected: list[Array] = []
    for run in runs:
        on, turn = _on_wall(run), robot.turn
        read = run.cut.during.force @ turn * (1.0 + gauges.gains) @ turn.T * (1.0 + gauges.load)
        jacobian, levers = run.cut.during.jacobian, _levers(run)
        for heights, force in ((true, run.cut.during.force), (expected, read)):
            twist = np.einsum("nai,na->ni", jacobian, force) * soft
            heights.append((levers * twist).sum(axis=1)[on])
    h, p = np.concatenate(true), np.concatenate(expected)
    factor = float(p @ p) / float(p @ h)
    return {"factor": round(factor, 4), "joint": "all"}, h - p, p / factor - p


def _hardening(robot: Robot, runs: Sequence[Run], joint: int) -> Told:
    """Tell the pieces of a spring about the weight that it carries: T = k x + c x³ over the load tests."""
    held = -float(np.mean([robot.arm.gravity(run.cut.during.q[0])[joint] for run in runs]))
    most = _LOADS * robot.moves.lever[joint]
    torque = np.linspace(-most, most, 101)
    x = twisted(robot.springs, held + torque, joint) - twisted(robot.springs, np.array([held]), joint)
    (stiffness, cubic), *_ = np.linalg.lstsq(np.stack([x, x**3], axis=1), torque, rcond=None)
    straight = torque / float((torque @ torque) / (torque @ x))
    levers = np.concatenate([_levers(run)[_on_wall(run), joint] for run in runs])
    lever = float(np.sqrt(np.mean(levers**2)))
    bent = np.interp(torque, stiffness * x + cubic * x**3, x) if cubic > 0.0 else straight
    told = lever * (bent - straight)
    return {"joint": joint + 1, "cubic": digits(max(float(cubic), 0.0))}, lever * (x - straight), told


def twisted(springs: Springs, torque: Array, joint: int) -> Array:
    """Twist (n,), rad, of one joint's spring under torques (n,), N m."""
    return np.asarray(springs.elastic(np.outer(torque, np.eye(6)[joint]))[:, joint])


def _uneven(robot: Robot, runs: Sequence[Run], joint: int) -> Iterator[Told]:
    """Errors of transmission that are waves of the wall, by the torque that would twist the joint so."""
    wheel, soft = robot.transmission, 1.0 / float(robot.arm.stiffness[joint])
    ways = [np.abs(run.cut.during.rate[:, joint]) / run.cut.during.feed for run in runs]
    per_m = float(np.median(np.concatenate(ways)))
    q = [run.cut.during.q[:, joint] for run in runs]
    for k, order in enumerate(wheel.order[joint]):
        if not _WAVES[0] < 2.0 * math.pi / max(float(order) * per_m, 1e-9) < _WAVES[1]:
            continue
        waves = [
            wheel.line(angle, run.cut.during.sliding[:, joint], joint, k)
            for angle, run in zip(q, runs, strict=True)
        ]
        parameters, twist, told = wave(joint, float(order), np.concatenate(q), np.concatenate(waves), -soft)
        sizes = np.cumsum([len(one) for one in q])[:-1]
        does, made = (_heights(runs, joint, np.split(one, sizes), _same) for one in (twist, told))
        yield parameters, does, made
