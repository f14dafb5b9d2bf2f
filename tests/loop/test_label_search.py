"""Effects behind labels: found where they are and only there; undecided where nothing tells them apart."""

import numpy as np
import pytest
from label_toy import GATES, IDLE, LOUD, SHIFT, SLOPE, TWIN, Line, problem
from scipy.stats import norm

from metro.effects.effect import EffectParameter
from metro.loop.labels import search
from metro.loop.labels.hypotheses import pursued
from metro.loop.labels.next_test import next_tests
from metro.loop.labels.points import quantile
from metro.loop.labels.search import LIKELY, NOTHING, search_labels, tried
from metro.loop.statement import Statement


def searched(true, effects, seed=1, **more):
    task = problem(true, seed, **more)
    return task, search_labels(task, effects, GATES)


def test_labels_of_the_base_model_need_no_effect():
    leads = [searched(Line(), (SHIFT, SLOPE), seed)[1].lead for seed in range(8)]
    assert sum(lead is None for lead in leads) >= 6
    assert all(lead is None or lead.rejected for lead in leads)


@pytest.mark.parametrize(
    ("true", "name"), [(Line(shift=0.7), "shift"), (Line(slope=0.7), "slope"), (Line(slope=-0.8), "slope")]
)
def test_an_effect_is_found_with_its_size(true, name):
    _, outcome = searched(true, (SHIFT, SLOPE))
    assert outcome.lead.names == (name,)
    assert not outcome.lead.rejected
    assert outcome.probability(name) > 0.95
    size = outcome.lead.hypothesis.parameters(name)["size"]
    low, high = size["ci95"]
    assert low < (true.shift or true.slope) < high
    assert high - low < 0.7


def test_intervals_cover_as_often_as_they_say():
    covered = 0
    for seed in range(20):
        _, outcome = searched(Line(slope=0.6), (SLOPE,), seed)
        one = next(w for w in outcome.weighed if w.names == ("slope",))
        low, high = one.hypothesis.parameters("slope")["size"]["ci95"]
        covered += low <= 0.6 <= high
    assert covered >= 17


def test_twins_are_both_named_and_neither_is_sure():
    _, outcome = searched(Line(shift=0.8), (SHIFT, TWIN, SLOPE))
    assert {*outcome.lead.names, *outcome.rivals} >= {"shift", "twin"}
    assert 0.2 < outcome.probability("shift") < 0.8


def test_the_chatter_frequency_tells_what_labels_do_not():
    true = Line(shift=-0.7, hz=450.0)
    _, mute = searched(true, (SHIFT, LOUD))
    _, heard = searched(true, (SHIFT, LOUD), heard=True)
    assert 0.2 < mute.probability("loud") < 0.8
    assert heard.probability("loud") > 0.95
    assert heard.lead.names == ("loud",)


def test_two_effects_are_found_together():
    _, outcome = searched(Line(shift=0.8, slope=0.9), (SHIFT, SLOPE))
    assert set(outcome.lead.names) == {"shift", "slope"}
    for entry in tried(outcome):  # every other hypothesis is a rival, or says why it is not the one
        names = set(entry["effect"].split(" + "))
        assert bool(entry["why_not"]) != (names == {"shift", "slope"} or bool(names & set(outcome.rivals)))
    assert sum(getattr(entry["why_not"], "code", "") == "beaten" for entry in tried(outcome))


def test_no_hypothesis_is_beaten_where_none_is_added():
    for seed in range(8):
        _, outcome = searched(Line(), (SHIFT, SLOPE), seed)
        reasons = [entry["why_not"] for entry in tried(outcome)]
        assert not any(isinstance(one, Statement) and one.code == "beaten" for one in reasons)


def test_a_second_effect_that_is_needed_but_not_known_is_open():
    # the shift is there whatever it is called; the slope alone is not enough
    _, outcome = searched(Line(shift=0.9, slope=1.0), (SHIFT, SLOPE, TWIN))
    assert "slope" in outcome.lead.names
    assert {*outcome.lead.names, *outcome.rivals} >= {"slope", "shift", "twin"}


def test_an_effect_that_changes_nothing_is_said_not_to_be_seen():
    _, outcome = searched(Line(), (IDLE, SLOPE))
    assert set(outcome.not_visible) == {"idle"}
    assert all("idle" not in one.names for one in outcome.weighed)


def test_the_held_out_labels_are_not_read():
    task, outcome = searched(Line(slope=0.7), (SHIFT, SLOPE))
    held = np.array(task.roles) == "validate"
    flipped = search_labels(
        type(task)(**{**task.__dict__, "unstable": task.unstable ^ held}), (SHIFT, SLOPE), GATES
    )
    assert [one.probability for one in flipped.weighed] == [one.probability for one in outcome.weighed]


def test_the_next_test_is_where_the_hypotheses_disagree_most():
    few = np.array([3600.0, 4000.0, 4400.0])
    task, outcome = searched(Line(slope=0.9), (SLOPE,), rpm=few)
    assert 0.05 < outcome.probability(NOTHING) < 0.95
    tests = next_tests(task, outcome)
    best, worst = tests[0], tests[-1]
    assert best.information > worst.information >= -1e-9
    assert best.leading >= best.leading_now - 1e-9
    assert abs(best.depth - 1e-3) < abs(worst.depth - 1e-3)


def test_priors_have_the_distribution_that_their_bounds_say():
    share = (np.arange(400) + 0.5) / 400
    flat, scale, weak = (
        quantile(EffectParameter("a", "1", low, high, 1.0, (1.0,), plausible=sd), share)
        for low, high, sd in ((-1.0, 3.0, None), (1.0, 100.0, None), (-5.0, 5.0, 1.0))
    )
    assert flat.mean() == pytest.approx(1.0)
    assert np.log(scale).mean() == pytest.approx(np.log(10.0))
    assert np.std(weak) == pytest.approx(1.0, rel=0.01)
    assert weak[100] == pytest.approx(norm.ppf(share[100]), rel=1e-3)
    choice = EffectParameter("c", "", 0.0, 1.0, 1.0, (0.0,), choices=("x", "y"))
    assert list(quantile(choice, np.array([0.2, 0.7, 1.0]))) == [0.0, 1.0, 1.0]


def test_what_may_come_to_count_is_drawn_to_the_end_and_nothing_else_is(monkeypatch):
    monkeypatch.setattr(search, "FIRST", 0)
    outcome = search_labels(problem(Line(slope=0.8), 3), (SHIFT, SLOPE), GATES)
    drawn = [one for one in outcome.weighed if one.hypothesis.drawn]
    likely = [one for one in drawn if one.probability > LIKELY]
    assert likely
    for one in likely:
        assert one.hypothesis.drawn.sets > 0
        assert pursued(one.hypothesis) is one.hypothesis
    unlikely = [one for one in drawn if one.probability <= LIKELY]
    assert unlikely
    assert max(one.hypothesis.drawn.sets for one in unlikely) == 0
