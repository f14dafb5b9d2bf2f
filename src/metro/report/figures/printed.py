"""Printed pairs: measured over predicted values, and the gain that the pairs have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from metro.report import style
from metro.units import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ABREAST = 3


@dataclass(frozen=True, eq=False)
class Common:
    """Pairs of one quantity, and their common gain.

    ``predicted``, ``measured`` (n,); ``gain`` of the second over the first, with the ends of its interval;
    ``offset`` of the line through the pairs, zero if the gain is a plain ratio.
    """

    name: str
    unit: str
    predicted: Array
    measured: Array
    gain: tuple[float, float, float]
    offset: float


def pairs(quantities: Sequence[Common]) -> Figure:
    """Draw the pairs of each quantity, the line of equal values, and the line of the common gain."""
    rows = -(-len(quantities) // ABREAST)
    with style.style():
        figure, grid = style.new_figure(0.45 + 1.75 * rows, rows, ABREAST)
        flat = [axes for row in grid for axes in row]
        for axes, one in zip(flat, quantities, strict=False):
            values = np.concatenate([one.predicted, one.measured])
            ends = np.array([values.min(), values.max()]) + 0.06 * np.ptp(values) * np.array([-1.0, 1.0])
            value, low, high = one.gain
            centre = one.predicted.mean() if one.offset else 0.0
            middle = one.offset + value * centre
            band = [middle + slope * (ends - centre) for slope in (low, high)]
            axes.fill_between(ends, *band, color=style.AFTER, alpha=0.18, lw=0)
            axes.plot(ends, ends, color=style.GREY, lw=0.8, label="equal")
            axes.plot(ends, one.offset + value * ends, color=style.AFTER, label="common gain, 95 % band")
            axes.plot(one.predicted, one.measured, "o", ms=3, color=style.MEASURED, label="printed pairs")
            axes.set(xlim=ends, ylim=ends)
            axes.set_title(f"{one.name} ({one.unit})" if one.unit else one.name, loc="left")
            axes.set_xlabel("predicted")
        for axes in flat[::ABREAST]:
            axes.set_ylabel("measured")
        for axes in flat[len(quantities) :]:
            axes.set_visible(False)
        style.legend_above(figure, flat[0])
    return figure
