"""What is missing for one reason is told once, with all that it is missing for."""

from dataclasses import replace

import synthetic_results as synthetic

from metro.report.campaign import campaign_sections
from metro.report.content import Bullets, Table
from metro.report.sections.identification import identification
from metro.report.sections.loop import loop

NO_ARM = "cell bench: no arm.dh, nothing is known of the arm"


def test_what_was_not_identified_for_one_reason_shares_a_line():
    lacking = {"deformation": NO_ARM, "waviness": NO_ARM, "lobes": "no impacts.csv"}
    section = identification(replace(synthetic.results(), identified={"not_identified": lacking}, tables={}))
    (told,) = [item.items for item in section.items if isinstance(item, Bullets)]
    assert list(told) == [
        f"deformation of the wall and waviness of the wall: {NO_ARM}.",
        "stability: no impacts.csv.",
    ]


def test_the_campaign_names_the_quantities_of_one_reason_together():
    lacking = {"deformation": NO_ARM, "waviness": NO_ARM}
    sections = campaign_sections({}, {name: {"not_identified": lacking} for name in ("a", "b")})
    (table,) = [item for item in sections[-1].items if isinstance(item, Table)]
    assert table.rows == [
        ["no arm.dh, nothing is known of the arm", "deformation of the wall and waviness of the wall", "a, b"]
    ]


def test_effects_that_cannot_be_seen_for_one_reason_share_a_line():
    told = synthetic.told()
    hidden = [{"effect": name, "why": "no setup"} for name in ("cubic_form", "spindle_tilt")]
    told["observables"]["force"]["cannot_be_seen"] = hidden
    items = loop(replace(synthetic.results(), loop=told)).items
    lines = [line for item in items if isinstance(item, Bullets) for line in item.items]
    assert "cubic form and spindle tilt: no setup" in lines


def test_what_several_batches_are_to_measure_is_told_once_and_what_verdicts_need_first():
    def verdict(status, told):
        return {"observables": {"force": synthetic.observable(status, next_experiment=told)}}

    same = verdict("clean", "a slot")
    verdicts = {"a": same, "b": same, "c": verdict("unexplained", "x")}
    (section,) = [one for one in campaign_sections(verdicts, {}) if one.title == "What to measure next"]
    (told,) = section.items
    needless = "a and b, cutting force: a slot (optional: the verdict does not depend on it)"
    assert list(told.items) == ["c, cutting force: x", needless]
