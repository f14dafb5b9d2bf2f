"""Curves of held-out runs, measured and predicted, as data for the page."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from metro.observables.catalogue import title
from metro.report.figures.comparison import (
    COORDINATES,
    Prediction,
    axes_of,
    axis_labels,
    coordinate,
    predictions,
)
from metro.report.numbers import number
from metro.report.page.packing import (
    THINNED,
    decimals,
    fitting,
    gaps,
    kept,
    left_out,
    notes,
    packed,
    rms_by_run,
)
from metro.report.results import Results
from metro.units import JSON, Array, printed

HELP = (
    "Arrow left and right: move the line. Page up and page down: ten places on or back. End: to the last "
    "place. Up and down: next test cut, where there are any. + and −: zoom at the line; the heights follow. "
    "Shift with an arrow: move the part that is seen. Home: all of it. Mouse or finger: drag over a part to "
    "see it, double click for all."
)


def run_curves(results: Results, observable: str, budget: int) -> JSON | None:
    """Return the held-out runs of an observable, measured and predicted, axis by axis; None without any."""
    frame = results.compared(observable)
    if frame is None or observable == "lobes":
        return None
    column, drawn = coordinate(frame), predictions(frame)
    frame = frame.assign(run=frame["run"].astype(str), axis=axis_labels(frame))
    if not column and not frame.duplicated(["run", "axis"]).any():
        # With one value per axis, the axes are the places.
        frame, keys = frame.assign(label=frame["axis"], axis=""), ["run"]
    else:
        keys = ["run", "axis", "part"]
    runs = list(frame["run"].drop_duplicates())
    entries, thinned = [], False
    for run in runs:
        curves = []
        for key, rows in _parts(frame[frame["run"] == run]):
            curve, fewer = _curve(rows, column, drawn)
            said = [run, *([f"along {key[0]}"] if key[0] else []), *([key[1]] if key[1] != "all" else [])]
            curves.append({"key": [run, *key][: len(keys)], "said": ", ".join(said), **curve})
            thinned |= fewer
        entries.append({"curves": curves})
    missed = {kind.column: _missed(frame, kind) for kind in drawn}
    shown = fitting(entries, budget, [missed["before"][run] for run in runs])
    unit = printed(str(frame["unit"].iloc[0]))
    name = title(observable)
    return {
        "kind": "chart",
        "title": f"Held-out runs: {name}",
        "x": COORDINATES.get(column, "row of the table" if "part" in keys else "axis"),
        "y": f"{name} ({unit})" if unit else name,
        "unit": unit,
        "keys": keys,
        "options": {run: run_option(run, [missed[kind.column][run] for kind in drawn], unit) for run in runs},
        "first": _first(frame, keys, max(runs, key=lambda run: missed["before"][run])),
        "curves": [curve for entry in shown for curve in entry["curves"]],
        "note": notes(
            left_out(len(shown), len(runs), "held-out runs", "those that the base model misses most"),
            THINNED * thinned,
        ),
        "help": HELP,
    }


def _missed(rows: pd.DataFrame, kind: Prediction) -> dict[str, float]:
    residual = (rows["measured"] - rows[kind.column]).to_numpy(float)
    return rms_by_run(residual, rows["run"].to_numpy(str))


def run_option(run: str, errors: list[float], unit: str) -> str:
    """Name a run with its error before, and after if anything was added."""
    return f"{run}: rms {' → '.join(number(error) for error in errors)} {unit}".rstrip()


def _first(frame: pd.DataFrame, keys: list[str], run: str) -> list[str]:
    """Return the key of a run's curve with the largest error of the base model."""

    def missed(part: tuple[list[str], pd.DataFrame]) -> float:
        return float(((part[1]["measured"] - part[1]["before"]) ** 2).mean())

    key, _ = max(_parts(frame[frame["run"] == run]), key=missed)
    return [run, *key][: len(keys)]


def _parts(rows: pd.DataFrame) -> list[tuple[list[str], pd.DataFrame]]:
    """Split a run by axis, and a signal that repeats over the revolution by its time in the record."""
    parts = []
    for axis in axes_of(rows):
        mine = rows[rows["axis"] == axis]
        times = np.unique(mine["t_s"].dropna())
        if mine["angle_deg"].isna().any() or times.size < 2:
            parts.append(([axis, "all"], mine))
        else:
            labels = (f"at {number(float(t))} s of the record" for t in times)
            parts += [([axis, text], mine[mine["t_s"] == t]) for text, t in zip(labels, times, strict=True)]
    return parts


def _curve(part: pd.DataFrame, column: str, drawn: tuple[Prediction, ...]) -> tuple[JSON, bool]:
    """Return one curve, and whether it was thinned."""
    part = part.sort_values(column, kind="stable") if column else part
    measured, half = part["measured"].to_numpy(float), 1.96 * part["sigma"].to_numpy(float)
    predicted = [part[kind.column].to_numpy(float) for kind in drawn]
    x: Array = part[column].to_numpy(float) if column else np.arange(1.0, len(part) + 1)
    after = gaps(x)
    at = kept([measured, *predicted], after)
    lines = [{"name": "measured", "look": "measured", "y": packed(measured[at])}]
    if np.isfinite(half).any():
        lines[0] |= {"low": packed((measured - half)[at]), "high": packed((measured + half)[at])}
    looks = zip(drawn, predicted, strict=True)
    lines += [{"name": kind.label, "look": kind.column, "y": packed(y[at])} for kind, y in looks]
    width = float(np.nanmedian(half)) if np.isfinite(half).any() else np.nan
    digits = decimals(width, float(np.nanmax(np.abs(measured))))
    curve = {"x": packed(x[at]), "lines": lines, "decimals": digits, "places": len(part)}
    curve |= {"gaps": np.searchsorted(at, after).tolist()}
    return (curve if column else {**curve, "rows": _rows(part)}), len(at) < len(part)


def _rows(part: pd.DataFrame) -> list[str]:
    """Name the places of a table: by axis, by the printed rows if a run is a span of them, or by counting."""
    if "label" in part:
        return [str(label) for label in part["label"]]
    span = re.search(r"(\d+)–(\d+)$", str(part["run"].iloc[0]))
    first, last = (int(span[1]), int(span[2])) if span else (1, 0)
    start = first if last - first + 1 == len(part) else 1
    return [str(start + i) for i in range(len(part))]
