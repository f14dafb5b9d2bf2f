"""Labels of stability against the boundary and the runs' own records: whether yes and no are exchanged."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.slips.slip import Slip
from metro.units import Array

OBSERVABLES = ("lobes",)
SURE = 3.0  # standard deviations of the rank sum by which labels must go the wrong way


def label_slips(tests: pd.DataFrame, chatter: pd.DataFrame) -> tuple[Slip, ...]:
    """Say that labels are inverted where deeper cuts are labelled stable, or the records say the opposite.

    How deep a cut is is its depth over that of the boundary at its speed; that the boundary as a whole may be
    off changes no rank.

    Parameters
    ----------
    tests : ``depth_mm, boundary_mm, labelled`` (1 unstable, 0 stable) of each labelled cut.
    chatter : ``probability, labelled`` of each cut whose record was tested.
    """
    texts = [*_by_depth(tests), *_by_record(chatter)]
    if not texts:
        return ()
    remedy = "Likely in runs.csv: yes and no are exchanged in the column stable (yes is a stable cut)"
    return (Slip(OBSERVABLES, "; ".join(texts), remedy, "runs.csv", "stable"),)


def _by_depth(tests: pd.DataFrame) -> list[str]:
    known = tests[np.isfinite(tests["boundary_mm"]) & (tests["boundary_mm"] > 0.0)]
    depth = (known["depth_mm"] / known["boundary_mm"]).to_numpy(float)
    unstable = known["labelled"].to_numpy(float) > 0.5
    share, deviations = _above(depth[unstable], depth[~unstable])
    if deviations > -SURE:
        return []
    return [
        f"of the {len(known)} labelled cuts, those labelled unstable are the shallower ones: in "
        f"{100 * (1.0 - share):.0f} % of the pairs, relative to the predicted boundary ({-deviations:.1f} "
        "standard deviations)"
    ]


def _above(first: Array, second: Array) -> tuple[float, float]:
    """Share of pairs in which the first is the larger, and its distance from one half in deviations."""
    m, n = len(first), len(second)
    if not m or not n:
        return 0.5, 0.0
    pairs = np.sign(first[:, None] - second[None, :])
    share = float(0.5 + 0.5 * pairs.mean())
    return share, (share - 0.5) / math.sqrt((m + n + 1) / (12.0 * m * n))


def _by_record(chatter: pd.DataFrame) -> list[str]:
    judged = chatter[chatter["labelled"].isin([0, 1]) & chatter["probability"].notna()]
    judged = judged[(judged["probability"] - 0.5).abs() > 0.4]
    against = int(((judged["probability"] > 0.5).astype(int) != judged["labelled"].astype(int)).sum())
    if not len(judged) or (2 * against - len(judged)) / math.sqrt(len(judged)) <= SURE:
        return []
    return [
        f"of {len(judged)} labelled cuts whose record shows chatter or none, {against} have the other label"
    ]
