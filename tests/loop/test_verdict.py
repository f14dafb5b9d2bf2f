"""The verdict: errors by run, statuses, and the entry of verdict.json as the contract has it."""

import itertools
import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from toy import ANGLE, BEND, BETA, GATES, POINTS, RIPPLE, SIGMA, TWIN, Wave, problem
from worded import in_words

from metro.effects.effect import EffectParameter
from metro.loop.checks.floor import AgainstFloor
from metro.loop.checks.signature import Line, share_left
from metro.loop.fitting.held_out import COMPARISON, comparison, held_out, identified_fit, run_dof
from metro.loop.search.search import search
from metro.loop.statement import Statement
from metro.loop.verdict.believable import contradicted
from metro.loop.verdict.residual import residual_of
from metro.loop.verdict.story import story
from metro.loop.verdict.verdict import bounded, error, judge, traces, widened
from metro.loop.verdict.verification import lowered_by_held_out
from metro.report.sections.verdict import verdict_words
from metro.wording.batch import STATUSES as SENTENCES
from metro.wording.batch import verdict_in_words

STATUSES = {"clean", "explained", "partly_explained", "undetermined", "unexplained", "insufficient"}


def number(value):
    return isinstance(value, int | float) and not isinstance(value, bool) and np.isfinite(value)


def check_entry(entry):
    """The entry of an observable in verdict.json, by the data contract."""
    assert entry["status"] in STATUSES
    assert isinstance(entry["unit"], str)
    assert entry["noise_floor"] is None or entry["noise_floor"] >= 0
    assert all(isinstance(run, str) for run in entry["held_out_runs"])
    for column in ("before", "after"):
        figures = entry[column]
        if figures is not None:
            assert set(figures) == {"rms", "nrmse", "ci95"}
            assert number(figures["rms"])
            assert number(figures["nrmse"])
            assert figures["ci95"][0] <= figures["ci95"][1]
    for effect in entry["effects"]:
        assert isinstance(effect["effect"], str)
        assert 0 <= effect["probability"] <= 1
        for parameter in effect["parameters"].values():
            assert number(parameter["value"])
            assert len(parameter["ci95"]) == 2
            assert isinstance(parameter["unit"], str)
    for candidate in entry["candidates"]:
        assert isinstance(candidate["effect"], str)
        assert 0 <= candidate["probability"] <= 1
        assert isinstance(candidate["why_not"], str)
    assert all(len(pair) == 2 for pair in entry["indistinguishable"])
    assert entry["next_experiment"] is None or isinstance(entry["next_experiment"], str)
    left = entry["unexplained"]
    assert left is None or ({"rms", "signature"} <= set(left) and left["signature"])
    json.dumps(entry, allow_nan=False)


def closed(task, library):
    outcome = search(task, library, GATES)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    return outcome, rows, in_words(judge(task, outcome, rows, GATES))


CASES = {
    "clean": (problem(1), (BEND,)),
    "explained": (problem(2, truth=Wave(bend=0.2)), (BEND, RIPPLE)),
    "partly_explained": (problem(3, truth=Wave(bend=0.5, spike=0.2)), (BEND,)),
    "undetermined": (problem(4, truth=Wave(bend=0.2)), (BEND, TWIN)),
    "unexplained": (problem(5, truth=Wave(spike=0.3)), (BEND,)),
    "insufficient": (problem(6, feeds=(2.0,), repeats=1), (BEND,)),
}


@pytest.mark.parametrize("status", CASES)
def test_every_status_has_an_entry_by_the_contract_and_a_sentence(status):
    task, library = CASES[status]
    outcome, _, verdict = closed(task, library)
    assert verdict["status"] == status
    check_entry(verdict)
    assert verdict["held_out_runs"] == [block.run for block in task.role("validate")]
    assert verdict_in_words(verdict).startswith(SENTENCES[status].split("{")[0])
    json.dumps(in_words(story(task, outcome, verdict, GATES)), allow_nan=False)


def test_a_probability_that_an_unexplained_residual_lowers_says_so_with_its_parts():
    """Half of the wave is bent, a fifth of it is a spike that the library lacks: power 0.5² beside 0.2²."""
    outcome, _, verdict = closed(*CASES["partly_explained"])
    (effect,) = verdict["effects"]
    assert "of the residual" in effect["lowered"]
    assert effect["lowered"] in verdict_in_words(verdict)
    weight, share = (float(number) for number in re.findall(r"[0-9.]*[0-9]", effect["lowered"])[:2])
    assert weight == pytest.approx(outcome.weight["bend"], abs=0.006)
    assert weight * share / 100.0 == pytest.approx(effect["probability"], abs=0.01)
    assert share < 99.0
    (whole,) = closed(*CASES["explained"])[2]["effects"]
    assert "lowered" not in whole


def with_spike_where_unseen(task):
    """The problem with what its library lacks in the held-out runs alone."""
    spike = 0.3 * BETA[1] * np.cos(7 * ANGLE)
    blocks = tuple(
        replace(block, measured=block.measured + spike) if block.role == "validate" else block
        for block in task.blocks
    )
    return replace(task, blocks=blocks)


@pytest.mark.parametrize(
    ("truth", "statuses"),
    [(Wave(), ["clean", "unexplained"]), (Wave(bend=0.2), ["explained", "partly_explained"])],
)
def test_runs_that_verify_name_no_cause_and_where_they_contradict_something_remains(truth, statuses):
    task = problem(2, truth=truth, phased=False)
    before = closed(task, (BEND,))[2]
    after = closed(with_spike_where_unseen(task), (BEND,))[2]
    told = ("noise_floor", "before", "after", "verification", "candidates")
    told += ("status", "unexplained", "next_experiment", "traces", "effects")
    decided = [
        {name: value for name, value in verdict.items() if name not in told} for verdict in (before, after)
    ]
    assert decided[0] == decided[1]
    assert [verdict["status"] for verdict in (before, after)] == statuses
    assert before["unexplained"] is None
    found = [{**one, "probability": 0.0, "lowered": ""} for one in before["effects"]]
    assert found == [{**one, "probability": 0.0, "lowered": ""} for one in after["effects"]]
    whole, left = (after[when]["rms"] ** 2 - after["noise_floor"] ** 2 for when in ("before", "after"))
    for surely, less in zip(before["effects"], after["effects"], strict=True):
        assert "lowered" not in surely
        assert less["probability"] == pytest.approx(surely["probability"] * (1.0 - left / whole))
        assert 0.05 < less["probability"] < 0.95
        share = f"{100 * (1.0 - left / whole):.0f} % of the residual of the held-out runs"
        assert share in less["lowered"]
    assert after["unexplained"]["held_out_only"] is True
    times, where = after["verification"]["ratio"], after["unexplained"]["signature"]
    assert where.startswith(
        f"only on the held-out runs, whose error is {times:.2g} times what noise explains"
    )
    worst = where.rpartition("the largest in ")[2]
    assert worst in {block.condition for block in task.role("validate")}
    assert worst in after["next_experiment"]
    excess = np.sqrt(after["after"]["rms"] ** 2 - after["noise_floor"] ** 2)
    assert after["unexplained"]["rms"] == pytest.approx(excess, rel=0.1)
    for verdict, holds in ((before, True), (after, False)):
        assert verdict["verification"]["holds"] is holds
        assert ("contradicts the model" in verdict["verification"]["words"]) is not holds
        check_entry(verdict)
    assert after["verification"]["ratio"] > 5.0 * before["verification"]["ratio"]
    assert after["after"]["rms"] == pytest.approx(0.3 * BETA[1] / np.sqrt(2), rel=0.1)


@pytest.mark.parametrize(("p_value", "relative"), [(0.02, 0.3), (1e-4, 0.001)])
def test_an_error_of_held_out_runs_that_chance_makes_or_that_is_small_is_none(p_value, relative):
    task = problem(2, phased=False)
    outcome = search(task, (BEND,), GATES)
    feed = task.role("validate")[-1].condition
    error = AgainstFloor(ratio=1.5, freedom=9.0, p_value=p_value, relative=relative, condition=feed)
    assert not residual_of(task, outcome, GATES, error).parts
    seen = residual_of(task, outcome, GATES, replace(error, p_value=1e-4, relative=0.3))
    assert [part.code for part in seen.parts] == ["held_out_above_floor"]
    assert seen.worst(task).condition == feed != task.role("validate")[0].condition


@pytest.mark.parametrize(("after", "explained"), [(0.1, 1.0), (0.5, 1 - 0.24 / 0.99), (3.0, 0.0)])
def test_an_effect_is_believed_as_far_as_it_explains_the_held_out_runs(after, explained):
    entry = {"noise_floor": 0.1, "before": {"rms": 1.0}, "after": {"rms": after}, "unexplained": {"rms": 1.0}}
    (effect,) = lowered_by_held_out({**entry, "effects": [{"effect": "bend", "probability": 0.9}]})["effects"]
    assert effect["probability"] == pytest.approx(0.9 * explained)


@given(st.permutations(range(4)), st.floats(-3.0, 3.0))
@settings(max_examples=8, deadline=None)
def test_permuted_data_of_the_runs_that_verify_change_no_fit_and_no_search(order, factor):
    task = problem(12, truth=Wave(bend=0.15), held=(2.5, 3.5, 2.2, 3.2), phased=False)
    held = task.role("validate")
    exchanged = {
        block.run: factor * held[place].measured[::-1] for block, place in zip(held, order, strict=True)
    }
    moved = replace(
        task,
        blocks=tuple(
            replace(block, measured=exchanged.get(block.run, block.measured)) for block in task.blocks
        ),
    )
    outcomes, _, verdicts = zip(*(closed(one, (BEND, RIPPLE)) for one in (task, moved)), strict=True)
    assert outcomes[0].names == outcomes[1].names == ("bend",)
    np.testing.assert_array_equal(outcomes[0].final.theta, outcomes[1].final.theta)
    np.testing.assert_array_equal(outcomes[0].final.beta, outcomes[1].final.beta)
    assert verdicts[0]["indistinguishable"] == verdicts[1]["indistinguishable"]
    parameters = [[one["parameters"] for one in verdict["effects"]] for verdict in verdicts]
    assert parameters[0] == parameters[1]
    remains = verdicts[1]["unexplained"] is not None
    assert verdicts[1]["status"] == ("partly_explained" if remains else "explained")
    assert not (remains and verdicts[1]["verification"]["holds"])


def test_a_residual_that_only_conditions_left_out_of_the_fit_show_is_stated():
    task = problem(5, truth=Wave(spike=0.3), phased=False)
    outcome = search(task, (BEND,), GATES)
    blind = replace(outcome, lines=(), between=None, restless=None, step=None)
    rows = comparison(task, held_out(task, blind.base), held_out(task, blind.final))
    verdict = in_words(judge(task, blind, rows, GATES))
    assert verdict["status"] == "unexplained"
    assert verdict["unexplained"]["signature"].startswith(
        "only in conditions that were left out of the fit: "
    )
    check_entry(verdict)


def test_without_held_out_runs_nothing_is_claimed():
    task = problem(7, held=())
    _, rows, verdict = closed(task, ())
    assert len(rows) == 0
    assert verdict["status"] == "insufficient"
    assert verdict["before"] is None
    check_entry(verdict)


def test_insufficient_runs_claim_no_effect_and_the_one_found_is_a_candidate_that_was_not_tested():
    task = problem(10, truth=Wave(bend=0.2), held=())
    outcome, _, verdict = closed(task, (BEND, RIPPLE))
    assert outcome.names == ("bend",)  # so sure is the search
    assert verdict["status"] == "insufficient"
    assert verdict["effects"] == []
    found = {entry["effect"]: entry for entry in verdict["candidates"]}
    assert set(found) == {"bend", "ripple"}
    assert found["bend"]["why_not"] == in_words(Statement("untested"))
    assert found["ripple"]["why_not"] not in ("", in_words(Statement("untested")))
    assert all(entry["held_out_rms"] is None for entry in found.values())


def test_every_candidate_that_is_not_taken_has_its_own_error_on_held_out_runs():
    task = problem(11, truth=Wave(bend=0.2))
    immaterial = replace(GATES, materiality=0.5)
    outcome = search(task, (BEND, RIPPLE), immaterial)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    verdict = judge(task, outcome, rows, immaterial)
    found = {entry["effect"]: entry["held_out_rms"] for entry in verdict["candidates"]}
    # The held-out runs at feeds 2.5 and 3.5 hold a wave of 0.2 β feed; ripple leaves it, bend takes it out.
    wave = 0.2 * BETA[0] * np.sqrt((2.5**2 + 3.5**2) / 4)
    assert verdict["before"]["rms"] == pytest.approx(wave, rel=0.05)
    assert found["ripple"] == pytest.approx(wave, rel=0.05)
    assert SIGMA / 2 < found["bend"] < 0.2 * wave


def test_what_errors_of_the_inputs_may_look_like_is_named_as_a_trace_and_not_claimed():
    task = replace(problem(3, truth=Wave(bend=0.2)), systematic=0.3)
    outcome, _, verdict = closed(task, (BEND, RIPPLE))
    assert verdict["status"] == "clean"
    (size,) = [trial.evidence.size for trial in outcome.trials if trial.effect.name == "bend"]
    assert verdict["traces"] == (
        f"Bend ({100 * size:.2g} % of the signal) improves the fit significantly, but errors of the model's "
        "inputs or of the instrument may cause up to 60 %, so it is not claimed."
    )
    assert verdict_words("force", verdict).count(verdict["traces"]) == 1
    assert "no larger effect is missing" in verdict_words("force", verdict)
    assert verdict["traces"] in verdict_in_words(verdict)
    assert "traces" not in contradicted(verdict)


def test_several_traces_are_named_the_largest_first():
    seen = [{"effect": name, "size": size, "least": 0.04} for name, size in (("bend", 0.01), ("big", 0.03))]
    assert in_words(Statement("traces", {"seen": seen})) == (
        "Big (3 % of the signal) and bend (1 % of the signal) each improve the fit significantly, but errors "
        "of the model's inputs or of the instrument may cause up to 4 %, so none of them is claimed."
    )


def test_there_is_no_trace_where_nothing_is_significant_or_all_is_smaller_than_what_matters():
    _, _, clean = closed(replace(problem(20), systematic=0.3), (BEND, RIPPLE))
    assert clean["status"] == "clean"
    assert "traces" not in clean
    task = replace(problem(3, truth=Wave(bend=0.2)), systematic=0.3)
    outcome = search(task, (BEND,), replace(GATES, materiality=0.5))
    assert traces(outcome, 0.5) is None
    assert traces(outcome, 0.01) is not None
    named = replace(outcome, final=SimpleNamespace(candidate=SimpleNamespace(effects=(BEND,))))
    assert traces(named, 0.01) is None  # another form of it is named: that none of it is claimed is not so


def test_the_unexplained_rest_has_the_size_of_what_the_library_lacks():
    task = problem(12, truth=Wave(spike=0.3))
    _, _, verdict = closed(task, (BEND,))
    assert verdict["status"] == "unexplained"
    assert verdict["unexplained"]["rms"] == pytest.approx(0.3 * BETA[1] / np.sqrt(2), rel=0.1)
    assert verdict["unexplained"]["unit"] == "N"


def test_the_share_left_is_what_is_significant_over_all_axes():
    def line(axis, excess, signal, significant=True):
        return Line(axis, "all", 2 * excess, excess, signal, excess / signal, 0.0, significant)

    lines = [line("x", 3.0, 30.0), line("x", 4.0, 30.0), line("y", 12.0, 40.0), line("y", 20.0, 40.0, False)]
    assert share_left(lines) == pytest.approx(13.0 / 50.0)
    assert share_left(lines[-1:]) == 0.0


def test_error_is_the_rms_and_its_interval_a_bootstrap_over_runs():
    size = np.array([1.0, 2.0, 3.0, 4.0, 9.0])
    rows = pd.DataFrame(
        {"run": np.repeat(list("abcde"), 50), "measured": 10 + np.repeat(size, 50), "before": 10.0}
    )
    found = error(rows, "before", seed=1)
    rms = np.sqrt(np.mean(size**2))
    assert found["rms"] == pytest.approx(rms)
    assert found["nrmse"] == pytest.approx(rms / np.sqrt(np.mean(rows["measured"] ** 2)))
    # Every draw of five runs from five, one as likely as the other.
    draws = np.sqrt([np.mean(np.square(draw)) for draw in itertools.product(size, repeat=5)])
    low, high = found["ci95"]
    assert 0.01 < np.mean(draws < low) < 0.04
    assert 0.01 < np.mean(draws > high) < 0.04
    many = pd.concat([rows] * 20)
    assert error(many, "before", seed=1)["ci95"] == pytest.approx(found["ci95"])


def test_comparison_has_the_columns_of_the_contract_in_their_order():
    task, _ = CASES["explained"]
    outcome, rows, _ = closed(task, (BEND,))
    assert tuple(rows.columns) == COMPARISON
    assert len(rows) == 2 * POINTS
    held = task.role("validate")[0]
    own = rows[rows["run"] == held.run]
    assert own["measured"].to_numpy() == pytest.approx(held.measured)
    assert own["angle_deg"].to_numpy() == pytest.approx(np.arange(POINTS) * 360 / POINTS)
    assert own["x_mm"].isna().all()
    assert (own["observable"] == "toy").all()
    assert (own["sigma"] > 0).all()
    before = comparison(task, held_out(task, outcome.base))
    assert before["after"].isna().all()
    assert before["before"].to_numpy() == pytest.approx(rows["before"].to_numpy())


def test_the_comparison_is_in_the_problems_unit():
    task = problem(8)
    outcome = search(task, (), GATES)
    rows = comparison(task, held_out(task, outcome.base))
    milli = replace(task, unit="mN", si=1e-3)
    scaled = comparison(milli, held_out(milli, outcome.base))
    for column in ("measured", "before", "sigma"):
        assert scaled[column].to_numpy() == pytest.approx(1e3 * rows[column].to_numpy())


def test_of_a_right_model_the_rest_is_as_large_as_sigma_says():
    z = []
    for seed in range(25):
        task = problem(200 + seed)
        rows = comparison(task, held_out(task, search(task, (), GATES).base))
        z += ((rows["measured"] - rows["before"]) / rows["sigma"]).tolist()
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.2)


def test_the_interval_of_an_error_weighs_runs_by_their_length_as_the_error_does():
    lengths, errors = (400, 10, 10, 10), (3.0, 0.5, 0.5, 0.5)
    rows = pd.DataFrame({"run": np.repeat(list("abcd"), lengths), "before": 0.0})
    rows["measured"] = np.repeat(errors, lengths)
    found = error(rows, "before", seed=1)
    # The highest ends are of the long run drawn three times of four; unweighted, they would be at 2.6.
    assert found["ci95"][0] == pytest.approx(0.5)
    assert found["ci95"][1] == pytest.approx(np.sqrt((3 * 400 * 9 + 10 * 0.25) / 1210), abs=0.02)
    assert found["ci95"][0] < found["rms"] < found["ci95"][1]


def test_intervals_count_runs_not_samples_and_keep_within_bounds():
    task, library = CASES["explained"]
    outcome, _, verdict = closed(task, library)
    entry = verdict["effects"][0]["parameters"]["bend"]
    sd = np.sqrt(outcome.final.covariance[2, 2] * outcome.final.dispersion)
    assert run_dof(outcome.final) == 11
    assert entry["ci95"][1] - entry["value"] == pytest.approx(stats.t.ppf(0.975, 11) * sd)
    tight = replace(BEND, parameters=(replace(BEND.parameters[0], upper=0.2),))
    bend = closed(task, (tight,))[2]["effects"][0]["parameters"]["bend"]
    assert bend["ci95"][1] <= 0.2


def test_the_identified_fit_hands_over_the_base_parameters_and_every_runs_phase():
    task = problem(9)
    outcome = search(task, (), GATES)
    found = identified_fit(task, outcome.base)
    assert found.beta == pytest.approx(BETA, rel=0.03)
    assert found.covariance.shape == (2, 2)
    assert set(found.nuisance) == {block.run for block in task.blocks}


def test_runs_that_the_effects_make_worse_are_named():
    """The runs of the fit bend their wave, those held out do not: the effect stays, its cost is said."""
    bent, straight = problem(9, truth=Wave(bend=0.1)), problem(9)
    mixed = replace(bent, blocks=(*bent.role("identify"), *straight.role("validate")))
    _, rows, verdict = closed(mixed, (BEND,))
    assert [found["effect"] for found in verdict["effects"]] == ["bend"]
    worse = [one["run"] for one in verdict["verification"]["worse_runs"]]
    assert worse == [block.run for block in straight.role("validate")]
    assert "With the effects the error increases in" in verdict["verification"]["words"]
    before, after = (f"{verdict[when]['rms']:.3g}" for when in ("before", "after"))
    assert f"the error increases from {before} to {after} N." in verdict["verification"]["words"]
    assert "increases" not in closed(bent, (BEND,))[2]["verification"]["words"]
    assert not closed(bent, (BEND,))[2]["verification"]["worse_runs"]
    assert len(rows)


def test_a_rival_that_is_no_effect_of_the_library_leaves_words_and_no_error():
    _, rows, verdict = closed(problem(9, truth=Wave(bend=0.1)), (BEND, replace(TWIN, resembled=True)))
    assert len(rows)
    assert [found["effect"] for found in verdict["effects"]] == ["bend"]
    assert "alternative explanation to bend: a twin" in verdict["unexplained"]["signature"]
    assert verdict["unexplained"]["rms"] is None  # nothing is left over


def test_of_a_parameter_that_may_be_anything_it_is_said_that_nothing_is_told():
    size = EffectParameter("size", "um", 0.0, 10.0, 1.0, starts=(1.0,))
    angle = EffectParameter("angle", "deg", 0.0, 360.0, 10.0, starts=(0.0,), period=360.0)
    assert "told" not in bounded(size, 4.0, 1.0, 20.0)
    assert bounded(size, 4.0, 100.0, 20.0)["ci95"] == [0.0, 10.0]
    assert bounded(size, 4.0, 100.0, 20.0)["told"] is False
    assert bounded(size, 4.0, np.inf, 20.0)["told"] is False
    assert "told" not in bounded(angle, 90.0, 20.0, 20.0)
    assert bounded(angle, 90.0, 200.0, 20.0)["told"] is False


def test_an_error_of_few_runs_that_agree_by_chance_has_the_interval_of_its_independent_values():
    rows = pd.DataFrame({"run": ["a", "b"], "measured": [3.0, 3.001], "before": 0.0})
    narrow = error(rows, "before", 1)
    assert narrow["ci95"][1] - narrow["ci95"][0] < 0.002
    low, high = widened(narrow, 10.0)["ci95"]
    squares = 3.0**2 * np.random.default_rng(1).chisquare(10, 20_000) / 10.0
    inside = (np.sqrt(squares) * np.sqrt(10.0 / stats.chi2.ppf(0.025, 10)) > 3.0) & (
        np.sqrt(squares) * np.sqrt(10.0 / stats.chi2.ppf(0.975, 10)) < 3.0
    )
    assert inside.mean() == pytest.approx(0.95, abs=0.01)
    assert (low, high) == pytest.approx((2.09, 5.27), abs=0.02)
    wide = {**narrow, "ci95": [0.5, 9.0]}
    assert widened(wide, 10.0)["ci95"] == [0.5, 9.0]
