"""Data quality: what was checked in the raw data, failures first."""

from __future__ import annotations

import pandas as pd

from metro.report.content import Item, Paragraph, Section, Table
from metro.report.numbers import number, words
from metro.report.results import Results

LONGEST = 40


def quality(results: Results) -> Section:
    """List every failed check with its message, then each kind of check with its worst value."""
    table = results.tables.get("qc")
    if table is None:
        return Section(
            "Data quality", [Paragraph("No signal was read, so there was nothing to check.")], page=True
        )
    failed = table[~table["ok"].astype(bool)]
    checks = table["check"].nunique()
    items: list[Item] = []
    if failed.empty:
        items.append(Paragraph(f"All {len(table)} checks of {checks} kinds passed."))
    else:
        items.append(
            Paragraph(
                f"{len(failed)} of {len(table)} checks failed. They come first; nothing was repaired.",
                "warning",
            )
        )
        items.append(_failures(failed))
    items.append(_checked(table))
    return Section("Data quality", items, page=True)


def _failures(failed: pd.DataFrame) -> Table:
    rows = [
        [
            str(r["file"]),
            str(r["run"] or "–"),
            words(str(r["check"])),
            number(r["value"]),
            number(r["limit"]),
            str(r["message"]),
        ]
        for _, r in failed.head(LONGEST).iterrows()
    ]
    more = f" The first {LONGEST} of {len(failed)}." if len(failed) > LONGEST else ""
    header = ["file", "run", "check", "value", "limit", "what it means"]
    return Table(header, rows, "Checks that failed." + more, [1.8, 0.8, 1.1, 0.8, 0.8, 2.6], numeric=[3, 4])


def _checked(table: pd.DataFrame) -> Table:
    rows = []
    for check, part in table.groupby("check", sort=True):
        failed = int((~part["ok"].astype(bool)).sum())
        values = part["value"].dropna()
        limits = part["limit"].dropna().unique()
        span = "–" if values.empty else f"{number(values.min())} … {number(values.max())}"
        limit = number(float(limits[0])) if len(limits) == 1 else "–" if len(limits) == 0 else "differs"
        rows.append([words(str(check)), str(len(part)), str(failed), span, limit])
    header = ["check", "times", "failed", "values", "limit"]
    return Table(header, rows, "What was checked.", [2, 0.7, 0.7, 2, 1], numeric=[1, 2, 3, 4])
