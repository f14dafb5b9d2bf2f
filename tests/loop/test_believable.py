"""Nothing is attributed where the data contradict the batch, or where the model misses half of the signal."""

from dataclasses import replace

import pytest
from toy import BEND, GATES, Wave, problem

from metro.loop.fitting.fit import fit
from metro.loop.search.search import search
from metro.loop.statement import to_json
from metro.loop.verdict import believable
from metro.wording.statements import worded

VERDICT = {
    "status": "explained",
    "unit": "N",
    "noise_floor": 3.0,
    "before": {"rms": 9.0, "nrmse": 0.9},
    "after": {"rms": 5.0, "nrmse": 0.75},
    "effects": [{"effect": "tool_runout"}],
    "indistinguishable": [["a", "b"]],
    "next_experiment": None,
    "unexplained": None,
}


def test_a_verdict_that_is_contradicted_has_no_cause_and_says_what_to_do():
    content = worded(to_json(believable.contradicted(VERDICT)))
    assert content["status"] == "unexplained"
    assert content["contradicted"] is True
    assert content["effects"] == content["indistinguishable"] == []
    assert "correct the declaration as proposed on page one" in content["next_experiment"]
    assert "contradict" in content["unexplained"]["signature"]


def test_the_missed_share_is_beyond_the_noise_and_given_where_it_is_over_half():
    assert believable.with_share(VERDICT)["misses"] == pytest.approx(0.6)  # 4 of 5 N beyond 3 N of noise
    assert "misses" not in believable.with_share({**VERDICT, "noise_floor": 4.5})
    assert "misses" not in believable.with_share({**VERDICT, "unit": "1"})
    assert "misses" not in believable.with_share({**VERDICT, "after": None})


def test_effects_are_withdrawn_where_even_with_them_half_of_the_signal_is_missed():
    outcome = search(problem(1, truth=Wave(bend=0.1), phased=False), (BEND,), GATES)
    assert believable.believable(outcome).names == ("bend",)
    astray = problem(
        1, truth=Wave(bend=0.1, spike=2.0), phased=False
    )  # conditions left out are missed by much
    lost = fit(outcome.final.candidate, astray.role("identify"), outcome.prior, outcome.final)
    doubted = believable.believable(replace(outcome, final=lost))
    assert doubted.names == ()
    assert [trial.why_not.code for trial in doubted.trials] == ["misses_half"]


def test_a_search_without_a_library_ends_with_the_base_model():
    outcome = search(problem(1, truth=Wave(bend=0.1), phased=False), (), GATES)
    assert outcome.names == ()
    assert outcome.final is outcome.base
