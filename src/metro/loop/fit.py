"""The joint fit: base parameters, effect parameters and every run's unknowns together, on the runs given.

Gauss–Newton with step control in all unknowns. The base parameters are linear, each run's nuisance (start
phase) touches only
its own block and is eliminated there, so the system that is solved has only base and effect parameters,
however many runs.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from metro.effects.effect import Effect, EffectParameter
from metro.loop import noise as noise_room
from metro.loop.noise import Noise
from metro.observables.problem import Block, Model
from metro.units import Array

ITERATIONS = 25
ENOUGH = 0.01  # gain in twice the log-likelihood below which a descent ends
FOLLOWED = 4
ROUNDS = 3
NUISANCE_STEP = 1e-4


@dataclass(frozen=True)
class Candidate:
    """A base model with effects on it, ready to be given parameter values."""

    base: Model
    effects: tuple[Effect, ...] = ()

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """Parameters of all effects, in order."""
        return tuple(itertools.chain.from_iterable(effect.parameters for effect in self.effects))

    def model(self, theta: Array) -> Model:
        """Apply the effects with the parameter values ``theta``, in the units of the contract."""
        model, values = self.base, list(theta)
        for effect in self.effects:
            taken = {parameter.name: float(values.pop(0)) for parameter in effect.parameters}
            model = effect.apply(model, taken)
        return model


@dataclass(frozen=True)
class Fit:
    """A fitted candidate.

    Attributes
    ----------
    theta, beta : effect parameters (units of the contract), base parameters (SI).
    nuisance : each block's nonlinear unknowns, by run.
    covariance : of ``[beta, theta]``, for a dispersion of one.
    log_likelihood : marginal, by run; ``chi2`` and ``elements``: whitened sum of squares and count, by run.
    """

    candidate: Candidate
    theta: Array
    beta: Array
    nuisance: Mapping[str, Array]
    noise: Noise
    covariance: Array
    log_likelihood: Mapping[str, float]
    chi2: Mapping[str, float]
    elements: Mapping[str, int]
    blocks: tuple[Block, ...] = field(repr=False)

    @property
    def total(self) -> float:
        """Log-likelihood of all blocks."""
        return sum(self.log_likelihood.values())

    @property
    def log_prior(self) -> float:
        """Logarithm of the weak prior of the effect parameters, up to a constant."""
        pairs = zip(self.candidate.parameters, self.theta, strict=True)
        return -0.5 * sum((value / p.plausible) ** 2 for p, value in pairs if p.plausible is not None)

    @property
    def dispersion(self) -> float:
        """Whitened mean square of the rest, at least one: how much worse than the noise the fit is."""
        return max(
            1.0,
            sum(self.chi2.values()) / max(1, sum(self.elements.values()) - len(self.beta) - len(self.theta)),
        )

    def predict(self, block: Block) -> Array:
        """Prediction of a block of this fit in the fit's basis, (n,) SI."""
        matrix, offset = self.candidate.model(self.theta).design(block, self.nuisance[block.run])
        return offset + matrix @ self.beta


@dataclass
class _State:
    theta: Array
    beta: Array
    nuisance: dict[str, Array]


def fit(candidate: Candidate, blocks: Sequence[Block], prior: Noise, start: Fit | None = None) -> Fit:
    """Fit a candidate to blocks: base parameters, effect parameters and nuisances jointly.

    ``start``, a fit of the same or of a simpler candidate, gives the base parameters and the noise to begin
    with; effect
    parameters that it lacks are started from all combinations of their starting values, and the best few are
    followed.
    """
    noise = start.noise if start else prior
    known = start.theta if start else np.zeros(0)
    fresh = candidate.parameters[len(known) :]
    beta = start.beta if start else _first_beta(candidate, blocks, noise)
    around = start.nuisance if start and fresh else None
    trials = []
    for combination in itertools.product(*(parameter.starts for parameter in fresh)):
        state = _State(np.concatenate([known, combination]), beta.copy(), {})
        trials.append((_search_nuisance(candidate, blocks, noise, state, around), len(trials), state))
    trials.sort(key=lambda trial: trial[:2])
    followed = [_descended(candidate, blocks, noise, state) for _, _, state in trials[: FOLLOWED if fresh else 1]]
    best = min(followed, key=lambda state: _linearised(candidate, blocks, noise, state, derivatives=False).cost)
    return _refined(candidate, blocks, prior, noise, best, ROUNDS)


def refit(start: Fit, blocks: Sequence[Block], prior: Noise) -> Fit:
    """Fit the same candidate to other blocks, from where ``start`` ended (leave-one-condition-out)."""
    state = _State(
        start.theta.copy(), start.beta.copy(), {run: value.copy() for run, value in start.nuisance.items()}
    )
    return _refined(start.candidate, blocks, prior, start.noise, state, 1)


def score(fitted: Fit, blocks: Sequence[Block]) -> Fit:
    """Evaluate a fit on blocks it has not seen: only their nuisances are estimated, nothing else moves."""
    state = _State(fitted.theta, fitted.beta, {})
    _search_nuisance(fitted.candidate, blocks, fitted.noise, state)
    for _ in range(8):
        system = _linearised(fitted.candidate, blocks, fitted.noise, state)
        for block, (rest, _, _, own) in zip(blocks, system.rows, strict=True):
            if own.shape[1]:
                state.nuisance[block.run] = (
                    state.nuisance[block.run] + np.linalg.lstsq(own, rest, rcond=None)[0]
                )
    return _finished(fitted.candidate, blocks, fitted.noise, state, fitted.covariance)


def linearised(
    candidate: Candidate,
    blocks: Sequence[Block],
    noise: Noise,
    theta: Array,
    beta: Array,
    nuisance: Mapping[str, Array],
) -> System:
    """Whitened rest and derivatives of every block at given values of everything."""
    return _linearised(candidate, blocks, noise, _State(theta, beta, dict(nuisance)))


def _first_beta(candidate: Candidate, blocks: Sequence[Block], noise: Noise) -> Array:
    """Base parameters with each block's nuisance at the start where the block alone is fitted best."""
    theta = np.array([parameter.starts[0] for parameter in candidate.parameters])
    model = candidate.model(theta)
    rows, right = [], []
    for block in blocks:
        weight = 1.0 / np.sqrt(noise_room.diagonal(block, noise))
        best, kept = np.inf, None
        for nuisance in model.nuisance_starts(block):
            matrix, offset = model.design(block, nuisance)
            scaled, target = matrix * weight[:, None], (block.measured - offset) * weight
            solution = np.linalg.lstsq(scaled, target, rcond=None)[0]
            cost = float(np.sum((target - scaled @ solution) ** 2))
            if cost < best:
                best, kept = cost, (scaled, target)
        if kept is not None:
            rows.append(kept[0])
            right.append(kept[1])
    return np.asarray(np.linalg.lstsq(np.vstack(rows), np.concatenate(right), rcond=None)[0])


def _search_nuisance(
    candidate: Candidate,
    blocks: Sequence[Block],
    noise: Noise,
    state: _State,
    around: Mapping[str, Array] | None = None,
) -> float:
    """Put each block's nuisance at the best of its starts for the state's parameters; return the cost.

    The starts are those of the model, or only the symmetric images of ``around``.
    """
    model = candidate.model(state.theta)
    total = 0.0
    for block in blocks:
        weight = 1.0 / np.sqrt(noise_room.diagonal(block, noise))
        best = np.inf
        for nuisance in _images(block, around[block.run]) if around else model.nuisance_starts(block):
            matrix, offset = model.design(block, nuisance)
            cost = float(np.sum(((block.measured - offset - matrix @ state.beta) * weight) ** 2))
            if cost < best:
                best, state.nuisance[block.run] = cost, np.asarray(nuisance, dtype=float)
        total += best
    return total


def _images(block: Block, nuisance: Array) -> Array:
    return nuisance[None] if block.symmetries is None else nuisance + block.symmetries


@dataclass(frozen=True)
class System:
    """Whitened rest, base columns, effect columns and own (nuisance) columns of each block, and the
    log-likelihoods.

    ``pull`` is the distance of the effect parameters from their weak prior's mean, zero, and ``weight`` its
    precision.
    """

    rows: list[tuple[Array, Array, Array, Array]]
    log_likelihood: dict[str, float]
    chi2: dict[str, float]
    pull: Array
    weight: Array

    @property
    def cost(self) -> float:
        """Twice the negative logarithm of likelihood times prior."""
        return float(self.pull @ (self.weight * self.pull)) - 2.0 * sum(self.log_likelihood.values())


def _prediction(model: Model, block: Block, nuisance: Array, beta: Array) -> Array:
    matrix, offset = model.design(block, nuisance)
    return offset + matrix @ beta


def _linearised(
    candidate: Candidate, blocks: Sequence[Block], noise: Noise, state: _State, derivatives: bool = True
) -> System:
    model = candidate.model(state.theta)
    shifted = []
    if derivatives:
        for i, parameter in enumerate(candidate.parameters):
            step = (
                1e-3
                * parameter.scale
                * (1.0 if state.theta[i] + 1e-3 * parameter.scale <= parameter.upper else -1.0)
            )
            moved = state.theta.copy()
            moved[i] += step
            shifted.append((candidate.model(moved), step))
    rows, log_likelihood, chi2 = [], {}, {}
    for block in blocks:
        nuisance = state.nuisance[block.run]
        matrix, offset = model.design(block, nuisance)
        predicted = offset + matrix @ state.beta
        directions = noise_room.shared(block, noise, matrix, state.beta)
        whiten = noise_room.whitener(noise_room.diagonal(block, noise), directions)
        rest = whiten(block.measured - predicted)
        chi2[block.run] = float(rest @ rest)
        log_likelihood[block.run] = -0.5 * (
            chi2[block.run] + whiten.log_shared + noise_room.log_scale(block, noise)
        )
        if derivatives:
            effect = [
                (_prediction(other, block, nuisance, state.beta) - predicted) / step
                for other, step in shifted
            ]
            own = [
                (_prediction(model, block, nuisance + NUISANCE_STEP * unit, state.beta) - predicted)
                / NUISANCE_STEP
                for unit in np.eye(len(nuisance))
            ]
            columns = [matrix.T, *(np.reshape(part, (-1, len(predicted))) for part in (effect, own))]
            whitened = whiten(np.vstack(columns).T)
            p, q = matrix.shape[1], len(effect)
            rows.append((rest, whitened[:, :p], whitened[:, p : p + q], whitened[:, p + q :]))
    weight = np.array([0.0 if p.plausible is None else p.plausible**-2 for p in candidate.parameters])
    return System(rows, log_likelihood, chi2, state.theta, weight)


def _step(system: System) -> tuple[Array, Array, list[Array], Array]:
    """Gauss–Newton step in base, effects and nuisances, and the normal matrix of base and effects."""
    normal, right = 0.0, 0.0
    for rest, base, effect, own in system.rows:
        columns = np.hstack([base, effect])
        if own.shape[1]:
            basis = np.linalg.qr(own)[0]
            columns = columns - basis @ (basis.T @ columns)
        normal = normal + columns.T @ columns
        right = right + columns.T @ rest
    p = system.rows[0][1].shape[1]
    normal[np.arange(p, len(normal)), np.arange(p, len(normal))] += system.weight
    right[p:] -= system.weight * system.pull
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    scaled = normal * scale[:, None] * scale[None, :]
    common = scale * np.linalg.lstsq(scaled, scale * right, rcond=1e-12)[0]
    each = []
    for rest, base, effect, own in system.rows:
        left = rest - np.hstack([base, effect]) @ common
        each.append(np.linalg.lstsq(own, left, rcond=None)[0] if own.shape[1] else np.zeros(0))
    return common[:p], common[p:], each, normal


def _moved(
    candidate: Candidate,
    blocks: Sequence[Block],
    state: _State,
    step: tuple[Array, Array, list[Array]],
    share: float,
) -> _State:
    theta = state.theta + share * step[1]
    for i, parameter in enumerate(candidate.parameters):
        if parameter.period:
            theta[i] = parameter.lower + (theta[i] - parameter.lower) % parameter.period
        else:
            theta[i] = min(max(theta[i], parameter.lower), parameter.upper)
    nuisance = {
        block.run: state.nuisance[block.run] + share * own for block, own in zip(blocks, step[2], strict=True)
    }
    return _State(theta, state.beta + share * step[0], nuisance)


def _refined(
    candidate: Candidate, blocks: Sequence[Block], prior: Noise, noise: Noise, state: _State, rounds: int
) -> Fit:
    """Descend from a state and re-estimate the noise from the rest, in turn."""
    for _ in range(rounds):
        noise = _reestimated(candidate, blocks, prior, noise, state)
        state = _descended(candidate, blocks, noise, state)
    normal = _step(_linearised(candidate, blocks, noise, state))[3]
    return _finished(candidate, blocks, noise, state, _inverse(normal))


def _descended(candidate: Candidate, blocks: Sequence[Block], noise: Noise, state: _State) -> _State:
    system = _linearised(candidate, blocks, noise, state)
    for _ in range(ITERATIONS):
        base, effect, own, _ = _step(system)
        for share in (1.0, 0.5, 0.25, 0.1, 0.02):
            trial = _moved(candidate, blocks, state, (base, effect, own), share)
            reached = _linearised(candidate, blocks, noise, trial, derivatives=False)
            if reached.cost < system.cost:
                break
        else:
            return state
        gain = system.cost - reached.cost
        state = trial
        if gain < ENOUGH:
            return state
        system = _linearised(candidate, blocks, noise, state)
    return state


def _reestimated(
    candidate: Candidate, blocks: Sequence[Block], prior: Noise, noise: Noise, state: _State
) -> Noise:
    model = candidate.model(state.theta)
    for _ in range(8):
        parts = []
        for block in blocks:
            matrix, offset = model.design(block, state.nuisance[block.run])
            rest = block.measured - offset - matrix @ state.beta
            parts.append((block, rest, noise_room.shared(block, noise, matrix, state.beta)))
        noise = noise_room.updated(noise, prior, parts)
    return noise


def _inverse(normal: Array) -> Array:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    scaled = normal * scale[:, None] * scale[None, :]
    return np.asarray(scale[:, None] * np.linalg.pinv(scaled, rcond=1e-12) * scale[None, :])


def _finished(
    candidate: Candidate, blocks: Sequence[Block], noise: Noise, state: _State, covariance: Array
) -> Fit:
    system = _linearised(candidate, blocks, noise, state, derivatives=False)
    elements = {block.run: len(block.measured) for block in blocks}
    return Fit(
        candidate, state.theta, state.beta, dict(state.nuisance), noise, covariance,
        system.log_likelihood, system.chi2, elements, tuple(blocks),
    )  # fmt: skip
