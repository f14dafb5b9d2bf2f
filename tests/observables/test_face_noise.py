"""Standard errors of faces: what comes again in every repeat is no noise."""

from dataclasses import replace

import numpy as np
import pytest

from metro.observables.flatness.model import BelievedSetting
from metro.observables.flatness.noise import without_what_repeats
from metro.observables.problem import Block, Problem
from metro.units import UM

X, Y = (c.ravel() for c in np.meshgrid(np.arange(10.0, 90.0, 4.0), np.arange(10.0, 70.0, 4.0)))
NOISE = 4 * UM


def face(
    run: str, heights: np.ndarray, *, sigma: float = 10 * UM, role: str = "identify", seed: int = 0
) -> Block:
    """Return a face that is measured with ``NOISE``, and said to be measured with ``sigma``."""
    rng = np.random.default_rng([int(run[1:]), seed])
    place = rng.normal(0.0, 30 * UM, 3) @ np.array([np.ones_like(X), X / 40.0 - 1.0, Y / 30.0 - 1.0])
    measured = heights + place + rng.normal(0.0, NOISE, len(X))
    count = len(X)
    return Block(
        *(run, "c", role, int(run[1:]), measured, np.full(count, sigma), BelievedSetting()),
        *(np.full(count, "z"), np.zeros((count, 0)), np.zeros(0)),
        {"x_mm": X, "y_mm": Y},
    )


RINGING = 12 * UM * np.sin(X / 1.3)


def test_waves_that_come_again_are_no_noise() -> None:
    for block in without_what_repeats([face(f"r{i}", RINGING) for i in range(3)]):
        assert block.sigma == pytest.approx(np.full(len(X), NOISE), rel=0.12)


def test_repeats_that_differ_by_more_than_noise_do_not_hide_what_they_differ_by() -> None:
    """A vibration has another phase in every face, and is to be found."""
    swung = [face(f"r{i}", 40 * UM * np.sin(X / 9.0 + phase)) for i, phase in enumerate((0.0, 2.0, 4.0))]
    assert all((block.sigma == 10 * UM).all() for block in without_what_repeats(swung))


def test_runs_that_verify_tell_those_of_the_fit_nothing() -> None:
    fitted, verifying = face("r1", RINGING), [face(f"r{i}", RINGING, role="validate") for i in (2, 3)]
    first, *others = without_what_repeats([fitted, *verifying])
    assert (first.sigma == fitted.sigma).all()
    assert all((block.sigma < 0.6 * fitted.sigma).all() for block in others)


def test_faces_of_other_places_are_not_compared() -> None:
    here, there = face("r1", RINGING), face("r2", RINGING)
    there.coordinates["x_mm"] = X + 2000.0
    assert all((block.sigma == 10 * UM).all() for block in without_what_repeats([here, there]))


def test_one_scan_in_two_runs_is_no_repeat() -> None:
    """A file that was given twice would leave no noise at all."""
    once = face("r1", RINGING)
    for block in without_what_repeats([once, replace(once, run="r2")]):
        assert (block.sigma == once.sigma).all()


def test_what_an_instrument_does_not_resolve_is_a_larger_share_of_a_smaller_signal() -> None:
    faces = (face("r1", 40 * UM * np.sin(X / 9.0)), face("r2", 40 * UM * np.sin(X / 9.0)))
    signal = np.sqrt(np.mean(np.concatenate([block.measured for block in faces]) ** 2))
    task = Problem("flatness", "mm", 1e-3, None, faces, np.zeros(0), unresolved=0.1 * signal)
    assert task.least_residual(0.04) == pytest.approx(0.1)
    assert task.least_residual(0.2) == 0.2
    assert replace(task, systematic=0.15).least_residual(0.04) == pytest.approx(0.3)
