"""Levenberg's and Marquardt's descent in base and effect parameters and every run's unknowns at once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Literal, NamedTuple

import numpy as np

from metro.loop.fitting.candidate import Candidate, unpredicted
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.system import (
    Known,
    State,
    System,
    ahead,
    linearised,
    normal_equations,
    own_step,
    solution,
)
from metro.observables.problem import Block, predictions
from metro.units import Array

ITERATIONS = 40
ENOUGH = 0.01  # gain in twice the log-likelihood below which a descent ends
SHARES = (1.0, 0.5, 0.25, 0.1)  # of an undamped step: along a bent valley a shorter one leads on
SMALL_SHARES = (0.03, 0.01, 0.003)  # that say whether the derivatives hold
FIRST_DAMPING, LARGEST_DAMPING = 1e-3, 1e9  # of the normal matrix's diagonal
HOPE = 30.0  # times what a step promises: more is not left to gain along a descent, except in a bent valley
ACCEPTED = 1e-3  # share of what a step promised that it must keep
MUCH = 0.5  # share of its promise that a step keeps where derivatives that were given are good enough


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
    slopes: Sequence[Array] | None = None,
    trusted: bool = False,
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
    slopes : of each block, derivatives by the first effect parameters (n, k) near the start. They are used as
        long as steps keep much of their promise, and not to end the descent. None: none are known.
    trusted : whether these derivatives may end it, too: the end is hardly away from where they hold.

    Returns
    -------
    state, cost : where at most so many ``steps`` lead.
    """
    free: Literal["all", "own"] = "own" if own else "all"
    at = partial(linearised, candidate, blocks, noise, known=known)
    system, damping = at(state, derivatives=free, slopes=slopes), 0.0
    for step in range(1, steps + 1):
        left = max(enough, (system.cost - rival) / HOPE)
        taken = _step(candidate, blocks, state, system, damping, own=own, enough=left)
        if taken is None and slopes and left == enough and not trusted:
            system, slopes = at(state, derivatives=free), None
            taken = _step(candidate, blocks, state, system, damping, own=own, enough=left)
        if taken is None:
            break
        state, damping = taken.state, taken.damping
        if (taken.gained < enough and (trusted or not slopes)) or step == steps:
            return state, at(state, derivatives="none").cost
        slopes = slopes if taken.kept > MUCH else None
        system = at(state, derivatives=free, slopes=slopes)
    return state, system.cost


class _Taken(NamedTuple):
    """A step that was taken: where it led, what it gained, and the share of its promise that it kept.

    ``damping``: to begin the next one with.
    """

    state: State
    gained: float
    kept: float
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
                return _Taken(trial, gained, gained / promised, min(eased, 2.0) * damping)
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
    """Sum of squares at another state under the weights of a system; infinite where nothing is predicted."""
    model = candidate.model(state.theta)
    if any(unpredicted(model, block, state.beta) for block in blocks):
        return np.inf
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

    There the cost no longer decides: it is flat to rounding where the parameters have half of their digits.
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

    A step of a plane vector's length and angle is one along them where it begins, straight on; one of what
    acts by its reciprocal is one of that.
    """
    p = len(state.beta)
    theta = state.theta + common[p:]
    for length, angle in candidate.vectors:
        turn = math.radians(common[p + angle]) * state.theta[length]
        theta[angle] = state.theta[angle] + math.degrees(math.atan2(turn, theta[length]))
        theta[length] = math.hypot(theta[length], turn)
    for i, parameter in enumerate(candidate.parameters):
        if parameter.reciprocal:
            inverse = 1.0 / state.theta[i] - common[p + i] / state.theta[i] ** 2
            theta[i] = 1.0 / min(max(inverse, 1.0 / parameter.upper), 1.0 / parameter.lower)
        elif parameter.period:
            theta[i] = parameter.lower + (theta[i] - parameter.lower) % parameter.period
        else:
            theta[i] = min(max(theta[i], parameter.lower), parameter.upper)
    nuisance = {run: state.nuisance[run] + step for run, step in own.items()}
    return State(theta, state.beta + common[:p], nuisance)


def free(candidate: Candidate, state: State, right: Array) -> np.ndarray:
    """Mark base and effect parameters that may move downhill: (p + q,), all but those pressed to a bound."""
    pull = right[len(state.beta) :]
    low, high = np.array([(e.lower, e.upper) for e in candidate.parameters]).reshape(-1, 2).T
    turning = np.array([bool(e.period) for e in candidate.parameters], dtype=bool)
    pressed = ((state.theta <= low) & (pull < 0.0)) | ((state.theta >= high) & (pull > 0.0))
    return np.concatenate([np.ones(len(state.beta), dtype=bool), ~pressed | turning])
