"""The factorial study of printed flatness indices: each case is measured and simulated only once.

A printed table has one value per case. The interactions have to serve as scatter, and the scatter of a repeat
is not known; the report says both.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.observables.flatness.study import (
    agreement_json,
    configuration,
    described,
    effects,
    factors_of,
    levels_of,
)
from metro.surface.factorial import Fitted, fit_design
from metro.surface.factors import Design, make_design
from metro.surface.ranking import agreement
from metro.units import JSON, MM, UM

PRIMARY = "X_m"
INDICES = (PRIMARY, "X_a", "X_g")
CANNOT = (
    "Every case is printed once: the scatter of a repeat is not known, interactions are taken as scatter, so "
    "that an interaction that is really there widens every interval here.",
    "The source does not state which repeats a printed value represents, nor what the scanner's noise "
    "adds to it, which is more in X_m than in X_a or X_g and the same in all cases.",
    "A ratio of measured to simulated that is the same in all cases may come from the model or from the "
    "scan: the table cannot distinguish these.",
)


def printed_study(batch: Batch, observed: Mapping[str, pd.DataFrame]) -> JSON:
    """Return the block ``study`` of a published batch whose rows of printed indices are runs of runs.csv.

    ``measured``, ``bias`` (measured over simulated): effects on X_m, with those on X_a and X_g; ``agreement``
    of the two rankings. Empty if the batch has no such rows.
    """
    pairs = _cases(batch, observed.get("published_errors", pd.DataFrame()))
    if pairs.empty:
        return {}
    runs = batch.runs.loc[list(pairs.index)]
    try:
        design = make_design(factors_of(runs))
    except ValueError as reason:
        return {"study": {"not_identified": {"factorial": str(reason)}}}
    measured, bias = _fits(design, pairs, ratio=False), _fits(design, pairs, ratio=True)
    values = {kind: pairs[kind, PRIMARY].to_numpy(dtype=float) for kind in ("measured", "predicted")}
    names = [str(run) for run in pairs.index]
    order = np.argsort(values["measured"])
    return {
        "study": {
            "index": "X_m as printed",
            "printed": True,
            "runs": len(pairs),
            **described(design),
            **effects(measured.pop(PRIMARY), measured),
            "bias": effects(bias.pop(PRIMARY), bias, "1"),
            "ranking": [
                {
                    "configuration": configuration(levels_of(design.factors, int(i))),
                    "levels": levels_of(design.factors, int(i)),
                    "runs": [names[i]],
                    "xm": {"value": float(values["measured"][i]), "ci95": [None, None], "unit": "um"},
                    "xm_predicted": float(values["predicted"][i]),
                }
                for i in order
            ],
            "agreement": agreement_json(agreement(values["predicted"], values["measured"])),
            "cannot_tell": list(CANNOT),
        }
    }


def _cases(batch: Batch, table: pd.DataFrame) -> pd.DataFrame:
    """Return printed indices in um by run, columns (measured | predicted, index); no rows without X_m.

    A mean that exceeds the range X_m of the same face is a misprint, and its value is omitted.
    """
    if table.empty or batch.runs.empty:
        return pd.DataFrame()
    known = {_plain(str(run)): str(run) for run in batch.runs.index}
    rows = table[table["quantity"].isin(INDICES) & (table["unit"] == "mm") & table["predicted"].notna()]
    rows = rows.assign(run=[known.get(_plain(str(row)), "") for row in rows["row"]])
    rows = rows[rows["run"] != ""]
    if PRIMARY not in set(rows["quantity"]):
        return pd.DataFrame()
    wide = rows.pivot_table(index="run", columns="quantity", values=["measured", "predicted"], sort=False)
    wide = wide[wide["measured", PRIMARY].notna()] * (MM / UM)
    for column in wide.columns:
        kind, name = str(column[0]), str(column[1])
        wide[kind, name] = wide[kind, name].where(wide[kind, name] <= wide[kind, PRIMARY])
    return wide


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _fits(design: Design, pairs: pd.DataFrame, *, ratio: bool) -> dict[str, Fitted]:
    """Fit measured values, or their ratio to the simulated ones; an index that lacks a case is omitted."""
    result = {}
    for name in INDICES:
        columns = [("measured", name), ("predicted", name)]
        if name not in pairs["measured"] or pairs[columns].isna().any(axis=None):
            continue
        values = pairs["measured", name].to_numpy(dtype=float)
        over = pairs["predicted", name].to_numpy(dtype=float) if ratio else 1.0
        result[name] = fit_design(design, values / over)
    return result
