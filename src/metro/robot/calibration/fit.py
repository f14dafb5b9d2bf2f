"""Geometry and effects fitted to measured poses, robustly, with covariances that the residual itself shows.

Residuals are of Student's t with four degrees of freedom in three dimensions, or one of distances (Lange,
Little & Taylor, J. Am. Stat. Assoc. 84 (1989) 881), of a scale that the median residual gives. The covariance
is that of an M-estimator: by the scores of poses, and by the sums of the scores of regions, since what no
effect explains is alike among neighbours. Of each parameter the largest variance counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from metro.robot.calibration import measured
from metro.robot.calibration.effects import PLAUSIBLE, Effect
from metro.robot.calibration.model import State, jacobian, moved, turning
from metro.robot.calibration.poses import Poses
from metro.units import Array

TAILS = 4.0  # degrees of freedom of Student's t
CHI2_HALF = {1: 0.454936, 3: 2.365974}  # median of chi-squared of so many degrees of freedom
STEPS = 20
SETTLED = 1e-3  # of the largest step over its standard error, from which on a fit has converged
HALVINGS = 5  # of the workspace: the scores of 32 regions are summed for the covariance


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted arm.

    Attributes
    ----------
    state : its geometry. free : (9 + 5 n) bool, the parameters of it that were fitted.
    effects : with ``values``, of each the parameters.
    scale : standard deviation of a coordinate beyond geometry, effects and the instrument, m.
    covariance : (p, p) of the free parameters and those of all effects, in this order.
    """

    state: State
    free: np.ndarray
    effects: tuple[Effect, ...]
    values: tuple[Array, ...]
    scale: float
    covariance: Array

    def predicted(self, poses: Poses) -> Array:
        """Positions (m, 3), m, in the frame of the instrument."""
        return predicted(self.state, self.effects, self.values, poses)[0]

    def place(self, effect: int) -> slice:
        """Return where the parameters of an effect are in the covariance."""
        first = int(self.free.sum()) + sum(len(values) for values in self.values[:effect])
        return slice(first, first + len(self.values[effect]))


def predicted(
    state: State, effects: Sequence[Effect], values: Sequence[Array], poses: Poses
) -> tuple[Array, Array]:
    """Return the positions (m, 3), and the readings (m, n) with what effects turn the joints by."""
    q, shift = poses.q.copy(), np.zeros((len(poses), 3))
    for effect, own in zip(effects, values, strict=True):
        if effect.joint >= 0:
            q[:, effect.joint] += effect.basis(poses, state) @ own
        else:
            shift += effect.basis(poses, state) @ own
    return state.position(q, poses.point) + shift, q


def columns(state: State, derivatives: Array, effects: Sequence[Effect], poses: Poses) -> list[Array]:
    """Return what each effect's parameters move the point by, (m, 3, k) each, given :func:`jacobian`."""
    by_joint = turning(state, derivatives)
    parts = []
    for effect in effects:
        basis = effect.basis(poses, state)
        parts.append(by_joint[:, :, effect.joint, None] * basis[:, None] if effect.joint >= 0 else basis)
    return parts


def scale_of(residuals: Array, sigma: Array) -> float:
    """Return the standard deviation of a coordinate beyond that of the instrument, by the median residual."""
    half = CHI2_HALF[residuals.shape[1]]
    beyond = float(np.median(np.sum(residuals**2, axis=1))) / half - float(np.median(sigma)) ** 2
    return float(np.sqrt(max(beyond, 1e-18)))


def weights_of(residuals: Array, sigma: Array) -> tuple[Array, Array, float]:
    """Return weights (m,) over variance, how far out each pose is (squared, scaled), and the scale."""
    scale = scale_of(residuals, sigma)
    variance = scale**2 + sigma**2
    out = np.sum(residuals**2, axis=1) / variance
    return (TAILS + residuals.shape[1]) / (TAILS + out) / variance, out, scale


def fitted(
    poses: Poses, state: State, free: np.ndarray, effects: Sequence[Effect] = (), prior: float = PLAUSIBLE
) -> Fit:
    """Fit the free parameters of a geometry, and effects, to poses.

    ``prior``: standard deviation of the corrections of rows about the state's own; base and tool have none.
    """
    count, start = int(free.sum()), state
    values = [np.zeros(effect.basis(poses, state).shape[-1]) for effect in effects]
    widths = [np.full(len(own), effect.prior) for own, effect in zip(values, effects, strict=True)]
    of_rows = np.where(np.arange(len(free)) < start.head, np.inf, prior)[free]
    precision = np.concatenate([of_rows, *widths]) ** -2.0
    for _ in range(STEPS):
        at, q = predicted(state, effects, values, poses)
        residuals = measured.residuals(state, at, poses)
        weight, out, scale = weights_of(residuals, poses.sigma)
        _, derivatives = jacobian(state, q, poses.point)
        moves = columns(state, derivatives, effects, poses)
        parts = [measured.seen_of_geometry(state, at, poses, derivatives)[..., free]]
        parts += [measured.seen(state, at, poses, each) for each in moves]
        design = np.concatenate(parts, axis=-1)
        now = np.concatenate([_change(state, start)[free], *values])
        weighted = (design * weight[:, None, None]).reshape(-1, len(precision))
        information = weighted.T @ design.reshape(-1, len(precision)) + np.diag(precision)
        gradient = weighted.T @ residuals.ravel() - precision * now
        step = np.linalg.solve(information, gradient)
        whole = np.zeros(len(free))
        whole[free] = step[:count]
        state = moved(state, whole)
        ends = np.cumsum([count, *map(len, values)])
        values = [own + step[a:b] for own, (a, b) in zip(values, pairwise(ends), strict=True)]
        if float(np.max(step**2 * np.diag(information))) < SETTLED**2:
            break
    scores = np.einsum("mik,mi->mk", design, residuals * weight[:, None])
    covariance = _covariance(scores, out, information, poses.parted(HALVINGS), residuals.shape[1])
    return Fit(state, free, tuple(effects), tuple(values), scale, covariance)


def _change(state: State, start: State) -> Array:
    """Corrections of the rows, in the order of the parameters; 0 of base and tool, which have no prior."""
    return np.concatenate([np.zeros(state.head), (state.rows - start.rows).ravel()])


def _covariance(scores: Array, out: Array, information: Array, region: np.ndarray, dims: int) -> Array:
    """Return the covariance by information, by poses and by regions: of each parameter the largest.

    ``scores``: (m, p) of the poses. ``out``: (m,) their squared scaled residuals, in ``dims`` dimensions.
    """
    inverse = np.linalg.inv(information)
    # The mean slope of the influence function is less than the mean weight, of which ``information`` is made.
    relative = (TAILS + dims) / (TAILS + out)
    slope = relative - (2.0 / dims) * (TAILS + dims) * out / (TAILS + out) ** 2
    stretch = (np.mean(relative) / np.mean(slope)) ** 2
    together = np.zeros((int(region.max()) + 1, scores.shape[1]))
    np.add.at(together, region, scores)
    # What the poses do not show keeps the variance of its prior, which the inverse has and scores lack.
    variances = [np.diag(inverse)]
    for each in (scores, together):
        half = inverse @ each.T
        variances.append(np.sum(half**2, axis=1) * stretch * len(each) / max(len(each) - 1, 1))
    grown = np.sqrt(np.max(variances, axis=0) / variances[0])
    return np.asarray(inverse * np.outer(grown, grown))
