"""What blocks say at given values of everything: residuals, their derivatives, and the normal equations.

Each run's nuisance (start phase) touches only its own block and is eliminated there, so the system that is
solved has only base and effect parameters, however many runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.noise import Noise, Whitener
from metro.observables.problem import Block, Model, differences
from metro.units import Array

THETA_STEP = 1e-3  # in units of the parameter's scale
NUISANCE_STEP = 1e-4
UNSEEN = 1e-12  # smallest eigenvalue of the scaled normal matrix that is more than its rounding
TRACE = 1e-9  # square of a parameter's part in a direction that is no more than rounding
Rows = tuple[Array, Array, Array, Array]


@dataclass
class State:
    """Values of everything that is fitted: effect parameters, base parameters, each run's nuisance."""

    theta: Array
    beta: Array
    nuisance: dict[str, Array]


@dataclass(frozen=True)
class Known:
    """What is known of base and effect parameters: ``mean`` (p + q,) and ``precision`` (p + q, p + q)."""

    mean: Array
    precision: Array


def weakly_known(candidate: Candidate, bases: int) -> Known:
    """Return what a machinist believes: effects are rather small; nothing of ``bases`` base parameters."""
    weight = [0.0 if p.plausible is None else p.plausible**-2 for p in candidate.parameters]
    return Known(np.zeros(bases + len(weight)), np.diag([0.0] * bases + weight))


@dataclass(frozen=True)
class System:
    """What the blocks say at given values of everything.

    Attributes
    ----------
    rows : of each block the whitened residual, base columns, effect columns and own (nuisance) columns.
    whiteners : of each block.
    log_likelihood, chi2 : by run.
    at : base and effect parameters, (p + q,). pull : their distance from what is known beforehand, (p + q,).
    weight : precision of what is known, (p + q, p + q).
    """

    rows: list[Rows]
    whiteners: list[Whitener]
    log_likelihood: dict[str, float]
    chi2: dict[str, float]
    at: Array
    pull: Array
    weight: Array

    @property
    def cost(self) -> float:
        """Twice the negative logarithm of likelihood times prior."""
        return float(self.pull @ self.weight @ self.pull) - 2.0 * sum(self.log_likelihood.values())

    @property
    def squares(self) -> float:
        """Sum of the squares of the whitened residuals and of the pull."""
        return float(self.pull @ self.weight @ self.pull) + sum(self.chi2.values())

    def left(self, common: Array, alone: Sequence[Array]) -> float:
        """Sum of squares that a step leaves if the model is linear; ``alone``: of each run's own unknowns."""
        pull = self.pull + common
        total = float(pull @ self.weight @ pull)
        for row, step in zip(self.rows, alone, strict=True):
            after = _without_common(row, common) - row[3] @ step
            total += float(after @ after)
        return total


def linearised(
    candidate: Candidate,
    blocks: Sequence[Block],
    noise: Noise,
    state: State,
    *,
    derivatives: Literal["all", "own", "none"] = "all",
    known: Known | None = None,
    slopes: Sequence[Array] | None = None,
) -> System:
    """Whitened residual of every block, its likelihood, and its derivatives: all, or by its unknowns only.

    ``known`` of the parameters beforehand; None: :func:`weakly_known`. ``slopes``: of each block, derivatives
    by the first effect parameters (n, k) that are taken to hold here, too; those by the others are computed.
    """
    point = _point(candidate, tuple(state.theta.tolist()), tuple(state.beta.tolist()))
    rows: list[Rows] = []
    whiteners: list[Whitener] = []
    log_likelihood, chi2 = {}, {}
    for i, block in enumerate(blocks):
        nuisance = tuple(state.nuisance[block.run].tolist())
        matrix, offset = _design(point, block, nuisance)
        predicted = offset + matrix @ state.beta
        directions = noise_room.shared(block, noise, matrix, state.beta)
        whiten = noise_room.whitener(noise_room.diagonal(block, noise), directions)
        whiteners.append(whiten)
        residual = whiten(block.measured - predicted)
        chi2[block.run] = float(residual @ residual)
        determinant = noise_room.log_determinant(block, noise, directions, whiten)
        log_likelihood[block.run] = -0.5 * (chi2[block.run] + determinant)
        if derivatives != "none":
            held = slopes[i] if slopes and derivatives == "all" else matrix[:, :0]
            first = held.shape[1] if derivatives == "all" else len(state.theta)
            effect, own = _slopes(point, block, nuisance, first)
            effect = np.hstack([held, effect]) if first and derivatives == "all" else effect
            whitened = whiten(np.hstack([matrix, effect, own]))
            p, q = matrix.shape[1], matrix.shape[1] + effect.shape[1]
            rows.append((residual, whitened[:, :p], whitened[:, p:q], whitened[:, q:]))
    known = known or weakly_known(candidate, len(state.beta))
    at = np.concatenate([state.beta, state.theta])
    return System(rows, whiteners, log_likelihood, chi2, at, at - known.mean, known.precision)


class _Point:
    """A candidate at values of effect and base parameters; a point is equal to itself alone."""

    def __init__(self, candidate: Candidate, theta: Array, beta: Array) -> None:
        self.candidate, self.theta, self.beta = candidate, theta, beta
        self.model = candidate.model(theta)

    @cached_property
    def moved(self) -> list[tuple[Model, float]]:
        """The model with each effect parameter moved."""
        return moved_models(self.candidate, self.theta)


# The same point comes again and again: with another noise, at the end of a descent for its covariance, and
# at the start of every fit that leaves a condition out.
@lru_cache(maxsize=64)
def _point(candidate: Candidate, theta: tuple[float, ...], beta: tuple[float, ...]) -> _Point:
    return _Point(candidate, np.array(theta), np.array(beta))


@lru_cache(maxsize=512)
def _design(point: _Point, block: Block, nuisance: tuple[float, ...]) -> tuple[Array, Array]:
    return _kept(*point.model.design(block, np.array(nuisance), point.beta))


def designs(candidate: Candidate, blocks: Sequence[Block], state: State) -> list[tuple[Array, Array]]:
    """Return design (n, p) and offset (n,) of each block at a state."""
    point = _point(candidate, tuple(state.theta.tolist()), tuple(state.beta.tolist()))
    return [_design(point, block, tuple(state.nuisance[block.run].tolist())) for block in blocks]


@lru_cache(maxsize=512)
def _slopes(point: _Point, block: Block, nuisance: tuple[float, ...], first: int) -> tuple[Array, Array]:
    """Return derivatives by effect parameters from ``first`` on, and by the block's own unknowns."""
    moved = point.moved[first:] if first < len(point.theta) else []
    return _kept(*sensitivities(point.model, moved, block, np.array(nuisance), point.beta))


def effect_slopes(candidate: Candidate, blocks: Sequence[Block], state: State) -> list[Array]:
    """Return derivatives of each block by the effect parameters of a candidate, (n, q), not whitened."""
    point = _point(candidate, tuple(state.theta.tolist()), tuple(state.beta.tolist()))
    return [_slopes(point, block, tuple(state.nuisance[block.run].tolist()), 0)[0] for block in blocks]


def _kept(first: Array, second: Array) -> tuple[Array, Array]:
    """Return two arrays that nobody may write to, since others will be given them too."""
    first, second = np.asarray(first).view(), np.asarray(second).view()
    first.flags.writeable = second.flags.writeable = False
    return first, second


def sensitivities(
    model: Model,
    moved: Sequence[tuple[Model, float]],
    block: Block,
    nuisance: Array,
    beta: Array,
) -> tuple[Array, Array]:
    """Return derivatives of a block's prediction by the effect parameters (n, q) and by its unknowns (n, m).

    ``moved``: the model with each effect parameter moved, of :func:`moved_models`. What changes nothing has a
    derivative of exactly zero and no direction.
    """
    places = nuisance + NUISANCE_STEP * np.eye(len(nuisance) + 1, len(nuisance), -1)
    effect, own = differences(model, [other for other, _ in moved], block, places, beta)
    steps = np.array([step for _, step in moved]).reshape(-1, 1)
    return (effect / steps).T, own.T / NUISANCE_STEP


def moved_models(candidate: Candidate, theta: Array) -> list[tuple[Model, float]]:
    """Return the model with each effect parameter moved a little, within its bounds, and by how much."""
    models = []
    for i, parameter in enumerate(candidate.parameters):
        step = THETA_STEP * parameter.scale
        if theta[i] + step > parameter.upper:
            step = -step
        moved = theta.copy()
        moved[i] += step
        models.append((candidate.model(moved), step))
    return models


def normal_equations(system: System, damping: float = 0.0) -> tuple[Array, Array]:
    """Return normal matrix and right side of base and effects, each block's own unknowns eliminated.

    ``damping`` : by how much the diagonal of the normal matrix of all unknowns is larger, relative to it.
    """
    p, q = (part.shape[1] for part in system.rows[0][1:3])
    normal, right = np.zeros((p + q, p + q)), np.zeros(p + q)
    for residual, base, effect, unknowns in system.rows:
        columns = np.hstack([base, effect])
        normal[np.diag_indices(p + q)] += damping * (columns**2).sum(axis=0)
        own = _damped(unknowns[:, unknowns.any(axis=0)], damping)  # what changes nothing has no direction
        columns = _lengthened(columns, len(own))
        if own.shape[1]:
            basis = np.linalg.qr(own)[0]
            columns = columns - basis @ (basis.T @ columns)
        normal += columns.T @ columns
        right += columns.T @ _lengthened(residual, len(own))
    return normal + system.weight, right - system.weight @ system.pull


def own_step(row: Rows, common: Array, damping: float = 0.0) -> Array:
    """Step of a block's nuisance when base and effect parameters together move by ``common``."""
    own = row[3]
    if not own.shape[1]:
        return np.zeros(0)
    left = _without_common(row, common)
    damped = _damped(own, damping)
    return np.asarray(np.linalg.lstsq(damped, _lengthened(left, len(damped)), rcond=None)[0])


def _without_common(row: Rows, common: Array) -> Array:
    """Residual of a block less what a step of base and effect parameters takes from it."""
    residual, base, effect, _ = row
    return residual - np.hstack([base, effect]) @ common if common.any() else residual


def _damped(columns: Array, damping: float) -> Array:
    """Append to columns the rows that damp a step along each of them."""
    if not damping:
        return columns
    return np.vstack([columns, math.sqrt(damping) * np.diag(np.linalg.norm(columns, axis=0))])


def _lengthened(values: Array, length: int) -> Array:
    """Append rows of zeros."""
    return np.concatenate([values, np.zeros((length - len(values), *values.shape[1:]))])


def ahead(normal: Array, right: Array) -> float:
    """Return what another step would gain in twice the log-likelihood, to second order."""
    return float(solution(normal, right) @ right)


def condition(normal: Array) -> float:
    """Return the condition number of the whitened columns, brought to one length, that a normal matrix is of.

    Infinite where a column, alone or beside the others, is not identifiable.
    """
    size = np.linalg.eigvalsh(_scaled(normal)[0])
    return float(np.sqrt(size[-1] / size[0])) if size.size and size[0] > UNSEEN * size[-1] else float(np.inf)


def solution(normal: Array, right: Array) -> Array:
    """Solve normal equations; a parameter that they say nothing of stays zero."""
    scaled, scale = _scaled(normal)
    return np.asarray(scale * np.linalg.lstsq(scaled, scale * right, rcond=UNSEEN)[0])


def inverse(normal: Array) -> Array:
    """Invert a normal matrix; a parameter that it says nothing of has an infinite variance."""
    scaled, scale = _scaled(normal)
    size, direction = np.linalg.eigh(scaled)
    seen = size > UNSEEN * size.max(initial=0.0)
    known = direction[:, seen] * scale[:, None]
    covariance = (known / size[seen]) @ known.T
    unknown = (direction[:, ~seen] ** 2).sum(axis=1) > TRACE
    covariance[unknown, unknown] = np.inf
    return np.asarray(covariance)


def _scaled(normal: Array) -> tuple[Array, Array]:
    """Bring the columns of a normal matrix to one size; those of zero length stay zero."""
    length = np.sqrt(np.diag(normal))
    scale = np.divide(1.0, length, out=np.zeros_like(length), where=length > 0.0)
    return normal * scale[:, None] * scale[None, :], scale
