"""What to measure next: where two explanations part, and how likely a run there decides between them."""

from dataclasses import replace

import numpy as np
import pytest
from toy import BEND, GATES, block, problem
from toy_knee import STOP, Knee
from worded import in_words

from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.descent import descend
from metro.loop.fitting.fit import fit, score
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.fitting.noise import first_noise
from metro.loop.fitting.system import State, linearised
from metro.loop.planning.experiment import probability, prospects
from metro.loop.search.search import search
from metro.loop.verdict.story import story
from metro.loop.verdict.verdict import judge
from metro.observables.problem import Proposal


def proposal(feed, runs=1):
    rng = np.random.default_rng(99)
    return Proposal(
        f"feed {feed:g}",
        tuple(
            block(f"p{feed:g}-{i}", feed, "identify", rng, condition=f"next-{feed:g}") for i in range(runs)
        ),
    )


PROPOSALS = tuple(proposal(feed) for feed in (0.5, 2.0, 4.3, 8.0))


def pair(bend=0.2, seed=1, effects=(BEND, STOP)):
    """Fits of the same runs by two effects that these runs cannot tell apart."""
    task = replace(problem(seed, truth=Knee(bend=bend)), base=Knee())
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    return [fit(Candidate(task.base, (each,)), blocks, prior) for each in effects]


def judged(task, library):
    outcome = search(task, library, GATES)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    verdict = judge(task, outcome, rows, GATES)
    return outcome, in_words(verdict), story(task, outcome, verdict, GATES)


def test_two_effects_that_differ_at_large_feed_alone_are_told_to_go_there():
    ranked = prospects(*pair(), PROPOSALS)
    assert ranked[0].proposal.words == "feed 8"
    assert ranked[0].probability > 0.99
    assert ranked[0].repeats == 1
    assert all(other.probability < 0.01 for other in ranked if other.proposal.words in ("feed 0.5", "feed 2"))


def test_the_paragraph_names_the_run_its_probability_and_the_pair():
    task = replace(problem(2, truth=Knee(bend=0.2)), base=Knee(), feasible=PROPOSALS)
    _, verdict, tried = judged(task, (BEND, STOP))
    assert verdict["status"] == "undetermined"
    text = verdict["next_experiment"]
    assert text.startswith("feed 8: this distinguishes")
    assert "more than 0.99" in text
    assert "an experiment" not in text
    best = tried["experiments"][0]
    assert best["proposal"] == "feed 8"
    assert set(best["pair"]) == {"bend", "stop"}
    assert best["runs"] == 1


def fitted_again(fitted, noise, made):
    """Log-likelihood of all runs, when a run is added and everything is fitted anew."""
    blocks = [*fitted.blocks, *made]
    start = {**fitted.nuisance, **(score(fitted, made).nuisance if made else {})}
    state, _ = descend(fitted.candidate, blocks, noise, State(fitted.theta, fitted.beta, start))
    return -0.5 * linearised(fitted.candidate, blocks, noise, state, derivatives="none").cost


def frequency(truth, other, feed, draws=150):
    """How often a run at a feed decides, drawn under the truth with parameters as uncertain as they are."""
    noise, rng = truth.noise, np.random.default_rng(5)
    sd = np.sqrt(truth.covariance[-1, -1] * truth.dispersion)
    before = [fitted_again(each, noise, []) for each in (truth, other)]
    decided = 0
    for _ in range(draws):
        wave = truth.candidate.model(truth.theta + sd * rng.normal(size=1))
        made = [block("new", feed, "identify", rng, truth=wave, scatter=noise.scatter[0])]
        after = [fitted_again(each, noise, made) for each in (truth, other)]
        decided += after[0] - after[1] - before[0] + before[1] > 3.0
    return decided / draws


@pytest.mark.parametrize(("bend", "feed"), [(0.03, 8.0), (0.03, 5.0), (0.05, 5.0)])
def test_the_probability_is_how_often_such_a_run_decides(bend, feed):
    one, other = pair(bend)
    stated = probability(one, other, proposal(feed).blocks)
    assert frequency(one, other, feed, draws=60) == pytest.approx(stated, abs=0.2)


def test_more_runs_decide_more_surely():
    one, other = pair(0.03)
    rising = [probability(one, other, proposal(5.0, runs).blocks) for runs in (1, 2, 4)]
    assert rising == sorted(rising)
    assert rising[0] < rising[-1]


def test_no_run_tells_apart_what_is_the_same():
    one, _ = pair()
    assert all(probability(one, one, each.blocks) < 0.01 for each in PROPOSALS)
