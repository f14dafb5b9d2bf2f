"""Whether labels contradict a hypothesis: against labels drawn from it with all its errors.

What a model gets wrong is the same in many tests: labels of one speed, and of all, are wrong together. Drawn
one by one they would be too seldom wrong by chance, and tests that are each a little unlikely, but all the
same way, would not count.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.loop.labels.evidence import OF_SPEED, OF_TEST, Errors, Labels, Likelihood, log_evidence
from metro.loop.labels.hypotheses import Hypothesis
from metro.units import Array

DRAWS = 400  # sets of labels: a p-value of 0.01 is known to 0.005
_BOUNDARIES = 12  # of a hypothesis, by their weights


def drawn(tests: Labels, boundary: Array, sd: float, rng: np.random.Generator) -> Array:
    """Labels (n,) of tests about a ``boundary`` (p,) in log depth, with errors of speeds and of tests.

    ``sd``: of all four parts of the error.
    """
    at = boundary + sd * OF_SPEED**0.5 * rng.standard_normal(len(boundary))
    at = at[tests.point] + sd * OF_TEST**0.5 * rng.standard_normal(len(tests.point))
    wrong = rng.random(len(at)) < tests.label_error
    return np.asarray((tests.depth > at) ^ wrong, dtype=float)


def surprise(tests: Labels, mine: Hypothesis, errors: Errors, seed: int) -> float:
    """Probability that labels drawn from a hypothesis are at least as unlikely as those measured.

    The model's errors are as large as is usual: where they are larger, something is missing. Labels are drawn
    from other boundaries of the hypothesis than those by which they are weighed, as the measured ones are:
    where its parameters leave many, labels look too likely by the very boundary that they were drawn from.
    """
    if not len(tests.depth):
        return 1.0
    rng, errors = np.random.default_rng([seed, 3]), errors.of_size(tests.model_sd)
    chosen = rng.choice(len(mine.prior), size=min(_BOUNDARIES, len(mine.prior)), p=mine.weights)
    others = rng.choice(len(mine.prior), size=DRAWS, p=mine.weights)
    depth = mine.depth[chosen]
    silent = replace(tests, chatter_hz=np.full(len(tests.depth), np.nan))
    places = [tests.point == point for point in np.unique(tests.point)]
    known: dict[tuple[int, bytes], Array] = {}  # log-likelihood (t, s, 1) of labels of a place

    def evidence(labels: Array) -> float:
        here = [(i, labels[place].tobytes()) for i, place in enumerate(places)]
        for key in here:
            if key not in known:
                place = silent.take(places[key[0]])
                labelled = replace(place, unstable=labels[places[key[0]]])
                known[key] = Likelihood.of(labelled, errors)(depth, depth)
        total = np.sum([known[key] for key in here], axis=0)
        return log_evidence(total, np.full(len(depth), 1.0 / len(depth)))

    measured = evidence(tests.unstable)
    below = 0
    for other in mine.depth[others]:
        one = rng.integers(len(errors.sd))
        boundary = other + errors.deviations[one]
        below += evidence(drawn(tests, boundary, float(errors.sd[one]), rng)) <= measured + 1e-9
    return (1 + below) / (1 + DRAWS)
