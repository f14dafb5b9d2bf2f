"""A wall's waviness and the tip's tracking error at the same places: evenly spaced points along a cut."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.joint_columns import numbered
from metro.observables.arm.tip_force import Log
from metro.observables.arm.wall import Wall
from metro.observables.arm.wall_profile import in_the_cut
from metro.observables.problem import Refusal
from metro.robot.drive_torques import TURNING
from metro.robot.kinematics import Arm
from metro.robot.statics import tip_jacobian
from metro.surface.dust import dust
from metro.surface.profile import ROUGHNESS_CUTOFF, even, part
from metro.surface.shift import Shift, shift_between
from metro.surface.waves import white_noise
from metro.units import MM, UM, Array

GRID = 0.16 * MM  # five points per shortest wave of the waviness
SAMPLES = 3.0  # of the log per shortest wave that can be compared
ALIGNED = (
    2.5 * MM
)  # shorter waves are not used to align profile and log, because they contain the encoders' noise
LEAST_LENGTH = 3  # cut-offs: one is omitted at either end, at least one is compared
LEAST_SAMPLES = 16
STRAYED, IDLE, ENCODER = "strayed{}_um", "strayed_idle{}_um", "encoder{}_um"

Points = tuple[pd.DataFrame, dict[str, object]]


def wave_points(
    profile: pd.DataFrame, cut: Log, idle: Log, arm: Arm, wall: Wall, *, cutoff: float
) -> Points | Refusal:
    """Return points every 0.16 mm along a wall, and facts on all of them together.

    The profile is shifted to the place at which the log of the cut has the same waves, if the shift differs
    from zero by more than its error. The shift is returned in either case.

    Parameters
    ----------
    profile : ``x_mm, z_mm``. cut, idle : the logs; that of the idle run may be empty. cutoff : between
        deformation and waviness, m.

    Returns
    -------
    tuple
        Per point ``x_mm, t_s, waviness_um, kept``, joint angles, the tip's tracking error along the wall's
        normal by joint, and that of the idle run (NaN if there is none); and ``shift_mm, shift_sd_mm,
        shifted, dust_points, alike, shortest_mm, profile_step_mm, log_step_mm, idle_speed``, and the noise of
        each joint's encoder at the tip, ``encoder1_um …``.
    """
    try:
        traced = profile[["x_mm", "z_mm"]].to_numpy(dtype=float).T * MM
        x, z = even(*traced)
    except ValueError as error:
        return Refusal(str(error))
    way = _way(cut, arm, wall)
    if way is None:
        return Refusal("the log of the cut does not pass the block")
    step = way.step
    shortest = max(ROUGHNESS_CUTOFF, SAMPLES * step)
    waves = part(z, x[1] - x[0], cutoff, shortest).waviness
    points = _on_grid(x, waves, way, wall, cutoff=cutoff, shift=0.0)
    if isinstance(points, Refusal):
        return points
    shift = _shift(points, wall, arm, cutoff)
    if shift.detected:
        points = _on_grid(x, waves, way, wall, cutoff=cutoff, shift=shift.value)
        if isinstance(points, Refusal):
            return points
    back = _way(idle, arm, wall) if len(idle.tip) else None
    place = points["x_mm"].to_numpy() * MM - shift.value * shift.detected
    numbers = range(1, len(arm.axes) + 1)
    strayed = np.full((len(points), len(numbers)), np.nan) if back is None else back.strayed_at(place) / UM
    points[[IDLE.format(i) for i in numbers]] = strayed
    facts: dict[str, object] = {
        "shift_mm": shift.value / MM,
        "shift_sd_mm": shift.sd / MM,
        "shifted": shift.detected,
        "dust_points": int(dust(traced[0], traced[1]).sum()),
        "alike": shift.alike,
        "shortest_mm": shortest / MM,
        "profile_step_mm": (x[1] - x[0]) / MM,
        "log_step_mm": step / MM,
        "idle_speed": math.nan if back is None else back.speed / way.speed,
        **{ENCODER.format(i): math.sqrt(white_noise(way.strayed[:, i - 1])) / UM for i in numbers},
    }
    return points, facts


class _Way:
    """The log of a pass along a wall, by place: ``strayed`` (m, n) m along the wall's normal by joint."""

    def __init__(self, place: Array, log: Log, arm: Arm, wall: Wall) -> None:
        self.place, first = np.unique(place, return_index=True)
        self.axes = arm.axes
        self.commanded, self.time = log.commanded[first], log.time[first]
        moves = np.einsum("a,mai->mi", wall.normal, tip_jacobian(arm, self.commanded))
        self.strayed = moves * (log.actual[first] - self.commanded)
        self.step = float(np.median(np.diff(self.place)))
        self.speed = self.step / float(np.median(np.diff(np.sort(self.time))))

    def strayed_at(self, place: Array) -> Array:
        """Tracking error (m, n) at places (m,), the mean over one grid spacing; NaN beyond the log.

        The mean removes noise that is finer than the grid.
        """
        from scipy.interpolate import CubicSpline

        whole = CubicSpline(self.place, self.strayed, extrapolate=False).antiderivative()
        ends = [np.clip(place + side * GRID / 2, self.place[0], self.place[-1]) for side in (-1.0, 1.0)]
        mean = (whole(ends[1]) - whole(ends[0])) / np.maximum(ends[1] - ends[0], 1e-12)[:, None]
        beyond = (place < self.place[0] - 1e-12) | (place > self.place[-1] + 1e-12)
        return np.asarray(np.where(beyond[:, None], np.nan, mean))


def _way(log: Log, arm: Arm, wall: Wall) -> _Way | None:
    """Return the part of a log that is on the line of the cut; None if it does not pass the block."""
    place = log.tip @ wall.along - wall.start
    cutting = in_the_cut(log.tip, place, wall) if len(place) else np.zeros(0, dtype=bool)
    if cutting.sum() < LEAST_SAMPLES:
        return None
    part_of = Log(
        log.commanded[cutting], log.actual[cutting], log.torque[cutting], log.tip[cutting], log.time[cutting]
    )
    return _Way(place[cutting], part_of, arm, wall)


def _on_grid(
    x: Array, waves: Array, way: _Way, wall: Wall, *, cutoff: float, shift: float
) -> pd.DataFrame | Refusal:
    """Put profile and log on one grid; the log's places lie ``shift`` further along the profile."""
    from scipy.interpolate import CubicSpline

    start = max(x[0], way.place[0] + shift, 0.0)
    end = min(x[-1], way.place[-1] + shift, wall.length)
    grid = GRID * np.arange(math.ceil(start / GRID - 1e-6), math.floor(end / GRID + 1e-6) + 1)
    kept = (grid >= start + cutoff - 1e-9) & (grid <= min(end, wall.length - wall.leaving) - cutoff + 1e-9)
    if len(grid) < 2 or kept.sum() * GRID < (LEAST_LENGTH - 2) * cutoff:
        return Refusal(
            f"{max(end - start, 0.0) / MM:.1f} mm of the trace lie where the log of the cut is: "
            f"at least {LEAST_LENGTH} cut-offs of {cutoff / MM:g} mm are needed, and the exit"
        )
    place = grid - shift
    joints = CubicSpline(way.place, way.commanded)(place)
    columns = {
        "x_mm": grid / MM,
        "t_s": np.interp(place, way.place, way.time),
        "waviness_um": np.interp(grid, x, waves) / UM,
        "kept": kept,
        **dict(zip(way.axes.commanded, (joints / way.axes.units).T, strict=True)),
        **{STRAYED.format(i + 1): one / UM for i, one in enumerate(way.strayed_at(place).T)},
    }
    return pd.DataFrame(columns)


def _shift(points: pd.DataFrame, wall: Wall, arm: Arm, cutoff: float) -> Shift:
    """Shift of the profile against the log, from the waves that exceed the noise of the encoders.

    A joint that reverses may leave a step that is no tracking error; the fit includes such steps.
    """
    joints, t = points[arm.axes.commanded].to_numpy() * arm.axes.units, points["t_s"].to_numpy()
    rate = np.gradient(joints, t, axis=0)
    turns = (rate.max(axis=0) > TURNING) & (rate.min(axis=0) < -TURNING)
    moves = np.einsum("a,mai->mi", wall.normal, tip_jacobian(arm, joints))
    shapes = np.column_stack(
        [
            points["waviness_um"].to_numpy() * UM,
            points[numbered(STRAYED, points)].to_numpy().sum(axis=1) * UM,
            (moves * np.tanh(rate / TURNING))[:, turns],
        ]
    )
    waves = part(shapes, GRID, cutoff, ALIGNED).waviness
    return shift_between(waves[:, 0], waves[:, 1], points["kept"].to_numpy(), GRID, waves[:, 2:])
