"""A run's waviness as a block of waves, whose noise is white although the profile is band-passed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.joint_columns import numbered
from metro.observables.arm.tip_force import FORCE
from metro.observables.arm.wall import wall
from metro.observables.problem import Block
from metro.observables.waviness.model import PHASES, BelievedSetting, WavyCut
from metro.observables.waviness.points import ENCODER, GRID, IDLE, STRAYED
from metro.robot.kinematics import Arm
from metro.robot.statics import joint_torque, tip_jacobian
from metro.surface.profile import part, transmission
from metro.surface.waves import signal_share, wave_basis
from metro.units import MM, MS, UM, Array

LEAST = 0.6  # of the shortest wavelength: the filter passes less than a seventh of shorter waves
NYQUIST = 2.0  # samples of the log per shortest wave that it can resolve
MARK = 0.1  # waves whose length is within this share of a feed mark are omitted
OCTAVES = (2.0, 4.0)  # mm, limits of the bands in which the residual is tested
# Of the straightness of the profiler's traverse, rms over the waves that are compared: makers state 0.2 to
# 0.5 µm over 100 mm, most of it long.
DATUM = 0.2 * UM
# The first mode of an arm (6 to 25 Hz) makes a wave at half of its frequency a third larger, and a wave at
# three halves of it a fifth smaller. Nearer to the mode a wave grows by more: such a transfer is a strain.
FOLLOWS = 0.5
BENDS = 3  # degree of the angles over time: an arm's joints along a straight line turn no more than that
# The tip follows its joints with a delay of 2 ζ / ω of the arm's first mode: 6 ms at 6.5 Hz and 12 %, 0.3 ms
# at 25 Hz and 2 % (Schneider 2014). A profile's place along the log is known no better than half of that.
DELAY = 3 * MS
LOOSEST = 0.1 * MM  # largest standard error of a profile's place along the log, if they do not determine it


def wave_block(
    batch: Batch,
    run: str,
    points: pd.DataFrame,
    facts: Mapping[str, Any],
    *,
    force: pd.DataFrame | None,
    arm: Arm,
    compliance: Array,
) -> Block:
    """Waves of one wall, each with its noise, and what the model needs to predict them.

    Parameters
    ----------
    points, facts : the run's rows of ``waviness_points`` and ``waviness_runs``. force : on the tip along the
        path (table ``tip_force``); None if it is not known. compliance : (n,) of the joints, rad/(N m).

    Notes
    -----
    The tracking error below the noise of the encoders may be the same in all repeats; the noise that passes
    for tracking error differs from run to run. Each joint is weighed by the signal above the noise of its own
    encoder. A profile that lies elsewhere along the log differs by its own slope, whatever made its waves.
    At the tip the noise of the first joints has a longer lever, and may exceed the tracking error of
    the wrist.
    """
    row: Any = batch.runs.loc[run]
    kept = points["kept"].to_numpy(dtype=bool)
    cutoff = float(batch.instrument("profiler").get("cutoff_mm", 8.0)) * MM
    shortest, step = facts["shortest_mm"] * MM, facts["log_step_mm"] * MM
    waves, length = wave_basis(int(kept.sum()), GRID, max(NYQUIST * step, LEAST * shortest), cutoff)
    free = _free_of_marks(batch, run, length)
    waves, length = waves[free], length[free]
    band = part(np.eye(len(points)), GRID, cutoff, shortest).waviness[kept]
    passes = transmission(length, shortest) - transmission(length, cutoff)
    strayed = points[numbered(STRAYED, points)].to_numpy() * UM
    by_joint = waves @ band @ strayed
    coded = (
        (np.array([facts[name] for name in numbered(ENCODER, facts)], dtype=float) * UM) ** 2 * step / GRID
    )
    profile = points.loc[kept, "waviness_um"].to_numpy() * UM
    profiler = float(batch.instrument("profiler").get("sigma_mm", 0.0005)) * MM
    traced = profiler**2 * facts["profile_step_mm"] * MM / GRID
    share, missed, passed = signal_share(by_joint / passes[:, None], coded, waves @ profile / passes, traced)
    speed = float(np.ptp(points["x_mm"]) * MM / np.ptp(points["t_s"]))
    longer, _ = wave_basis(int(kept.sum()), GRID, cutoff, np.inf)
    place, axis = points.loc[kept, "x_mm"].to_numpy(), np.full(int(kept.sum()), "z")
    return Block(
        run=run,
        condition=str(row["condition"]),
        role="validate" if row["role"] == "validate" else "identify",
        order=int(row["order"]),
        measured=waves @ profile,
        sigma=passes * np.sqrt(traced + passed + _datum(length, int(kept.sum()))),
        alike=passes * np.sqrt(missed),
        setting=WavyCut(
            by_joint=by_joint,
            idle=_known(waves @ band @ (points[numbered(IDLE, points)].to_numpy() * UM)),
            share=share,
            longer=np.stack([longer @ profile, longer @ (band @ strayed.sum(axis=1))]) @ longer,
            filtered=waves @ band,
            compliance=compliance,
            **_joints(points, force, arm, wall(batch, run).normal),
        ),
        axis=np.full(len(length), "z"),
        zeros=(waves @ np.gradient(points["waviness_um"].to_numpy() * UM, GRID)[kept])[:, None],
        zero_sd=np.array([math.hypot(min(facts["shift_sd_mm"] * MM, LOOSEST), DELAY * speed)]),
        coordinates={"axis": axis, "s_mm": place, "x_mm": place, "t_s": points.loc[kept, "t_s"].to_numpy()},
        synthesis=waves.T,
        labels=_band(length),
        symmetries=np.array(PHASES)[:, None],
    )


def believed_block() -> Block:
    """Return what is believed of the transfer: the wall follows the tip, and the tip its joints."""
    zeros, none = np.zeros((1, 0)), np.zeros(0)
    return Block(
        *("believed", "believed", "calibrate", 0, np.ones(1), np.array([FOLLOWS]), BelievedSetting()),
        *(np.array(["transfer"]), zeros, none, {}),
        belief=True,
    )


def _datum(length: Array, count: int) -> Array:
    """Variance of each wave of ``length`` (k,) by the profiler's traverse, of ``count`` points in all."""
    return np.asarray(DATUM**2 * count * length / length.sum())


def _known(waves: Array) -> Array | None:
    return waves if np.isfinite(waves).all() else None


def _joints(points: pd.DataFrame, force: pd.DataFrame | None, arm: Arm, normal: Array) -> dict[str, Array]:
    """Angles, speeds, times, motion of the tip, and torques of the cut at the points."""
    q, t = points[arm.axes.commanded].to_numpy() * arm.axes.units, points["t_s"].to_numpy()
    jacobian = tip_jacobian(arm, q)
    load = np.zeros_like(q)
    if force is not None:  # mean of the steady cut: its noise along the path is no wave of the wall
        inside = force["x_mm"].between(*points.loc[points["kept"], "x_mm"].agg(["min", "max"]))
        steady = force[inside] if inside.any() else force
        load = -joint_torque(jacobian, np.tile(steady[FORCE].mean().to_numpy(), (len(q), 1)))
    moves = np.einsum("a,mai->mi", normal, jacobian)
    return {
        "q": q,
        "t": t,
        "rate": np.gradient(q, t, axis=0),
        "pace": _pace(q, t),
        "moves": moves,
        "load": load,
    }


def _pace(q: Array, t: Array) -> Array:
    """Smooth speeds (m, n) of the joints along a line at a steady feed; stamps (m,) may be late."""
    from numpy.polynomial import Polynomial

    fits = [Polynomial.fit(t, angle, BENDS) for angle in q.T]
    return np.stack([fit.deriv()(t) for fit in fits], axis=1)


def _free_of_marks(batch: Batch, run: str, length: Array) -> np.ndarray:
    """Mark the waves (n,) that are not as long as the marks of the feed: per turn, and its fractions."""
    row: Any = batch.runs.loc[run]
    teeth = int((batch.manifest.get("tool") or {}).get("teeth", 1))
    turn = float(row["feed_per_tooth_mm"]) * MM * teeth
    marks = turn / np.arange(1, teeth + 1)
    free = np.ones(len(length), dtype=bool)
    for mark in marks[np.isfinite(marks)]:
        free &= np.abs(length / mark - 1.0) > MARK
    return free


def _band(length: Array) -> np.ndarray:
    """Name the band of each wavelength (n,), m."""
    edges = np.array(OCTAVES) * MM
    names = [
        f"waves below {OCTAVES[0]:g} mm",
        *(f"waves of {low:g} to {high:g} mm" for low, high in pairwise(OCTAVES)),
        f"waves above {OCTAVES[-1]:g} mm",
    ]
    return np.array(names)[np.searchsorted(edges, length)]
