"""Predicted against measured on the held-out runs: every figure and number from comparison.parquet."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.observables.catalogue import names, title
from metro.report.content import Heading, Item, Paragraph, Picture, Section, Table
from metro.report.figures import comparison as figures
from metro.report.figures import surface
from metro.report.numbers import listing, number, percent
from metro.report.results import Results, heading
from metro.report.sections import findings
from metro.report.sections.along_path import along_path
from metro.report.sections.face_pairing import pairing_items
from metro.report.sections.force import force_items
from metro.report.sections.lobes import cut_items
from metro.units import printed

LONGEST, SHORT = 30, 6
WHAT_IS_DRAWN = "Measured {} and predictions, held-out runs."
ABREAST = 2  # runs in one figure, so that figures break over pages
FEWEST = 3  # values of a run along an axis that make a curve


def comparison(results: Results) -> Section:
    """Write for each observable overlay, residual, parity plot and the error of each run and axis."""
    items: list[Item] = []
    compared = {name: frame for name in names() if (frame := results.compared(name)) is not None}
    for observable, frame in compared.items():
        items.append(Heading(heading(observable)))
        if observable == "lobes":
            items += cut_items(results, frame)
            continue
        merit = force_items(results) if observable == "force" else []
        items += _values(frame, title(observable), merit, alone=len(compared) == 1)
        items += [*pairing_items(frame), *along_path(results, "faces")] if observable == "flatness" else []
    if "pose" in results.verdicts():
        text = "Poses that no fit saw: section “The arm by measured poses”."
        items.append(Paragraph(text))
    if not items:
        nothing = "No held-out run has both a measurement and a prediction: there is nothing to compare."
        return Section("Predicted against measured", [Paragraph(nothing)])
    return Section("Predicted against measured", items)


def _values(frame: pd.DataFrame, name: str, merit: list[Item], *, alone: bool) -> list[Item]:
    """Errors, curves and parity; ``merit`` takes the place of the table of errors and of the residual.

    ``alone``: no other observable is compared, so there is room for more runs.

    A force's angle starts anywhere in each run: residuals of several runs over it are no picture of anything.
    """
    rms = {k: float(np.sqrt(np.mean((frame["measured"] - frame[k]) ** 2))) for k in ("before", "after")}
    shown = printed(str(frame["unit"].iloc[0]))
    words = f"rms residual {number(rms['before'])} {shown} before and {number(rms['after'])} {shown} after"
    whole = name[0].upper() + name[1:]

    def parity() -> Picture:
        by_axis = ", axis by axis," if len(figures.axes_of(frame)) > 1 else ","
        about = f"Parity on held-out runs{by_axis} and distribution of the residual and of the noise."
        return Picture(
            figures.parity(frame, name),
            f"{whole}. {findings.scatter(frame)} {about}",
            f"Scatter of predicted over measured {name} and histogram of both residuals; {words}.",
        )

    if frame.groupby(["run", figures.axis_labels(frame)]).size().max() < FEWEST:
        return [errors(frame), parity()]
    if merit:
        return [merit[0], *_curves(frame, name, words, alone=alone), *merit[1:], parity()]
    about = (
        f"{whole}. {findings.offsets(frame)} Residual of all held-out runs: median and the band that holds "
        "80 % of the values"
    )
    alt = f"Residual of the base model and of the model with effects; {words}."
    if len(figures.axes_of(frame)) == 1:
        caption = f"{about}. Parity and distribution: {findings.scatter(frame)}"
        judged = [Picture(figures.judged(frame, name), caption, alt)]
    else:
        judged = [Picture(figures.residuals(frame, name), f"{about}.", alt), parity()]
    return [errors(frame), *_curves(frame, name, words, alone=alone), *judged]


def _curves(frame: pd.DataFrame, name: str, words: str, *, alone: bool) -> list[Item]:
    """Overlay, and maps where there are places on a face."""
    runs, shown = frame["run"].nunique(), figures.shown_runs(frame, alone=alone)
    blocks = frame["angle_deg"].notna().all() and frame["t_s"].nunique() > 1
    repeats = " One time block of each run is drawn." if blocks else ""
    abreast = ABREAST if len(figures.axes_of(frame)) > 1 else len(shown)
    items: list[Item] = []
    for i in range(0, len(shown), abreast):
        runs_here = shown[i : i + abreast]
        drawn = frame[frame["run"].isin(runs_here)]
        many = "Runs" if len(runs_here) > 1 else "Run"
        part = f" {many} {listing(runs_here)} of {runs}." if runs > len(runs_here) else ""
        items.append(
            Picture(
                figures.overlay(drawn, name, alone=alone),
                f"{findings.left(drawn)} {WHAT_IS_DRAWN.format(name)}{part}{repeats}",
                f"Measured and predicted {name} for {listing(runs_here)}; {words}.",
            )
        )
    if frame[["x_mm", "y_mm"]].notna().all().all():
        items.append(
            Picture(
                surface.face_points(frame),
                f"{findings.left(frame)} Deviation at path points of the first held-out runs, and the "
                "residual of each "
                "prediction.",
                f"Maps of measured deviation and of both residuals; {words}.",
            )
        )
    return items


def errors(frame: pd.DataFrame) -> Table:
    """Tabulate the rms of signal and residuals by run and axis; of one model if nothing was added."""
    shown = printed(str(frame["unit"].iloc[0]))
    drawn = figures.predictions(frame)
    rows = []
    for (run, axis), part in frame.assign(axis=figures.axis_labels(frame)).groupby(
        ["run", "axis"], sort=False
    ):
        measured = part["measured"].to_numpy(float)
        missed = [float(np.sqrt(np.mean((measured - part[kind.column]) ** 2))) for kind in drawn]
        signal = float(np.sqrt(np.mean(measured**2)))
        gain = [percent(1 - missed[1] / missed[0]) if missed[0] > 0 else "–"] if len(drawn) > 1 else []
        rows.append([str(run), str(axis) or "–", number(signal), *map(number, missed), *gain, str(len(part))])
    caption = f"Errors on held-out runs, rms{f' ({shown})' if shown else ''}."
    if len(rows) > LONGEST:
        caption += f" The first {LONGEST} of {len(rows)} rows; comparison.parquet has all."
    compared = ["base model", "with effects", "gain"] if len(drawn) > 1 else [drawn[0].label]
    header = ["run", "axis", "measured", *compared, "values"]
    widths = [2, 0.6, 1, *([1, 1, 0.8] if len(drawn) > 1 else [1.6]), 0.8]
    numeric = list(range(2, len(header)))
    return Table(header, rows[:LONGEST], caption, widths, numeric=numeric, small=len(rows) > SHORT)
