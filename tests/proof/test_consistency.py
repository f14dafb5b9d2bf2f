"""What a report must not say beside its own figures; each rule sees what it is there for."""

import copy
import json

import pytest

from proof.consistency import checked, contradictions

WORDS = "Verification on 4 held-out runs: the error is 1.1 times that expected, which chance can explain."
ENTRY = {
    "status": "explained",
    "unit": "N",
    "noise_floor": 1.0,
    "before": {"rms": 5.0, "nrmse": 0.1, "ci95": [4.0, 6.0]},
    "after": {"rms": 1.1, "nrmse": 0.02, "ci95": [0.9, 1.4]},
    "verification": {"ratio": 1.1, "p_value": 0.3, "holds": True, "worse_runs": [], "words": WORDS},
    "effects": [
        {
            "effect": "tool_runout",
            "probability": 0.97,
            "parameters": {
                "radius_um": {"value": 9.0, "ci95": [8.0, 10.0], "unit": "um"},
                "pitch_deg": [{"value": 0.1, "ci95": [0.0, 0.2]}, {"value": 0.1, "ci95": [0.0, None]}],
            },
        }
    ],
    "candidates": [{"effect": "tool_wear", "probability": 0.01, "why_not": "not significant"}],
    "indistinguishable": [],
    "unexplained": None,
}
PAGE = f"Cutting force: explained, by tool runout (0.97). {WORDS}"
RESIDUAL = {"rms": 1.0, "unit": "N", "signature": "order 2"}


def verdict(**changes):
    """A verdict with one observable; keys with dots are changed further down."""
    entry = copy.deepcopy(ENTRY)
    for path, value in changes.items():
        *above, last = path.split("__")
        place = entry
        for key in above:
            place = place[int(key) if key.isdigit() else key]
        place[last] = value
    return {"observables": {"force": entry}}


def test_a_verdict_that_agrees_with_itself_has_no_contradiction():
    assert contradictions(verdict(), PAGE) == []
    assert contradictions(verdict(status="partly_explained", unexplained=RESIDUAL)) == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"effects": []}, "no effect is named"),
        ({"status": "clean"}, "clean, but tool_runout is named"),
        ({"status": "unexplained", "unexplained": RESIDUAL}, "unexplained, but tool_runout is named"),
        ({"unexplained": RESIDUAL}, "explained, but a residual is described"),
        ({"status": "partly_explained"}, "no residual is described"),
        ({"status": "clean", "effects": []}, "the error before differs from that after"),
        ({"after__ci95": [1.2, 1.4]}, "interval of the error after"),
        ({"before__ci95": [1.2, 1.4]}, "interval of the error before"),
        ({"before__rms": 1.0, "before__ci95": [0.9, 1.2]}, "the held-out error grew"),
        ({"verification__holds": False}, "the verification fails at p = 0.3"),
        ({"verification__p_value": 0.001}, "the verification holds at p = 0.001"),
        ({"verification__words": "Verification contradicts the model, can explain"}, "disagree"),
        (
            {"verification__words": "Verification: the error is 1.1 times."},
            "is not said to be one that chance",
        ),
        ({"verification__worse_runs": [{"run": "r77"}]}, "run r77 became worse"),
        ({"effects__0__probability": 1.2}, "has the probability 1.2"),
        ({"candidates__0__why_not": ""}, "tool_wear is neither named nor"),
        ({"effects__0__parameters__radius_um__value": 11.0}, "interval of radius_um"),
        ({"effects__0__parameters__pitch_deg__0__value": -1.0}, "interval of pitch_deg"),
    ],
)
def test_each_contradiction_is_found(changes, said):
    assert any(said in words for words in contradictions(verdict(**changes))), changes


@pytest.mark.parametrize(
    ("page", "said"),
    [
        (PAGE.replace("explained", "clean", 1), "does not say 'explained'"),
        (PAGE.replace("1.1 times", "0.9 times"), "sentence on the verification"),
        (PAGE.replace("tool runout", "tool wear"), "does not name tool_runout"),
    ],
)
def test_a_report_that_says_something_else_than_the_file_is_found(page, said):
    assert any(said in words for words in contradictions(verdict(), page))


def test_nothing_is_proven_at_a_probability_below_95_percent():
    page = PAGE + " Proven."
    assert contradictions(verdict(), page) == []
    (words,) = contradictions(verdict(effects__0__probability=0.9), page)
    assert "proven" in words


def test_a_folder_of_reports_is_checked_batch_by_batch(tmp_path):
    for name, one in (("good", verdict()), ("bad", verdict(effects=[]))):
        (tmp_path / name).mkdir()
        (tmp_path / name / "verdict.json").write_text(json.dumps(one))
    found = checked(tmp_path)
    assert found["good"] == []
    assert found["bad"]
