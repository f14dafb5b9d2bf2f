"""The verdict where the measurement is a label: stable or unstable, against a predicted probability.

Nothing is fitted to labels, so there is no joint refit: the residual is the likelihood of the labels under
the predicted probabilities, judged against what those probabilities themselves would let one expect.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import pandas as pd

from metro.loop.search import Gates
from metro.loop.story import in_words
from metro.loop.verdict import DRAWS, error
from metro.units import JSON, Array

LEAST_TESTS = 6
SIGNIFICANT = 0.01


class Labelled(Protocol):
    """What the verdict needs of a problem of labels."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What the problem left out or assumed."""
        ...


def log_likelihood(label: Array, probability: Array) -> Array:
    """Log-likelihood of labels, (…, n) → (…,); the probabilities (n,) are kept off 0 and 1 by 1e-3."""
    p = np.clip(probability, 1e-3, 1.0 - 1e-3)
    return np.asarray(np.sum(np.where(label > 0.5, np.log(p), np.log1p(-p)), axis=-1))


def surprise(label: Array, probability: Array, seed: int) -> float:
    """Probability that labels drawn from the prediction are at least as unlikely as those measured."""
    drawn = np.random.default_rng(seed).random((DRAWS, len(label))) < probability
    found = log_likelihood(drawn.astype(float), probability) <= log_likelihood(label, probability) + 1e-12
    return float((1 + np.count_nonzero(found)) / (1 + DRAWS))


def judge_labels(
    task: Labelled, rows: pd.DataFrame, upstream: list[JSON], gates: Gates
) -> tuple[pd.DataFrame, JSON, JSON]:
    """Judge tests with labels: comparison rows, entry of verdict.json, entry of loop.json.

    Parameters
    ----------
    rows : comparison rows of the held-out tests; ``after`` is predicted with the coefficients as they are
        when the effects found in the cutting force are known.
    upstream : those effects. They are what explains the labels where the prediction contradicts these without
        them only.
    """
    label = rows["measured"].to_numpy(float)
    before, after = rows["before"].to_numpy(float), rows["after"].to_numpy(float)
    p_before, p_after = (surprise(label, p, gates.seed) if len(rows) else 1.0 for p in (before, after))
    explains = p_before < SIGNIFICANT <= p_after
    status = _status(len(rows), p_after < SIGNIFICANT, explains)
    wrong = rows["run"][np.abs(label - after) > 0.5].tolist()
    left = f"labels against the predicted boundary in {len(wrong)} of {len(rows)} tests: {', '.join(wrong)}"
    figures = {
        column: error(rows, column, gates.seed) if len(rows) else None for column in ("before", "after")
    }
    floor = float(np.sqrt(np.mean(after * (1.0 - after)))) if len(rows) else None
    verdict: JSON = {
        "status": status,
        "unit": "1",
        "noise_floor": floor,
        "held_out_runs": rows["run"].tolist(),
        **figures,
        "effects": upstream if explains else [],
        "candidates": [],
        "indistinguishable": [],
        "next_experiment": _next_test(rows),
        "unexplained": None,
    }
    if status == "unexplained" and figures["after"]:
        verdict["unexplained"] = {"rms": figures["after"]["rms"], "unit": "1", "signature": left}
    story: JSON = {
        "unit": "1",
        "notes": list(task.notes),
        "noise": {
            "floor": floor,
            "budget": gates.model_form_budget,
            "words": _noise_words(len(rows), p_before, p_after),
        },
        "candidates": [],
        "path": [],
        "signature": [],
        "cannot_be_seen": [],
        "blocks": [],
        "words": in_words(verdict),
    }
    return rows, verdict, story


def _status(tests: int, contradicted: bool, explained: bool) -> str:
    if tests < LEAST_TESTS:
        return "insufficient"
    if contradicted:
        return "unexplained"
    return "explained" if explained else "clean"


def _noise_words(tests: int, before: float, after: float) -> str:
    return (
        f"{tests} held-out tests; labels drawn from the predicted probabilities would be as unlikely as "
        f"those measured with probability {before:.2g} for the base model and {after:.2g} with the "
        "coefficients refitted with the effects found in the cutting force."
    )


def _next_test(rows: pd.DataFrame) -> str:
    """Return what to test next: where the prediction says least."""
    if rows.empty:
        return (
            "tests with a stable or unstable label, two depths at each of three speeds, half of them held out"
        )
    closest = rows.iloc[int(np.argmin(np.abs(rows["after"].to_numpy() - 0.5)))]
    return (
        f"a test beside run {closest['run']}, where the prediction is least sure "
        f"(P unstable = {closest['after']:.2f})"
    )
