"""Corrected joint targets of a calibrated arm, and the errors that remain."""

from __future__ import annotations

import re
from collections.abc import Sequence

import pandas as pd

from metro.report.content import Item, Paragraph, Table
from metro.report.numbers import number, quantity
from metro.report.results import Results
from metro.units import JSON

MOST = 8
ABOUT = (
    "Corrected targets of {run}. Command these, and the point comes to where the nominal arm has it. "
    "{shown} of {count}; all are in table pose_targets. Before: error as predicted without the correction. "
    "After: median and 97.5th percentile, by the errors of poses that no fit saw, the instrument's included."
)
_IS_JOINT = re.compile(r"q\d_(?:deg|mm)")


def corrected_targets(results: Results, one: JSON) -> list[Item]:
    """Tabulate the corrected targets that a series gives, the first of them."""
    table = results.tables.get("pose_targets")
    if table is None:
        return []
    items: list[Item] = []
    for run, gain in (one.get("targets") or {}).items():
        items += [Paragraph(_words(run, gain)), _table(table[table["run"] == run], run)]
    return items


def joint_titles(joints: Sequence[str]) -> list[str]:
    """Write columns of joints as headings: q1, °."""
    return [name.replace("_", ", ").replace("deg", "°") for name in joints]


def _words(run: str, gain: JSON) -> str:
    text = (
        f"Corrected targets of {run}: the predicted error falls from {number(gain['before']['value'], 2)} mm "
        f"to {quantity(gain['after'])} (medians of {gain['targets']} targets, with the interval of 95 % of "
        f"errors); the flange is turned by {number(gain['turned']['value'], 2)} mrad at most."
    )
    beyond = f" {gain['outside']} targets are beyond where joints were measured: their errors may be larger."
    return text + (beyond if gain["outside"] else "")


def _table(mine: pd.DataFrame, run: str) -> Table:
    joints = [str(name) for name in mine if _IS_JOINT.fullmatch(str(name)) and mine[name].notna().all()]
    rows = [
        [
            str(int(row["target"])),
            *(f"{float(row[name]):.4f}" for name in joints),
            number(float(row["before_mm"]), 2),
            f"{number(float(row['after_mm']), 2)} ({number(float(row['after_high_mm']), 2)})",
        ]
        for _, row in mine.head(MOST).iterrows()
    ]
    header = ["target", *joint_titles(joints), "before, mm", "after, mm"]
    caption = ABOUT.format(run=run, count=len(mine), shown=len(rows))
    return Table(header, rows, caption, numeric=list(range(len(header))), small=True)
