"""Coverage of the sensorless force and error of the clock, over side cuts of simulated arms.

``python benchmarks/coverage_tip_force.py [RUNS] [STYLE]``: batches of ``virtual_cell.recipes.arm`` (their own
cell, wall, tool's tip, noise of the torques; the log of the robot late by an offset of its own) are made
until there are RUNS (200) runs, and go through the stages' own functions: ingest, the observation of the
joint force with its clock, the robot's tables of the report. The truth is the force that the simulator put on
the tool. The yardstick of the errors is table 7 of Deng et al. 2023 (doi 10.1007/s00170-023-11559-y): the
mean of its nine |measured - estimated|.
"""

import sys
import tempfile
from pathlib import Path
from unittest import mock

import numpy as np
import pandas as pd

from metro.batch.processed import Processed, read_batch
from metro.loop.fitting.held_out import identified_fit
from metro.observables.arm.robot_tables import robot_tables
from metro.observables.joint_force import observable as joint_force
from metro.stages.identify import base_fit
from metro.stages.ingest import ingest
from metro.units import DEG, MS
from virtual_cell.recipes import arm

SEED, RUNS, STYLE = 71_000, 200, "b"
BUDGET = 0.02  # model_form_budget of the configuration
TABLE_7 = [[45.96, 56.21], [-96.10, -84.73], [-18.21, -33.89], [78.125, 102.71], [-176.50, -157.15],
           [-34.71, -54.66], [150.75, 127.13], [-266.83, -223.07], [-51.65, -89.23]]  # fmt: skip


def simulated(folder, seed, style):
    """Make a batch; return its clock offset (s) and the true mean force (n, 3) of its runs, feed frame."""
    made = []
    original = arm.side_force

    def kept(*args, **keywords):
        made.append(original(*args, **keywords))
        return made[-1]

    with mock.patch.object(arm, "side_force", kept):
        truth = arm.make(folder, {"clock_offset": None}, seed, style)
    late = truth["effects"]["clock_offset"]["offset_ms"] * MS
    return late, np.array([force.turn.mean(axis=0) for force in made])


def in_work(row, force):
    """Turn a force from the feed frame to the work's."""
    c, s = np.cos(row.feed_direction_deg * DEG), np.sin(row.feed_direction_deg * DEG)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ force


def judged(seed, style):
    """Return one batch's means (per run and axis) and clocks (per run), each beside the truth."""
    with tempfile.TemporaryDirectory() as folder:
        raw, processed = Path(folder) / "raw", Path(folder) / "processed"
        late, forces = simulated(raw, seed, style)
        ingest(raw, Path(folder), processed, {}, "")
        batch = read_batch(processed)
        read = Processed(processed)
        means = robot_tables(batch, read, {}, None).get("robot_means", pd.DataFrame())
        observed = joint_force.observe(batch, read, {})
        task = joint_force.problem(batch, observed, {})
        clocks = joint_force.report(batch, observed, {}, task, identified_fit(task, base_fit(task, BUDGET)))[
            "arm"
        ]["clock_offset_s"]
    rows = batch.runs.sort_values("order")
    true = {row.Index: in_work(row, force) for row, force in zip(rows.itertuples(), forces, strict=True)}
    means = means.assign(true_n=[true[r.run]["xyz".index(r.axis)] for r in means.itertuples()], seed=seed)
    told = [
        {
            "seed": seed,
            "run": run,
            "late_s": late,
            "value": one["value"],
            "low": one["ci95"][0],
            "high": one["ci95"][1],
        }
        for run, one in clocks.items()
    ]
    return means, pd.DataFrame(told), len(rows)


def summary(means, clocks, runs):
    """Print the figures and their demands."""
    error, sd = means["sensorless_n"] - means["true_n"], means["sensorless_sd_n"]
    inside = error.abs() < 1.96 * sd
    per_run = inside.groupby([means["seed"], means["run"]]).mean()
    spread = 1.96 * per_run.std() / np.sqrt(len(per_run))
    yardstick = float(np.abs(np.diff(TABLE_7, axis=1)).mean())
    print(f"{len(per_run)} of {runs} runs have a force; {means['by_index'].mean():.0%} by the index")
    for name, part in means.groupby("axis"):
        e = error[part.index]
        print(f"  {name}: coverage {inside[part.index].mean():.1%}, mean |error| {e.abs().mean():.2f} N, "
              f"bias {e.mean():+.2f} N, mean sd {sd[part.index].mean():.2f} N")  # fmt: skip
    print(f"coverage of the 95 % interval {inside.mean():.1%} ± {spread:.1%} (asked 93-97 %)")
    print(f"mean |error| {error.abs().mean():.2f} N (table 7: {yardstick:.1f} N; asked half of it)")
    off = (clocks["value"] - clocks["late_s"]) / MS
    sd = (clocks["high"] - clocks["low"]) / 3.92 / MS
    held = (clocks["low"] < clocks["late_s"]) & (clocks["late_s"] < clocks["high"])
    print(
        f"clock, per run: |error| median {off.abs().median():.2f} ms, rms {np.sqrt((off**2).mean()):.2f} ms,"
    )
    print(f"  mean {off.mean():+.2f} ms, median sd {sd.median():.2f} ms, interval holds {held.mean():.1%}")
    pooled = pd.DataFrame({"seed": clocks["seed"], "w": sd**-2, "we": off * sd**-2}).groupby("seed").sum()
    batch = pooled["we"] / pooled["w"]
    near = f"within 1 ms {(batch.abs() < 1).sum()} of {len(batch)}"
    scale = np.sqrt((batch**2 * pooled["w"]).mean())
    print(f"clock, per batch: rms {np.sqrt((batch**2).mean()):.2f} ms, {near}; {scale:.2f} of its own sd")


def main():
    wanted = int(sys.argv[1]) if len(sys.argv) > 1 else RUNS
    style = sys.argv[2] if len(sys.argv) > 2 else STYLE
    means, clocks, runs, seed = [], [], 0, SEED
    while runs < wanted:
        force, clock, count = judged(seed, style)
        means.append(force)
        clocks.append(clock)
        runs, seed = runs + count, seed + 1
    means, clocks = pd.concat(means, ignore_index=True), pd.concat(clocks, ignore_index=True)
    summary(means, clocks, runs)
    return means, clocks


if __name__ == "__main__":
    main()
