"""The labelled tests of a problem, as the loop weighs them: by role, at places whose modes are known."""

from __future__ import annotations

import numpy as np

from metro.loop.labels.evidence import Labels
from metro.observables.labelled import Labelled


def tests_of(problem: Labelled, role: str) -> tuple[Labels, tuple[str, ...]]:
    """Return the tests of a role at places whose modes are known, and their runs."""
    which = (np.array(problem.roles) == role) & (problem.point >= 0)
    return _labels(problem).take(which), tuple(np.array(problem.runs, dtype=object)[which])


def every_test(problem: Labelled) -> Labels:
    """Return all tests at places whose modes are known, of any role."""
    return _labels(problem).take(problem.point >= 0)


def _labels(problem: Labelled) -> Labels:
    return Labels(
        problem.point,
        np.log(problem.depth),
        problem.unstable.astype(float),
        problem.chatter_hz,
        problem.point_rpm,
        problem.point_tooth_hz,
        problem.model_sd,
        problem.label_error,
        problem.point_cut,
    )
