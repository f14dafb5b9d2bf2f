"""What may be relied on: how far, for which cuts, which causes; and where the verdict needs nothing more."""

from dataclasses import replace

import pandas as pd
import pytest
import synthetic_results as synthetic

from metro.report.content import Picture, Table
from metro.report.results import Results, without_lone_intervals
from metro.report.sections.summary import first_words, summary
from metro.report.sections.trust import IDENTIFIED, MEASURED, PRINTED, UNTESTED, trust, trust_in, untested
from metro.report.sections.verdict import next_words, remedies

RUNS = pd.DataFrame(
    {
        "role": ["identify", "validate", "validate", "validate"],
        "operation": ["slot", "slot", "side", "side"],
        "direction": ["slot", "slot", "up", "down"],
        "feed_per_tooth_mm": [0.1, 0.05, 0.08, 0.12],
        "axial_depth_mm": 2.0,
        "radial_depth_mm": [12.0, 12.0, 4.0, 4.0],
        "spindle_rpm": 6000.0,
    },
    index=pd.Index(["r1", "r2", "r3", "r4"], name="run"),
)


def results(**observables) -> Results:
    batch = replace(synthetic.batch(), runs=RUNS)
    return replace(synthetic.results(), batch=batch, verdict={"observables": observables}, loop={})


def entry(status="clean", runs=("r2", "r3", "r4"), **more):
    return synthetic.observable(status, 10.0, 2.0, held_out_runs=list(runs), **more)


def test_a_prediction_holds_to_the_upper_end_of_its_interval_for_the_cuts_that_tested_it():
    (said,) = trust(results(force=entry()))
    assert said.startswith("Cutting force: the predictions are accurate to 2.2 N rms (1.8 % of the signal).")
    assert "side and slot cuts, direction down and up" in said
    assert "feed per tooth 0.05 to 0.12 mm and radial depth 4 and 12 mm" in said
    assert said.endswith("at one axial depth (2 mm) and spindle speed (6000 rpm) only.")


def test_without_an_interval_it_is_said_that_there_is_none():
    (said,) = trust(results(force=entry(runs=["r2"])))
    assert "accurate to 2.0 N rms (1.7 % of the signal; one condition: no interval)." in said


def test_a_setting_of_which_one_level_alone_was_tested_is_named():
    (said,) = trust(results(force=entry(runs=["r3"])))
    assert "Tested on side cuts, at one direction (up), feed per tooth (0.08 mm)" in said


def test_a_setting_that_the_whole_batch_shares_is_no_limit_of_the_test():
    posed = results(force=entry())
    posed = replace(
        posed, batch=replace(posed.batch, runs=RUNS.assign(pose="p1", wrist=["A", "B", "B", "B"]))
    )
    (said,) = trust(posed)
    assert "at one wrist (B), axial depth" in said
    assert "pose" not in said


@pytest.mark.parametrize("status", ["partly_explained", "undetermined", "unexplained"])
def test_predictions_that_miss_something_are_not_to_be_relied_on(status):
    (said,) = trust(results(force=entry(status, noise_floor=0.5)))
    assert "do not use the predictions" in said
    assert "4.0 times the noise" in said


@pytest.mark.parametrize(("ratio", "within"), [(0.9, True), (1.3, False)])
def test_what_holds_on_the_held_out_runs_is_trusted_for_such_cuts_alone(ratio, within):
    verification = {"holds": True, "ratio": ratio, "words": ""}
    (said,) = trust(results(force=entry("unexplained", noise_floor=0.5, verification=verification)))
    assert ("on the held-out runs the predictions are accurate to" in said) is within
    assert ("do not use the predictions for other cuts than those" in said) is within
    assert ("do not use the predictions, which have an error" in said) is not within


def test_without_enough_runs_nothing_is_to_be_relied_on():
    assert (
        "no prediction was tested, so none can be relied on"
        in trust(results(force=entry("insufficient", runs=[])))[0]
    )


def test_a_sure_cause_is_a_finding_and_a_likely_one_a_lead():
    effects = [
        {"effect": "tool_runout", "probability": 0.99, "parameters": {}},
        {"effect": "tool_wear", "probability": 0.6, "parameters": {}},
    ]
    said = trust_in(results(force=entry("explained", effects=effects)), "force")
    assert "Identified cause: tool runout (probability 0.990)." in said
    assert "Possible cause: tool wear (probability 0.600)." in said
    assert "the predictions with the effects found are accurate" in said


def test_the_probability_that_causes_share_is_stated_once():
    effects = [
        {"effect": name, "probability": chance, "parameters": {}}
        for name, chance in (("tool_runout", 0.9999), ("tool_end", 0.97), ("uneven_teeth", 0.9999))
    ]
    said = trust_in(results(force=entry("explained", effects=effects)), "force")
    expected = "tool runout and uneven teeth (each with probability > 0.999); tool end (probability 0.970)."
    assert f"Identified causes: {expected}" in said


def test_verdicts_that_the_same_cuts_tested_share_a_paragraph():
    both = trust(results(force=entry(), waviness=entry(unit="um")))
    assert len(both) == 1
    assert both[0].count("Tested on") == 1
    apart = trust(results(force=entry(), waviness=entry(unit="um", runs=["r2"])))
    assert len(apart) == 2


def test_the_error_of_a_probability_is_no_share_of_a_signal():
    assert (
        "0.12 rms of the probability"
        in trust(results(lobes=synthetic.observable("clean", 0.4, 0.11, unit="1")))[0]
    )


def test_without_a_verdict_it_is_said_that_no_prediction_was_tested():
    assert trust(results()) == [IDENTIFIED]


def test_what_was_not_identified_does_not_hold_within_an_interval():
    assert untested({"format": 1, "arm": {"not_identified": {"waviness": "no arm"}}, "faces": {}}) == UNTESTED
    assert untested({"faces": {"r1": {}}, "texture": {"r1": {}}, "arm": {"not_identified": {}}}) == MEASURED
    assert untested({"faces": {"r1": {}}, "modes": [{}]}) == IDENTIFIED
    assert untested({"modes": [{}]}, printed=True) == PRINTED


def test_what_to_measure_next_says_where_the_verdict_does_without():
    assert (
        next_words(entry("clean", next_experiment="a slot."))
        == "a slot (optional: the verdict does not depend on it)"
    )
    assert next_words(entry("unexplained", next_experiment="a slot.")) == "a slot"
    assert next_words(entry("clean", next_experiment=None)) == ""


def test_a_remedy_is_given_for_causes_that_are_identified_and_for_no_others():
    causes = [
        {
            "effect": "gear_ripple",
            "probability": 0.97,
            "parameters": {"joint": 4},
            "remedy": "check it",
        },
        {"effect": "tool_runout", "probability": 0.9, "parameters": {}, "remedy": "clamp the tool anew"},
        {"effect": "helix_error", "probability": 1.0, "parameters": {}, "remedy": ""},
    ]
    assert remedies(entry("explained", effects=causes)) == ["gear ripple of joint 4: check it"]
    assert remedies(entry("clean", effects=[])) == []


def test_the_first_page_of_a_batch_without_a_verdict_gives_the_mode_that_yields_most():
    modes = synthetic.identified()["modes"]
    stiff = {**modes[0], "stiffness": synthetic.q(1e9, 1e7, "N/m")}
    soft = {**modes[0], "stiffness": synthetic.q(2e6, 1e5, "N/m"), "damping": synthetic.q(0.05, 0.001, "1")}
    silent = replace(
        results(), identified={"modes": [stiff, soft]}, tables={"frf_used": synthetic.responses()}
    )
    items = summary(silent).items
    (table,) = (item for item in items if isinstance(item, Table))
    ((name, value, _),) = table.rows
    assert name == "most flexible mode"
    assert "receptance 5.00·10⁻⁶ m/N" in value  # 1 / (2 · 0.05 · 2e6)
    (picture,) = (item for item in items if isinstance(item, Picture))
    assert "highest response" in picture.caption
    assert any("Identified: 2 modes" in getattr(item, "text", "") for item in first_words(silent))


@pytest.mark.parametrize(("holds", "words"), [(True, "agree with the prediction"), (False, "contradict")])
def test_where_nothing_can_be_decided_the_held_out_tests_are_told_of_all_the_same(holds, words):
    tested = {**entry("insufficient", runs=["r07"]), "verification": {"holds": holds}}
    said = trust(results(force=tested))[0]
    assert words in said
    assert "Too few tests have the role identify" in said
    assert ("do not use the predictions" in said) is not holds


def test_a_verification_that_fails_says_not_to_use_the_predictions_whatever_the_status():
    for status in ("clean", "explained"):
        good, bad = (
            trust(results(force={**entry(status, runs=["r07"]), "verification": {"holds": holds}}))[0]
            for holds in (True, False)
        )
        assert "predictions are accurate to" in good
        assert "do not use the predictions" in bad


def test_repeats_of_one_condition_have_no_interval_of_an_error_in_any_report():
    error = {"rms": 2.0, "nrmse": 0.1, "ci95": [1.0, 4.0]}
    told = {"force": {"held_out_runs": ["r1", "r2"], "before": error, "after": error}}
    runs = pd.DataFrame({"condition": ["slot", "slot"]}, index=["r1", "r2"])
    alone = without_lone_intervals({"observables": told}, runs)["observables"]["force"]
    assert alone["before"] == alone["after"] == {**error, "ci95": None}
    several = runs.assign(condition=["slot", "side"])
    assert without_lone_intervals({"observables": told}, several)["observables"] == told
