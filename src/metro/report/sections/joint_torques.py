"""The force from the joints' torques: which joints count, how the torques are filtered, what comes of it."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.report.content import Bullets, Heading, Item, Picture, Table
from metro.report.figures import joint_torques as figures
from metro.report.numbers import listing, number
from metro.report.results import Results
from metro.report.sections.stiffness import LONGEST, band, more

RUNS = 2
SAME = 1e-3  # of the forces' size: frames in which they differ by less are one frame


def joint_torques(results: Results) -> list[Item]:
    """Write the force from the torques of the joints; nothing where no run has both logs."""
    means, refused = results.tables.get("robot_means"), results.tables.get("robot_refused")
    joints = results.tables.get("robot_joints")
    items: list[Item] = []
    if joints is not None:
        items += [*_torques(results, joints), *_joints(joints)]
    if means is not None and joints is not None:
        about = (results.identified.get("arm") or {}).get("tip_force_by_torques_about") or {}
        items += _means(means, joints, str(about.get("gain_from") or ""))
        items += _course(results, means)
    if refused is not None:
        groups = refused.groupby("reason", sort=False)["run"]
        items.append(Bullets([f"{listing(list(runs))}: {reason}." for reason, runs in groups]))
    return [Heading("Force from the joints' torques"), *items] if items else []


def _torques(results: Results, joints: pd.DataFrame) -> list[Item]:
    """Draw the torques of the first run, before and after they are brought together and filtered."""
    together, table = results.tables.get("robot_aligned"), results.tables.get("robot_torques")
    if together is None or table is None:
        return []
    run = str(together["run"].iloc[0])
    caption = (
        f"Torques of run {run}. Left: a joint in the cut and in the idle run, by their clocks and by the "
        "place along the wall, where the logs are subtracted. Right: what the cut adds, mean of each bin, "
        "and filtered with its 95 % band."
    )
    drawn = figures.torques(together, table[table["run"] == run], joints[joints["run"] == run])
    return [Picture(drawn, caption, caption)]


def _joints(joints: pd.DataFrame) -> list[Item]:
    """Draw which joints count and whether the filter's model holds; tabulate the model and remarks."""
    tested = joints["whiteness"].notna()
    alarms = int((joints["whiteness"] < figures.LEVEL).sum())
    threshold = float(joints["threshold"].iloc[0])
    passing = (joints["index"] >= threshold).groupby(joints["run"]).sum()
    caption = (
        f"Left: observability index of the joints, mean torque of the steady cut over the range of the idle "
        f"run; {threshold:g} is the threshold of [K], which fewer than three joints reach in "
        f"{int((passing < 3).sum())} of {len(passing)} runs. Right: probability of the innovations' "
        f"autocorrelation in white noise (Li–McLeod), in order; on the line if the filter's model is right. "
        f"{alarms} of {int(tested.sum())} are below {figures.LEVEL:g}, where chance puts "
        f"{number(figures.LEVEL * int(tested.sum()), 2)}."
    )
    columns = (
        ("noise of a bin, √R (N m)", "noise_nm"),
        ("drift from bin to bin, √Q (N m)", "drift_nm"),
        ("friction, cut against idle run (N m)", "friction_nm"),
    )
    medians = joints.groupby("joint")[[name for _, name in columns]].median()
    rows = [[title, *(number(value, 2) for value in medians[name])] for title, name in columns]
    about = (
        "What each joint's torque is weighted by, medians over the runs: R from the idle run; Q by maximum "
        "likelihood, anew on either side of the places where the tool enters and leaves; the difference of "
        "friction from the torques in the air, at least a tenth of the noise."
    )
    header = ["", *(f"joint {i}" for i in medians.index)]
    items: list[Item] = [
        Picture(figures.joints(joints, threshold), caption, caption),
        Table(
            header,
            rows,
            about,
            [2.4, *([0.8] * len(medians))],
            numeric=list(range(1, len(header))),
            small=True,
        ),
    ]
    said = joints[joints["remark"] != ""].drop_duplicates(["run", "remark"])
    groups = said.groupby("remark", sort=False)["run"]
    if len(said):
        items.append(Bullets([f"{listing(list(runs))}: {remark}." for remark, runs in groups]))
    return items


def _means(means: pd.DataFrame, joints: pd.DataFrame, gain_from: str) -> list[Item]:
    """Tabulate the steady means run by run, as in [K] table 7, in the frames of work and tool.

    ``gain_from``: where the uncertainty of the drives is from, which runs without a dynamometer have.
    """
    drives = f", and by the drives' constants where no dynamometer read it ({gain_from})" if gain_from else ""
    frames = dict(tuple(means.groupby("frame", sort=False)))
    work, tool = frames["work"], frames.get("tool")
    if tool is None:
        return [_mean_table(work, joints, drives, "the work's axes")]
    off = np.abs(tool["sensorless_n"].to_numpy() - work["sensorless_n"].to_numpy()).max()
    if off <= SAME * np.abs(work["sensorless_n"]).max():
        return [_mean_table(work, joints, drives, "the work's axes, which are the tool's")]
    return [
        _mean_table(work, joints, drives, "the work's axes"),
        _mean_table(tool, joints, drives, "the tool's axes"),
    ]


def _mean_table(means: pd.DataFrame, joints: pd.DataFrame, drives: str, axes: str) -> Table:
    beside = means[means["dynamometer_n"].notna()]
    used = joints[joints["used"]].groupby("run", sort=False)["joint"].apply(_numbers)
    rows = []
    for run, part in means.groupby("run", sort=False):
        star = "" if part["enough"].iloc[0] else " *"
        cells = (cell for _, r in part.sort_values("axis").iterrows() for cell in _mean(r, bool(len(beside))))
        rows.append([str(run), str(used.get(run, "–")) + star, *cells])
    caption = (
        f"Mean force on the tool in the steady cut by the torques of the joints (N), in {axes}, with its "
        f"95 % interval by noise and friction{drives}, and the joints that it is solved from"
    )
    if len(beside):
        off = (beside["sensorless_n"] - beside["dynamometer_n"]).abs()
        by_axis = ", ".join(
            f"{a} {number(float(e), 2)}" for a, e in off.groupby(beside["axis"]).mean().items()
        )
        caption += (
            "; beside the dynamometer's, with the error in percent of that. Mean of the absolute errors: "
            f"{number(float(off.mean()), 2)} N ({by_axis})"
        )
    caption += f". Condition number: {number(float(means['condition'].max()), 2)} at most."
    if not means["enough"].all():
        caption += (
            " * Fewer than three joints reach the index: by the rule of [K] there is no estimate. Here the "
            "interval takes its place."
        )
    header = ["run", "joints"]
    for axis in sorted(means["axis"].unique()):
        header += [f"{axis}, measured", "by torques", "%"] if len(beside) else [f"{axis} (N)"]
    widths = [0.6, 0.9, *([0.95, 1.4, 0.65] if len(beside) else [1.0]) * means["axis"].nunique()]
    numeric = list(range(2, len(header)))
    body = rows[:LONGEST]
    return Table(header, body, caption + more(len(rows)), widths, numeric=numeric, small=bool(len(beside)))


def _numbers(joints: pd.Series) -> str:
    """Write the numbers of joints: 1–6 where none between is left out, else 1 3 5."""
    known = sorted(int(joint) for joint in joints)
    whole = len(known) > 2 and known == list(range(known[0], known[-1] + 1))
    return f"{known[0]}–{known[-1]}" if whole else " ".join(map(str, known))


def _mean(row: pd.Series, beside: bool) -> list[str]:
    measured, sd = float(row["dynamometer_n"]), float(row["sensorless_sd_n"])
    if math.isnan(measured):
        sd = math.hypot(sd, float(row["drives_sd_n"]))
    text = band(row["sensorless_n"], sd)
    if not beside:
        return [text]
    error = number(100 * (row["sensorless_n"] / measured - 1), 2) if measured else "–"
    return [number(measured), text, error if math.isfinite(measured) else "–"]


def _course(results: Results, means: pd.DataFrame) -> list[Item]:
    force = results.tables.get("robot_force")
    if force is None:
        return []
    means = means[means["frame"] == "work"]
    beside = means.loc[means["dynamometer_n"].notna(), "run"].drop_duplicates()
    runs = [str(r) for r in dict.fromkeys([*beside, *force["run"].drop_duplicates()])][:RUNS]
    off = (means["sensorless_n"] - means["dynamometer_n"]).abs() if len(beside) else None
    finding = "" if off is None else f"The steady means differ by at most {number(off.max(), 2)} N. "
    caption = (
        f"{finding}Force on the tool along the wall from the torques of the joints, smoothed, with the "
        f"95 % band of each place; cut-in and cut-out shaded. Runs {listing(runs)} of "
        f"{force['run'].nunique()}."
    )
    return [Picture(figures.courses(force, means, runs), caption, caption)]
