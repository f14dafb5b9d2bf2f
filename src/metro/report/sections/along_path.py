"""Errors point by point along a path, of printed pairs and of held-out faces ([F] figures 13 to 16)."""

from __future__ import annotations

from metro.report.content import Item, Picture, Table
from metro.report.figures import along_path as figures
from metro.report.numbers import number
from metro.report.results import Results
from metro.units import printed

SHOWN = ("measured", "predicted", "of_measured_percent", "of_predicted_percent")
OF_POINTS = ("points_of_measured_percent", "points_of_predicted_percent")
HOW = (
    "Absolute: size of the deviation at the point; arithmetic and geometric: means of the sizes over "
    "five points about it."
)


def along_path(results: Results, source: str) -> list[Item]:
    """Tabulate and draw the errors along a path; ``source``: name of a printed table, or ``faces``."""
    errors, indices = (results.tables.get(name) for name in ("path_errors", "path_indices"))
    if errors is None or indices is None:
        return []
    curves, table = errors[errors["source"] == source], indices[indices["source"] == source]
    if curves.empty:
        return []
    several = table["curve"].nunique() > 1
    rows = [
        [
            f"{r['curve']}: {r['error']}, {r['index']}" if several else f"{r['error']}, {r['index']}",
            *(number(float(r[name])) for name in (*SHOWN, *OF_POINTS)),
        ]
        for _, r in table.iterrows()
    ]
    about, unit = str(table["about"].iloc[0]), printed(str(table["unit"].iloc[0]))
    header = [
        "error",
        f"measured ({unit})",
        "predicted",
        "D_r/m (%)",
        "D_r/p (%)",
        "points: |D_r|/m",
        "|D_r|/p",
    ]
    said = (
        f"{about}: index over all points, measured and predicted, with D_r over the measured and over the "
        f"predicted value; and the median of |D_r| over the points. {HOW}"
    )
    last = str(table["curve"].iloc[-1])
    pairs = curves.pivot_table(index="place", columns="curve", values="deviation", sort=False)
    rms = float(((pairs["measured"] - pairs[last]) ** 2).mean() ** 0.5)
    caption = (
        f"{about}: measured less {last} is {number(rms, 2)} {unit} (rms). Deviation point by point, and its "
        f"absolute, arithmetic and geometric error. {HOW}"
    )
    widths, numeric = [2.0, 1, 1, 0.9, 0.9, 1.1, 0.9], list(range(1, 7))
    return [
        Table(header, rows, said, widths, numeric=numeric, small=True),
        Picture(figures.along(curves), caption, caption),
    ]
