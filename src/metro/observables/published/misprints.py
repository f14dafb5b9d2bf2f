"""Printed values that cannot be right, from the other values of their table alone."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pandas as pd

from metro.units import Array

INDICES = ("X_g", "X_a", "X_m")
CHANCE = 0.01  # that a value of a sound table is called a misprint (Bonferroni over its columns)
FEWEST = 5  # points from which a column of load tests is judged
INERTIA = "moment of inertia"


def disorder(table: pd.DataFrame) -> pd.Series:
    """Flag flatness indices that break X_g ≤ X_a ≤ X_m, which holds for every set of deviations."""
    flags = pd.Series("", index=table.index)
    for _, rows in table[table["quantity"].isin(INDICES)].groupby(["table", "row"], sort=False):
        values = {
            str(r["quantity"]): (float(r["measured"]), float(r["predicted"])) for _, r in rows.iterrows()
        }
        for low, high in itertools.pairwise(INDICES):
            pairs = zip(("measured", "predicted"), values.get(low, ()), values.get(high, ()), strict=False)
            wrong = [name for name, lower, upper in pairs if lower > upper]
            if wrong:
                words = f"{low} exceeds {high} ({' and '.join(wrong)}), which no surface can do"
                flags[rows.index[rows["quantity"] == low]] = words
    return flags


def outlying(table: pd.DataFrame, load: pd.Series) -> pd.Series:
    """Flag displacements of load tests that stand out of the other points of their column.

    Parameters
    ----------
    table : rows of published.csv. load : (N), by row; NaN where the row is no load test.

    Notes
    -----
    Grubbs's two-sided test (Technometrics 11 (1969) 1) on the logarithms, because a misplaced decimal point
    multiplies a value and because displacements of like points differ by a share of themselves.
    """
    flags = pd.Series("", index=table.index)
    tests = table[load.notna() & (table["measured"].astype(float) != 0.0)]
    columns = [rows for _, rows in tests.groupby(["table", "quantity", "axis"], sort=False)]
    for rows in columns:
        sizes = np.log(np.abs(rows["measured"].to_numpy(dtype=float)))
        if len(rows) < FEWEST:
            continue
        place, probability = grubbs(sizes)
        if probability * len(columns) > CHANCE:
            continue
        others = np.exp(np.delete(sizes, place))
        flags[rows.index[place]] = (
            f"{rows['measured'].iloc[place]:g} {rows['unit'].iloc[place]} is an outlier among the other "
            f"{len(others)} points, {others.min():g} to {others.max():g} (Grubbs, p = {probability:.1g}); "
            "it is left out of the compliance"
        )
    return flags


def grubbs(values: Array) -> tuple[int, float]:
    """Return the place of the most outlying of ``values`` (n,), and the chance of one as far out.

    The values are taken to be normal; the chance is Bonferroni's bound over both sides, at most 1.
    """
    from scipy.stats import t as student

    count, spread = len(values), float(np.std(values, ddof=1))
    off = np.abs(values - values.mean())
    place = int(np.argmax(off))
    if spread == 0.0:
        return place, 1.0
    ratio = float(off[place]) / spread
    room = (count - 1) ** 2 - count * ratio**2
    statistic = math.sqrt(count * (count - 2) * ratio**2 / room) if room > 0.0 else math.inf
    return place, min(1.0, 2 * count * float(student.sf(statistic, count - 2)))


def impossible_inertia(table: pd.DataFrame) -> pd.Series:
    """Flag a moment of inertia that exceeds the sum of the other two, which no body has about any axes."""
    flags = pd.Series("", index=table.index)
    for _, rows in table[table["quantity"] == INERTIA].groupby(["table", "row"], sort=False):
        moments = rows["measured"].to_numpy(dtype=float)
        most = int(np.argmax(moments))
        if len(rows) == 3 and 2.0 * moments[most] > moments.sum():
            flags[rows.index[most]] = (
                f"{moments[most]:g} exceeds the sum of the other two, {moments.sum() - moments[most]:g}, "
                "which no body can have"
            )
    return flags
