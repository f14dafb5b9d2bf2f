"""How far the force by the joints' torques is off, and how often its interval holds the truth (robot.md).

    python scripts/sensorless_study.py [batches]

Batches of twelve runs of a simulated KR160, as in kr160-side: two forces, white noise of 3 N m with 1/f
noise under it, and a Coulomb friction that differs between cut and idle run by a share of its level, drawn
per joint and run. Three rules are compared: that of [K] (joints whose index reaches 2, at least three of
them, least squares), one random walk over the whole path with the same joints, or all where fewer than three
pass, and that of the report (the walk starts anew where the tool enters and leaves; all joints, by noise and
friction).
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from metro.observables.arm.force_tables import Common, RunForce, common, force_of_all
from metro.observables.arm.tip_force import Log, Sensorless, sensorless
from metro.observables.arm.wall import Wall
from metro.observables.joint_force.observable import REPEATABLE
from metro.robot.kinematics import Arm, rotation, transform
from metro.robot.sensorless import (
    LEAST_INDEX,
    LEAST_JOINTS,
    TipForce,
    Torques,
    mean_force,
    smoothed_torque,
    tip_force,
)
from metro.units import DEG, MM, Array
from virtual_cell import noise, robot
from virtual_cell.recipes import kr160

LENGTH, REACH, LEAD = 0.1, 6.93 * MM, 12 * MM
NOISE, RUNS = 3.0, 12  # N m; of a batch
SHARES = (0.0, 0.02, 0.05, 0.1)
FORCES = np.array([[37.5, 101.0, 21.0], [-76.0, 4.5, 15.5]])  # N, work frame: a down cut, an up cut
TURN = rotation(0.0, 0.0, kr160.YAW_DEG * DEG)
DH = np.array(kr160.DH, dtype=float) * (DEG, DEG, MM, MM)
ARM = Arm(DH, np.array(kr160.TIP_MM) * MM, transform(np.array(kr160.WORK_MM) * MM, TURN))
FACE = Wall(np.array([1.0, 0, 0]), np.array([0, -1.0, 0]), 0.0, LENGTH, REACH)
RULES = ("[K]: joints of the index", "one walk over the path", "the report's")


def share(x: Array) -> Array:
    """Share of the whole force at places (n,), m, of the tool's axis from the face."""
    return np.interp(x, [-REACH, 0.0, LENGTH - REACH, LENGTH], [0.0, 1.0, 1.0, 0.0])


@cache
def logs(which: int) -> tuple[Log, Log]:
    """Return the logs of cut and idle run without noise, for one of the forces."""
    ends = [TURN @ np.array([x, 0.0, -5 * MM]) + ARM.work[:3, 3] for x in (-LEAD - REACH, LENGTH + LEAD)]
    near = np.array(kr160.NEAR_DEG) * DEG
    path = robot.straight_path(kr160.ARM, (ends[0], ends[1]), TURN, 0.012, near)
    drives = kr160.replace(kr160.DRIVES, torque_noise=0.0)

    def force(s: Array) -> Array:
        return np.outer(share(s - LEAD - REACH), TURN @ FORCES[which])

    def read(loads: object) -> Log:
        table = robot.log(kr160.ARM, drives, path, loads, np.random.default_rng(0), begin=0.0)
        commanded, actual = (
            np.stack([table[f"q{i}{kind}_deg"] for i in range(1, 7)], axis=1) * DEG for kind in ("_set", "")
        )
        torque = np.stack([table[f"tau{i}_nm"] for i in range(1, 7)], axis=1)
        return Log(commanded, actual, torque, ARM.tip(commanded), table["t_s"])

    return read(force), read(None)


def drawn(which: int, friction: float, rng: np.random.Generator) -> tuple[Log, Log]:
    """Draw logs with noise; the cut's Coulomb friction is not the idle run's, by a share ``friction``."""
    pair = []
    for log in logs(which):
        rough = np.stack([noise.sensor_noise(len(log.time), NOISE, rng) for _ in range(6)], axis=1)
        pair.append(log.torque + rough)
    cut, idle = logs(which)
    way = np.tanh(np.gradient(cut.commanded, cut.time, axis=0) / 2e-4)
    pair[0] += friction * rng.normal(size=6) * kr160.DRIVES.coulomb * way
    return tuple(
        Log(log.commanded, log.actual, torque, log.tip, log.time)
        for log, torque in zip((cut, idle), pair, strict=True)
    )


@dataclass(frozen=True)
class Estimate:
    """The force of a run by one rule, with the torques that it is from and the noise all runs share."""

    torques: Torques
    solution: TipForce
    shared: Common


@dataclass
class Tally:
    """Errors of the mean force, N, half-widths of its interval, and whether intervals hold the truth."""

    refused: list[bool] = field(default_factory=list)
    error: list[Array] = field(default_factory=list)
    half: list[Array] = field(default_factory=list)
    mean_held: list[np.ndarray] = field(default_factory=list)
    place_held: list[Array] = field(default_factory=list)

    def add(self, one: Sensorless, estimate: Estimate, truth: Array) -> None:
        """Count a run's mean force and the force at its places; ``truth`` (3,) N when engaged."""
        solution, shared = estimate.solution, estimate.shared
        mean, covariance = mean_force(solution, estimate.torques, one.steady, shared.friction, shared.wander)
        error, sd = mean - truth, np.sqrt(np.diag(covariance))
        off = solution.force - np.outer(share(one.x), truth)
        spread = np.sqrt(np.einsum("maa->ma", solution.covariance))
        self.refused.append(False)
        self.error.append(error)
        self.half.append(1.96 * sd)
        self.mean_held.append(np.abs(error) < 1.96 * sd)
        self.place_held.append((np.abs(off) < 1.96 * spread).mean(axis=0))


def batch(friction: float, rng: np.random.Generator, tallies: dict[str, Tally], white: list[Array]) -> None:
    """Simulate one batch and count it for every rule."""
    solved = []
    for run in range(RUNS):
        cut, idle = drawn(run % len(FORCES), friction, rng)
        one = sensorless(cut, idle, ARM, FACE, 0.0)
        assert isinstance(one, Sensorless)
        white.append(one.torques.whiteness)
        solved.append(RunForce(one, np.full(6, NOISE), None))
    shared = common(solved)
    fixed = Common(np.full(6, REPEATABLE * NOISE), shared.wander)
    for run, item in enumerate(solved):
        one, truth = item.sensorless, FORCES[run % len(FORCES)]
        of_all = force_of_all(one, shared)
        tallies[RULES[2]].add(one, Estimate(one.torques, of_all, shared), truth)
        whole = smoothed_torque(one.difference, one.torques.noise)
        least = LEAST_INDEX if (one.index >= LEAST_INDEX).sum() >= LEAST_JOINTS else 0.0
        try:
            before = tip_force(whole.level, whole.variance, one.moves, one.index, least)
        except ValueError:
            before = tip_force(whole.level, whole.variance, one.moves, one.index, 0.0)
        tallies[RULES[1]].add(one, Estimate(whole, before, fixed), truth)
        passing = one.index >= LEAST_INDEX
        if passing.sum() < LEAST_JOINTS:
            tallies[RULES[0]].refused.append(True)
            continue
        pinv = -np.linalg.pinv(np.swapaxes(one.moves[:, :, passing], 1, 2))
        force = np.einsum("mai,mi->ma", pinv, whole.level[:, passing])
        tallies[RULES[0]].refused.append(False)
        tallies[RULES[0]].error.append(force[one.steady].mean(axis=0) - truth)


def study(batches: int, friction: float, seed: int = 1) -> tuple[dict[str, Tally], Array]:
    """Return tallies by rule, and all p values of the innovations (runs, 6)."""
    rng, tallies, white = np.random.default_rng(seed), {rule: Tally() for rule in RULES}, []
    for _ in range(batches):
        batch(friction, rng, tallies, white)
    return tallies, np.array(white)


def main(batches: int) -> None:
    """Print the rows of the table in docs/robot.md."""
    for friction in SHARES:
        tallies, white = study(batches, friction)
        for rule, tally in tallies.items():
            rms = np.sqrt(np.mean(np.square(tally.error), axis=0)) if tally.error else np.full(3, np.nan)
            cells = [
                f"{friction:.0%}",
                rule,
                f"{np.mean(tally.refused):.0%}",
                ", ".join(f"{v:.2f}" for v in rms),
            ]
            if tally.half:
                cells.append(", ".join(f"{v:.2f}" for v in np.mean(tally.half, axis=0)))
                cells += [f"{np.mean(held):.1%}" for held in (tally.mean_held, tally.place_held)]
            print("| " + " | ".join(cells) + " |")
        print(f"not white at 5 %: {np.mean(white < 0.05):.1%} of {white.size}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
