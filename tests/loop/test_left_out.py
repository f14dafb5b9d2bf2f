"""Conditions left out: each by a fit that has not seen it, a dozen fits however many there are."""

import numpy as np
import pytest
from toy import GATES, problem

from metro.loop.checks import left_out as room
from metro.loop.checks.left_out import MOST_FITS, left_out
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise


def fitted(conditions):
    """Fit of the base model to one run in each of so many conditions."""
    task = problem(5, phased=False, repeats=1, feeds=tuple(np.linspace(1.0, 4.0, conditions)))
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    return fit(Candidate(task.base), blocks, prior), prior


@pytest.mark.parametrize(("conditions", "fits"), [(5, 5), (MOST_FITS, MOST_FITS), (31, MOST_FITS)])
def test_a_dozen_fits_leave_every_condition_out(conditions, fits, monkeypatch):
    counted, refit = [], room.refit
    monkeypatch.setattr(room, "refit", lambda *given: counted.append(given) or refit(*given))
    whole, prior = fitted(conditions)
    found = left_out(whole, prior)
    assert len(counted) == fits
    assert set(found) == {block.condition for block in whole.blocks}
    for name, (part,) in found.items():
        assert {block.condition for block in part.blocks} == {name}
        assert name not in {block.condition for block in part.others.blocks}
        assert len(part.others.blocks) >= len(whole.blocks) * (1.0 - 1.0 / MOST_FITS) - 1.0


def test_conditions_that_alone_tell_a_parameter_are_left_out_one_by_one():
    whole, prior = fitted(31)
    needed = room._determined
    fewest = len(whole.blocks) - 1  # as if a fit of fewer runs told a parameter less
    room._determined = lambda fit: needed(fit) - (len(fit.blocks) < fewest)
    try:
        found = left_out.__wrapped__(whole, prior)
    finally:
        room._determined = needed
    assert all(len(part.others.blocks) == fewest for (part,) in found.values())
