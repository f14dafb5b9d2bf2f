"""How often intervals of a calibration by poses hold the truth, and how often an effect is missed or made up.

``python benchmarks/coverage_poses.py [draws]``: arms of the tests' simulator (errors of its rows, gravity
on two joints, eccentricity of one gear, play of one joint; a tracker of 0.03 mm), 600 poses each.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np

from metro.robot.calibration.poses import Poses, approached
from metro.robot.calibration.study import calibrated

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/shared"))
from simulated_poses import drawn, measured, rows_rad

POSES, SIGMA = 600, 3e-5
FREE = {1: (0, 1, 3), 2: (0, 1, 3), 4: (1,)}  # joint from 0 → what of its row is drawn: no redundant one
HIDDEN = {("elasticity", 2), ("elasticity", 3), ("eccentricity", 4), ("approach", 3)}


def one(seed: int, sags: bool) -> tuple[list[float], set[tuple[str, int]]]:
    """Return errors over standard errors of rows and named parameters, and the effects that were found."""
    rng = np.random.default_rng(seed)
    errors = np.zeros((6, 4))
    for joint, own in FREE.items():
        errors[joint, list(own)] = rng.normal(0.0, 7e-4, len(own))
    once, twice, play = rng.uniform(1e-4, 5e-4, 3)
    q = drawn(POSES, seed + 1)
    came = approached(q)

    def turned(joint: int, angle: float) -> float:
        return once * np.sin(angle) + twice * np.cos(2 * angle) if sags and joint == 3 else 0.0 * angle

    q_true = q + play * came * (np.arange(6) == 2) * sags
    at = measured(q_true, errors, turned, sags=sags, sigma=SIGMA, seed=seed + 2)
    blank = np.zeros(POSES)
    time = np.arange(POSES, dtype=float)
    found = calibrated(Poses(q, at, blank, time, np.full(POSES, np.nan), came), rows_rad())
    fit, start = found.final, found.fits[0].state
    sd = np.sqrt(np.diag(fit.covariance))
    truth = np.column_stack([errors, np.zeros(6)]).ravel()
    change = (fit.state.rows - start.rows).ravel()
    free = np.flatnonzero(fit.free)
    off = [(change[place - 9] - truth[place - 9]) / sd[k] for k, place in enumerate(free) if place >= 9]
    known = {("eccentricity", 3): [once, 0.0, 0.0, twice], ("approach", 2): [play]}
    for k, effect in enumerate(fit.effects):
        if (effect.code, effect.joint) in known:
            off += list((fit.values[k] - known[effect.code, effect.joint]) / sd[fit.place(k)])
    return [float(each) for each in off], {(effect.code, effect.joint + 1) for effect in fit.effects}


def main() -> None:
    """Print shares over the draws."""
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    for sags in (False, True):
        hidden = HIDDEN if sags else set()
        off: list[float] = []
        missed, invented = Counter[tuple[str, int]](), Counter[tuple[str, int]]()
        for seed in range(draws):
            own, found = one(1000 * (seed + 1), sags)
            off += own
            missed.update(hidden - found)
            invented.update(found - hidden)
        inside = float(np.mean(np.abs(off) < 1.96))
        print(f"{len(hidden)} effects hidden; intervals that hold the truth: {inside:.0%} of {len(off)}")
        print(f"  missed {dict(missed)}, invented {dict(invented)} in {draws} draws")


if __name__ == "__main__":
    main()
