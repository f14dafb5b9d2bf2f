"""Runs that a model makes, at settings of a batch: on these the tests of a draft fit its effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter
from metro.cutting.engagement import Engagement
from metro.cutting.law import EdgeLaw
from metro.effects.effect import Effect, Values
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit
from metro.loop.fitting.noise import first_noise
from metro.observables.force.blocks import zeros
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceModel, ForceSetting
from metro.observables.problem import Block
from metro.units import Array

HIGHEST = 16  # order
NOISE, SCATTER = 2e-3, 3e-3  # of the signal within a run; of each coefficient between runs
BUDGET = 2e-3  # of the model's form, in the fit
Row = tuple[str, float, float, float, float, float, float, float]


@dataclass(frozen=True)
class Workshop:
    """A tool, coefficients (SI), and the settings of runs, one row each.

    A row: condition, feed per tooth (m), depth (m), entry and exit of the arc (rad), speed (rev/s), length
    cut before (m), duration (s).
    """

    radius: float
    helix: float
    tooth_angles: tuple[float, ...]
    coefficients: tuple[float, ...]
    rows: tuple[Row, ...]
    middles: int = 4

    @property
    def base(self) -> ForceModel:
        """The model without any effect."""
        return ForceModel(Cutter(self.radius, self.helix, self.tooth_angles), EdgeLaw())


def estimated(effect: Effect, shop: Workshop, values: Values | None, seed: int) -> tuple[Fit, Array]:
    """Fit an effect to runs of a workshop that have it by ``values`` (None: that lack it).

    Returns
    -------
    The fit, and the standard deviations of the effect's parameters.
    """
    model = effect.apply(shop.base, values) if values is not None else shop.base
    blocks = made(model, shop, seed)
    prior = first_noise(BUDGET, np.full(6, SCATTER), blocks)
    base = fit(Candidate(shop.base), blocks, prior)
    with_it = fit(Candidate(shop.base, (effect,)), blocks, prior, base)
    variance = np.diag(with_it.covariance)[len(with_it.beta) :] * with_it.dispersion
    return with_it, np.sqrt(variance)


def made(model: ForceModel, shop: Workshop, seed: int) -> tuple[Block, ...]:
    """Make the runs of a workshop with a model, each with scatter and noise of its own."""
    rng = np.random.default_rng(seed)
    return tuple(_run(model, shop, order, rng) for order in range(len(shop.rows)))


def _run(model: ForceModel, shop: Workshop, order: int, rng: np.random.Generator) -> Block:
    condition, feed, depth, entry, end, speed, travel, duration = shop.rows[order]
    middles = tuple(((np.arange(shop.middles) + 0.5) * duration / shop.middles).tolist())
    recording = Recording(middles, duration / shop.middles, speed)
    cut = Cut(feed, depth, Engagement(entry, end))
    setting = ForceSetting(cut, 0.0, HIGHEST, recording, travel)
    orders = 2 * HIGHEST + 1
    table = pd.MultiIndex.from_product([middles, list("xyz"), range(orders)])
    axis = table.get_level_values(1).to_numpy().astype(str)
    mean = table.get_level_values(2).to_numpy() == 0
    count = len(axis)
    block = Block(
        run=f"r{order + 1}",
        condition=condition,
        role="identify",
        order=order,
        measured=np.zeros(count),
        sigma=np.ones(count),
        setting=setting,
        axis=axis,
        zeros=zeros(axis, mean, np.repeat(middles, count // shop.middles), recording),
        zero_sd=np.zeros(3),
        coordinates={},
        repeats=shop.middles,
        symmetries=np.array(shop.tooth_angles)[:, None],
    )
    beta = np.array(shop.coefficients) * (1.0 + SCATTER * rng.standard_normal(6))
    matrix, offset = model.design(block, rng.uniform(0.0, 2.0 * np.pi, 1), beta)
    force = matrix @ beta + offset
    signal = float(np.sqrt(np.mean(force**2)))
    return replace(
        block,
        measured=force + NOISE * signal * rng.standard_normal(count),
        sigma=np.full(count, NOISE * signal),
        scale=np.full(count, signal),
        zero_sd=np.full(3, NOISE * signal * np.sqrt(count / block.repeats)),
    )


def rows_of(blocks: Sequence[Block]) -> tuple[Row, ...]:
    """Return the settings of straight cuts of a batch as the rows of a workshop, with five digits."""
    rows: list[Row] = []
    for block in blocks:
        setting: ForceSetting = block.setting
        if setting.helix is None:
            cut, recording = setting.cut, setting.recording
            feed, depth, speed, travel, duration = (
                float(f"{number:.5g}")
                for number in (
                    cut.feed_per_tooth,
                    cut.axial_depth,
                    recording.speed,
                    setting.cut_length,
                    recording.span * len(recording.middles),
                )
            )
            arc = cut.engagement
            rows.append((block.condition, feed, depth, arc.entry, arc.exit, speed, travel, duration))
    return tuple(rows)
