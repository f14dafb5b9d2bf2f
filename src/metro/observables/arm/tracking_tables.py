"""Tables of how far the arm is off its set-points across the feed: flange and tip, cut and idle, by joint.

Tables ``robot_tracking`` (along the path, means over bins), ``robot_tracking_size`` (amplitudes of a run, and
the joint that makes most of the tip's error), ``robot_spectra`` and ``robot_lines`` (of the tip's error).
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.joint_columns import numbered
from metro.observables.arm.tip_force import BIN, Log
from metro.observables.arm.wall import Wall
from metro.observables.waviness.report import joint_share
from metro.robot.kinematics import Arm
from metro.robot.statics import tip_jacobian
from metro.robot.tracking import tracking_error
from metro.signals import align
from metro.signals.path_spectrum import FINER, even_samples, spectrum
from metro.units import MM, UM, Array

BY_JOINT, ERROR, TORQUE, RATE = "joint{}_um", "error{}_urad", "torque{}_nm", "rate{}_rad_s"
UPWARD = np.array([0.0, 0.0, 1.0])


def tracking_tables(cut: Log, idle: Log, arm: Arm, face: Wall) -> dict[str, pd.DataFrame]:
    """Return the tracking errors of a run ([K] eqs. 3 and 4), and their spectra."""
    logs = {name: log for name, log in (("cut", cut), ("idle", idle)) if len(log.tip)}
    courses = {name: _course(log, cut, arm, face) for name, log in logs.items()}
    course = pd.concat([table.assign(log=name) for name, table in courses.items()], ignore_index=True)
    return {"robot_tracking": course, "robot_tracking_size": _sizes(courses), **_spectra(cut, arm)}


def _course(log: Log, cut: Log, arm: Arm, face: Wall) -> pd.DataFrame:
    """Errors of a log across the feed, by bins along the path of the cut.

    ``flange_um``, ``tip_um``; ``joint1_um`` …: at the tip, of one joint alone; ``error1_urad`` …,
    ``torque1_nm`` …, ``rate1_rad_s`` … of the joints.
    """
    across = np.cross(UPWARD, face.along)
    error = tracking_error(arm, log.actual, log.commanded)
    moves = np.einsum("a,mai->mi", across, tip_jacobian(arm, log.commanded))
    strayed = log.actual - log.commanded
    place = align.along_path(log.tip, cut.tip)
    step = float(np.median(np.abs(np.diff(place[np.isfinite(place)]))))
    edges: Array = np.arange(np.nanmin(place), np.nanmax(place), max(BIN, 3 * step))
    x = (log.tip @ face.along - face.start) / MM
    joints = range(1, len(arm.axes) + 1)
    rates = [RATE.format(i) for i in joints]
    columns = ["x_mm", "flange_um", "tip_um", *(BY_JOINT.format(i) for i in joints)]
    columns += [ERROR.format(i) for i in joints] + arm.axes.driven(TORQUE) + rates
    values = np.column_stack(
        [
            x,
            error.flange @ across / UM,
            error.tip @ across / UM,
            moves * strayed / UM,
            strayed / UM,
            log.torque,
            log.commanded,
            log.time,
        ]
    )
    means = align.bin_means(place, values, edges)
    means = means[np.isfinite(means).all(axis=1)]
    _, angles, time = np.split(means, [-1 - len(rates), -1], axis=1)
    turned = align.slopes(angles, time[:, 0])
    return pd.DataFrame(means[:, :-1], columns=columns).assign(**dict(zip(rates, turned.T, strict=True)))


def _sizes(courses: dict[str, pd.DataFrame]) -> pd.DataFrame:
    """One row: amplitudes of flange and tip in both logs, and what the joint with the largest share does."""
    row: dict[str, float | int] = {}
    for name, course in courses.items():
        for what in ("flange", "tip"):
            row[f"{what}_{name}_um"] = 0.5 * float(np.ptp(course[f"{what}_um"]))
    course = courses["cut"]
    by_joint = course[numbered(BY_JOINT, course)].to_numpy()
    share = joint_share(by_joint - by_joint.mean(axis=0))
    first = int(np.argmax(share))
    row |= {"joint": first + 1, "share": float(share[first])}
    row["joint_um"] = 0.5 * float(np.ptp(by_joint[:, first]))
    error, torque = ERROR.format(first + 1), TORQUE.format(first + 1)
    pair = course[[error, torque]].to_numpy() if torque in course else np.zeros((0, 2))
    varies = len(pair) > 1 and bool((pair.std(axis=0) > 0.0).all())
    row["correlation"] = float(np.corrcoef(pair.T)[0, 1]) if varies else np.nan
    return pd.DataFrame([row])


def _spectra(cut: Log, arm: Arm) -> dict[str, pd.DataFrame]:
    """Spectra of the tip's tracking error (encoder less set, work frame), over time and along the path."""
    error = arm.tip(cut.actual) - cut.tip
    place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(cut.tip, axis=0), axis=1))])
    spectra, lines = [], []
    for domain, along, unit in (("time", cut.time, 1.0), ("path", place, MM)):
        even, spacing = even_samples(along, error)
        for axis, channel in zip("xyz", even.T, strict=True):
            try:
                resolved = spectrum(channel, spacing)
            except ValueError:
                continue
            keep = slice(FINER, None, FINER)  # the zero padding gives finer steps than the record resolves
            density = {
                "frequency": resolved.frequency[keep] * unit,
                "density_um2": resolved.density[keep] / UM**2 / unit,
            }
            spectra.append(pd.DataFrame({"domain": domain, "axis": axis, **density}))
            lines += [
                {
                    "domain": domain,
                    "axis": axis,
                    "frequency": line.frequency * unit,
                    "frequency_sd": line.frequency_sd * unit,
                    "amplitude_um": line.amplitude / UM,
                    "amplitude_sd_um": line.amplitude_sd / UM,
                    "probability": line.probability,
                }
                for line in resolved.lines
            ]
    tables = {"robot_spectra": pd.concat(spectra, ignore_index=True)} if spectra else {}
    return tables | ({"robot_lines": pd.DataFrame(lines)} if lines else {})
