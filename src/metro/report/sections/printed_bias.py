"""Printed pairs of measured and predicted values: the gain between the two, if there is one."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from metro.report.content import Bullets, Item, Picture, Table
from metro.report.figures.printed import Common
from metro.report.figures.printed import pairs as pairs_drawn
from metro.report.numbers import listing, probability, with_interval
from metro.units import Array, printed

LEAST = 3  # pairs of one quantity and axis, all of one sign
LEAST_LINE = 10  # pairs of either sign
SURE = 0.05  # over all quantities of a table (Holm)
CANNOT = (
    "The printed values have no stated uncertainty. The rows are taken as repeats, and the intervals follow "
    "from their scatter. A scale error may come from the model (stiffness, coefficients, orientation of the "
    "force) or from the instrument; these values do not distinguish the two."
)
Estimate = tuple[float, float, float, float]  # value, low and high end of 95 %, p-value


def bias(name: str, pairs: pd.DataFrame) -> list[Item]:
    """Write the gain and the difference of each quantity and axis of a printed table with enough pairs.

    The p-values of gains are Holm's, over the quantities of the table.
    """
    from statsmodels.stats.multitest import multipletests

    gains: list[tuple[str, str, int, Estimate, Estimate]] = []
    drawn: list[Common] = []
    axis = pairs["axis"].fillna("").astype(str)
    for (quantity, along), rows in pairs.groupby([pairs["quantity"], axis], sort=False):
        measured, predicted = (rows[c].to_numpy(dtype=float) for c in ("measured", "predicted"))
        gain = _gain(measured, predicted)
        if gain is not None and math.isfinite(gain[3]):
            less = _mean(measured - predicted)
            what, shown = f"{quantity} {along}".strip(), printed(str(rows["unit"].iloc[0]))
            gains.append((what, shown, len(rows), gain, less))
            offset = 0.0 if _of_one_sign(measured, predicted) else _offset(measured, predicted, gain[0])
            drawn.append(Common(what, shown, predicted, measured, gain[:3], offset))
    if not gains:
        return []
    p_values = multipletests([gain[3] for *_, gain, _ in gains], method="holm")[1]
    body, sentences = [], []
    for (what, shown, count, gain, less), p in zip(gains, p_values, strict=True):
        ratio, difference = _written(gain), f"{_written(less)} {shown}".strip()
        body.append([what, str(count), ratio, probability(p), difference, probability(less[3])])
        if p <= SURE:
            sentences.append(f"Table {name}, {what}: measured is {ratio} times what was predicted.")
        else:
            sentences.append(f"Table {name}, {what}: no gain is shown; it may be {ratio}.")
    header = ["quantity", "pairs", "measured / predicted", "p (Holm)", "measured − predicted", "p"]
    caption = (
        f"Table {name}: what the pairs have in common, with 95 % intervals from the scatter of the rows."
    )
    table = Table(header, body, caption, [1.5, 0.6, 1.4, 0.8, 1.6, 0.7])
    sure = [what for (what, *_), p in zip(gains, p_values, strict=True) if p <= SURE]
    finding = f"A gain is shown of {listing(sure)}" if sure else "No gain is shown"
    about = f"Table {name}. {finding} ({len(sure)} of {len(gains)}). Printed pairs, and the gain they share."
    alt = f"Measured over predicted, {len(gains)} quantities of table {name}. {finding}."
    return [table, Picture(pairs_drawn(drawn), about, alt), Bullets(sentences)]


def _of_one_sign(measured: Array, predicted: Array) -> bool:
    return bool((measured * predicted > 0.0).all())


def _offset(measured: Array, predicted: Array, gain: float) -> float:
    return float(np.mean(measured) - gain * np.mean(predicted))


def _gain(measured: Array, predicted: Array) -> Estimate | None:
    """Return measured over predicted with its interval, and the p-value of one; None for too few pairs.

    For values of one sign it is the geometric mean. For values of either sign it is the least-squares slope
    of a line with an offset; successive rows may be correlated (Newey and West, Econometrica 55 (1987) 703).
    """
    if len(measured) >= LEAST and _of_one_sign(measured, predicted):
        value, low, high, p = _mean(np.log(measured / predicted))
        return math.exp(value), math.exp(low), math.exp(high), p
    if len(measured) < LEAST_LINE or np.ptp(predicted) == 0.0:
        return None
    from statsmodels.api import OLS

    lags = int(4.0 * (len(measured) / 100.0) ** (2.0 / 9.0))
    design = np.stack([np.ones_like(predicted), predicted], axis=1)
    options = {"maxlags": lags, "use_correction": True}
    fitted = OLS(measured, design).fit(cov_type="HAC", cov_kwds=options, use_t=True)
    low, high = np.asarray(fitted.conf_int())[1]
    return float(fitted.params[1]), float(low), float(high), float(fitted.t_test("x1 = 1").pvalue)


def _mean(values: Array) -> Estimate:
    """Return the mean with its interval by Student's t, and the p-value of zero."""
    from scipy.stats import ttest_1samp

    test = ttest_1samp(values, 0.0)
    low, high = test.confidence_interval(0.95)
    return float(np.mean(values)), float(low), float(high), float(test.pvalue)


def _written(estimate: Estimate) -> str:
    value, low, high, _ = estimate
    return with_interval(value, [low, high])
