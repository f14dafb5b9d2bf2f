"""What a calibration names, misses and makes up on simulated arms of other geometry, and what it promises.

``python benchmarks/proof_poses.py [draws] [--size 1] [--stations 0] [--load 0]``: arms of
``virtual_cell/tracked_arm.py`` (an industrial one, one with three parallel axes, one of seven joints), each
with its own hidden effects, errors of all rows that the poses can show, a tracker of 0.02 to 0.04 mm
somewhere, 1 % of readings off by millimetres, temperatures that wander. 600 poses each. Effects are ``size``
times as large as drawn. Every third arm is also sent to corrected targets. With ``stations``, wires from so
many places measure in the tracker's place; with ``load`` (kg), the second half of the poses carries it.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from metro.robot.calibration.compensation import corrected
from metro.robot.calibration.determined import determined
from metro.robot.calibration.model import State, free_of_geometry, jacobian
from metro.robot.calibration.poses import Poses, approached
from metro.robot.calibration.start import placed
from metro.robot.calibration.study import Calibration, calibrated, left_out
from metro.units import DEG, Array

sys.path.insert(0, str(Path(__file__).parents[1]))
from virtual_cell.tracked_arm import TrackedArm, spanned, tracked

POSES, TARGETS, OUTLIERS = 600, 100, 0.01
SCATTER = 1e-3  # m, about the declared arm: what it leaves undetermined has no error either
# Rows θ₀, α (°), d, a (m), reach of each joint (rad), masses (kg); none is of a robot of the repository.
ARMS = {
    "industrial": (
        [
            [0, -90, 0.45, 0.15],
            [-90, 0, 0, 0.68],
            [0, -90, 0, 0.12],
            [0, 90, 0.66, 0],
            [0, -90, 0, 0.04],
            [0, 0, 0.1, 0],
        ],
        [2.4, 1.0, 1.0, 2.6, 1.7, 2.8],
        [0.0, 16.0, 12.0, 5.0, 2.0, 1.5],
    ),
    "parallel axes": (
        [
            [0, 90, 0.17, 0],
            [0, 0, 0, -0.52],
            [0, 0, 0, -0.48],
            [0, 90, 0.14, 0],
            [0, -90, 0.12, 0],
            [0, 0, 0.1, 0],
        ],
        [2.6, 1.2, 1.8, 2.2, 2.0, 2.8],
        [0.0, 9.0, 6.0, 2.0, 1.5, 1.0],
    ),
    "seven joints": (
        [
            [0, -90, 0.34, 0],
            [0, 90, 0, 0],
            [0, 90, 0.4, 0],
            [0, -90, 0, 0],
            [0, -90, 0.4, 0],
            [0, 90, 0, 0.03],
            [0, 0, 0.13, 0],
        ],
        [2.5, 1.6, 2.5, 1.7, 2.5, 1.6, 2.8],
        [0.0, 4.0, 4.0, 3.0, 2.5, 1.5, 0.8],
    ),
}


@dataclass
class Tally:
    """Counts over arms. ``off``: errors of parameters over their standard errors."""

    arms: int = 0
    named: Counter[str] = field(default_factory=Counter)
    open: Counter[str] = field(default_factory=Counter)
    missed: Counter[str] = field(default_factory=Counter)
    invented: Counter[str] = field(default_factory=Counter)
    off: list[float] = field(default_factory=list)
    before: list[float] = field(default_factory=list)
    after: list[float] = field(default_factory=list)
    promised: list[float] = field(default_factory=list)
    inside: list[bool] = field(default_factory=list)


def main() -> None:
    """Print a table over the draws of each geometry."""
    reader = argparse.ArgumentParser()
    reader.add_argument("draws", type=int, nargs="?", default=12)
    reader.add_argument("--size", type=float, default=1.0)
    reader.add_argument("--stations", type=int, default=0)
    reader.add_argument("--load", type=float, default=0.0)
    asked = reader.parse_args()
    whole = Tally()
    for place, name in enumerate(ARMS):
        tally = Tally()
        for draw in range(asked.draws):
            one(name, 1000 * place + draw, asked, tally, serves=draw % 3 == 0 and not asked.stations)
        print(name, _told(tally))
        for key in ("named", "open", "missed", "invented"):
            getattr(whole, key).update(getattr(tally, key))
        for key in ("off", "before", "after", "promised", "inside"):
            getattr(whole, key).extend(getattr(tally, key))
        whole.arms += tally.arms
    print("all", _told(whole))
    kinds = sorted(set(whole.named) | set(whole.open) | set(whole.missed) | set(whole.invented))
    print("| effect | hidden | named | left open | missed | made up |\n| --- | --- | --- | --- | --- | --- |")
    for kind in kinds:
        parts = [tally[kind] for tally in (whole.named, whole.open, whole.missed)]
        print(f"| {kind} | {sum(parts)} | {' | '.join(map(str, parts))} | {whole.invented[kind]} |")


def _told(tally: Tally) -> str:
    counts = ", ".join(
        f"{name} {sum(getattr(tally, name).values())}" for name in ("named", "open", "missed", "invented")
    )
    held = np.mean(np.abs(tally.off) < 1.96)
    found = f"{tally.arms} arms: {counts}; intervals hold {held:.1%} of {len(tally.off)} parameters"
    if not tally.inside:
        return found
    errors = [1e3 * float(np.median(each)) for each in (tally.before, tally.after, tally.promised)]
    return (
        f"{found}; targets {errors[0]:.3f} mm off, corrected {errors[1]:.3f} mm, promised "
        f"{errors[2]:.3f} mm, {np.mean(tally.inside):.1%} of {len(tally.inside)} inside their intervals"
    )


def one(name: str, seed: int, asked: argparse.Namespace, tally: Tally, *, serves: bool) -> None:
    """Draw an arm, calibrate it and add to the tally; with ``serves`` correct targets, too."""
    rng = np.random.default_rng(seed)
    rows, reach, masses = (np.array(each, dtype=float) for each in ARMS[name])
    rows = np.column_stack([rows * (DEG, DEG, 1.0, 1.0), np.zeros(len(rows))])
    q = rng.uniform(-reach, reach, (POSES, len(reach)))
    arm, hidden = _drawn(rows, masses, q, asked.size, rng)
    warmth, sigma = np.cumsum(rng.normal(0, 0.15, POSES)), rng.uniform(2e-5, 4e-5, POSES)
    load = np.where(np.arange(POSES) < POSES // 2, 0.0, asked.load)
    day = warmth, np.linspace(0, 1, POSES), load
    wrong = rng.uniform(size=POSES) < OUTLIERS
    noise = np.random.default_rng(seed + 7)
    if asked.stations:
        stations = noise.uniform([-2.0, -2.0, -0.5], [2.0, 2.0, 0.5], (asked.stations, 3))
        lengths = spanned(arm, q, day, stations=stations, sigma=sigma, rng=noise)
        lengths[wrong] += rng.normal(0, 2e-3, (int(wrong.sum()), asked.stations))
        poses = placed(_by_wires(q, lengths, sigma, warmth, load), rows[:, :4])
    else:
        at = tracked(arm, q, day, sigma, noise)
        at[wrong] += rng.normal(0, 2e-3, (int(wrong.sum()), 3))
        time = np.arange(POSES, dtype=float)
        poses = Poses(q, at, sigma, time, 20.0 + warmth, approached(q), payload=load)
    found = calibrated(poses, rows[:, :4])
    _score(found, hidden, tally)
    tally.off += _parameters(found, arm)
    tally.arms += 1
    if serves:
        targets = rng.uniform(-0.9 * reach, 0.9 * reach, (TARGETS, len(reach)))
        made = corrected(targets, found.fits[0], found.final, poses, left_out(poses, rows[:, :4]))
        wanted = found.fits[0].state.position(targets)

        def missed(own: Array, noise: float) -> Array:
            last = np.full(TARGETS, warmth[-1]), np.ones(TARGETS), np.full(TARGETS, load[-1])
            own_sigma = np.full(TARGETS, noise)
            at = tracked(arm, own, last, own_sigma, np.random.default_rng(seed + 7))
            return np.asarray(np.linalg.norm(at - wanted, axis=1))

        tally.before += list(missed(targets, 0.0))
        tally.after += list(missed(made.q, 0.0))
        seen = missed(made.q, 3e-5)
        tally.promised += list(made.after[:, 0])
        tally.inside += list((seen > made.after[:, 1]) & (seen < made.after[:, 2]))


def _by_wires(q: Array, lengths: Array, sigma: Array, warmth: Array, load: Array) -> Poses:
    """Return lengths (m, s) as poses, one row for each."""
    count, stations = lengths.shape
    again = np.repeat(np.arange(count), stations)
    return Poses(
        q[again],
        np.full((len(again), 3), np.nan),
        sigma[again],
        again.astype(float),
        20.0 + warmth[again],
        approached(q)[again],
        pose=again,
        distance=lengths.ravel(),
        station=np.tile(np.arange(stations), count),
        payload=load[again],
    )


def _drawn(
    rows: Array, masses: Array, q: Array, size: float, rng: np.random.Generator
) -> tuple[TrackedArm, set[str]]:
    """Draw an arm, and return the labels of what it hides."""
    count, tool = len(rows), rng.uniform([-0.1, -0.1, 0.0], [0.1, 0.1, 0.2])
    state = State(rows, np.zeros(count, dtype=bool), np.eye(4), tool)
    kept = determined(jacobian(state, q)[1], free_of_geometry(state), SCATTER).kept
    errors = np.where(kept[9:].reshape(-1, 5), rng.normal(0, 5e-4, (count, 5)), 0.0)
    hidden: set[str] = set()

    def hides(label: str, chance: float = 0.5) -> bool:
        if rng.uniform() < chance:
            hidden.add(label)
            return True
        return False

    compliance, lag = np.zeros(count), np.zeros(count)
    for joint in (1, 3 if count == 7 else 2):
        if hides(f"elasticity under gravity, joint {joint + 1}"):
            compliance[joint] = size * rng.uniform(3e-6, 8e-6)
    wavy, rippled, slack = rng.permutation(count - 1)[:3]  # the last joint moves the point little
    turned: dict[int, Array] = {}
    if hides(f"gear eccentricity, joint {wavy + 1}"):
        turned[wavy] = size * rng.normal(0, 2e-4, (2, 2))
    if hides(f"curve of the reading, joint {rippled + 1}"):
        turned[rippled] = size * np.where(np.arange(14)[:, None] >= 7, rng.normal(0, 1e-4, (14, 2)), 0.0)
    if hides(f"direction of approach, joint {slack + 1}"):
        lag[slack] = size * rng.uniform(6e-5, 2e-4)
    return (
        TrackedArm(
            rows + errors,
            tool,
            masses,
            compliance,
            turned,
            lag,
            base=size * rng.uniform(2e-7, 6e-7)
            if hides("tilt of the base under the arm's weight", 0.3)
            else 0.0,
            growth=size * rng.uniform(1.5e-5, 4e-5) if hides("growth with temperature", 0.3) else 0.0,
            drift=size * rng.normal(0, 1e-4, 3) if hides("drift with time", 0.3) else None,
        ),
        hidden,
    )


def _score(found: Calibration, hidden: set[str], tally: Tally) -> None:
    """Count what was named, left open between rivals, missed, made up."""
    names = {effect.label for effect in found.final.effects}
    rivals = {other: first for first, other in found.found.rivals}
    for label in hidden:
        kind = label.partition(",")[0]
        either = label in rivals and rivals[label] not in hidden
        counter = tally.named if label in names else tally.open if either else tally.missed
        counter[kind] += 1
    for label in names - hidden:
        if not any(first == label and other in hidden for first, other in found.found.rivals):
            tally.invented[label.partition(",")[0]] += 1


def _parameters(found: Calibration, arm: TrackedArm) -> list[float]:
    """Return errors over standard errors: of the rows, of eccentricities and of lags that were named."""
    fit = found.final
    sd = np.sqrt(np.diag(fit.covariance))
    free = np.flatnonzero(fit.free)
    change = (fit.state.rows - arm.rows).ravel()
    head = fit.state.head
    off = [change[place - head] / sd[k] for k, place in enumerate(free) if place >= head]
    for k, effect in enumerate(fit.effects):
        own = fit.values[k]
        if effect.code == "eccentricity" and len(arm.turned.get(effect.joint, ())) == 2:
            (cos1, sin1), (cos2, sin2) = arm.turned[effect.joint]
            off += list((own - [sin1, cos1, sin2, cos2]) / sd[fit.place(k)])
        if effect.code == "approach" and arm.lag is not None and arm.lag[effect.joint]:
            off += list((own + arm.lag[effect.joint]) / sd[fit.place(k)])
    return [float(each) for each in off]


if __name__ == "__main__":
    main()
