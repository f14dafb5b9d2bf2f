"""The verdict where the measurement is a label: stable or unstable, against a predicted probability.

Nothing is fitted to labels, so there is no joint refit: the residual is the likelihood of the labels under
the predicted
probabilities, judged against what those probabilities themselves would let one expect.
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
    """Logarithm of the likelihood of labels, (…, n) → (…,); probabilities (n,) are kept off 0 and 1 by
    1e-3.
    """
    p = np.clip(probability, 1e-3, 1.0 - 1e-3)
    return np.asarray(np.sum(np.where(label > 0.5, np.log(p), np.log1p(-p)), axis=-1))


def surprise(label: Array, probability: Array, seed: int) -> float:
    """Probability that labels drawn from the prediction are at least as unlikely as those measured."""
    drawn = np.random.default_rng(seed).random((DRAWS, len(label))) < probability
    found = log_likelihood(drawn.astype(float), probability) <= log_likelihood(label, probability) + 1e-12
    return float((1 + np.count_nonzero(found)) / (1 + DRAWS))


def judge_labels(task: Labelled, rows: pd.DataFrame, gates: Gates) -> tuple[pd.DataFrame, JSON, JSON]:
    """Return comparison rows, the entry of verdict.json and the entry of loop.json for tests with labels."""
    rows = rows.assign(after=rows["before"])
    label, probability = rows["measured"].to_numpy(float), rows["before"].to_numpy(float)
    p_value = surprise(label, probability, gates.seed) if len(rows) else 1.0
    wrong = rows["run"][np.abs(label - probability) > 0.5].tolist()
    significant = p_value < SIGNIFICANT
    status = "insufficient" if len(rows) < LEAST_TESTS else "unexplained" if significant else "clean"
    figures = error(rows, "before", gates.seed) if len(rows) else None
    floor = float(np.sqrt(np.mean(probability * (1.0 - probability)))) if len(rows) else None
    left = {
        "rms": figures["rms"] if figures else None,
        "unit": "1",
        "signature": f"labels against the predicted boundary in {len(wrong)} of {len(rows)} tests: {', '.join(wrong)}",
    }
    verdict: JSON = {
        "status": status,
        "unit": "1",
        "noise_floor": floor,
        "held_out_runs": rows["run"].tolist(),
        "before": figures,
        "after": figures,
        "effects": [],
        "candidates": [],
        "indistinguishable": [],
        "next_experiment": _next_test(rows)
        if status != "unexplained"
        else "tests beside the ones that disagree",
        "unexplained": left if status == "unexplained" else None,
    }
    story: JSON = {
        "unit": "1",
        "notes": list(task.notes),
        "noise": {"floor": floor, "budget": gates.budget, "words": _noise_words(len(rows), p_value)},
        "candidates": [],
        "path": [],
        "signature": [],
        "cannot_be_seen": [],
        "blocks": [],
        "words": in_words(verdict),
    }
    return rows, verdict, story


def _noise_words(tests: int, p_value: float) -> str:
    return (
        f"{tests} held-out tests; labels drawn from the predicted probabilities would be as unlikely as those measured with "
        f"probability {p_value:.2g}."
    )


def _next_test(rows: pd.DataFrame) -> str:
    """Return what to test next: where the prediction says least."""
    if rows.empty:
        return (
            "tests with a stable or unstable label, two depths at each of three speeds, half of them held out"
        )
    closest = rows.iloc[int(np.argmin(np.abs(rows["before"].to_numpy() - 0.5)))]
    return f"a test beside run {closest['run']}, where the prediction is least sure (P unstable = {closest['before']:.2f})"
