"""The search on a small library: what is found, what is not, and what is said of it."""

from dataclasses import replace

import numpy as np
import pytest
from toy import BEND, GAIN, GATES, RIPPLE, TWIN, Wave, effect, problem
from worded import in_words

from metro.loop.checks.evidence import Evidence, surviving_share
from metro.loop.checks.signature import places, q_values
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.held_out import comparison, held_out
from metro.loop.fitting.noise import first_noise
from metro.loop.search import forward as forward_room
from metro.loop.search import trial as trial_room
from metro.loop.search.search import NOT_VISIBLE, search
from metro.loop.search.strategy import SearchSpace
from metro.loop.statement import Statement
from metro.loop.verdict.verdict import judge, parameters, why_not


def judged(task, library, gates=GATES):
    outcome = search(task, library, gates)
    rows = comparison(task, held_out(task, outcome.base), held_out(task, outcome.final))
    return outcome, in_words(judge(task, outcome, rows, gates))


def test_an_effect_that_is_there_is_found_and_the_held_out_error_falls():
    outcome, verdict = judged(problem(1, truth=Wave(bend=0.2)), (BEND, RIPPLE))
    assert outcome.names == ("bend",)
    assert verdict["status"] == "explained"
    entry = verdict["effects"][0]["parameters"]["bend"]
    assert entry["ci95"][0] < 0.2 < entry["ci95"][1]
    assert verdict["after"]["rms"] < 0.3 * verdict["before"]["rms"]


def test_two_effects_are_both_found():
    outcome, verdict = judged(problem(2, truth=Wave(bend=0.2, ripple=0.15)), (BEND, RIPPLE))
    assert set(outcome.names) == {"bend", "ripple"}
    assert verdict["status"] == "explained"


@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_added_to_a_clean_batch(seed):
    outcome, verdict = judged(problem(20 + seed), (BEND, RIPPLE))
    assert outcome.names == ()
    assert verdict["status"] == "clean"
    assert all(trial.why_not for trial in outcome.trials)


def test_an_immaterial_effect_is_not_added_however_certain():
    outcome, _ = judged(problem(3, truth=Wave(bend=0.2)), (BEND,), replace(GATES, materiality=0.5))
    assert outcome.names == ()
    assert outcome.trials[0].why_not.code == "immaterial"


def test_the_systematic_error_of_the_inputs_raises_the_bar():
    task = replace(problem(3, truth=Wave(bend=0.2)), systematic=0.3)
    assert search(task, (BEND,), GATES).trials[0].why_not.code == "immaterial"


def test_an_effect_smaller_than_what_the_instrument_resolves_is_none():
    task = problem(3, truth=Wave(bend=0.2))
    measured = np.concatenate([block.measured for block in task.role("identify")])
    signal, (tried,) = float(np.sqrt(np.mean(measured**2))), search(task, (BEND,), GATES).trials
    below, above = (
        search(replace(task, unresolved=share * tried.evidence.size * signal), (BEND,), GATES)
        for share in (1.1, 0.9)
    )
    assert below.names == ()
    assert below.trials[0].why_not.code == "immaterial"
    assert above.names == ("bend",)


def test_an_effect_must_predict_conditions_left_out():
    outcome = search(problem(4, truth=Wave(bend=0.2)), (BEND,), replace(GATES, held_out_gain=1e9))
    assert outcome.names == ()
    assert outcome.trials[0].why_not.code == "no_gain"


def test_an_effect_that_the_base_absorbs_is_said_to_be_invisible():
    outcome, verdict = judged(problem(5, truth=Wave(gain=0.3)), (GAIN, RIPPLE))
    assert outcome.names == ()
    assert set(outcome.not_visible) == {"gain"}
    assert verdict["status"] == "clean"
    assert "an experiment for gain" in verdict["next_experiment"]


def nearly_absorbed(size):
    """A gain with a little ripple of its own, of which the base parameters leave nothing but the ripple."""
    return replace(
        GAIN,
        name="corner",
        parameters=(replace(GAIN.parameters[0], starts=(-0.6, 0.6)),),
        apply=lambda model, values: replace(
            model, gain=model.gain + values["gain"], ripple=model.ripple + size * values["gain"]
        ),
    )


def test_what_the_base_absorbs_but_for_what_is_far_above_the_noise_is_tried():
    corner = nearly_absorbed(0.1)
    task = problem(5, truth=Wave(gain=0.4, ripple=0.04), phased=False)
    blocks = task.role("identify")
    base = fit(Candidate(task.base), blocks, first_noise(0.002, task.scatter, blocks))
    share = surviving_share(Candidate(task.base, (corner,)), base)
    assert 1e-4 < share < NOT_VISIBLE
    outcome = search(task, (corner,), GATES)
    assert outcome.names == ("corner",)
    assert outcome.final.theta[0] == pytest.approx(0.4, abs=0.1)


def test_what_the_base_absorbs_but_for_what_is_lost_in_the_noise_is_not_tried():
    outcome = search(problem(5, truth=Wave(gain=0.4, ripple=0.0004)), (nearly_absorbed(0.001),), GATES)
    assert set(outcome.not_visible) == {"corner"}


def test_two_effects_that_are_the_same_leave_the_cause_undetermined():
    outcome, verdict = judged(problem(6, truth=Wave(bend=0.2)), (BEND, TWIN))
    assert len(outcome.names) == 1
    assert {*outcome.rivals[0].pair} == {"bend", "twin"}
    assert verdict["status"] == "undetermined"
    assert {*verdict["indistinguishable"][0]} == {"bend", "twin"}
    assert "an experiment for twin" in verdict["next_experiment"]
    (rival,) = verdict["candidates"]
    assert rival["why_not"] == f"these runs do not distinguish it from {outcome.names[0]}"


def test_what_passes_every_gate_and_is_not_added_says_why():
    outcome, _ = judged(problem(1, truth=Wave(bend=0.2)), (BEND,))
    lost = replace(outcome, final=outcome.base)
    assert why_not(lost, outcome.trials[0]) == Statement("beaten")


def test_a_structure_outside_the_library_is_left_unexplained():
    outcome, verdict = judged(problem(7, truth=Wave(spike=0.3)), (BEND, RIPPLE))
    assert outcome.names == ()
    assert verdict["status"] == "unexplained"
    assert "quarter" in verdict["unexplained"]["signature"]
    assert 0.5 < verdict["unexplained"]["rms"] / (8.0 * 0.3 / np.sqrt(2)) < 1.5


def test_an_effect_found_beside_what_is_outside_the_library_explains_in_part():
    outcome, verdict = judged(problem(8, truth=Wave(bend=0.5, spike=0.2)), (BEND,))
    assert outcome.names == ("bend",)
    assert verdict["status"] == "partly_explained"


def test_one_run_is_too_few_to_tell():
    task = problem(9, feeds=(2.0,), repeats=1)
    _, verdict = judged(task, (BEND,))
    assert verdict["status"] == "insufficient"
    assert "at least two conditions" in verdict["next_experiment"]


def test_the_search_never_reads_the_validation_runs():
    task = problem(10, truth=Wave(bend=0.2))
    poisoned = tuple(
        replace(block, measured=block.measured * np.nan) if block.role == "validate" else block
        for block in task.blocks
    )
    clean, other = (
        search(task, (BEND, RIPPLE), GATES),
        search(replace(task, blocks=poisoned), (BEND, RIPPLE), GATES),
    )
    assert other.names == clean.names == ("bend",)
    assert other.final.theta == pytest.approx(clean.final.theta, rel=1e-12)
    assert other.final.total == pytest.approx(clean.final.total, rel=1e-12)


def ripple_before_bend(task):
    """The space of a problem with no effects in its base, and the fit with ``ripple`` and then ``bend``."""
    blocks = task.role("identify")
    prior = first_noise(GATES.model_form_budget, task.scatter, blocks)
    base = fit(Candidate(task.base), blocks, prior)
    first = fit(Candidate(task.base, (RIPPLE,)), blocks, prior, base)
    both = fit(Candidate(task.base, (RIPPLE, BEND)), blocks, prior, first)
    return SearchSpace(base, (), prior, GATES, GATES.materiality), both


def test_an_effect_that_a_later_one_makes_idle_is_dropped():
    space, both = ripple_before_bend(problem(11, truth=Wave(bend=0.3)))
    kept, dropped = forward_room._pruned(both, space)
    assert dropped == {"ripple"}
    assert [effect.name for effect in kept.candidate.effects] == ["bend"]
    space, both = ripple_before_bend(problem(12, truth=Wave(bend=0.3, ripple=0.2)))
    assert forward_room._pruned(both, space)[1] == set()


def test_false_discoveries_are_controlled_as_benjamini_and_hochberg_do():
    rng = np.random.default_rng(1)
    for _ in range(50):
        p = rng.uniform(size=rng.integers(1, 20)) ** 2
        ordered = np.sort(p)
        most = max((k for k in range(1, len(p) + 1) if ordered[k - 1] <= 0.2 * k / len(p)), default=0)
        expected = p <= (ordered[most - 1] if most else -1.0)
        assert np.array_equal(q_values(p) <= 0.2, expected)
    assert q_values([]).size == 0


def test_the_rest_of_a_clean_fit_is_nowhere_significant_and_named_in_order_of_size():
    assert not any(line.significant for line in search(problem(13), (), GATES).lines)
    lines = list(search(problem(14, truth=Wave(spike=0.3)), (), GATES).lines)
    found = sorted((line for line in lines if line.significant), key=lambda line: -line.excess)
    assert len(found) == 4
    stated = [place["label"] for place in places(lines).values["places"]]
    assert stated == [line.label for line in found]


def test_an_effect_that_helps_one_condition_alone_is_not_added():
    evidence = Evidence(
        statistic=50.0,
        p_value=1e-6,
        held_out={"a": 9.0, "b": -1.0, "c": -1.0, "d": -1.0},
        moved=0.1,
        size=0.1,
        missed=0.0,
    )
    assert evidence.gain > GATES.held_out_gain
    assert trial_room._not_held_out(evidence, GATES) == Statement("better_in_few", {"share": 0.25})
    even = replace(evidence, held_out=dict.fromkeys("abcd", 1.5))
    assert trial_room._not_held_out(even, GATES) is None


def test_an_effect_smaller_than_half_of_what_stays_unexplained_is_added_on_trial_only():
    evidence = Evidence(statistic=50.0, p_value=1e-6, held_out={}, moved=0.02, size=0.02, missed=0.05)
    assert trial_room._why_not(evidence, 0.0, GATES, 0.004) is None
    assert "5 % of the signal remain unexplained" in in_words(trial_room.small_beside_residual(evidence))
    assert trial_room.small_beside_residual(replace(evidence, missed=0.03)) is None


def test_a_small_p_value_among_many_candidates_is_told_with_what_it_is_among_so_many():
    evidence = Evidence(statistic=9.0, p_value=0.006, held_out={}, moved=0.02, size=0.02, missed=0.0)
    assert "(q = 0.06 over" in in_words(trial_room._why_not(evidence, 0.06, GATES, 0.004))
    weak = in_words(trial_room._why_not(replace(evidence, p_value=0.4), 0.9, GATES, 0.004))
    assert weak == "not significant: p = 0.4 over the identification runs"


def test_what_is_not_of_the_library_is_told_as_a_likeness_and_not_added():
    strange = replace(RIPPLE, resembled=True)
    task = problem(15, truth=Wave(ripple=0.1))
    outcome, verdict = judged(task, (BEND, strange))
    assert outcome.names == ()
    assert outcome.final is outcome.base
    assert outcome.likeness.theta[0] == pytest.approx(0.1, rel=0.1)
    assert verdict["status"] == "unexplained"
    assert [c["why_not"] for c in verdict["candidates"] if c["effect"] == "ripple"] == [
        in_words(Statement("resembled"))
    ]
    assert "like a ripple (ripple 0.0997)" in verdict["unexplained"]["signature"]


@pytest.mark.parametrize("seed", range(15, 18))
def test_what_explains_as_well_as_an_effect_of_the_library_leaves_that_in_its_place(seed):
    strange = replace(TWIN, resembled=True)
    outcome = search(problem(seed, truth=Wave(bend=0.1)), (strange, BEND), GATES)
    assert outcome.names == ("bend",)
    assert outcome.likeness is None
    assert [rival.pair for rival in outcome.rivals] == [("bend", "twin")]


def test_runs_that_hold_their_wave_once_say_nothing_of_changes_along_the_run():
    task = problem(19)
    once = tuple(replace(block, slow={"along the run": np.zeros((1, 1))}) for block in task.blocks)
    lines = search(replace(task, blocks=once), (), GATES).lines
    assert len(lines) == 4
    assert not any("along the run" in line.label for line in lines)


@pytest.mark.parametrize(
    ("gains", "share"),
    [
        ((-0.02, -0.01, 0.01, 17.0), 1.0),  # acts in one condition alone
        ((-0.02, -5.0, 3.0, 17.0), 2 / 3),
        ((1.0, -2.0, -3.0, -4.0), 0.25),
        ((), 0.0),
    ],
)
def test_conditions_that_an_effect_does_not_touch_say_nothing_of_it(gains, share):
    held_out = {f"condition {i}": gain for i, gain in enumerate(gains)}
    evidence = Evidence(1.0, 0.5, held_out, 0.1, 0.1, 0.0)
    assert evidence.better_share == pytest.approx(share)


FORMS = tuple(
    replace(effect("bent", attribute), form=f"joint {i}", where={"joint": i})
    for i, attribute in ((1, "bend"), (2, "ripple"), (3, "bend"))
)


def test_of_the_forms_of_an_effect_the_right_one_is_found():
    task = problem(5, truth=Wave(ripple=0.3))
    outcome = search(task, FORMS[:2], GATES)
    (found,) = outcome.final.candidate.effects
    assert found.form == "joint 2"
    assert not outcome.rivals
    assert [trial.effect.name for trial in outcome.trials] == ["bent"]
    assert parameters(outcome.final, "bent")["joint"] == 2


def test_forms_that_the_runs_do_not_tell_apart_are_rivals_by_their_form():
    outcome = search(problem(5, truth=Wave(bend=0.3)), FORMS, GATES)
    (rival,) = outcome.rivals
    assert set(rival.pair) == {"bent (joint 1)", "bent (joint 3)"}
    assert 0.3 < outcome.probability("bent") < 0.7


LAWS = tuple(
    replace(effect("bent", attribute), form=form, where={"joint": 1}, prior=0.5)
    for form, attribute in (("joint 1", "bend"), ("joint 1, amplified", "bend"))
)


def test_forms_of_one_cause_that_the_runs_do_not_tell_apart_leave_it_determined():
    outcome, verdict = judged(problem(5, truth=Wave(bend=0.3)), LAWS)
    assert verdict["status"] == "explained"
    assert not outcome.rivals
    assert outcome.probability("bent") == pytest.approx(1.0, abs=0.01)


def test_against_another_effect_the_forms_of_one_cause_count_together():
    """Of two laws and a twin that all describe the runs alike, the cause with the two laws has two thirds."""
    whole = tuple(replace(law, prior=1.0) for law in LAWS)
    outcome = search(problem(5, truth=Wave(bend=0.3)), (*whole, TWIN), GATES)
    assert outcome.names == ("bent",)
    assert outcome.weight["bent"] == pytest.approx(2 / 3, abs=0.05)
    assert {rival.other for rival in outcome.rivals} == {"twin"}


def test_the_best_of_many_places_must_be_better_than_chance_makes_it():
    """An effect whose place was sought among a thousand million needs as much more evidence."""
    task = problem(6, truth=Wave(bend=0.02))
    plain, sought = (search(task, (replace(BEND, sought=places),), GATES) for places in (1.0, 1e9))
    before, after = plain.trials[0].evidence, sought.trials[0].evidence
    assert plain.names == ("bend",)
    assert sought.names == ()
    assert after.p_value == pytest.approx(min(1.0, -np.expm1(1e9 * np.log1p(-before.p_value))))
    assert after.gain - sum(after.held_out.values()) == pytest.approx(-np.log(1e9))
