"""Settings and flatness in the report: what is said from which block, and nothing where there is none."""

from dataclasses import replace

import pytest
import synthetic_results as synthetic

from metro.report.content import Bullets, Heading, Paragraph, Picture, Table
from metro.report.document import Cover, compile_pdf
from metro.report.sections.study import study
from metro.report.sections.summary import summary

q = synthetic.q
NAMES = [("A", "L"), ("A", "T"), ("B", "L"), ("B", "T")]


def rows(key="xm"):
    return [
        {"configuration": f"wrist {w}, orientation {o}", "levels": {"wrist": w, "orientation": o}}
        | {"runs": [f"r{i}"], key: q(70.0 + 20 * i, 4.0, "um"), "probability_best": (0.9, 0.1, 0.0, 0.0)[i]}
        | ({"xm_predicted": 50.0 + 15 * i} if key == "xm" else {})
        for i, (w, o) in enumerate(NAMES)
    ]


def term(name, levels, p):
    return {
        "term": name,
        "f": 5.0,
        "p_value": p,
        "dof": [1, 8],
        "levels": levels,
        "p_holm": {"xa": p, "fltt": 0.5},
    }


def level(names, over):
    return {"level": names, "over": over, "factor": q(1.3, 0.1, "1"), "difference": q(30.0, 9.0, "um")}


def measured():
    agreement = {"spearman": q(0.94, 0.05, "1"), "p_value": 0.008, "pairs": 6, "alike": 0.93}
    return {
        "runs": 12,
        "factors": [{"name": "wrist", "levels": ["A", "B"], "same_as": ["pose"]}],
        "counted_as_scatter": [],
        "not_separable": [{"term": "wrist × depth", "from": ["wrist"], "in_part": True}],
        "mean": q(96.0, 3.0, "um"),
        "scatter": 0.032,
        "dof": 8,
        "terms": [
            term("wrist", [level(["B"], "A")], 0.002),
            term("wrist × orientation", [level([w, o], "mean") for w, o in NAMES], 0.4),
        ],
        "ranking": rows(),
        "agreement": agreement | {"sure_pairs": 5, "sure_alike": 1.0},
        "after_loop": {"ranking": [r | {"xm_predicted": 71.0} for r in rows()], "agreement": agreement},
    }


def planned():
    return {
        "advice": {"measured": False, "statement": "Nothing was measured of these runs.", "left_out": []}
    } | {}


def results(block):
    return replace(synthetic.results(), identified={"study": block})


def of_kind(section, kind):
    return [item for item in section.items if isinstance(item, kind)]


def test_without_a_study_there_is_no_section():
    assert study(results({})) is None
    assert study(results({"not_identified": {"factorial": "no factor varies between the runs"}})) is None


def test_effects_stand_with_intervals_and_the_significant_ones_stand_out():
    section = study(results(measured()))
    table = of_kind(section, Table)[0]
    assert table.rows[0] == ["wrist", "B over A", "× 1.30 ± 0.10", "30.0 ± 9.0 µm", "0.002", "X_a"]
    assert table.rows[1][1] == "B, T beyond both alone"
    assert list(table.strong) == [0]
    assert len(table.rows) == 2


def test_what_the_runs_cannot_tell_apart_is_said():
    told = " ".join(" ".join(item.items) for item in of_kind(study(results(measured())), Bullets))
    assert "wrist and pose vary together" in told
    assert "wrist × depth cannot be separated from wrist in part" in told


def test_the_ranking_has_both_predictions_and_says_how_far_they_agree():
    section = study(results(measured()))
    table = of_kind(section, Table)[1]
    assert list(table.header)[-2:] == ["predicted (µm)", "with effects"]
    assert table.rows[0] == ["wrist A, orientation L", "70.0 ± 4.0", "0.900", "50.0", "71.0"]
    told = of_kind(section, Bullets)[-1].items
    assert "0.94 (0.89 … 0.99)" in told[0]
    assert "of the 5 whose measured order is sure, 100 %" in told[0]
    assert told[1].startswith("Prediction with the effects found")
    assert len(of_kind(section, Picture)) == 2


def advice():
    block = planned()
    block["advice"]["configurations"] = rows("xm_predicted")
    return block


def test_advice_comes_with_the_warning_that_nothing_was_measured():
    section = study(results(advice()))
    warning = next(item for item in of_kind(section, Paragraph) if item.look == "warning")
    assert "Nothing was measured" in warning.text
    assert [item.text for item in of_kind(section, Heading)] == ["Before cutting"]
    assert of_kind(section, Table)[0].rows[0] == ["wrist A, orientation L", "r0", "70.0 ± 4.0", "0.900"]


def test_the_first_page_names_the_best_planned_configuration():
    text = " ".join(item.text for item in of_kind(summary(results(advice())), Paragraph))
    assert "wrist A, orientation L is predicted to be the flattest" in text
    assert "4 runs are planned, not cut" in text


def test_a_printed_study_has_the_bias_and_what_a_table_cannot_tell():
    block = measured() | {"printed": True, "cannot_tell": ["Every case is printed once."]}
    block["bias"] = {"mean": q(1.16, 0.11, "1"), "scatter": 0.1, "dof": 4, "terms": block["terms"][:1]}
    text = " ".join(item.text for item in of_kind(study(results(block)), Paragraph))
    assert "1.16 ± 0.11 times the simulated one" in text
    assert "It depends on wrist" in text


@pytest.mark.parametrize("block", [measured(), advice()])
def test_the_section_is_set_as_a_pdf(block):
    assert compile_pdf(Cover("t", "s", "f"), [study(results(block))]).startswith(b"%PDF")
