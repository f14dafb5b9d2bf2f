"""The study behind docs/robot.md: intervals of the sensorless force, by rule, on simulated batches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sensorless_study import RULES, study

PAPER, ONE_WALK, REPORT = RULES
PAGE = (Path(__file__).parents[2] / "docs/robot.md").read_text(encoding="utf-8")


def held(tally):
    return float(np.mean(tally.mean_held)), float(np.mean(tally.place_held))


def test_friction_that_differs_widens_the_interval_as_much_as_it_errs():
    """Cut and idle run differ by 5 % of the Coulomb level: intervals by noise alone miss nearly always."""
    tallies, _ = study(1, 0.05)
    assert min(held(tallies[REPORT])) > 0.85
    assert held(tallies[ONE_WALK])[0] < 0.4
    refused = tallies[PAPER].refused
    assert 0 < sum(refused) < len(refused) == 12


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "place"), [(0.0, 0.97), (0.02, 0.96), (0.05, 0.93)])
def test_the_intervals_of_the_report_hold_the_truth(friction, place):
    """At rest they are the wider by the tenth of the noise that friction is granted."""
    tallies, white = study(25, friction)
    of_mean, of_place = held(tallies[REPORT])
    assert of_mean > 0.94
    assert of_place > place
    assert np.mean(white < 0.05) < 0.085
    errors = {rule: np.sqrt(np.mean(np.square(tally.error), axis=0)) for rule, tally in tallies.items()}
    assert (errors[REPORT] < errors[PAPER]).all()
    row = f"| {friction:.0%} | {REPORT} | 0% | " + ", ".join(f"{value:.2f}" for value in errors[REPORT])
    assert row in PAGE
