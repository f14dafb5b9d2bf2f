"""Stability boundaries with their test cuts, as data for the page."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.report.cuts import deepest_cut
from metro.report.figures.lobes import top_of
from metro.report.numbers import number, probability, with_interval
from metro.report.page.curves import HELP
from metro.report.page.packing import fitting, left_out, notes, packed
from metro.report.results import Results
from metro.report.sections.lobes import placed
from metro.units import JSON, Array

TITLE = "Stability boundary"


def boundary_curves(results: Results, budget: int) -> JSON | None:
    """Return the stability boundary of every position before and after, with its test cuts and islands."""
    tables = results.tables
    after = tables.get("lobes_final", tables.get("lobes"))
    if after is None:
        return None
    before, islands = tables.get("lobes"), tables.get("lobe_islands")
    compared = results.compared("lobes")
    cuts = None if compared is None else placed(results, compared)
    positions = list(after["position"].drop_duplicates())
    several, deepest = len(positions) > 1, deepest_cut(results.batch.manifest)
    curves = [
        {
            "said": f"position {position}" * several,
            **_boundary((position, deepest), after, before, cuts, islands),
        }
        for position in positions
    ]
    shown = fitting(curves, budget, [-float(i) for i in range(len(curves))])
    return {
        "kind": "chart",
        "title": TITLE,
        "x": "spindle speed (rpm)",
        "y": "depth of cut (mm)",
        "unit": "mm",
        "keys": ["position"],
        "curves": shown,
        "note": notes(left_out(len(shown), len(positions), "positions", "the first")),
        "help": HELP,
    }


def _boundary(
    place: tuple[object, float],
    after: pd.DataFrame,
    before: pd.DataFrame | None,
    cuts: pd.DataFrame | None,
    islands: pd.DataFrame | None,
) -> JSON:
    """Return the boundary at a place: its position, and the depth beyond which nobody cuts, mm."""
    position, deepest = place
    line = after[after["position"] == position].sort_values("rpm").reset_index(drop=True)
    base = None if before is None else _at_speeds(before[before["position"] == position], line["rpm"])
    changed = base is not None and not np.allclose(
        *(base["depth_mm"], line["depth_mm"]), rtol=1e-9, atol=0, equal_nan=True
    )
    lines = [_depths(line, "boundary with effects found" if changed else "boundary (nothing added)", "after")]
    if changed and base is not None:
        lines.append({"name": "base model", "look": "before", "y": packed(base["depth_mm"].to_numpy(float))})
    here = None if cuts is None else cuts[cuts["position"].astype(str) == str(position)]
    none = pd.DataFrame({"depth_mm": []})
    top = 1.15 * top_of(line["depth_mm"], none if here is None else here, deepest)
    spans = [] if islands is None else islands[islands["position"] == position].to_dict("records")
    return {
        "key": [str(position)],
        "x": packed(line["rpm"].to_numpy(float)),
        "lines": lines,
        "told": [_reading(row, base, i if changed else None) for i, row in line.iterrows()],
        "marks": [] if here is None else [_mark(row) for _, row in here.iterrows()],
        "spans": [[float(s["rpm"]), float(s["from_mm"]), float(s["to_mm"])] for s in spans],
        "range": [0.0, top],
        "places": len(line),
    }


def _depths(line: pd.DataFrame, name: str, look: str) -> JSON:
    band: dict[str, Array] = {
        key: line[f"depth_{key}_mm"].to_numpy(float) for key in ("lo", "hi") if f"depth_{key}_mm" in line
    }
    entry = {"name": name, "look": look, "y": packed(line["depth_mm"].to_numpy(float))}
    return entry | ({"low": packed(band["lo"]), "high": packed(band["hi"])} if len(band) == 2 else {})


def _at_speeds(base: pd.DataFrame, rpm: pd.Series) -> pd.DataFrame | None:
    """Return the base model's boundary at the speeds of the other; None if it has no unique speeds."""
    rows = base.set_index("rpm")
    known = rows.index.is_unique and len(rows) > 0
    return rows.reindex(rpm).reset_index() if known else None


def _reading(row: pd.Series, base: pd.DataFrame | None, place: object) -> str:
    """Describe the boundary at one speed, in the report's numbers."""
    text = f"{number(row['rpm'], 4)} rpm: {_depth(row)} mm"
    if np.isfinite(row["chatter_hz"]):
        doubling = " (the period doubles)" if row["kind"] == "flip" else ""
        text += f", chatter at {number(row['chatter_hz'])} Hz{doubling}"
    if base is not None and isinstance(place, int):
        text += f"; base model {_depth(base.iloc[place])} mm"
    return text


def _depth(row: pd.Series) -> str:
    return with_interval(row["depth_mm"], [row.get("depth_lo_mm"), row.get("depth_hi_mm")])


def _mark(row: pd.Series) -> JSON:
    chatter = bool(row["measured"] > 0.5)
    cut = f"{row['run']}: {number(row['depth_mm'])} mm at {number(row['rpm'], 4)} rpm"
    odds = f"P(chatter) {probability(row['before'])} before, {probability(row['after'])} after"
    return {
        "x": float(row["rpm"]),
        "y": float(row["depth_mm"]),
        "look": "chatter" if chatter else "stable",
        "told": f"Test cut {cut}: {'chatter' if chatter else 'stable'}; {odds}",
    }
