"""A vibration that begins at the same phase in every repeat is none: something ties it to the program."""

from dataclasses import replace

import numpy as np
import pytest
from toy import BEND, GATES, problem
from worded import in_words

from metro.loop.checks.phases import TIED, tied
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import Fit, fit
from metro.loop.fitting.noise import first_noise
from metro.loop.search.settled import unsettled

FREE = replace(BEND, name="path_vibration", own=1)
CONDITIONS, REPEATS = 4, 2


@pytest.fixture(scope="module")
def found() -> Fit:
    task = problem(1, phased=False)
    blocks = task.role("identify")
    return fit(Candidate(task.base), blocks, first_noise(GATES.model_form_budget, task.scatter, blocks))


def with_phases(found: Fit, phases: np.ndarray) -> Fit:
    """Return the fit as one of repeated conditions with a free vibration, with ``phases`` (c, repeats)."""
    runs = [(f"r{i}{k}", f"c{i}", value) for i, row in enumerate(phases) for k, value in enumerate(row)]
    blocks = tuple(replace(found.blocks[0], run=run, condition=condition) for run, condition, _ in runs)
    nuisance = {run: np.array([0.3, value]) for run, _, value in runs}  # the first is one of the base model
    theta = np.zeros(len(FREE.parameters))
    candidate = Candidate(found.candidate.base, (FREE,))
    covariance = 1e-4 * np.eye(len(found.beta) + len(theta))
    unpressed = np.zeros(len(theta))
    known = replace(found, candidate=candidate, theta=theta, covariance=covariance, pressed=unpressed)
    return replace(known, blocks=blocks, nuisance=nuisance)


def test_phases_that_repeat_are_tied_whatever_they_are(found: Fit) -> None:
    rng = np.random.default_rng(5)
    each = rng.uniform(0.0, 2.0 * np.pi, (CONDITIONS, 1))
    repeated = with_phases(found, each + rng.normal(0.0, 0.2, (CONDITIONS, REPEATS)))
    said = tied(repeated)
    assert said is not None
    assert (said.effect, said.pairs) == ("path_vibration", CONDITIONS)
    assert said.cosine > 0.8
    assert "begin at the same time in every repeat" in in_words(unsettled(repeated))


def test_free_phases_are_refused_as_rarely_as_the_level_says(found: Fit) -> None:
    rng = np.random.default_rng(6)
    draws = 1000
    refused = sum(
        tied(with_phases(found, rng.uniform(0.0, 2.0 * np.pi, (CONDITIONS, REPEATS)))) is not None
        for _ in range(draws)
    )
    assert refused < 2.0 * TIED * draws


def test_two_pairs_are_too_few_to_say(found: Fit) -> None:
    assert tied(with_phases(found, np.zeros((2, 2)))) is None
    assert tied(with_phases(found, np.zeros((5, 1)))) is None


def test_effects_without_a_phase_of_their_own_are_not_asked(found: Fit) -> None:
    repeated = with_phases(found, np.zeros((CONDITIONS, REPEATS)))
    bend = replace(repeated.candidate, effects=(replace(FREE, own=0),))
    assert tied(replace(repeated, candidate=bend)) is None


def test_what_runs_of_several_speeds_show_to_go_with_time_may_begin_alike(found: Fit) -> None:
    repeated = with_phases(found, np.zeros((CONDITIONS, REPEATS)))
    assert tied(repeated) is not None
    timed = replace(repeated.candidate, effects=(replace(FREE, timed=True),))
    assert tied(replace(repeated, candidate=timed)) is None
