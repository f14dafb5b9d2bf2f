"""Effects added one at a time, where they predict regions of the workspace better that no fit has seen.

The model is linear about the fitted geometry (corrections of some 10⁻³ leave some 10⁻⁶ m), so that each
region is its information matrix and gradient, and leaving one out is a subtraction. An effect is added where
the squared residual of left-out regions falls: by more than chance over the regions, and by more than
:data:`MATERIAL` of it. First those effects that have a shape, then curves, which could take
the place of any; then those with a shape once more, in what curves left; at last each must still earn its
place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from metro.robot.calibration.effects import PLAUSIBLE, Effect
from metro.robot.calibration.fit import Fit, columns, weights_of
from metro.robot.calibration.model import jacobian
from metro.robot.calibration.poses import Poses
from metro.units import Array

MOST = 5000  # poses that are searched; of more, every so many
MATERIAL = 0.01  # of the left-out squared residual
CHANCE = 0.01  # that the mean gain over the regions is above zero by luck, one-sided
RENEWED = 0.95  # of the scale, below which weights are made anew


@dataclass(frozen=True)
class Trial:
    """What became of an effect.

    Attributes
    ----------
    label, code : of it.
    gain, error : mean over the left-out regions of the logarithm by which the squared residual falls, and its
        standard error.
    kept : whether it stays.
    """

    label: str
    code: str
    gain: float
    error: float
    kept: bool


@dataclass
class _Search:
    """A linear model in pieces by region.

    Attributes
    ----------
    design : (m, 3, p) of geometry and all effects. residuals : (m, 3) of the geometry alone.
    blocks : of every effect the places of its columns. precision : (p,) of the priors.
    """

    design: Array
    residuals: Array
    sigma: Array
    region: np.ndarray
    geometry: np.ndarray
    blocks: list[np.ndarray]
    precision: Array
    chosen: list[int] = field(default_factory=list)
    scale: float = np.inf

    def __post_init__(self) -> None:
        self.renew(self.residuals)

    def renew(self, residuals: Array) -> None:
        """Weigh the poses by these residuals, where they have become smaller."""
        weight, _, scale = weights_of(residuals, self.sigma)
        if scale > RENEWED * self.scale:
            return
        self.scale = scale
        root = np.sqrt(weight)[:, None]
        scaled, left = self.design * root[..., None], self.residuals * root
        self.information, self.gradient, self.square = [], [], []
        for region in range(int(self.region.max()) + 1):
            mine = self.region == region
            rows, values = scaled[mine].reshape(-1, len(self.precision)), left[mine].ravel()
            self.information.append(rows.T @ rows)
            self.gradient.append(rows.T @ values)
            self.square.append(float(values @ values))

    def places(self, chosen: Sequence[int]) -> np.ndarray:
        """Return the columns of the geometry and of chosen effects."""
        return np.concatenate([self.geometry, *(self.blocks[one] for one in chosen)]).astype(int)

    def left_out(self, chosen: Sequence[int], more: Sequence[int] = ()) -> tuple[Array, Array]:
        """Squared residual (regions,) of each region by a fit to the others: chosen effects, and with each.

        The second is (len(more), regions), of chosen effects with one more each.
        """
        from scipy.linalg import cho_factor, cho_solve

        have = self.places(chosen)
        total, slope = sum(self.information), sum(self.gradient)
        base, each = np.zeros(len(self.square)), np.zeros((len(more), len(self.square)))
        for region, (own, gradient, square) in enumerate(
            zip(self.information, self.gradient, self.square, strict=True)
        ):
            rest, pull = total - own + np.diag(self.precision), slope - gradient
            factor = cho_factor(rest[np.ix_(have, have)])
            values = cho_solve(factor, pull[have])
            base[region] = _square(own, gradient, square, have, values)
            for row, one in enumerate(more):
                new = self.blocks[one]
                carried = cho_solve(factor, rest[np.ix_(have, new)])
                schur = rest[np.ix_(new, new)] - rest[np.ix_(new, have)] @ carried
                added = np.linalg.solve(schur, pull[new] - rest[np.ix_(new, have)] @ values)
                both = np.concatenate([values - carried @ added, added])
                each[row, region] = _square(own, gradient, square, np.concatenate([have, new]), both)
        return base, each

    def remaining(self) -> Array:
        """Residuals (m, 3) of the fit with the chosen effects to all regions."""
        have = self.places(self.chosen)
        total = sum(self.information) + np.diag(self.precision)
        values = np.linalg.solve(total[np.ix_(have, have)], sum(self.gradient)[have])
        return np.asarray(self.residuals - self.design[..., have] @ values)


def _square(own: Array, gradient: Array, square: float, places: np.ndarray, values: Array) -> float:
    return float(square - 2.0 * gradient[places] @ values + values @ own[np.ix_(places, places)] @ values)


def search(poses: Poses, fit: Fit, effects: Sequence[Effect]) -> tuple[tuple[Effect, ...], tuple[Trial, ...]]:
    """Return the effects that stay, and what became of each.

    ``fit``: of the geometry alone.
    """
    some = poses.of(np.linspace(0, len(poses) - 1, min(len(poses), MOST)).astype(int))
    state = fit.state
    at, derivatives = jacobian(state, some.q)
    parts = [derivatives[..., fit.free], *columns(state, derivatives, effects, some)]
    ends = np.cumsum([0, *(part.shape[-1] for part in parts)])
    blocks = [np.arange(a, b) for a, b in pairwise(ends)]
    geometry = np.where(np.flatnonzero(fit.free) < 9, np.inf, PLAUSIBLE)
    priors = [geometry, *(np.full(len(own), one.prior) for own, one in zip(blocks[1:], effects, strict=True))]
    design = np.concatenate(parts, axis=-1)
    model = _Search(
        design, some.at - at, some.sigma, some.regions, blocks[0], blocks[1:], np.concatenate(priors) ** -2.0
    )
    early = [place for place, effect in enumerate(effects) if not effect.late]
    late = [place for place, effect in enumerate(effects) if effect.late]
    trials: dict[int, Trial] = {}
    for candidates in (early, late, early):
        _forward(model, effects, candidates, trials)
    _backward(model, effects, early, trials)
    return tuple(effects[one] for one in sorted(model.chosen)), tuple(trials[one] for one in sorted(trials))


def _forward(
    model: _Search, effects: Sequence[Effect], candidates: list[int], trials: dict[int, Trial]
) -> None:
    """Add what gains most, until nothing gains."""
    while left := [one for one in candidates if one not in model.chosen]:
        base, each = model.left_out(model.chosen, left)
        found = {one: _trial(effects[one], base, with_it) for one, with_it in zip(left, each, strict=True)}
        trials |= found
        worth = [one for one in left if found[one].kept]
        if not worth:
            return
        model.chosen.append(max(worth, key=lambda one: found[one].gain))
        model.renew(model.remaining())


def _backward(
    model: _Search, effects: Sequence[Effect], candidates: list[int], trials: dict[int, Trial]
) -> None:
    """Drop what no longer earns its place beside the others, the least useful first."""
    while earlier := [one for one in candidates if one in model.chosen]:
        with_all, _ = model.left_out(model.chosen)
        found = {}
        for one in earlier:
            without, _ = model.left_out([other for other in model.chosen if other != one])
            found[one] = _trial(effects[one], without, with_all)
        trials |= found
        useless = [one for one in earlier if not found[one].kept]
        if not useless:
            return
        model.chosen.remove(min(useless, key=lambda one: found[one].gain))


def _trial(effect: Effect, without: Array, with_it: Array) -> Trial:
    """Judge an effect by the squared residuals of left-out regions without and with it."""
    from scipy.stats import t

    gains = np.log(without / with_it)
    gain, count = float(np.mean(gains)), len(gains)
    error = float(np.std(gains, ddof=1) / np.sqrt(count))
    kept = gain > float(t.ppf(1.0 - CHANCE, count - 1)) * error and gain > MATERIAL
    return Trial(effect.label, effect.code, gain, error, kept)
