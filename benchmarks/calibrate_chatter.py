"""Fit the probability of chatter on simulated tests, and print the constants of ``metro.signals.chatter``.

``python benchmarks/calibrate_chatter.py``: :mod:`chatter_trials` makes 75 tests of tools with two, three,
four and six teeth each; those on the boundary and those that flip in step with the spindle are left out. A
logistic regression, drawn weakly towards nothing, weighs evidence, line and side bands.
"""

import numpy as np
from chatter_trials import TEETH, settings, trials

from metro.signals import chatter, chatter_signs
from metro.signals.asynchronous import windows

SEED, COUNT = 101, 75
TOWARDS_NOTHING = 0.3  # precision of the weights' prior


def features(test):
    """Evidence within its limits, share of the line that keeps its frequency, share with side bands."""
    seen = windows(test.time, test.angle, test.signal)
    order = chatter_signs.line(seen)
    bands = chatter_signs.side_bands(seen, order, test.setting.teeth)
    within = np.clip(chatter.evidence(seen.energy_ratio), *chatter.LIMITS)
    return within, chatter_signs.kept_frequency(seen, order)[1], bands.mean()


def fitted(told, unstable):
    """Weights (4,), the constant first, of a logistic regression of labels (n,) on features (n, 3)."""
    design = np.column_stack([np.ones(len(told)), told])
    prior = TOWARDS_NOTHING * np.diag([0.0, 1.0, 1.0, 1.0])
    weights = np.zeros(4)
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-design @ weights))
        bend = (design * (p * (1.0 - p))[:, None]).T @ design + prior
        weights += np.linalg.solve(bend, design.T @ (unstable - p) - prior @ weights)
    return weights


def main():
    made = [test for teeth in TEETH for test in trials(settings(COUNT, teeth, SEED), SEED)]
    used = [test for test in made if test.unstable >= 0 and not test.locked]
    weights = fitted(np.array([features(test) for test in used]), np.array([test.unstable for test in used]))
    print(f"{len(used)} of {len(made)} tests, {sum(test.unstable for test in used)} of them chatter")
    for name, value in zip(("ALONE", "PER_LOGIT", "PER_KEPT", "PER_SIDE_BANDS"), weights, strict=True):
        print(f"{name:15} {value:6.2f}   in the code {getattr(chatter, name):6.2f}")


if __name__ == "__main__":
    main()
