"""Held-out errors of the friction of joints, with and without what it has beyond Coulomb and viscous.

    python scripts/friction_study.py

Records of a Staubli TX40 and of a UR10e, where METRO_REAL_DATA (and ``field`` beside it) has them. Each sixth
of a log is predicted by a fit to the other five, which choose the terms, too.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from metro.robot.chain import REVOLUTE, chain, of_rows
from metro.robot.determined import RANK, STRETCHES, solve
from metro.robot.friction_terms import FOLDS, Samples, further_terms
from metro.robot.joint_dynamics import free_motion, samples
from metro.robot.kinematics import Geometry
from metro.robot.motion import Motion
from metro.robot.rigid_body import torque_regressor
from metro.units import DEG, MM, Array

# alpha (deg), d, a (mm)
TX40 = ((-90, 320, 0), (0, 35, 225), (90, 0, 0), (-90, 225, 0), (90, 0, 0), (0, 65, 0))
UR10E = ((90, 180.7, 0), (0, 0, -612.7), (0, 0, -571.55), (90, 174.15, 0), (-90, 119.85, 0), (0, 116.55, 0))
COUPLED = {4: 5, 5: 4}  # joints of the TX40: the motor of joint 6 turns with joint 5, too
SLIDES = 0.05  # rad/s from which on that motor's friction has its sign
CONSTANTS = np.array([10.0, 10.70, 8.46, 9.00, 9.48, 10.12])  # N m/A, published for the UR10e


def records(real: Path) -> Iterator[tuple[str, Geometry, Array, Array, Array]]:
    """Yield name, geometry, times (m,) s, angles (m, n) rad and torques (m, n) N m of each record."""
    folder = real / "reference/friction-tx40"
    if folder.exists():
        motor, load = (
            pd.read_csv(folder / f"{name}.csv").to_numpy(dtype=float)
            for name in ("pos_read_data", "curr_data")
        )
        ratio = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
        ratio[5, 4] = 32.0
        q = motor @ np.linalg.inv(ratio).T + np.array([0, -np.pi / 2, np.pi / 2, 0, 0, 0])
        rows = np.array([(0.0, alpha * DEG, d * MM, a * MM) for alpha, d, a in TX40])
        yield "TX40", rows, np.arange(len(q)) / 5000.0, q, load @ ratio
    folder = real.parent / "field/robot-ur10e-payload"
    if folder.exists():
        rows = np.array([(0.0, alpha * DEG, d * MM, a * MM) for alpha, d, a in UR10E])
        geometry = chain(of_rows(rows, [REVOLUTE] * 6))
        for path in sorted(folder.glob("*.csv")):
            log = pd.read_csv(path, header=None).to_numpy(dtype=float)
            name = "UR10e with load" if "Load" in path.name else "UR10e"
            yield name, geometry, log[:, 0] - log[0, 0], log[:, 1:7], log[:, 13:19] * CONSTANTS


def held_out(joint: Samples) -> tuple[float, float, list[str]]:
    """Rms of the held-out residual without and with further terms, and the terms that all folds chose."""
    fold = joint.stretch * FOLDS // STRETCHES
    square, named = np.zeros(2), []
    for part in np.unique(fold):
        out = fold == part
        known = _part(joint, ~out)
        names = [(term.name, term.scale * np.abs(known.rate).max()) for term in further_terms(known)]
        named.append({name for name, _ in names})
        inside, outside = known.columns, joint.columns[out]
        square[0] += _error(inside, known.torque, outside, joint.torque[out])
        more = np.zeros((len(known.torque), 0))
        for key in names:
            column = known.column(key, more)
            if key[0] == "load":
                values = solve(np.column_stack([inside, column]), known.torque, known.stretch).value
                links = joint.columns[:, joint.links] @ values[: joint.columns.shape[1]][joint.links]
                whole = joint.columns[:, 0] * np.abs(links)
            else:
                whole = joint.column(key, np.zeros((len(joint.torque), 0)))
                column = whole[~out]
            more = np.column_stack([more, column])
            inside, outside = (
                np.column_stack([one, add]) for one, add in ((inside, column), (outside, whole[out]))
            )
        square[1] += _error(inside, known.torque, outside, joint.torque[out])
    rms = np.sqrt(square / len(joint.torque))
    return float(rms[0]), float(rms[1]), sorted(set.intersection(*named))


def _coupled(joint: Samples, log: Motion, other: int, moving: np.ndarray) -> Samples:
    """Add what a motor that two joints share has of the other one's motion: inertia and friction."""
    rate, together = log.rate[moving, other], log.rate[moving][:, list(COUPLED)].sum(axis=1)
    more = np.column_stack([log.acceleration[moving, other], rate, np.tanh(together / SLIDES)])
    return replace(joint, columns=np.column_stack([joint.columns, more]))


def _part(joint: Samples, which: np.ndarray) -> Samples:
    rows = joint.columns[which], joint.torque[which], joint.stretch[which]
    return Samples(*rows, joint.links, joint.rate[which])


def _error(inside: Array, torque: Array, outside: Array, asked: Array) -> float:
    """Sum of the squares of what a fit inside leaves outside."""
    scale = np.maximum(np.linalg.norm(inside, axis=0), np.finfo(float).tiny)
    value = np.linalg.lstsq(inside / scale, torque, rcond=RANK)[0]
    return float(np.sum((asked - outside / scale @ value) ** 2))


def main() -> None:
    """Print a table of every record."""
    sys.stdout.write("record | joint | without (N m) | with (N m) | terms in every fold\n")
    for name, geometry, time, q, torque in records(Path(os.environ.get("METRO_REAL_DATA", "../shared/real"))):
        log = free_motion(time, q, torque)
        links = torque_regressor(geometry, log.angle, log.rate, log.acceleration)
        for joint in range(q.shape[1]):
            own = samples(log, links, joint)
            if name == "TX40" and joint in COUPLED:
                own = _coupled(own, log, COUPLED[joint], log.moving[:, joint])
            before, after, terms = held_out(own)
            sys.stdout.write(f"{name} | {joint + 1} | {before:.3g} | {after:.3g} | {', '.join(terms)}\n")


if __name__ == "__main__":
    main()
