"""Effects added one at a time, where they predict regions of the workspace better that no fit has seen.

The model is linear about the fitted geometry (corrections of some 10⁻³ leave some 10⁻⁶ m), so that each
region is its information matrix and gradient, and leaving one out is a subtraction. An effect is added where
the squared residual of left-out regions falls: by more than chance over the regions, and by more than
:data:`MATERIAL` of it. First those effects that have a shape, then curves, which could take
the place of any; then all once more, in the residual; at last those with a shape must still earn their place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise

import numpy as np

from metro.robot.calibration import measured
from metro.robot.calibration.effects import PLAUSIBLE, Effect
from metro.robot.calibration.fit import TAILS, Fit, columns, weights_of
from metro.robot.calibration.model import jacobian
from metro.robot.calibration.poses import Poses
from metro.units import Array

MOST = 5000  # poses that are searched; of more, every so many
MATERIAL = 0.01  # of the left-out squared residual
CHANCE = 0.01  # that the gains of the regions are gains by luck: see `by_luck`
RENEWED = 0.95  # of the scale, below which weights are made anew


@dataclass(frozen=True)
class Trial:
    """What became of an effect.

    Attributes
    ----------
    label, code : of it.
    gain, error : mean over the left-out regions of what the loss falls by, and its standard error: the share
        of the squared residual that the effect takes away, while this is small.
    luck : how often the regions gain as much by chance, see :func:`by_luck`.
    kept : whether it stays. joint : from 0; −1 where it moves the point as a whole.
    """

    label: str
    code: str
    gain: float
    error: float
    luck: float
    kept: bool
    joint: int


@dataclass(frozen=True)
class Found:
    """The outcome of a search: effects that stay, what became of each, and which could take another's place.

    ``rivals``: pairs of labels, of an effect that stays and one that does as well in its place; only of
    those that have a shape, since a curve can take the place of any.
    """

    effects: tuple[Effect, ...]
    trials: tuple[Trial, ...]
    rivals: tuple[tuple[str, str], ...]


@dataclass
class _Search:
    """A linear model in pieces by region.

    Attributes
    ----------
    design : (m, d, p) of geometry and all effects. residuals : (m, d) of the geometry alone.
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
        self.information, self.gradient = [], []
        for region in range(int(self.region.max()) + 1):
            mine = self.region == region
            rows, values = scaled[mine].reshape(-1, len(self.precision)), left[mine].ravel()
            self.information.append(rows.T @ rows)
            self.gradient.append(rows.T @ values)

    def places(self, chosen: Sequence[int]) -> np.ndarray:
        """Return the columns of the geometry and of chosen effects."""
        return np.concatenate([self.geometry, *(self.blocks[one] for one in chosen)]).astype(int)

    def left_out(self, chosen: Sequence[int], more: Sequence[int] = ()) -> tuple[Array, Array]:
        """Loss (regions,) of each region by a fit to the others: of chosen effects, and with one more each.

        The second is (len(more), regions).
        """
        from scipy.linalg import cho_factor, cho_solve

        have = self.places(chosen)
        total, slope = sum(self.information), sum(self.gradient)
        losses = np.zeros((1 + len(more), len(self.information)))
        for region, (own, gradient) in enumerate(zip(self.information, self.gradient, strict=True)):
            rest, pull = total - own + np.diag(self.precision), slope - gradient
            factor = cho_factor(rest[np.ix_(have, have)])
            values = cho_solve(factor, pull[have])
            mine = self.region == region
            design = self.design[mine].reshape(-1, len(self.precision))
            known = design[:, have]
            left = self.residuals[mine].ravel() - known @ values
            changed = [left]
            for new in (self.blocks[one] for one in more):
                carried = cho_solve(factor, rest[np.ix_(have, new)])
                schur = rest[np.ix_(new, new)] - rest[np.ix_(new, have)] @ carried
                added = np.linalg.solve(schur, pull[new] - rest[np.ix_(new, have)] @ values)
                changed.append(left - design[:, new] @ added + known @ (carried @ added))
            shape = self.residuals[mine].shape
            losses[:, region] = [self.loss(each.reshape(shape), self.sigma[mine]) for each in changed]
        return losses[0], losses[1:]

    def loss(self, residuals: Array, sigma: Array) -> float:
        """Mean of −2/d times the log-likelihood of poses, of Student's t in d dimensions, less that of none.

        It grows as the logarithm of the squared residual where this is as the scale has it.
        """
        out = np.sum(residuals**2, axis=1) / (self.scale**2 + sigma**2)
        dims = residuals.shape[1]
        return float((TAILS + dims) / dims * np.mean(np.log1p(out / TAILS)))

    def remaining(self) -> Array:
        """Residuals (m, d) of the fit with the chosen effects to all regions."""
        have = self.places(self.chosen)
        total = sum(self.information) + np.diag(self.precision)
        values = np.linalg.solve(total[np.ix_(have, have)], sum(self.gradient)[have])
        return np.asarray(self.residuals - self.design[..., have] @ values)


def search(poses: Poses, fit: Fit, effects: Sequence[Effect]) -> Found:
    """Search for the effects that stay; ``fit`` is of the geometry alone."""
    some = poses.thinned(MOST)
    state = fit.state
    at, derivatives = jacobian(state, some.q, some.point)
    parts = [measured.seen_of_geometry(state, at, some, derivatives)[..., fit.free]]
    moves = columns(state, derivatives, effects, some)
    parts += [measured.seen(state, at, some, each) for each in moves]
    ends = np.cumsum([0, *(part.shape[-1] for part in parts)])
    blocks = [np.arange(a, b) for a, b in pairwise(ends)]
    geometry = np.where(np.flatnonzero(fit.free) < state.head, np.inf, PLAUSIBLE)
    priors = [geometry, *(np.full(len(own), one.prior) for own, one in zip(blocks[1:], effects, strict=True))]
    design = np.concatenate(parts, axis=-1)
    left = measured.residuals(state, at, some)
    model = _Search(
        design, left, some.sigma, some.regions, blocks[0], blocks[1:], np.concatenate(priors) ** -2.0
    )
    early = [place for place, effect in enumerate(effects) if not effect.late]
    late = [place for place, effect in enumerate(effects) if effect.late]
    trials: dict[int, Trial] = {}
    for candidates in (early, late, early + late):
        _forward(model, effects, candidates, trials)
    _backward(model, effects, early, trials)
    return Found(
        tuple(effects[one] for one in sorted(model.chosen)),
        tuple(trials[one] for one in sorted(trials)),
        _rivals(model, effects, early),
    )


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


def _rivals(model: _Search, effects: Sequence[Effect], candidates: list[int]) -> tuple[tuple[str, str], ...]:
    """Return which effects would stay in the place of one that does, and lose no more than by chance."""
    found = []
    others = [one for one in candidates if one not in model.chosen]
    with_all, _ = model.left_out(model.chosen)
    for one in (each for each in candidates if each in model.chosen):
        without, instead = model.left_out([other for other in model.chosen if other != one], others)
        for other, loss in zip(others, instead, strict=True):
            if by_luck(loss - with_all) >= CHANCE and _trial(effects[other], without, loss).kept:
                found.append((effects[one].label, effects[other].label))
    return tuple(found)


def _trial(effect: Effect, without: Array, with_it: Array) -> Trial:
    """Judge an effect by the losses of left-out regions without and with it."""
    gains = without - with_it
    gain, error = float(np.mean(gains)), float(np.std(gains, ddof=1) / np.sqrt(len(gains)))
    luck = by_luck(gains)
    kept = gain > MATERIAL and luck < CHANCE
    return Trial(effect.label, effect.code, gain, error, luck, kept, effect.joint)


@cache
def _signs(count: int) -> Array:
    places = np.arange(count)
    return np.asarray(1.0 - 2.0 * ((np.arange(2**count)[:, None] >> places) & 1), dtype=np.float64)


def by_luck(gains: Array) -> float:
    """Return how often a mean gain is as large where each region's is as likely to be a loss.

    Fisher's test of all signs: regions gain by very different amounts, which a test by their scatter would
    hold against what helps everywhere.
    """
    means = _signs(len(gains)) @ gains
    return float(np.mean(means >= means[0] - 1e-12 * np.abs(gains).sum()))
