"""The stability boundary at settings that a user asks about, with its band and probabilities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.dynamics.stability_model import StabilityModel
from metro.loaded.found import Found, found
from metro.loaded.settings import ASKED, asked_for, wrong
from metro.observables.problem import Refusal
from metro.observables.stability import boundary as stability
from metro.observables.stability.positions import tips
from metro.units import JSON, MM, Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_SPEEDS = 400


@dataclass(frozen=True, eq=False)
class LobePrediction:
    """The lowest stability boundary of one cut at one position.

    Attributes
    ----------
    position : whose modes were used. settings : of the cut, by column of ``runs.csv``.
    table : ``rpm, depth_mm`` with the 95 % band ``depth_lo_mm, depth_hi_mm`` that contains the model's error,
        and ``chatter_hz``.
    effects, notes : included effects; and those left out.
    samples : (s, k) boundary depths, m, under the uncertainty of modes and coefficients.
    """

    position: str
    settings: Mapping[str, Any]
    table: pd.DataFrame
    effects: tuple[str, ...]
    notes: tuple[str, ...]
    samples: Array = field(repr=False)

    @property
    def lowest_mm(self) -> float:
        """Depth below which every speed of the table is predicted stable, mm."""
        return float(self.table["depth_mm"].min())

    def probability_stable(self, rpm: float, depth_mm: float) -> float:
        """Return the probability that a cut is stable, at the speed of the table that is nearest."""
        speeds = self.table["rpm"].to_numpy(float)
        if not speeds.min() <= rpm <= speeds.max():
            raise wrong("rpm", f"found {rpm:g}; expected {speeds.min():g} to {speeds.max():g}")
        at = int(np.abs(speeds - rpm).argmin())
        chatter = stability.probability_unstable(np.array([depth_mm * MM]), self.samples[:, at : at + 1])
        return float(1.0 - chatter[0])

    def plot(self, axes: Axes | None = None) -> Axes:
        """Draw the boundary with its band; return the axes."""
        from metro.loaded.plots import lobe_axes

        return lobe_axes(self, axes)


def predict_lobes(
    batch: Batch,
    modes: pd.DataFrame,
    identified: JSON,
    entry: JSON,
    *,
    position: str | None,
    rpm: Sequence[float] | None,
    run: str | None,
    **settings: Any,
) -> LobePrediction:
    """Solve the boundary of a cut with the identified modes and coefficients, and the effects found.

    Parameters
    ----------
    modes : the observed table. entry : of the lobes in ``verdict.json``; empty without a verdict.
    position : of the modes; None: the first. rpm : speeds; None: those about the runs of the batch.
    """
    asked = asked_for(batch, run, settings)
    cutting = stability.cutting(batch, identified)
    if isinstance(cutting, Refusal):
        raise wrong(batch.name, f"its lobes cannot be predicted: {cutting.reason}")
    notes: list[str] = []
    known = {tip.position: tip for tip in tips(modes, notes)} if len(modes) else {}
    if not known:
        raise wrong(batch.name, "its lobes cannot be predicted: no modes were identified (impacts.csv)")
    tip = known.get(str(position)) if position is not None else next(iter(known.values()))
    if tip is None:
        raise wrong(str(position), f"has no modes; expected one of: {', '.join(known)}")
    speeds = _speeds(batch, rpm)
    first: Any = asked.runs.loc[ASKED]
    lobes = stability.solve(tip, cutting, first, speeds, check=False)
    effects, left_out = found(entry, "lobes")
    table = stability.diagram(lobes)
    if effects:
        table, lobes = _changed(table, lobes, cutting.tool.radius, effects)
    columns = ["rpm", "depth_mm", "depth_lo_mm", "depth_hi_mm", "chatter_hz"]
    finite = np.isfinite(lobes.boundary.depth)
    shown = {k: first[k] for k in ("operation", "direction", "radial_depth_mm", "feed_direction_deg")}
    return LobePrediction(
        tip.position,
        {name: value for name, value in shown.items() if not (pd.isna(value) or value == "")},
        table[columns].reset_index(drop=True),
        tuple(each.effect.name for each in effects),
        (*notes, *left_out),
        lobes.samples[:, finite],
    )


def _speeds(batch: Batch, rpm: Sequence[float] | None) -> Array:
    if rpm is None:
        return stability.speeds_of(batch.runs, whole=True)
    speeds = np.unique(np.asarray(rpm, dtype=float))
    if not len(speeds) or speeds[0] <= 0.0 or len(speeds) > MOST_SPEEDS:
        raise wrong("rpm", f"expected 1 to {MOST_SPEEDS} speeds greater than 0")
    return speeds


def _changed(
    table: pd.DataFrame, lobes: stability.Lobes, radius: float, effects: Sequence[Found]
) -> tuple[pd.DataFrame, stability.Lobes]:
    """Return table and samples with effects: bands in proportion, as the report draws them."""
    model = StabilityModel(lobes.tip.structure, lobes.cuts, radius)
    for each in effects:
        model = each.applied(model)
    depth, chatter = model.boundary(lobes.boundary.rpm)
    before = lobes.boundary.depth
    factor = np.where(np.isfinite(before) & np.isfinite(depth), depth / before, np.nan)
    lobes = replace(
        lobes, samples=lobes.samples * factor, boundary=replace(lobes.boundary, depth=before * factor)
    )
    here = np.isfinite(before)
    depths = [name for name in table.columns if str(name).startswith("depth")]
    table = table.assign(**table[depths].mul(factor[here], axis=0), chatter_hz=chatter[here])
    return table[np.isfinite(factor[here])], lobes
