"""What a figure shows, as the sentence that its caption starts with: computed from the figure's own data."""

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


def changed(rows: Sequence[Change]) -> str:
    """Say where an error fell by what was added, and where the largest one is left."""
    fell = [row for row in rows if row.after < row.before]
    largest = max(rows, key=lambda row: row.after)
    if len(rows) == 1:
        (row,) = rows
        if not fell:
            return f"Held-out error: {_percent(row.after)} of the signal, nothing was added."
        return f"The held-out error falls from {_percent(row.before)} to {_percent(row.after)} of the signal."
    least = f"the largest that is left is {_percent(largest.after)} of the signal, {largest.label}."
    if not fell:
        return f"No held-out error fell, as nothing was added; {least}"
    return f"Held-out errors fall in {len(fell)} of {len(rows)} cases; {least}"


def left(frame: pd.DataFrame) -> str:
    """Say how much of a signal the predictions leave, rms over the values of a table of comparison."""
    signal = f"of {_with_unit(_rms(frame['measured']), frame)} measured"
    before, *after = (_with_unit(_rms(_rest(frame, k.column)), frame) for k in predictions(frame))
    if not after:
        return f"The base model leaves {before} rms {signal}."
    return f"The base model leaves {before} rms {signal}, with the effects found {after[0]}."


def missed(frame: pd.DataFrame, run: str) -> str:
    """Say how much a run leaves that the base model misses most."""
    said = left(frame[frame["run"] == run]).removeprefix("The base model leaves ")
    return f"Of the held-out runs the base model misses {run} most: it leaves {said}"


def scatter(frame: pd.DataFrame) -> str:
    """Say within what the differences lie, and within what those that noise makes would."""
    told = listing(
        [
            f"{_with_unit(float(np.quantile(np.abs(_rest(frame, k.column)), _SHARE)), frame)} of "
            + ("the base model" if k.column == "before" else "the model with the effects found")
            for k in predictions(frame)
        ]
    )
    noise = NORMAL * _rms(frame["sigma"]) if frame["sigma"].notna().all() else 0.0
    beside = f"; noise alone puts them within {_with_unit(noise, frame)}" if noise else ""
    return f"{percent(_SHARE)} of the values are within {told}{beside}."


def offsets(frame: pd.DataFrame) -> str:
    """Say by how much a prediction is off on the average, axis by axis."""
    told = []
    for kind in predictions(frame):
        rests = pd.Series(_rest(frame, kind.column)).groupby(axis_labels(frame).to_numpy(), sort=False)
        sizes = [f"{axis} {_rounded(float(rest.mean()), _rms(rest))}".strip() for axis, rest in rests]
        name = "base model" if kind.column == "before" else "with the effects found"
        told.append(f"{name} {', '.join(sizes)}{_unit(frame)}")
    return f"Measured less predicted, on the average: {'; '.join(told)}."


def peak_order(orders: pd.DataFrame) -> str:
    """Say at which order of the spindle, along which axis, most is left."""
    row = orders.iloc[int(orders["after"].argmax())]
    return (
        f"Most is left at order {row['order']:g} along {row['axis']}: {number(row['after'])} N "
        f"of {number(row['measured'])} N measured there."
    )


def tooth_peaks(peaks: pd.DataFrame) -> str:
    """Say by how much the peaks of single teeth are missed, in the median and at worst."""
    said = []
    for model, name in MODELS.items():
        part = peaks[peaks["model"] == model]
        size = part["percent"].abs()
        if size.notna().any():
            worst = part.iloc[int(np.nanargmax(size))]
            share = f"{number(size.median(), 2)} % in the median, {number(size.max(), 2)} % at worst"
            said.append(f"with {name} by {share} ({worst['run']}, {worst['axis']})")
    unlike = len(said) > 1 and said[0].partition(" by ")[2] != said[1].partition(" by ")[2]
    return f"The peaks of single teeth are missed {listing(said if unlike else said[:1])}." if said else ""


def above_floor(blocks: Sequence[JSON], floor: float | None, shown: str | None) -> str:
    """Say how many runs leave more than noise would, and which the most."""
    rests = {str(b["run"]): float(b.get("rms_after") or b["rms_before"]) for b in blocks}
    worst = max(rests, key=lambda run: rests[run])
    most = f"{worst} leaves most, {number(rests[worst])} {printed(shown)}".rstrip()
    if floor is None:
        return f"Run {most}."
    above = sum(rest > floor for rest in rests.values())
    some = f"{above or 'None'} of {len(rests)} runs {'lie' if above > 1 else 'lies'} above the noise floor"
    return f"{some}; {most}."


def lowest_boundary(boundary: pd.DataFrame, columns: Sequence[tuple[str, str]]) -> str:
    """Say how deep one may cut at the worst speed, and which that is, for each line of a diagram."""
    told = []
    for column, name in columns:
        known = boundary[boundary[column].notna()]
        if len(known):
            row = known.iloc[int(known[column].argmin())]
            told.append(f"{number(row[column])} mm (reached at {number(row['rpm'], 4)} rpm){name}")
    return f"At every speed a cut is stable up to {listing(told)}." if told else ""


def _rest(frame: pd.DataFrame, column: str) -> Array:
    rest: Array = frame["measured"].to_numpy(float) - frame[column].to_numpy(float)
    return rest


def _rms(values: pd.Series | Array) -> float:
    return float(np.sqrt(np.mean(np.square(np.asarray(values, float)))))


def _rounded(value: float, spread: float) -> str:
    """Write a mean to the digits that the spread of what it is the mean of has."""
    return with_interval(value, [value - spread, value + spread]).partition(" ")[0]


def _unit(frame: pd.DataFrame) -> str:
    shown = printed(str(frame["unit"].iloc[0]))
    return f" {shown}" if shown else ""


def _with_unit(value: float, frame: pd.DataFrame) -> str:
    return f"{number(value)}{_unit(frame)}"


def _percent(value: float) -> str:
    return percent(value / 100)
