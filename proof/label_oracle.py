"""The oracle where the measurement is a label: what a reader who knows the true effects could predict.

As everywhere the oracle knows which effects act, and learns their parameters from the identification tests.
How large the effects are is judged with their true parameters: boundaries are predicted with the batch's own
modes and coefficients, and labels are drawn from them with the errors that are usual in the loop.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from metro.dynamics.stability_model import StabilityModel
from metro.effects.effect import Effect, fitted_to
from metro.loop.labels.evidence import (
    FREQUENCY_SD,
    LINES,
    SIZES,
    STRAY,
    STRAY_WIDTH,
    Errors,
    Labels,
    Likelihood,
    drawn_errors,
    log_evidence,
    unstable_probability,
)
from metro.loop.labels.hypotheses import LabelEvidence, hypothesis
from metro.loop.labels.problem import every_test, tests_of
from metro.loop.labels.search import LEAST_SPEEDS, LEAST_TESTS, predicted
from metro.loop.labels.surprise import drawn as labels_drawn
from metro.observables.labelled import Labelled
from metro.observables.stability.problem import LabelProblem
from metro.units import JSON, Array
from proof.score import forms

DEVIATIONS, DRAWS, ASSURED = 128, 100, 0.05
LONG, ALARM = 400, 0.01  # draws for, and the share of, what is unlikely by chance
SEED = 11


@dataclass(frozen=True)
class _Boundary:
    """Log depth and chatter frequency (Hz) at all points, each (p,)."""

    depth: Array
    chatter: Array


def label_oracle(
    task: LabelProblem,
    hidden: Mapping[str, JSON],
    effects: Sequence[Effect],
    gain: float,
    also: Mapping[str, JSON | list[JSON]] | None = None,
) -> JSON:
    """Compute how large the hidden effects are, and how well held-out labels can be predicted.

    Parameters
    ----------
    hidden : true effects and their parameters, as in the contract's table.
    effects : the library.
    gain : log-likelihood that an effect must gain, in the loop.
    also : what a cell always has a little of: it acts beside the hidden effects, and its size is not asked.

    Returns
    -------
    ``before`` and ``after`` (rms error of the probability of the held-out labels without the effects, and
    with them, their parameters from the identification tests), ``exact`` (with the true parameters),
    ``floor`` (that of labels drawn from these), ``enough`` (whether there are tests enough for any verdict),
    and ``sizes``: the log-likelihood ratio, with the effect at its true parameters over without, that 95 % of
    identification labels drawn from the truth exceed, over ``gain``. Where the library lacks one of the
    effects: ``after`` is None, and the size is by how much less likely all labels are than those that the
    base model would draw, over the amount by which one set in a hundred is less likely by chance.
    """
    able, _ = fitted_to(tuple(effects), task)
    known = {effect.name: effect for effect in able}
    mine, _ = tests_of(task, "identify")
    held, _ = tests_of(task, "validate")
    errors = usual_errors(task, SEED)
    base = _boundary_of(task, known, {})
    counts = (len(mine.depth), len(held.depth))
    result: JSON = {"enough": min(counts) >= LEAST_TESTS and len(mine.speeds) >= LEAST_SPEEDS}
    if not counts[0]:
        return result | dict.fromkeys(("before", "after", "floor")) | {"sizes": dict.fromkeys(hidden, 0.0)}
    if set(hidden) - set(known):
        every = every_test(task)
        drawn = [_evidence(one, base, errors) for one in _drawn(task, every, base, LONG)]
        usual, chance = float(np.mean(drawn)), float(np.quantile(drawn, ALARM))
        size = (usual - _evidence(every, base, errors)) / (usual - chance)
        before, floor = _errors(held, base, errors)
        sizes = dict.fromkeys(hidden, max(0.0, size))
        return result | {"before": before, "after": None, "floor": floor, "sizes": sizes}
    # A boundary has no joints: what is always there has one form.
    always = {name: forms(values)[0] for name, values in (also or {}).items() if name in known}
    truth = _boundary_of(task, known, {**hidden, **always})
    drawn_labels = _drawn(task, mine, truth, DRAWS)
    full = np.array([_evidence(one, truth, errors) for one in drawn_labels])
    sizes = {}
    for name in hidden:
        others = {other: values for other, values in hidden.items() if other != name}
        without = _boundary_of(task, known, {**others, **always})
        ratio = full - [_evidence(one, without, errors) for one in drawn_labels]
        sizes[name] = max(0.0, float(np.quantile(ratio, ASSURED))) / gain
    before, _ = _errors(held, base, errors)
    exact, floor = _errors(held, truth, errors)
    after = _rms(held, _learnt(task, [known[name] for name in (*hidden, *always)], held, errors))
    return result | {"before": before, "after": after, "exact": exact, "floor": floor, "sizes": sizes}


def _learnt(task: LabelProblem, effects: Sequence[Effect], held: Labels, errors: Errors) -> Array:
    """Probability that held-out tests are unstable, with parameters learnt from the identification tests."""
    evidence = LabelEvidence(task.boundaries, task.estimates, tests_of(task, "identify")[0], errors, SEED)
    learnt = hypothesis((effects[0],), evidence)
    for count in range(2, len(effects) + 1):
        learnt = hypothesis(tuple(effects[:count]), evidence, learnt)
    return predicted(learnt, held, errors)


def usual_errors(task: Labelled, seed: int) -> Errors:
    """Draw errors of the models, of the usual size."""
    every = task.deviations(DEVIATIONS * len(SIZES), seed)
    return drawn_errors(every_test(task), every, seed).of_size(task.model_sd)


def _boundary_of(task: LabelProblem, known: Mapping[str, Effect], hidden: Mapping[str, JSON]) -> _Boundary:
    """Boundary of the batch's model with effects at their true parameters."""
    changes = [_change(known[name], values) for name, values in hidden.items()]

    def change(model: StabilityModel) -> StabilityModel:
        for one in changes:
            model = one(model)
        return model

    return _Boundary(*(part[0] for part in task.boundaries([change])))


def _change(effect: Effect, values: JSON) -> Callable[[StabilityModel], StabilityModel]:
    numbers = effect.spread(values)
    return lambda model: effect.apply(model, numbers)


def _evidence(tests: Labels, boundary: _Boundary, errors: Errors) -> float:
    likelihood = Likelihood.of(tests, errors)(boundary.depth[None], boundary.chatter[None])
    return log_evidence(likelihood, np.ones(1))


def _drawn(task: LabelProblem, tests: Labels, truth: _Boundary, draws: int) -> list[Labels]:
    """Return the tests with labels drawn from the truth; with frequencies where records gave any."""
    rng = np.random.default_rng([SEED, 2])
    heard = bool(np.isfinite(task.chatter_hz).any())
    size = len(tests.depth)
    errors = usual_errors(task, SEED + 1)
    drawn = []
    for _ in range(draws):
        boundary = truth.depth + errors.deviations[rng.integers(DEVIATIONS)]
        unstable = labels_drawn(tests, boundary, task.model_sd, rng) > 0.5
        stray = rng.random(size) < STRAY
        spread = np.where(
            stray,
            STRAY_WIDTH * rng.uniform(-0.5, 0.5, size),
            FREQUENCY_SD * rng.standard_normal(size),
        )
        line = rng.choice(list(LINES), size=size, p=list(LINES.values()))
        heard_at = np.abs(truth.chatter[tests.point] + np.where(stray, 0, line) * tests.tooth_hz[tests.point])
        chatter = np.where(unstable & heard, heard_at * np.exp(spread), np.nan)
        drawn.append(replace(tests, unstable=unstable.astype(float), chatter_hz=chatter))
    return drawn


def _errors(held: Labels, boundary: _Boundary, errors: Errors) -> tuple[float | None, float | None]:
    """Rms error of the predicted probability of held-out labels, and what it would be of drawn ones."""
    if not len(held.depth):
        return None, None
    depth = boundary.depth[held.point] + errors.deviations[:, held.point]
    chance = unstable_probability(held, depth, errors.own_sd[:, None]).mean(axis=0)
    return _rms(held, chance), float(np.sqrt(np.mean(chance * (1.0 - chance))))


def _rms(held: Labels, chance: Array) -> float | None:
    return float(np.sqrt(np.mean((held.unstable - chance) ** 2))) if len(held.depth) else None
