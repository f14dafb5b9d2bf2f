"""Which runs decide: by the verdict's own rule, with as few runs as will do."""

from dataclasses import replace

import numpy as np
import pytest
from toy import BEND, GATES, block, problem
from toy_knee import STOP, Knee

from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.loop.planning.decide import Pair, decided, plan
from metro.loop.search.rivals import RIVAL_WEIGHT
from metro.loop.search.trial import HOPELESS
from metro.observables.problem import Made, Proposal


def proposal(feed):
    run = block(f"p{feed:g}", feed, "identify", np.random.default_rng(99), condition=f"next-{feed:g}")
    return Proposal(f"feed {feed:g}", (run,), (Made("r1"),))


FEEDS = (0.5, 2.0, 4.5, 8.0)
PROPOSALS = tuple(map(proposal, FEEDS))


@pytest.fixture(scope="module")
def undecided():
    """A pair of fits that the runs cannot tell apart, and the noise before anything was known."""
    task = replace(problem(1, truth=Knee(bend=0.05)), base=Knee())
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    fits = [fit(Candidate(task.base, (each,)), blocks, prior) for each in (BEND, STOP)]
    return Pair(("bend", "stop"), *fits), prior


def test_one_condition_decides_from_the_gain_at_which_the_rivals_weight_no_longer_counts():
    # With a single condition the bootstrap has nothing to vary: the weight is 1/(1 + e^gain).
    needed = np.log(1.0 / RIVAL_WEIGHT - 1.0)
    gains = np.array([[needed + 0.01], [needed - 0.01], [0.0], [-20.0]])
    assert decided(np.zeros(0), gains, 0.0, 0.0, np.random.default_rng(0)) == 0.25


def test_a_believed_rival_needs_more_evidence():
    rng, gains = np.random.default_rng(0), np.array([[4.0]])
    assert decided(np.zeros(0), gains, 0.0, 0.0, rng) == 1.0
    assert decided(np.zeros(0), gains, 0.0, -3.0, rng) == 0.0


def test_one_condition_among_many_that_are_silent_speaks_less_loudly():
    # Drawn conditions: the one that speaks has a share w of n, w ~ Beta(1, n − 1), and E[1/(1 + e^(n w g))]
    # is to be below 0.05; for n = 7, g = 6 it is about 6 ln 2 / 42 = 0.10, for g = 40 about 0.015.
    rng = np.random.default_rng(0)
    assert decided(np.zeros(6), np.array([[6.0]]), 0.0, 0.0, rng) == 0.0
    assert decided(np.zeros(6), np.array([[6.0]]), HOPELESS - 5.0, 0.0, rng) == 1.0
    assert decided(np.zeros(6), np.array([[40.0]]), -50.0, 0.0, rng) == 1.0


def test_the_run_at_which_the_two_part_is_planned_and_as_few_as_will_do(undecided):
    pair, prior = undecided
    found = plan([pair], PROPOSALS, prior, 12, 1)
    assert [kind.proposal.words for kind in found.kinds] == ["feed 8"]
    assert found.chance["bend", "stop"] >= 0.95
    assert found.runs <= 2


def test_without_that_run_more_of_a_weaker_one_are_planned_within_what_may_be_made(undecided):
    pair, prior = undecided
    nearer = [one for one in PROPOSALS if one.words != "feed 8"]
    best, few = plan([pair], nearer, prior, 12, 1), plan([pair], nearer, prior, 1, 1)
    assert "feed 4.5" in [kind.proposal.words for kind in best.kinds]
    assert few.runs == 1
    assert few.chance["bend", "stop"] < best.chance["bend", "stop"]


def test_where_no_run_parts_them_nothing_is_promised(undecided):
    pair, prior = undecided
    alike = [one for one in PROPOSALS if one.words in ("feed 0.5", "feed 2")]
    assert plan([pair], alike, prior, 12, 1).chance["bend", "stop"] < 0.05
    assert plan([pair], [], prior, 12, 1) is None
