"""The contents of verdict.json and loop.json, made of findings alone."""

import json

import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.batch.processed import write_batch, write_json, write_table
from metro.batch.provenance import stages
from metro.stages.verdict import verdict
from metro.wording.batch import story_of, verdict_in_words, verdict_of
from metro.wording.causes import cause_in_words

FIGURES = {"rms": 12.34, "nrmse": 0.2, "ci95": [11.0, 13.0]}
VERDICT = {
    "status": "unexplained",
    "unit": "um",
    "before": FIGURES,
    "after": FIGURES,
    "effects": [],
    "candidates": [{"effect": "tool_wear", "why_not": {"code": "beaten", "values": {}}}],
    "indistinguishable": [],
    "next_experiment": {"code": "any_tests", "values": {"held_out": 0, "enough": False}},
    "unexplained": {
        "rms": None,
        "signature": {"code": "residual", "values": {"parts": [{"code": "unbelieved", "values": {}}, "b"]}},
    },
}
CAUSE = {
    "cause": "tool_wear",
    "where": {"joint": 3},
    "status": "one_observable",
    "probability": 0.9,
    "parameters": {},
    "seen_in": ["joint_force", "lobes"],
    "witnesses": [],
    "agreement": None,
    "or_else": [],
}
FINDINGS = {
    "effects": {"tool_wear": {"belongs_to": ["tool"]}},
    "format": 1,
    "batch": "slots",
    "metro": "1.2.3",
    "observables": {"force": {"verdict": VERDICT, "story": {"unit": "um", "notes": ["as it is"]}}},
    "causes": [CAUSE],
    "chain": {},
}


def test_the_verdict_holds_sentences_and_of_a_cause_what_is_brief():
    content = verdict_of(FINDINGS)
    assert list(content) == ["format", "batch", "metro", "observables", "causes"]
    entry = content["observables"]["force"]
    assert (
        entry["unexplained"]["signature"]
        == "with what stays unexplained beside it, it is not likelier than not to be the cause; b"
    )
    assert entry["candidates"][0]["why_not"].startswith("passed every test")
    assert entry["next_experiment"].startswith("tests with a stable or unstable label")
    (cause,) = content["causes"]
    assert list(cause) == ["cause", "where", "status", "probability", "parameters", "seen_in"]


def test_the_story_ends_with_the_verdict_in_a_sentence():
    content = story_of(FINDINGS)
    assert list(content) == ["format", "batch", "observables", "effects", "causes", "chain"]
    story = content["observables"]["force"]
    assert story["notes"] == ["as it is"]
    assert story["words"] == (
        "There is a significant residual that no effect of the library explains; nothing was added. "
        "On held-out runs the error is 12.3 µm rms before and 12.3 µm after."
    )
    assert content["causes"][0]["words"] == (
        "tool wear of joint 3: seen in joint force; no other observable of this batch could show it."
    )


@pytest.mark.parametrize(
    ("chances", "words"),
    [
        ({"a_b": 0.99}, "by a b."),
        ({"a": 0.99, "b": 0.94}, "by a and b (possible)."),
        ({"a": 1.0, "b": 0.96, "c_d": 0.95}, "by a, b and c d."),
    ],
)
def test_effects_are_named_in_a_row_with_those_that_are_only_possible(chances, words):
    effects = [{"effect": name, "probability": chance} for name, chance in chances.items()]
    entry = {**VERDICT, "status": "explained", "effects": effects, "unexplained": None, "before": None}
    assert verdict_in_words(entry) == f"The residual is explained {words}"


def test_where_a_further_cause_is_undetermined_the_proven_one_is_said_first():
    effects = [
        {"effect": "stiffness_scale", "probability": 0.99},
        {"effect": "joint_backlash", "probability": 0.4},
    ]
    pairs = [["joint_backlash", "tip_give"]]
    told = {"status": "undetermined", "effects": effects, "indistinguishable": pairs, "before": None}
    words = verdict_in_words({**VERDICT, **told, "unexplained": None})
    assert words.startswith("Part of the residual is explained by stiffness scale. Several effects explain ")


def test_a_contradiction_says_how_probable_such_differences_are():
    size = {"value": 1.0, "ci95": [0.5, 1.5], "unit": "um"}
    witness = {"observable": "force", "says": "found it", "parameters": {"radius_um": size, "joint": 3}}
    cause = {**CAUSE, "status": "contradiction", "witnesses": [witness], "agreement": {"p_value": 0.0012}}
    words = cause_in_words({**cause, "or_else": ["pitch error"]})
    assert "force found it (radius 1 ± 0.5 µm)" in words
    assert words.endswith(
        "not one common cause (alternative explanation: pitch error) (p = 0.0012): one of them has a "
        "further cause, or a wrong input."
    )


def test_the_stage_writes_both_files_and_with_which_code(tmp_path):
    processed, reports = tmp_path / "processed", tmp_path / "reports"
    write_json(processed / "findings.json", FINDINGS)
    write_json(reports / "identified.json", {})
    write_batch(processed, Batch("b", {}, {}, pd.DataFrame({"run": []}).set_index("run"), {}), {})
    write_table(processed / "lobes_final.parquet", pd.DataFrame())
    verdict(processed, reports, {}, "c0de")
    assert json.loads((processed / "loop.json").read_text()) == story_of(FINDINGS)
    assert json.loads((reports / "verdict.json").read_text()) == verdict_of(FINDINGS)
    assert stages(processed, {}, "other") == {
        "verdict": {"code": "c0de", "settings": {}},
        "report": {"code": "other", "settings": {}},
    }
