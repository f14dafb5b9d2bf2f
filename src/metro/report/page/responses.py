"""Frequency responses, measured and from the modal model, as data for the page."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.report.numbers import number, percent
from metro.report.page.curves import HELP
from metro.report.page.packing import THINNED, fitting, gaps, kept, left_out, notes, packed
from metro.report.results import Results
from metro.units import JSON, Array

PARTS = ("real_m_n", "imag_m_n", "modal_real_m_n", "modal_imag_m_n")


def response_curves(results: Results, budget: int) -> JSON | None:
    """Return the receptance of every pair of points over frequency; None without a modal model of it."""
    table = results.tables.get("frf_used")
    if table is None or not set(PARTS) <= set(table.columns):
        return None
    table = table.sort_values("frequency_hz", kind="stable")
    pairs = list(table.groupby(["position", "reference", "response"]))
    curves, highest, thinned = [], [], False
    for (position, reference, response), rows in pairs:
        measured, modal = (_logarithm(rows, *PARTS[i : i + 2]) for i in (0, 2))
        highest.append(float(np.nanmax(measured)))
        x = rows["frequency_hz"].to_numpy(float)
        after = gaps(x)
        at = kept([measured, modal], after)
        thinned |= len(at) < len(x)
        pair = f"{reference} → {response}"
        left = f", error of the modes {percent(float(rows['error'].iloc[0]))}" if "error" in rows else ""
        curves.append(
            {
                "key": [str(position), pair],
                "said": f"position {position}, {pair}{left}",
                "x": packed(x[at]),
                "lines": [
                    {"name": "measured", "look": "measured", "y": packed(measured[at])},
                    {"name": "modal model", "look": "before", "y": packed(modal[at])},
                ],
                "gaps": np.searchsorted(at, after).tolist(),
                "places": len(x),
            }
        )
    shown = fitting(curves, budget, highest)
    peak = f"the highest response is {number(10.0 ** max(highest))} m/N"
    return {
        "kind": "chart",
        "title": "Frequency responses",
        "x": "frequency (Hz)",
        "y": "receptance (m/N)",
        "unit": "m/N",
        "log": True,
        "keys": ["position", "response"],
        "first": curves[int(np.argmax(highest))]["key"],
        "curves": shown,
        "note": notes(peak, left_out(len(shown), len(pairs), "responses", "the highest"), THINNED * thinned),
        "help": HELP,
    }


def _logarithm(rows: pd.DataFrame, real: str, imaginary: str) -> Array:
    """Return the decadic logarithm of a magnitude; NaN if it is zero or not known."""
    size = np.hypot(rows[real].to_numpy(float), rows[imaginary].to_numpy(float))
    logarithm: Array = np.log10(size, out=np.full(len(size), np.nan), where=size > 0)
    return logarithm
