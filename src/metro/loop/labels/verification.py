"""Verification by labels: how surprising the held-out tests are, which decides no cause."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.loop.labels.problem import tests_of
from metro.loop.labels.search import LabelOutcome, Weighed
from metro.loop.labels.surprise import surprise
from metro.loop.search.trial import Gates
from metro.loop.statement import Statement
from metro.loop.verdict.verdict import DRAWS
from metro.observables.labelled import Labelled
from metro.units import JSON, Array

SIGNIFICANT = 0.01  # chance of labels as unlikely, below which they contradict a hypothesis


def log_likelihood(label: Array, probability: Array) -> Array:
    """Log-likelihood of labels, (…, n) → (…,); the probabilities (n,) are kept off 0 and 1 by 1e-3."""
    p = np.clip(probability, 1e-3, 1.0 - 1e-3)
    return np.asarray(np.sum(np.where(label > 0.5, np.log(p), np.log1p(-p)), axis=-1))


def surprise_alone(label: Array, probability: Array, seed: int) -> float:
    """Probability that labels drawn one by one are at least as unlikely as those measured."""
    drawn = np.random.default_rng(seed).random((DRAWS, len(label))) < probability
    unlikelier = (
        log_likelihood(drawn.astype(float), probability) <= log_likelihood(label, probability) + 1e-12
    )
    return float((1 + np.count_nonzero(unlikelier)) / (1 + DRAWS))


def verification(rows: pd.DataFrame, gates: Gates, surprises: tuple[float, float] | None = None) -> JSON:
    """Compare the held-out tests with what is predicted of them.

    Parameters
    ----------
    rows : of the comparison, measured, before and after. surprises : of the tests before and after, where
        hypotheses with all their errors predict them; None: by the probabilities of the rows alone.
    """
    label = rows["measured"].to_numpy(float)
    if surprises is None:
        before, after = (
            surprise_alone(label, rows[name].to_numpy(float), gates.seed) for name in ("before", "after")
        )
    else:
        before, after = surprises
    right = int(np.sum(np.abs(label - rows["after"].to_numpy(float)) < 0.5))
    holds = after >= SIGNIFICANT
    values: JSON = {"tests": len(label), "right": right, "p_value": after, "before": before, "holds": holds}
    return {
        "ratio": None,
        "p_value": after,
        "holds": holds,
        "worse_runs": [],
        "words": Statement("verification_of_labels", values),
    }


def of_hypotheses(
    task: Labelled, outcome: LabelOutcome, lead: Weighed | None, gates: Gates
) -> tuple[float, float]:
    """Return how surprising the held-out tests are under nothing, and under the lead (None: nothing)."""
    tests, _ = tests_of(task, "validate")
    first, second = (
        surprise(tests, one.hypothesis, outcome.evidence.errors, gates.seed)
        for one in (outcome.weighed[0], lead or outcome.weighed[0])
    )
    return first, second
