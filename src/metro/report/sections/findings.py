"""The first sentence of a figure's caption, which states its result, computed from the figure's data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from metro.report.figures.comparison import axis_labels, predictions
from metro.report.figures.verdicts import Change
from metro.report.numbers import listing, number, percent, with_interval
from metro.units import JSON, Array, printed

MODELS = {"before": "the base model", "after": "the effects found"}
NORMAL = 1.96
_SHARE = 0.95
_OF_BASE_MODEL = "The error of the base model is "


def changed(rows: Sequence[Change]) -> str:
    """Say which errors the added effects reduced, by as much as is printed, and which is the largest left."""
    fell = [row for row in rows if row.after < row.before and _percent(row.after) != _percent(row.before)]
    largest = max(rows, key=lambda row: row.after)
    if len(rows) == 1:
        (row,) = rows
        if row.after == row.before:
            return f"The held-out error is {_percent(row.after)} of the signal; no effect was added."
        if not fell:
            return f"The held-out error does not fall; it is {_percent(row.after)} of the signal."
        return f"The held-out error falls from {_percent(row.before)} to {_percent(row.after)} of the signal."
    least = f"the largest remaining error is {_percent(largest.after)} of the signal, {largest.label}."
    if all(row.after == row.before for row in rows):
        return f"No effect was added; {least}"
    return f"Held-out errors fall in {len(fell)} of {len(rows)} cases; {least}"


def left(frame: pd.DataFrame) -> str:
    """Say the residual of the predictions and the signal, rms over the values of a comparison table."""
    signal = f"for a measured signal of {_with_unit(_rms(frame['measured']), frame)} rms"
    before, *after = (_with_unit(_rms(_residual(frame, k.column)), frame) for k in predictions(frame))
    with_effects = f" and {after[0]} with the effects found" if after else ""
    return f"{_OF_BASE_MODEL}{before} rms{with_effects}, {signal}."


def missed(frame: pd.DataFrame, run: str) -> str:
    """Say the residual of the run for which the base model has the largest error."""
    said = left(frame[frame["run"] == run]).removeprefix(_OF_BASE_MODEL)
    return f"Held-out run {run} has the largest error of the base model: {said}"


def scatter(frame: pd.DataFrame) -> str:
    """Say the limits of the differences, and the limits of differences from noise alone."""
    limits = listing(
        [
            f"{_with_unit(float(np.quantile(np.abs(_residual(frame, k.column)), _SHARE)), frame)} of "
            + ("the base model" if k.column == "before" else "the model with the effects found")
            for k in predictions(frame)
        ]
    )
    noise = NORMAL * _rms(frame["sigma"]) if frame["sigma"].notna().all() else 0.0
    beside = f"; with noise alone they would lie within {_with_unit(noise, frame)}" if noise else ""
    return f"{percent(_SHARE)} of the values lie within {limits}{beside}."


def offsets(frame: pd.DataFrame) -> str:
    """Say the mean error of a prediction, axis by axis."""
    averages = []
    for kind in predictions(frame):
        residuals = pd.Series(_residual(frame, kind.column)).groupby(
            axis_labels(frame).to_numpy(), sort=False
        )
        sizes = [
            f"{axis} {_rounded(float(residual.mean()), _rms(residual))}".strip()
            for axis, residual in residuals
        ]
        name = "base model" if kind.column == "before" else "with the effects found"
        averages.append(f"{name} {', '.join(sizes)}{_unit(frame)}")
    return f"Mean of measured minus predicted: {'; '.join(averages)}."


def peak_order(orders: pd.DataFrame) -> str:
    """Say at which order of the spindle, and along which axis, the residual is largest."""
    row = orders.iloc[int(orders["after"].argmax())]
    return (
        f"The largest residual is at order {row['order']:g} along {row['axis']}: {number(row['after'])} N, "
        f"for {number(row['measured'])} N measured there."
    )


def tooth_peaks(peaks: pd.DataFrame) -> str:
    """Say the errors of the peaks of single teeth, in the median and at worst."""
    said = []
    for model, name in MODELS.items():
        part = peaks[peaks["model"] == model]
        size = part["percent"].abs()
        if size.notna().any():
            worst = part.iloc[int(np.nanargmax(size))]
            share = f"{number(size.median(), 2)} % in the median, {number(size.max(), 2)} % at worst"
            said.append(f"with {name} {share} ({worst['run']}, {worst['axis']})")
    unlike = len(said) > 1 and said[0].partition(MODELS["before"])[2] != said[1].partition(MODELS["after"])[2]
    return f"The error of the tooth peaks is {listing(said if unlike else said[:1])}." if said else ""


def above_floor(blocks: Sequence[JSON], floor: float | None, shown: str | None) -> str:
    """Say how many runs have a residual above the noise floor, and which has the largest."""
    residuals = {str(b["run"]): float(b.get("rms_after") or b["rms_before"]) for b in blocks}
    worst = max(residuals, key=lambda run: residuals[run])
    most = f"{worst} has the largest residual, {number(residuals[worst])} {printed(shown)}".rstrip()
    if floor is None:
        return f"Run {most}."
    above = sum(residual > floor for residual in residuals.values())
    some = (
        f"{above or 'None'} of {len(residuals)} runs {'exceed' if above > 1 else 'exceeds'} the noise floor"
    )
    usual = ", as up to half of them do where nothing is missing" if 0 < above <= len(residuals) / 2 else ""
    return f"{some}{usual}; {most}."


def lowest_boundary(boundary: pd.DataFrame, columns: Sequence[tuple[str, str]]) -> str:
    """Say the stable depth at the worst speed, and this speed, for each line of a diagram."""
    depths = []
    for column, name in columns:
        known = boundary[boundary[column].notna()]
        if len(known):
            row = known.iloc[int(known[column].argmin())]
            end = row["rpm"] in (boundary["rpm"].min(), boundary["rpm"].max())
            at = f"{number(row['rpm'], 4)} rpm{', the end of the computed speeds' if end else ''}"
            depths.append(f"{number(row[column])} mm (reached at {at}){name}")
    return f"At every speed a cut is stable up to {listing(depths)}." if depths else ""


def _residual(frame: pd.DataFrame, column: str) -> Array:
    residual: Array = frame["measured"].to_numpy(float) - frame[column].to_numpy(float)
    return residual


def _rms(values: pd.Series | Array) -> float:
    return float(np.sqrt(np.mean(np.square(np.asarray(values, float)))))


def _rounded(value: float, spread: float) -> str:
    """Write a mean to the digits of the spread of its values."""
    return with_interval(value, [value - spread, value + spread]).partition(" ")[0]


def _unit(frame: pd.DataFrame) -> str:
    shown = printed(str(frame["unit"].iloc[0]))
    return f" {shown}" if shown else ""


def _with_unit(value: float, frame: pd.DataFrame) -> str:
    return f"{number(value)}{_unit(frame)}"


def _percent(value: float) -> str:
    return percent(value / 100)
