"""Gauss–Newton descent in base parameters, effect parameters and every run's unknowns at once.

Each run's nuisance (start phase) touches only its own block and is eliminated there, so the system that is
solved has only base and effect parameters, however many runs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.noise import Noise
from metro.observables.problem import Block, Model, predictions
from metro.units import Array

ITERATIONS = 40
ENOUGH = 0.01  # gain in twice the log-likelihood below which a descent ends
SHARES = (1.0, 0.5, 0.25, 0.1, 0.02)  # of a step, tried in turn until the cost falls
DAMPINGS = (0.1, 10.0, 1e3, 1e5)  # of the normal matrix's diagonal, where no share of the step makes it fall
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
    log_likelihood, chi2 : by run.
    pull : distance of base and effect parameters from what is known of them beforehand, (p + q,).
    weight : precision of that, (p + q, p + q).
    """

    rows: list[Rows]
    log_likelihood: dict[str, float]
    chi2: dict[str, float]
    pull: Array
    weight: Array

    @property
    def cost(self) -> float:
        """Twice the negative logarithm of likelihood times prior."""
        return float(self.pull @ self.weight @ self.pull) - 2.0 * sum(self.log_likelihood.values())


def linearised(
    candidate: Candidate,
    blocks: Sequence[Block],
    noise: Noise,
    state: State,
    *,
    derivatives: Literal["all", "own", "none"] = "all",
    known: Known | None = None,
) -> System:
    """Whitened residual of every block, its likelihood, and its derivatives: all, or by its unknowns only.

    ``known`` of the parameters beforehand; None: :func:`weakly_known`.
    """
    model = candidate.model(state.theta)
    moved = moved_models(candidate, state.theta) if derivatives == "all" else []
    rows: list[Rows] = []
    log_likelihood, chi2 = {}, {}
    for block in blocks:
        nuisance = state.nuisance[block.run]
        matrix, offset = model.design(block, nuisance, state.beta)
        predicted = offset + matrix @ state.beta
        directions = noise_room.shared(block, noise, matrix, state.beta)
        whiten = noise_room.whitener(noise_room.diagonal(block, noise), directions)
        residual = whiten(block.measured - predicted)
        chi2[block.run] = float(residual @ residual)
        determinant = noise_room.log_determinant(block, noise, directions, whiten)
        log_likelihood[block.run] = -0.5 * (chi2[block.run] + determinant)
        if derivatives != "none":
            effect, own = sensitivities(model, moved, block, nuisance, state.beta)
            whitened = whiten(np.hstack([matrix, effect, own]))
            p, q = matrix.shape[1], matrix.shape[1] + effect.shape[1]
            rows.append((residual, whitened[:, :p], whitened[:, p:q], whitened[:, q:]))
    known = known or weakly_known(candidate, len(state.beta))
    pull = np.concatenate([state.beta, state.theta]) - known.mean
    return System(rows, log_likelihood, chi2, pull, known.precision)


def sensitivities(
    model: Model,
    moved: Sequence[tuple[Model, float]],
    block: Block,
    nuisance: Array,
    beta: Array,
) -> tuple[Array, Array]:
    """Return derivatives of a block's prediction by the effect parameters (n, q) and by its unknowns (n, m).

    ``moved``: the model with each effect parameter moved, of :func:`moved_models`. All are predicted by one
    way, so that a parameter that changes nothing has a derivative of exactly zero and no direction.
    """
    here = nuisance[None]
    predicted = predictions(model, block, here, beta)[0]
    effect = [(predictions(other, block, here, beta)[0] - predicted) / step for other, step in moved]
    places = nuisance + NUISANCE_STEP * np.eye(len(nuisance))
    own = (predictions(model, block, places, beta) - predicted) / NUISANCE_STEP
    return np.array(effect).reshape(-1, len(predicted)).T, own.T


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


def normal_equations(system: System) -> tuple[Array, Array]:
    """Return normal matrix and right side of base and effects, each block's own unknowns eliminated."""
    p, q = (part.shape[1] for part in system.rows[0][1:3])
    normal, right = np.zeros((p + q, p + q)), np.zeros(p + q)
    for residual, base, effect, unknowns in system.rows:
        columns = np.hstack([base, effect])
        own = unknowns[:, unknowns.any(axis=0)]  # what changes nothing has no direction to take out
        if own.shape[1]:
            basis = np.linalg.qr(own)[0]
            columns = columns - basis @ (basis.T @ columns)
        normal += columns.T @ columns
        right += columns.T @ residual
    return normal + system.weight, right - system.weight @ system.pull


def own_step(row: Rows, common: Array) -> Array:
    """Step of a block's nuisance when base and effect parameters together move by ``common``."""
    residual, base, effect, own = row
    if not own.shape[1]:
        return np.zeros(0)
    left = residual - np.hstack([base, effect]) @ common if common.any() else residual
    return np.asarray(np.linalg.lstsq(own, left, rcond=None)[0])


def descend(
    candidate: Candidate,
    blocks: Sequence[Block],
    noise: Noise,
    state: State,
    steps: int = ITERATIONS,
    *,
    own: bool = False,
    enough: float = ENOUGH,
    known: Known | None = None,
) -> tuple[State, float]:
    """Follow Gauss–Newton steps, shortened until the cost falls, to where they gain next to nothing.

    Where no share of a step lowers the cost although there is something to gain, Levenberg's steps are tried.

    Parameters
    ----------
    own : move the blocks' own unknowns alone; base and effect parameters stay.
    enough : gain in twice the log-likelihood below which the descent ends.
    known : of the parameters beforehand; None: :func:`weakly_known`.

    Returns
    -------
    state, cost : where at most so many ``steps`` lead.
    """
    free: Literal["all", "own"] = "own" if own else "all"
    system = linearised(candidate, blocks, noise, state, derivatives=free, known=known)
    for step in range(steps):
        for way in _ways_down(blocks, system, own=own, enough=enough):
            trial = _moved(candidate, state, way.common, way.alone)
            reached = linearised(candidate, blocks, noise, trial, derivatives="none", known=known)
            if reached.cost < system.cost:
                break
        else:
            break
        gain, system, state = system.cost - reached.cost, reached, trial
        if gain < way.share * enough:
            break
        if step + 1 < steps:
            system = linearised(candidate, blocks, noise, state, derivatives=free, known=known)
    return state, system.cost


class _Way(NamedTuple):
    """A step to try: what share of a whole one it is, its part of base and effects, and that of each run."""

    share: float
    common: Array
    alone: dict[str, Array]


def _ways_down(blocks: Sequence[Block], system: System, *, own: bool, enough: float) -> Iterator[_Way]:
    """Yield steps to try in turn; none where the model overflows.

    First Gauss–Newton's, shortened; then, where that promises to gain ``enough``, Levenberg's, ever more
    damped, which turn to the steepest way down.
    """
    still = np.zeros_like(system.pull)
    normal, right = (np.diag(still), still) if own else normal_equations(system)
    if not np.isfinite(normal).all():
        return
    whole = still if own else solution(normal, right)
    alone = [own_step(row, whole) for row in system.rows]
    for share in SHARES:
        yield _Way(share, share * whole, _by_run(blocks, alone, share))
    if own or whole @ right < enough:
        return
    for damping in DAMPINGS:
        common = solution(normal + damping * np.diag(np.diag(normal)), right)
        alone = [own_step(row, common) for row in system.rows]
        # not a share of a whole step: it must gain as much as that for the descent to go on
        yield _Way(1.0, common, _by_run(blocks, alone, 1.0 / (1.0 + damping)))


def _by_run(blocks: Sequence[Block], steps: Sequence[Array], share: float) -> dict[str, Array]:
    """Give each run its share of its own step."""
    return {block.run: share * step for block, step in zip(blocks, steps, strict=True)}


def polish(
    candidate: Candidate, blocks: Sequence[Block], noise: Noise, state: State, steps: int = ITERATIONS
) -> State:
    """Follow whole steps from the end of a descent, as long as each leaves less ahead than the one before.

    There the cost no longer tells: it is flat to rounding where the parameters have half of their digits.
    """
    nearest, best = np.inf, state
    for _ in range(steps):
        system = linearised(candidate, blocks, noise, state)
        normal, right = normal_equations(system)
        if not np.isfinite(normal).all():
            break
        left = ahead(normal, right)
        if not left < nearest:
            break
        nearest, best = left, state
        common = solution(normal, right)
        alone = [own_step(row, common) for row in system.rows]
        state = _moved(candidate, state, common, _by_run(blocks, alone, 1.0))
    return best


def _moved(candidate: Candidate, state: State, common: Array, own: Mapping[str, Array]) -> State:
    """Add steps to a state; angles are turned into their period, other effect parameters kept in bounds."""
    p = len(state.beta)
    theta = state.theta + common[p:]
    for i, parameter in enumerate(candidate.parameters):
        if parameter.period:
            theta[i] = parameter.lower + (theta[i] - parameter.lower) % parameter.period
        else:
            theta[i] = min(max(theta[i], parameter.lower), parameter.upper)
    nuisance = {run: state.nuisance[run] + step for run, step in own.items()}
    return State(theta, state.beta + common[:p], nuisance)


def ahead(normal: Array, right: Array) -> float:
    """Return what another step would gain in twice the log-likelihood, to second order."""
    return float(solution(normal, right) @ right)


def free(candidate: Candidate, state: State, right: Array) -> np.ndarray:
    """Mark base and effect parameters that may move downhill: (p + q,), all but those pressed to a bound."""
    pull = right[len(state.beta) :]
    low, high = np.array([(e.lower, e.upper) for e in candidate.parameters]).reshape(-1, 2).T
    turning = np.array([bool(e.period) for e in candidate.parameters], dtype=bool)
    pressed = ((state.theta <= low) & (pull < 0.0)) | ((state.theta >= high) & (pull > 0.0))
    return np.concatenate([np.ones(len(state.beta), dtype=bool), ~pressed | turning])


def condition(normal: Array) -> float:
    """Return the condition number of the whitened columns, brought to one length, that a normal matrix is of.

    Infinite where a column tells nothing, or nothing beside the others.
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
