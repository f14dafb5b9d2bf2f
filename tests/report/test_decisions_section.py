"""Decisions and recommended cuts in the report: a line each on page one, a section, and the identity."""

from dataclasses import replace

import pytest
import synthetic_results as synthetic

from metro.report.batch_report import report_sections
from metro.report.campaign import campaign_sections
from metro.report.content import Paragraph, Table
from metro.report.sections.decisions import WHY, best_cut, decided, decisions
from metro.report.sections.identity import identity

JUDGED = [
    {"quantity": "flatness", "unit": "um", "where": run, "value": value, "ci95": [value - 3, value + 3],
     "lower": None, "upper": 50.0, "decision": decision, "probability": p}
    for run, value, decision, p in (
        ("r1", 44.0, "conforms", 0.9999),
        ("r2", 48.0, "undecided", 0.904),
        ("r3", 60.0, "does_not_conform", 0.0),
    )
]  # fmt: skip
CUT = {
    "position": "1", "spindle_rpm": 2500.0, "axial_depth_mm": 0.0612, "feed_per_tooth_mm": 0.05,
    "probability_stable": 0.975, "removal_cm3_min": 1.234, "torque_nm": 2.345, "power_kw": 0.613,
    "chatter_hz": 641.2, "advice": "use", "why": "tests_confirm_the_band",
}  # fmt: skip


def with_verdict(**more):
    results = synthetic.results()
    return replace(results, verdict={**results.verdict, **more})


def test_page_one_counts_the_decisions_and_names_what_does_not_conform():
    (line,) = decided({"decisions": JUDGED})
    assert line == (
        "Conformity (ISO 14253-1): of 3 results, 1 does not conform, 1 undecided, 1 conforms. "
        "Not conforming: flatness (minimum zone)."
    )
    assert decided({}) == []
    assert "2 conform." in decided({"decisions": [JUDGED[0]] * 2})[0]


def test_page_one_has_the_cut_that_removes_most_and_none_that_is_advised_against():
    better = {**CUT, "removal_cm3_min": 9.9, "advice": "do_not", "why": "verdict_unexplained"}
    (line,) = best_cut({"recommended_cuts": [better, CUT]})
    assert line.startswith(
        "Recommended cut: 2500 rpm, 0.061 mm deep (position 1): stable with probability 0.975"
    )
    assert line.endswith(WHY["tests_confirm_the_band"])
    assert best_cut({"recommended_cuts": [better]}) == []


def test_of_several_positions_that_which_bears_least_gives_the_recommended_cut():
    deeper = {**CUT, "position": "2", "axial_depth_mm": 0.08, "removal_cm3_min": 9.0}
    slower = {
        **CUT,
        "axial_depth_mm": 0.09,
        "removal_cm3_min": 0.01,
    }  # at the same position, but removes less
    (line,) = best_cut({"recommended_cuts": [deeper, CUT, slower]})
    assert "0.061 mm deep (position 1, which bears least of 2; position 2 bears 0.080 mm" in line


def test_what_to_do_is_said_once_whatever_the_reasons():
    near = {**CUT, "advice": "try", "why": "no_test_below_the_band"}
    far = {**CUT, "advice": "try", "why": "no_test_at_such_a_speed"}
    section = decisions(with_verdict(recommended_cuts=[near, far]))
    (told,) = [item.text for item in section.items if isinstance(item, Paragraph)]
    assert told.count("Begin at half the depth and listen.") == 1
    assert "No test cut confirms this boundary." in told
    assert "The test cuts were made at other speeds." in told


def test_where_cuts_have_several_reasons_each_is_said_of_its_rows():
    used = {**CUT, "advice": "use", "why": "tests_confirm_the_band", "spindle_rpm": 3000.0}
    not_used = {**CUT, "advice": "do_not", "why": "tests_chatter_below_the_band"}
    other = {**not_used, "position": "2"}
    section = decisions(with_verdict(recommended_cuts=[used, not_used, other]))
    (told,) = [item.text for item in section.items if isinstance(item, Paragraph)]
    assert told == (
        f"Position 1 at 3000 rpm: {WHY['tests_confirm_the_band']} "
        f"Position 1 at 2500 rpm and 2: {WHY['tests_chatter_below_the_band']}"
    )


def test_the_summary_of_a_campaign_lists_the_best_cut_of_each_batch():
    forbidden = {**CUT, "advice": "do_not", "why": "verdict_unexplained"}
    verdicts = {
        "b1": {"observables": {}, "recommended_cuts": [forbidden]},
        "b2": {"observables": {}, "recommended_cuts": [CUT]},
    }
    sections = {section.title: section for section in campaign_sections(verdicts, {})}
    (bullets,) = sections["Recommended cuts"].items
    assert list(bullets.items) == [f"b2: {best_cut(verdicts['b2'])[0]}"]
    del verdicts["b2"]
    assert "Recommended cuts" not in {section.title for section in campaign_sections(verdicts, {})}


def test_the_table_begins_with_what_does_not_conform():
    section = decisions(with_verdict(decisions=JUDGED))
    (table,) = [item for item in section.items if isinstance(item, Table)]
    assert [row[1] for row in table.rows] == ["r3", "r2", "r1"]
    assert table.rows[0][2:] == ["60.0 ± 3.0", "–", "50", "µm", "does not conform", "< 0.001"]
    assert list(table.strong) == [0]


def test_many_results_are_cut_and_counted():
    section = decisions(with_verdict(decisions=JUDGED * 10))
    (table,) = [item for item in section.items if isinstance(item, Table)]
    assert len(table.rows) == 16
    assert "14 others" in table.caption


def test_cuts_that_must_not_be_used_are_listed_with_the_reason():
    section = decisions(
        with_verdict(recommended_cuts=[{**CUT, "advice": "do_not", "why": "verdict_unexplained"}])
    )
    (table,) = [item for item in section.items if isinstance(item, Table)]
    assert table.rows == [["1", "2500", "0.061", "0.050", "1.2", "2.3", "0.61", "641", "do not use"]]
    assert any(getattr(item, "text", "") == WHY["verdict_unexplained"] for item in section.items)


def test_a_bending_moment_that_is_known_is_beside_the_torque():
    section = decisions(with_verdict(recommended_cuts=[{**CUT, "bending_nm": 5.67}]))
    (table,) = [item for item in section.items if isinstance(item, Table)]
    assert table.rows[0][5] == "2.3, 5.7"
    assert "bending" in table.header[5]
    assert "bending" in table.caption
    without = decisions(with_verdict(recommended_cuts=[CUT]))
    (table,) = [item for item in without.items if isinstance(item, Table)]
    assert table.header[5] == "torque (N m)"
    assert "bending" not in table.caption


def test_a_report_has_the_section_after_page_one_only_where_something_is_decided():
    titles = [section.title for section in report_sections(with_verdict(decisions=JUDGED))]
    assert titles[1] == "Decisions"
    assert "Decisions" not in [section.title for section in report_sections(synthetic.results())]
    first = report_sections(with_verdict(decisions=JUDGED))[0]
    assert any(isinstance(item, Paragraph) and item.text.startswith("Conformity") for item in first.items[:4])


def test_the_summary_has_a_line_for_each_batch_with_tolerances():
    verdicts = {"one": {"decisions": JUDGED, "observables": {}}, "two": {"observables": {}}}
    section = next(s for s in campaign_sections(verdicts, {}) if s.title == "Conformity with tolerances")
    assert [text.partition(":")[0] for text in section.items[0].items] == ["one"]


def of_manifest(**manifest):
    results = synthetic.results()
    return identity(replace(results, batch=replace(results.batch, manifest=manifest)))


def test_who_measured_with_what_is_tabulated_and_gaps_are_said():
    items = of_manifest(
        measurement={"operator": "A. Smith", "temperature_c": 20.5},
        instruments={"dynamometer": {"serial": "0815", "calibration_due": "2027-03-01"}, "scanner": {}},
    )
    made, instruments = (item for item in items if isinstance(item, Table))
    assert made.rows == [["operator", "A. Smith"], ["date", "not stated"], ["temperature", "20.5 °C"]]
    assert instruments.rows == [
        ["dynamometer", "0815", "not stated", "2027-03-01"],
        ["scanner", "not stated", "not stated", "not stated"],
    ]


@pytest.mark.parametrize("manifest", [{}, {"instruments": {"dynamometer": {"rate_hz": 1e4}, "hammer": None}}])
def test_a_batch_that_states_none_of_it_has_no_table_of_blanks(manifest):
    assert of_manifest(**manifest) == []
