"""Levenberg's and Marquardt's descent in base parameters, effect parameters and every run's unknowns at once.

Each run's nuisance (start phase) touches only its own block and is eliminated there, so the system that is
solved has only base and effect parameters, however many runs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.noise import Noise, Whitener
from metro.observables.problem import Block, Model, predictions
from metro.units import Array

ITERATIONS = 40
ENOUGH = 0.01  # gain in twice the log-likelihood below which a descent ends
SHARES = (1.0, 0.5, 0.25, 0.1)  # of an undamped step: along a bent valley a shorter one leads on
SMALL_SHARES = (0.03, 0.01, 0.003)  # that say whether the derivatives hold
FIRST_DAMPING, LARGEST_DAMPING = 1e-3, 1e9  # of the normal matrix's diagonal
HOPE = 30.0  # times what a step promises: more is not left to gain along a descent, except in a bent valley
ACCEPTED = 1e-3  # share of what a step promised that it must keep
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
) -> System:
    """Whitened residual of every block, its likelihood, and its derivatives: all, or by its unknowns only.

    ``known`` of the parameters beforehand; None: :func:`weakly_known`.
    """
    model = candidate.model(state.theta)
    moved = moved_models(candidate, state.theta) if derivatives == "all" else []
    rows: list[Rows] = []
    whiteners: list[Whitener] = []
    log_likelihood, chi2 = {}, {}
    for block in blocks:
        nuisance = state.nuisance[block.run]
        matrix, offset = model.design(block, nuisance, state.beta)
        predicted = offset + matrix @ state.beta
        directions = noise_room.shared(block, noise, matrix, state.beta)
        whiten = noise_room.whitener(noise_room.diagonal(block, noise), directions)
        whiteners.append(whiten)
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
    at = np.concatenate([state.beta, state.theta])
    return System(rows, whiteners, log_likelihood, chi2, at, at - known.mean, known.precision)


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
    rival: float = np.inf,
) -> tuple[State, float]:
    """Follow Levenberg's and Marquardt's steps to where none promises to gain anything that counts.

    A step is judged by the weights at its start; then the weights are those of where it led (iteratively
    reweighted least squares). How much a step was damped is remembered: where the model bends, the next one
    need not find out anew (Marquardt 1963, J. SIAM 11, 431; Nielsen 1999, IMM-REP-1999-05, for its growth).

    Parameters
    ----------
    own : move the blocks' own unknowns alone; base and effect parameters stay.
    enough : gain in twice the log-likelihood below which the descent ends.
    known : of the parameters beforehand; None: :func:`weakly_known`.
    rival : cost that another descent has reached. This one is given up where it would stay above that even
        if it gained ``HOPE`` times what its next step promises.

    Returns
    -------
    state, cost : where at most so many ``steps`` lead.
    """
    free: Literal["all", "own"] = "own" if own else "all"
    system = linearised(candidate, blocks, noise, state, derivatives=free, known=known)
    damping = 0.0
    for step in range(1, steps + 1):
        taken = _step(
            candidate,
            blocks,
            state,
            system,
            damping,
            own=own,
            enough=max(enough, (system.cost - rival) / HOPE),
        )
        if taken is None:
            break
        state, gained, damping = taken
        last = gained < enough or step == steps
        system = linearised(
            candidate, blocks, noise, state, derivatives="none" if last else free, known=known
        )
        if last:
            break
    return state, system.cost


class _Taken(NamedTuple):
    """A step that was taken: where it led, what it gained, and the damping to begin the next one with."""

    state: State
    gained: float
    damping: float


def _step(
    candidate: Candidate,
    blocks: Sequence[Block],
    state: State,
    system: System,
    damping: float,
    *,
    own: bool,
    enough: float,
) -> _Taken | None:
    """Take a step, shortened and then ever more damped until it gains; None: none promises ``enough``."""
    here, growth = system.squares, 2.0
    while damping < LARGEST_DAMPING:
        common, alone = _way(candidate, state, system, damping, own=own)
        for share in (1.0,) if damping else SHARES:
            part = [share * step for step in alone]
            promised = here - system.left(share * common, part)
            if not promised > enough:  # nor where the model overflows
                return None
            trial = _moved(candidate, state, share * common, _by_run(blocks, part))
            gained = here - _squares(candidate, blocks, trial, system)
            if gained > ACCEPTED * promised:
                eased = max(1.0 / 3.0, 1.0 - (2.0 * gained / promised - 1.0) ** 3)
                return _Taken(trial, gained, min(eased, 2.0) * damping)
        damping, growth = max(growth * damping, FIRST_DAMPING), 2.0 * growth
    return None


def farthest(candidate: Candidate, blocks: Sequence[Block], state: State, system: System) -> float:
    """Return the share of an undamped step at which the sum of squares is lowest.

    A model that bends more than its derivatives say has its end short of the whole step. All of it (1) counts
    where not even a small share gains: the derivatives of a rough model say nothing of where its end is.
    """
    common, alone = _way(candidate, state, system, 0.0, own=False)
    left = {}
    for share in (*SHARES, *SMALL_SHARES):
        part = [share * step for step in alone]
        trial = _moved(candidate, state, share * common, _by_run(blocks, part))
        left[share] = _squares(candidate, blocks, trial, system)
    best = min(left, key=lambda share: left[share])
    return best if left[SMALL_SHARES[-1]] < system.squares else 1.0


def _way(
    candidate: Candidate, state: State, system: System, damping: float, *, own: bool
) -> tuple[Array, list[Array]]:
    """Return a damped step of base and effects together, and of each run's own unknowns.

    Parameters that are pressed to a bound stay there.
    """
    common = np.zeros_like(system.pull)
    if not own:
        normal, right = normal_equations(system, damping)
        if not np.isfinite(normal).all():
            return common, [np.full(row[3].shape[1], np.nan) for row in system.rows]
        moving = free(candidate, state, right)
        common[moving] = solution(normal[np.ix_(moving, moving)], right[moving])
    return common, [own_step(row, common, damping) for row in system.rows]


def _squares(candidate: Candidate, blocks: Sequence[Block], state: State, system: System) -> float:
    """Sum of squares at another state under the weights of a system; infinite where the model overflows."""
    model = candidate.model(state.theta)
    pull = system.pull + np.concatenate([state.beta, state.theta]) - system.at
    total = float(pull @ system.weight @ pull)
    for block, whiten in zip(blocks, system.whiteners, strict=True):
        predicted = predictions(model, block, state.nuisance[block.run][None], state.beta)[0]
        residual = whiten(block.measured - predicted)
        total += float(residual @ residual)
    return total if np.isfinite(total) else np.inf


def _by_run(blocks: Sequence[Block], steps: Sequence[Array]) -> dict[str, Array]:
    """Give each run its own step."""
    return {block.run: step for block, step in zip(blocks, steps, strict=True)}


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
        state = _moved(candidate, state, common, _by_run(blocks, alone))
    return best


def _moved(candidate: Candidate, state: State, common: Array, own: Mapping[str, Array]) -> State:
    """Add steps to a state; angles are turned into their period, other effect parameters kept in bounds.

    A step of a plane vector's length and angle is one along them where it begins, straight on.
    """
    p = len(state.beta)
    theta = state.theta + common[p:]
    for length, angle in candidate.vectors:
        turn = math.radians(common[p + angle]) * state.theta[length]
        theta[angle] = state.theta[angle] + math.degrees(math.atan2(turn, theta[length]))
        theta[length] = math.hypot(theta[length], turn)
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
