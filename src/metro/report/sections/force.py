"""Figures of merit of the cutting force of held-out runs: table, order spectrum, peaks of the teeth."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from metro.report.content import Item, Picture, Table
from metro.report.cuts import NUMBERS
from metro.report.figures import force as figures
from metro.report.numbers import number, percent, with_interval
from metro.report.results import Results
from metro.report.sections import findings

LONGEST, MOST_GROUPS = 30, 8
FEED = "feed_per_tooth_mm"
# metric, its title, and whether its share of the measured value is written
COLUMNS = (
    ("nrmse", "NRMSE (%)", False),
    ("peak", "peak (N)", True),
    ("mean", "mean (N)", True),
    ("phase", "phase (°)", False),
)


def force_items(results: Results) -> list[Item]:
    """Write the figures of merit of each held-out run, the order spectra and the peaks of the teeth.

    There is nothing if they were not computed.
    """
    metrics, orders = results.tables.get("force_metrics"), results.tables.get("force_orders")
    if metrics is None or orders is None:
        return []
    teeth = int(metrics["tooth"].max())
    peaks = metrics[metrics["metric"] == "tooth_peak"]
    return [
        metrics_table(metrics),
        Picture(
            figures.spectrum(orders, teeth),
            f"{findings.peak_order(orders)} Order spectra of the measured force and of the residuals, rms "
            f"over the held-out runs. The ticks mark the tooth passing, every {teeth} orders.",
            _spectrum_words(orders),
        ),
        Picture(
            figures.tooth_peaks(peaks),
            f"{findings.tooth_peaks(peaks)} Largest magnitude within each pitch, the {teeth} teeth of a run "
            "in the order of passing; whiskers: 95 % interval of predicted less measured.".lstrip(),
            f"Measured and predicted peaks of each of {teeth} teeth.",
        ),
    ]


def mean_items(table: pd.DataFrame | None) -> list[Item]:
    """Draw the mean forces over the feed with the coefficients' lines; nothing if all have one feed."""
    if table is None or table[FEED].nunique() < 2:
        return []
    columns = [name for name in ("operation", "direction", *NUMBERS) if name in table and name != FEED]
    differ = [name for name in columns if table[name].nunique(dropna=False) > 1]
    group = [_cut({name: row[name] for name in differ}) for row in table.to_dict("records")]
    if len(set(group)) > MOST_GROUPS:
        return []
    residual = table["measured_n"] - table["fitted_n"]
    share = float(np.sqrt(np.mean(residual**2) / np.mean(table["measured_n"] ** 2)))
    worst = table.iloc[int(residual.abs().argmax())]
    missed = abs(worst["measured_n"] - worst["fitted_n"])
    about = (
        f"The coefficients miss the mean forces by {percent(share)} rms, most in {worst['run']} along "
        f"{worst['axis']}, by {number(missed)} N. Mean force over whole revolutions of straight cuts; lines: "
        "the coefficients from the mean forces of all runs. Open: held-out runs."
    )
    return [Picture(figures.means(table, group), about, about)]


def _cut(settings: Mapping[Hashable, Any]) -> str:
    """Name a cut by the settings that differ: slot; down, 4 mm wide."""
    parts = [
        f"{value:g} {NUMBERS[str(name)].of_cut}" if isinstance(value, float | int) else str(value)
        for name, value in settings.items()
        if not (name == "operation" and "direction" in settings) and pd.notna(value)
    ]
    return ", ".join(parts) or "all cuts"


def metrics_table(metrics: pd.DataFrame) -> Table:
    """Tabulate NRMSE, peak, mean and phase of each run and axis, with those of the base model in grey."""
    whole = metrics[metrics["metric"] != "tooth_peak"]
    figures_of = {
        (row["run"], row["axis"], row["metric"], row["model"]): row for row in whole.to_dict("records")
    }
    keys = list(dict.fromkeys(zip(metrics["run"], metrics["axis"], strict=True)))
    changed = any(
        not math.isnan(row["value"]) and row["value"] != figures_of[(*key[:3], "after")]["value"]
        for key, row in figures_of.items()
    )
    models = ["after", "before"] if changed else ["before"]
    rows = [
        [
            str(run),
            str(axis),
            *(
                _cell(figures_of[run, axis, metric, model], share, model == models[0])
                for metric, _, share in COLUMNS
                for model in models
            ),
        ]
        for run, axis in keys[:LONGEST]
    ]
    header = ["run", "axis"]
    for _, name, _ in COLUMNS:
        header += [name, "before"] if changed else [name]
    widths = [w for _, _, share in COLUMNS for w in (2.2 if share else 1.6, 1)[: len(models)]]
    caption = (
        "Errors on held-out runs, predicted less measured, with 95 % intervals from the scatter over the "
        "time blocks of a run (one block: from its noise): NRMSE, largest magnitude, mean, and phase "
        "(positive: the measured force comes later)."
    )
    caption += " In grey: the base model." if changed else " Base model; nothing was added."
    caption += f" The first {LONGEST} of {len(keys)} rows." if len(keys) > LONGEST else ""
    return Table(
        *(header, rows, caption, [1.1, 0.5, *widths]),
        faint=[i for i, name in enumerate(header) if name == "before"],
        small=changed,
    )


def _cell(row: Mapping[Hashable, Any], share: bool, whole: bool) -> str:
    """Write a figure of merit with interval and share; one for comparison is written without them."""
    if not whole:
        return number(row["value"])
    text = with_interval(float(row["value"]), [float(row["lo"]), float(row["hi"])])
    return f"{text} ({_share(row)}\u00a0%)" if share else text


def _share(row: Mapping[Hashable, Any]) -> str:
    """Write the share of the measured value to the digits of the error's interval."""
    scale = abs(row["percent"] / row["value"]) if row["value"] else 0.0
    interval = [row["percent"] + scale * (row[end] - row["value"]) for end in ("lo", "hi")]
    return with_interval(row["percent"], interval).partition(" ")[0]


def _spectrum_words(orders: pd.DataFrame) -> str:
    axes = []
    for axis, part in orders.groupby("axis"):
        largest = int(part["after"].argmax())
        order, size = part["order"].to_numpy()[largest], part["after"].to_numpy()[largest]
        axes.append(f"{axis}: largest residual at order {order}, {number(float(size))} N")
    return "; ".join(axes) + "."
