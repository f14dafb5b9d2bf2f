"""Stylus traces as points along the wall, each with the pose of the arm when it was cut."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pandas as pd

from metro.observables.arm.tip_force import Log
from metro.observables.arm.wall import Wall
from metro.observables.problem import Refusal
from metro.robot.kinematics import Arm
from metro.signals.align import bin_means
from metro.surface.profile import Bands, even, gaussian_filter, noise_gain, part
from metro.units import MM, Array

SPACING = 1 * MM
WEIGHT = "weight{}_nm"
ASIDE = 1 * MM  # a log's sample further than this from the line of the cut belongs to another move


def wall_points(
    profile: pd.DataFrame,
    log: Log,
    arm: Arm,
    wall: Wall,
    *,
    cutoff: float,
    noise: float,
    weight: Callable[[Array], Array],
) -> pd.DataFrame | Refusal:
    """Return points at each millimetre along a wall, from its trace and the log of the cut.

    Parameters
    ----------
    profile : ``x_mm, z_mm``. cutoff : between deformation and waviness, m. noise : of the profiler, m.
    weight : torque of the arm's weight on each joint's link (m, n), N m, at joint angles (m, n).

    Returns
    -------
    pd.DataFrame
        ``x_mm, deformation_mm, sigma_mm, waviness_mm, tracking_mm, tracking_waviness_mm``, joint angles, and
        ``weight1_nm`` … of the joints that turn.
    """
    try:
        x, z = even(profile["x_mm"].to_numpy(dtype=float) * MM, profile["z_mm"].to_numpy(dtype=float) * MM)
    except ValueError as error:
        return Refusal(str(error))
    place = log.tip @ wall.along - wall.start
    cutting = in_the_cut(log.tip, place, wall)
    if cutting.sum() < 2:
        return Refusal("the log of the cut does not pass the block")
    place, commanded, actual = place[cutting], log.commanded[cutting], log.actual[cutting]
    inside = (x >= max(0.0, place.min())) & (x <= min(wall.length, place.max()))
    x, z = x[inside], z[inside]
    if len(x) < 2 or x[-1] - x[0] < 2 * cutoff:
        return Refusal(
            f"less than two cut-offs ({2 * cutoff / MM:g} mm) of the trace lie where the log of the cut is"
        )
    spacing = x[1] - x[0]
    order = np.argsort(place)
    strayed = (arm.tip(actual) - arm.tip(commanded)) @ wall.normal
    tracking = part(np.interp(x, place[order], strayed[order]), spacing, cutoff)
    bands = part(z, spacing, cutoff)
    points = SPACING * np.arange(math.ceil(x[0] / SPACING - 1e-6), math.floor(x[-1] / SPACING + 1e-6) + 1)
    edges = np.append(points - SPACING / 2, points[-1] + SPACING / 2)
    axes = arm.axes
    joints = _filled(points, bin_means(place, np.hstack([commanded, actual]) / (2 * axes.units), edges))
    columns = {
        "x_mm": points / MM,
        "deformation_mm": np.interp(points, x, bands.deformation) / MM,
        "sigma_mm": _error(bands, tracking, spacing, cutoff, noise) / MM,
        "waviness_mm": np.interp(points, x, bands.waviness) / MM,
        "tracking_mm": np.interp(points, x, tracking.deformation) / MM,
        "tracking_waviness_mm": np.interp(points, x, tracking.waviness) / MM,
    }
    columns |= dict(zip([*axes.commanded, *axes.positions], joints.T, strict=True))
    carried = weight(joints[:, : len(axes)] * axes.units)[:, axes.turning]
    return pd.DataFrame({**columns, **dict(zip(axes.driven(WEIGHT), carried.T, strict=True))})


def in_one_pose(joints: Array, wall: Wall, arm: Arm) -> Log:
    """Replace a log that was not kept: one pose (n,) rad all along the wall, without tracking error."""
    length = wall.length if math.isfinite(wall.length) else 1.0
    x = np.arange(0.0, length + SPACING, SPACING / 4)
    still = np.tile(joints, (len(x), 1))
    tip = arm.tip(joints)
    on_line = tip + np.outer(x + wall.start - tip @ wall.along, wall.along)
    return Log(still, still, np.zeros_like(still[:, arm.axes.turning]), on_line)


def in_the_cut(tip: Array, place: Array, wall: Wall) -> np.ndarray:
    """Mark the samples on the line of the cut; a log may also hold the approach and the return."""
    over = (place >= 0.0) & (place <= wall.length)
    if not over.any():
        return over
    beside = tip - np.outer(tip @ wall.along, wall.along)
    on_line = np.linalg.norm(beside - np.median(beside[over], axis=0), axis=1) < ASIDE
    return np.asarray(on_line & (place >= -5 * MM) & (place <= wall.length + 5 * MM))


def _error(bands: Bands, tracking: Bands, spacing: float, cutoff: float, noise: float) -> float:
    """Estimate the error of the deformation: the profiler's noise, and waviness that the filter lets through.

    The latter is what a second pass of the filter removes from the part that the tracking error does not
    explain. Its wavelengths are near the cut-off, where deformation and waviness cannot be distinguished.
    """
    long_wave = bands.deformation - tracking.deformation
    edge = min(len(long_wave) // 4, math.ceil(cutoff / 2 / spacing))
    between = (long_wave - gaussian_filter(long_wave, spacing, cutoff))[edge : len(long_wave) - edge]
    return math.hypot(noise * noise_gain(spacing, cutoff), float(np.sqrt(np.mean(between**2))))


def _filled(x: Array, values: Array) -> Array:
    """Fill empty rows (a fast feed skips a millimetre) linearly between their neighbours."""
    known = np.isfinite(values).all(axis=1)
    return np.stack([np.interp(x, x[known], column[known]) for column in values.T], axis=1)
