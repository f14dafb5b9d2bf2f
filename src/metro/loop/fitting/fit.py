"""The joint fit: base parameters, effect parameters and every run's unknowns together, on the runs given.

A fit of a larger candidate starts from the fit of the smaller one, with the new effect parameters at all
combinations of their starting values; the noise is re-estimated from the residual as the fit goes on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from metro.loop.fitting import noise as noise_room
from metro.loop.fitting.candidate import Candidate, predicting, started
from metro.loop.fitting.descent import HOPE, ITERATIONS, descend, polish
from metro.loop.fitting.end import CONVERGED, End, end_of
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.nuisances import costs, first_beta, search_nuisance
from metro.loop.fitting.system import State, effect_slopes, linearised
from metro.observables.problem import Block
from metro.units import Array

FOLLOWED = 4  # starts of new effect parameters that are followed to the end; of a single one, all are
OF_A_LIKENESS = 2  # the same of an effect that is not of the library: its parameters are no result
FIRST_STEPS, KEPT = 3, 2  # where little is left to explain, after so many steps so many are kept
HOPELESS = 1.0  # and none, where twice the log-likelihood has not gained that much per parameter: chance does
SAME = 0.05  # difference of the costs of two descents that ended in one place: each stops before its very end
ALIKE = 1e-9  # relative difference of the sums of squares of starts that are the same
UNDECIDED = 0.1  # differences in twice the log-likelihood that the noise, once known better, may turn round
ROUNDS, SETTLED = 12, 0.2  # of noise estimation and descent; gain in twice the log-likelihood that ends them


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted candidate.

    Attributes
    ----------
    theta, beta : effect parameters (units of the contract), base parameters (SI).
    nuisance : each block's nonlinear unknowns, by run.
    covariance : of ``[beta, theta]``, for a dispersion of one.
    wider : by how much the interval of each effect parameter is wider than that covariance says, (q,) at
        least one, since the runs differ by more.
    pressed : by how many standard deviations each effect parameter at a bound would be beyond it, (q,); 0 of
        one that is at none.
    step : by how much another step of the descent would move a parameter, in its standard deviation, at most.
    condition : of the whitened, scaled columns of base and effects; infinite: a parameter is not determined.
    log_likelihood : marginal, by run; ``chi2`` and ``elements``: whitened sum of squares and count, by run.
    """

    candidate: Candidate
    theta: Array
    beta: Array
    nuisance: Mapping[str, Array]
    noise: Noise
    covariance: Array
    wider: Array
    pressed: Array
    step: float
    condition: float
    log_likelihood: Mapping[str, float]
    chi2: Mapping[str, float]
    elements: Mapping[str, int]
    blocks: tuple[Block, ...] = field(repr=False)

    @property
    def rank(self) -> int:
        """How many of the base and effect parameters the blocks determine."""
        return int(np.count_nonzero(np.isfinite(np.diag(self.covariance))))

    @property
    def converged(self) -> bool:
        """Whether the descent ended where the likelihood is highest, to what its interval would not show."""
        return self.step < CONVERGED

    @property
    def total(self) -> float:
        """Log-likelihood of all blocks."""
        return sum(self.log_likelihood.values())

    @property
    def dispersion(self) -> float:
        """Whitened mean square of the residual, at least one: how much worse than the noise the fit is."""
        freedom = sum(self.elements.values()) - len(self.beta) - len(self.theta)
        return max(1.0, sum(self.chi2.values()) / max(1, freedom))

    def predict(self, block: Block) -> Array:
        """Prediction of a block of this fit in the fit's basis, (n,) SI."""
        matrix, offset = self.candidate.model(self.theta).design(block, self.nuisance[block.run], self.beta)
        return offset + matrix @ self.beta


class Race(NamedTuple):
    """What a fit must come to: a cost of at most ``bound``, and a log-likelihood of ``least``.

    The cost is under the noise to begin with, the log-likelihood under the fit's own.
    """

    bound: float = np.inf
    least: float = -np.inf


def fit(
    candidate: Candidate,
    blocks: tuple[Block, ...],
    prior: Noise,
    start: Fit | None = None,
    race: Race | None = None,
) -> Fit:
    """Fit a candidate to blocks: base parameters, effect parameters and nuisances jointly.

    ``start``, a fit of the same or of a simpler candidate, gives the base parameters and the noise to begin
    with; effect parameters that it lacks are started from all combinations of their starting values, group
    after group, and the best few are followed. One that stays behind in a ``race`` is given up where that is
    seen, with the noise of that place. Fits are kept: one that was followed to its end is as good as any, and
    one that was given up in a race would be given up in one that asks for more.
    """
    race, kept = race or Race(), _kept(candidate, blocks, prior, start)
    for known, fitted in kept.items():
        in_bound = race.bound <= known.bound or _below(fitted, known.bound, start, prior)
        if in_bound and (race.least >= known.least or fitted.total >= known.least):
            return fitted
    kept[race] = _fitted(candidate, blocks, prior, start, race)
    return kept[race]


@lru_cache(maxsize=256)
def _kept(
    candidate: Candidate, blocks: tuple[Block, ...], prior: Noise, start: Fit | None
) -> dict[Race, Fit]:
    """Return the place where fits are kept, by what they were to come to."""
    del candidate, blocks, prior, start
    return {}


def _below(fitted: Fit, bound: float, start: Fit | None, prior: Noise) -> bool:
    """Whether a fit stayed below its bound, so that it was followed to its end."""
    return cost_under(fitted, start.noise if start else prior) <= bound


def _fitted(
    candidate: Candidate, blocks: tuple[Block, ...], prior: Noise, start: Fit | None, race: Race
) -> Fit:
    """Fit as :func:`fit` says."""
    noise, bound = start.noise if start else prior, race.bound
    known = start.theta if start else np.zeros(0)
    fresh = candidate.parameters[len(known) :]
    theta = np.concatenate([known, [parameter.neutral for parameter in fresh]])
    beta = start.beta if start else first_beta(candidate, blocks, noise)
    around = start.nuisance if start and fresh else None
    best = [State(theta, beta, {})]
    for places in candidate.groups(len(known)) or [[]]:
        trials: list[tuple[float, State]] = []
        for given in started(candidate, best[0].theta, places):
            state = State(predicting(candidate, blocks, given, beta, len(known)), beta.copy(), {})
            trials.append((search_nuisance(candidate, blocks, noise, state, around), state))
        best = _distinct(sorted(trials, key=lambda trial: trial[0]), ALIKE * trials[0][0])
    nothing = cost_under(start, noise) if start and fresh else np.inf  # what the simpler candidate costs
    if start and fresh:
        most = OF_A_LIKENESS if candidate.effects[-1].resembled else FOLLOWED
        followed = best if len(fresh) == 1 else best[:most]
        first = _lowest_first(candidate, blocks, noise, followed, steps=FIRST_STEPS, bound=bound, known=start)
        best, chance = _distinct(first, SAME), _by_chance(candidate, len(fresh))
        if noise_room.within_budget(blocks, noise):
            best = best[:KEPT]
            if nothing - first[0][0] < chance:
                return _refined(candidate, blocks, prior, noise, best[0], rounds=0)
        elif first[0][0] < nothing + UNDECIDED:
            # What is missed makes the noise large: whether this gains anything is seen under its own.
            own = _reestimated(candidate, blocks, prior, noise, best[0])
            reached_first = _refined(candidate, blocks, prior, own, best[0], rounds=0)
            if 2.0 * (reached_first.total - start.total) < chance:
                return reached_first
    bound = min(bound, nothing)  # above it all was in vain: neutral values are where such a descent leads
    reached = _lowest_first(candidate, blocks, noise, best, steps=ITERATIONS, bound=bound, known=start)
    if reached[0][0] > bound:
        state = reached[0][1]
        noise = _reestimated(candidate, blocks, prior, noise, state)
        return _refined(candidate, blocks, prior, noise, state, rounds=0)
    near = _distinct([one for one in reached if one[0] < reached[0][0] + UNDECIDED], SAME)
    refine = partial(_refined, candidate, blocks, prior, noise, rounds=ROUNDS, least=race.least)
    refined = [refine(state) for state in near]
    return max(refined, key=lambda fitted: fitted.total)


def _by_chance(candidate: Candidate, count: int) -> float:
    """Return what ``count`` parameters gain by chance in twice the log-likelihood where nothing is hidden.

    It is the mean; of an effect that was sought in many places, what one of them gains more often than not.
    """
    from scipy.special import chdtri

    return max(HOPELESS * count, float(chdtri(count, 1.0 / candidate.effects[-1].sought)))


def _distinct(reached: Sequence[tuple[float, State]], apart: float) -> list[State]:
    """Return states with rising costs, without those that cost the same as the one before.

    They are the same with another tooth as the first one, or come from two starts that lead to one place.
    """
    costs = [-np.inf, *(cost for cost, _ in reached)]
    return [state for (cost, state), lower in zip(reached, costs, strict=False) if cost - lower > apart]


def _lowest_first(
    candidate: Candidate,
    blocks: Sequence[Block],
    noise: Noise,
    states: Sequence[State],
    *,
    steps: int,
    bound: float = np.inf,
    known: Fit | None,
) -> list[tuple[float, State]]:
    """Follow each state some steps down; return where they lead, with the cost there.

    ``known``: the fit of the smaller model, whose derivatives hold where each begins. Once one has been
    followed to its end, others are given up when they cannot come as low; so is each that cannot come below
    the ``bound``, and all after one whose first step already promises too little for that.
    """
    reached: list[tuple[float, State]] = []
    for state in states:
        lowest = min((cost for cost, _ in reached), default=np.inf) if steps == ITERATIONS else np.inf
        lowest = min(lowest, bound)
        slopes = _slopes_of(known, blocks, state)
        end, cost = descend(candidate, blocks, noise, state, steps, rival=lowest + UNDECIDED, slopes=slopes)
        reached.append((cost, end))
        if cost > bound and end is state:
            break
    return sorted(reached, key=lambda pair: pair[0])


def _slopes_of(known: Fit | None, blocks: Sequence[Block], state: State) -> list[Array] | None:
    """Return derivatives by the effects of a fit, at its parameters and the runs' unknowns of a state."""
    if known is None or not known.theta.size:
        return None
    own = {run: values[: len(known.nuisance[run])] for run, values in state.nuisance.items()}
    return effect_slopes(known.candidate, blocks, State(known.theta, known.beta, own))


def cost_under(fitted: Fit, noise: Noise) -> float:
    """Return the cost of a fit under another noise: twice the negative logarithm of likelihood and prior."""
    state = State(fitted.theta, fitted.beta, dict(fitted.nuisance))
    return linearised(fitted.candidate, fitted.blocks, noise, state, derivatives="none").cost


def refit(start: Fit, blocks: Sequence[Block], prior: Noise) -> Fit:
    """Fit the same candidate to other blocks, from where ``start`` ended (leave-one-condition-out).

    The derivatives are those of ``start`` as long as steps keep much of their promise.
    """
    nuisance = {run: value.copy() for run, value in start.nuisance.items()}
    state = State(start.theta.copy(), start.beta.copy(), nuisance)
    slopes = effect_slopes(start.candidate, blocks, state)
    noise = _reestimated(start.candidate, blocks, prior, start.noise, state)
    state, _ = descend(start.candidate, blocks, noise, state, slopes=slopes, trusted=True)
    end = end_of(start.candidate, blocks, noise, state, slopes if _near(start, state) else None)
    return _finished(start.candidate, blocks, noise, state, end)


def _near(start: Fit, state: State) -> bool:
    """Whether the effect parameters are within a standard deviation of where they were."""
    sd = np.sqrt(np.diag(start.covariance)[len(start.beta) :])
    return bool((np.abs(state.theta - start.theta) <= sd).all())


def polished(fitted: Fit) -> Fit:
    """Follow a fit from where its likelihood says no more to where its parameters have all their digits."""
    state = State(fitted.theta, fitted.beta, dict(fitted.nuisance))
    state = polish(fitted.candidate, fitted.blocks, fitted.noise, state)
    end = end_of(fitted.candidate, fitted.blocks, fitted.noise, state)
    return _finished(fitted.candidate, fitted.blocks, fitted.noise, state, end)


def score(fitted: Fit, blocks: Sequence[Block]) -> Fit:
    """Evaluate a fit on blocks it has not seen: only their nuisances are estimated, nothing else moves.

    It is kept: the verdict and the story of the search ask for the same trials.
    """
    return _scored(fitted, tuple(blocks))


@lru_cache(maxsize=64)
def _scored(fitted: Fit, blocks: tuple[Block, ...]) -> Fit:
    candidate, noise = fitted.candidate, fitted.noise
    model = candidate.model(fitted.theta)
    state = State(fitted.theta, fitted.beta, {})
    for block in blocks:
        starts = model.nuisance_starts(block)
        states = [State(state.theta, state.beta, {block.run: start}) for start in starts]
        left = costs(model, block, noise, state.beta, starts).tolist()
        near = _distinct(sorted(zip(left, states, strict=True), key=lambda one: one[0]), ALIKE * min(left))
        state.nuisance |= _own_lowest(candidate, block, noise, near[:FOLLOWED]).nuisance
    end = End(fitted.covariance, fitted.wider, fitted.pressed, fitted.step, fitted.condition)
    return _finished(candidate, blocks, noise, state, end)


def _own_lowest(candidate: Candidate, block: Block, noise: Noise, states: Sequence[State]) -> State:
    """Follow each state of a block's own unknowns down, as long as it may come below those before it."""
    lowest, best = np.inf, states[0]
    for state in states:
        end, cost = descend(candidate, [block], noise, state, own=True, rival=lowest)
        if cost < lowest:
            lowest, best = cost, end
    return best


def _refined(
    candidate: Candidate,
    blocks: Sequence[Block],
    prior: Noise,
    noise: Noise,
    state: State,
    *,
    rounds: int,
    least: float = -np.inf,
) -> Fit:
    """Re-estimate the noise from the residual and descend, in turn, until that gains next to nothing.

    Or until it gains so little that the log-likelihood would stay below ``least`` if it went on like that.
    """
    before, rival = np.inf, -2.0 * least
    for _ in range(rounds):
        noise = _reestimated(candidate, blocks, prior, noise, state)
        state, cost = descend(candidate, blocks, noise, state, rival=rival)
        if before - cost < max(SETTLED, (cost - rival) / HOPE):
            break
        before = cost
    return _finished(candidate, blocks, noise, state, end_of(candidate, blocks, noise, state))


def _reestimated(
    candidate: Candidate, blocks: Sequence[Block], prior: Noise, noise: Noise, state: State
) -> Noise:
    # It takes numba, which a prediction of a robot or a face by a known fit does without.
    from metro.loop.fitting.reestimate import reestimated

    return reestimated(candidate, blocks, prior, noise, state)


def _finished(candidate: Candidate, blocks: Sequence[Block], noise: Noise, state: State, end: End) -> Fit:
    system = linearised(candidate, blocks, noise, state, derivatives="none")
    elements = {block.run: len(block.measured) for block in blocks}
    return Fit(
        candidate, state.theta, state.beta, dict(state.nuisance), noise, *end,
        system.log_likelihood, system.chi2, elements, tuple(blocks),
    )  # fmt: skip
