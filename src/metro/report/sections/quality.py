"""Data quality: checks of the raw data, failures first."""

from __future__ import annotations

import re
from dataclasses import replace

import pandas as pd

from metro.report.content import Item, Paragraph, Section, Table
from metro.report.numbers import listing, number, words
from metro.report.results import Results
from metro.report.sections.chatter import chatter_flags
from metro.report.sections.records import record_items

LONGEST, MOST_NAMES, MOST_FLAGS = 40, 24, 5
MEANING = {
    "FRF convention": "sign of the imaginary part at the resonances",
    "FRF sign": "sign of the imaginary part at the resonances",
    "channels alike": "pairs of channels that are one signal",
    "clipping": "samples in a row at an end of the range",
    "dead channel": "span of a channel, in its unit",
    "gaps": "gaps in a record",
    "jitter": "scatter of the time step over the step",
    "missing points": "share of a scan's grid without a point",
    "motion": "travel of a joint in a cut (°)",
    "scene": "faces that were cut out of a scan",
    "sampling rate": "rate (Hz); limit: as declared",
    "size of the scan": "longest side (mm)",
    "time zero": "first time of a record (s)",
    "zero in air": "mean force while the tool cuts air (N)",
}


def quality(results: Results) -> Section:
    """List the failed checks, then each kind of check with the range of its values."""
    table = results.tables.get("qc")
    if table is None:
        return Section("Data quality", [Paragraph("No signal was read, so there was nothing to check.")])
    failed = table[~table["ok"].astype(bool)]
    checks = table["check"].nunique()
    items: list[Item] = []
    if failed.empty:
        kinds = f"{checks} kinds" if checks > 1 else "one kind"
        passed = (
            f"All {len(table)} checks, of {kinds}, passed." if len(table) > 1 else "The one check passed."
        )
        items.append(Paragraph(passed))
    else:
        items.append(
            Paragraph(
                f"{len(failed)} of {len(table)} checks failed. They come first; nothing was repaired.",
                "warning",
            )
        )
        items.append(_failures(failed))
    return Section("Data quality", [*items, _checked(table), *record_items(results)])


def with_flags(first: Section, results: Results) -> Section:
    """Return the first page with the errors in the raw data, and the data that were omitted for them."""
    table = results.tables.get("qc")
    failed = [] if table is None else table[~table["ok"].astype(bool)].to_dict("records")
    failed.sort(key=lambda row: "left out" not in str(row["message"]))
    flags = [": ".join(str(row[part]) for part in ("file", "message") if row[part]) for row in failed]
    flags = [*chatter_flags(results), *flags]
    if not flags:
        return first
    more = f" And {len(flags) - MOST_FLAGS} more, see Data quality." if len(flags) > MOST_FLAGS else ""
    text = f"Flagged in the raw data: {'; '.join(flags[:MOST_FLAGS])}.{more}"
    return replace(first, items=[*first.items[:1], Paragraph(text, "warning"), *first.items[1:]])


def _failures(failed: pd.DataFrame) -> Table:
    """Tabulate the failures, a row for each check and meaning, with the runs (or files) of the failures."""
    groups = failed.assign(meaning=failed["message"].map(_without_numbers)).groupby(
        ["check", "meaning"], sort=False
    )
    rows = [
        [
            words(str(check)),
            _span(part["value"]),
            _limit(part),
            str(part["message"].iloc[0]) + (f" (and {len(part) - 1} more alike)" if len(part) > 1 else ""),
            _where(part),
        ]
        for (check, _), part in groups
    ]
    more = f" The first {LONGEST} of {len(rows)}." if len(rows) > LONGEST else ""
    header = ["check", "value", "limit", "what it means", "where"]
    caption = f"Checks that failed, alike ones together.{more}"
    return Table(header, rows[:LONGEST], caption, [1.1, 1.2, 0.7, 2.6, 2], numeric=[1, 2])


def _without_numbers(message: object) -> str:
    return re.sub(r"[-+]?\d[\d.,]*(?:e[-+]?\d+)?", "#", str(message))


def _where(part: pd.DataFrame) -> str:
    """Name the runs, else the files, in which a check failed."""
    runs = [str(run) for run in part["run"] if run and pd.notna(run)]
    named = list(dict.fromkeys(runs if len(runs) == len(part) else part["file"].astype(str)))
    if len(named) > MOST_NAMES:
        return f"{', '.join(named[:MOST_NAMES])} and {len(named) - MOST_NAMES} more"
    return listing(named)


def _span(values: pd.Series) -> str:
    known = values.dropna()
    if known.empty:
        return "–"
    ends = [number(known.min()), number(known.max())]
    return ends[0] if ends[0] == ends[1] else " … ".join(ends)


def _limit(part: pd.DataFrame) -> str:
    """Return the limit of checks of one kind, and on which side a value passes, where they show that."""
    known = part[["value", "limit", "ok"]].dropna()
    limits = part["limit"].dropna().unique()
    if len(limits) != 1:
        return "differs" if len(limits) else "–"
    limit, passed = number(float(limits[0])), known["ok"].astype(bool)
    if known.empty or (known["value"] == known["limit"]).all():
        return limit
    if ((known["value"] <= known["limit"]) == passed).all():
        return f"≤ {limit}" if limits[0] else limit  # there are no gaps, not fewer than none
    lower = ((known["value"] >= known["limit"]) == passed).all()
    return limit if not lower else f"≥ {limit}" if limits[0] else "> 0"  # what has no span at all is dead


def _checked(table: pd.DataFrame) -> Table:
    rows = []
    for check, part in table.groupby("check", sort=True):
        failed = int((~part["ok"].astype(bool)).sum())
        ends = (_span(part["value"]), _limit(part))
        rows.append([words(str(check)), MEANING.get(str(check), "–"), str(len(part)), str(failed), *ends])
    header = ["check", "its value", "times", "failed", "values", "limit"]
    return Table(header, rows, "What was checked.", [1.3, 2.8, 0.6, 0.6, 1.7, 0.8], numeric=[2, 3, 4, 5])
