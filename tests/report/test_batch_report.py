"""The report of a batch: what it says, and that it says it the same way each time."""

import re
import subprocess
from dataclasses import replace

import pypdfium2
import pytest
import synthetic_results as synthetic

from metro.report.batch_report import drawn_once, report_pdf, report_sections
from metro.report.content import Paragraph, Picture, Section
from metro.report.document import Cover, compile_pdf
from metro.report.figures import lobes as lobe_figures
from metro.report.parameters import parameter_name
from metro.report.sections.causes import upstream
from metro.report.sections.verdict import verdict_words


def pdf_of(results):
    return report_pdf(results, report_sections(results))


def text_of(pdf):
    document = pypdfium2.PdfDocument(pdf)
    pages = [document[i].get_textpage().get_text_range() for i in range(len(document))]
    return [" ".join(page.split()) for page in pages]


@pytest.fixture(scope="module")
def pdf():
    return pdf_of(synthetic.results())


@pytest.fixture(scope="module")
def pages(pdf):
    return text_of(pdf)


def test_the_first_page_says_the_verdict_with_its_numbers(pages):
    for words in (
        "tool runout",
        "9.83 ± 0.31 µm",
        "11.80 ± 0.94 N",
        "2.10 ± 0.17 N",
        "r07 and r08",
        "scan the face clamped and free",
    ):
        assert words in pages[0]
    assert "Data quality" not in pages[0]
    assert "Data quality" in pages[1]


def test_every_part_is_there(pages):
    text = " ".join(pages)
    for words in (
        *("Identification", "Predicted against measured", "The closed loop", "Provenance", "Not identified"),
        *("3 samples missing", "no impacts.csv", "absorbed", "K_tc", "958.9 ± 6.0", "(7.255 ± 0.040)·10⁶"),
        *(
            "These effects cannot be detected in this batch",
            "from the column role of runs.csv",
            "grows along the path",
        ),
    ):
        assert words in text


def test_the_list_of_source_files_has_the_sum_that_sha256sum_would_give(pages):
    named = sorted(synthetic.results().sources.items())
    listed = "".join(f"{digest}  {name}\n" for name, digest in named)
    summed = subprocess.run(["sha256sum"], input=listed, capture_output=True, text=True, check=True)
    text = " ".join(pages)
    assert summed.stdout.split()[0] in text
    assert all(name in text and digest[:12] in text for name, digest in named)


def test_tables_are_numbered_without_gaps(pages):
    numbers = [int(number) for number in re.findall(r"Table (\d+)[.:]", " ".join(pages))]
    assert "signature" in " ".join(pages)  # of those who approve: a table without a title
    assert numbers == list(range(1, len(numbers) + 1))


def test_failed_checks_come_before_what_was_checked(pages):
    page = pages[1]
    assert page.index("3 samples missing") < page.index("What was checked")


def test_the_same_results_give_the_same_bytes(pdf):
    assert pdf_of(synthetic.results()) == pdf


def test_the_file_declares_archival_and_accessible_pdf(pdf):
    assert b"pdfaid:part" in pdf
    assert b"pdfuaid:part" in pdf


def test_errors_by_run_and_axis_come_from_the_comparison_table(pages):
    frame = synthetic.tables()["comparison"].query("run == 'r07' and axis == 'x'")
    before = ((frame["measured"] - frame["before"]) ** 2).mean() ** 0.5
    assert f"{before:.2f}" in " ".join(pages)


def test_a_batch_with_nothing_in_it_still_has_a_report_that_says_so():
    empty = replace(synthetic.results(), tables={}, identified={}, verdict={}, loop={}, sources={})
    text = " ".join(text_of(pdf_of(empty)))
    assert "no verdict" in text
    assert "Nothing could be identified" in text
    assert "nothing to compare" in text


def test_nothing_could_be_identified_is_not_said_of_faces_that_were():
    faces = {"r1": {"xm": {"value": 20.0, "ci95": [19.0, 21.0], "unit": "um"}}}
    some = replace(
        synthetic.results(), tables={}, identified={"format": 1, "faces": faces}, verdict={}, loop={}
    )
    text = " ".join(text_of(pdf_of(some)))
    assert "Nothing could be identified" not in text
    assert "are given in other sections: flatness of faces" in text


def test_modes_without_a_driving_point_have_no_stiffness_and_the_first_page_shows_a_response():
    modes = [
        {**mode, "stiffness": {"value": None, "unit": "N/m"}} for mode in synthetic.identified()["modes"]
    ]
    tables = {"frf_used": synthetic.responses().assign(response="9x")}
    some = replace(synthetic.results(), tables=tables, identified={"modes": modes}, verdict={}, loop={})
    first = text_of(pdf_of(some))[0]
    assert "most flexible mode" not in first
    assert "The highest response" in first


@pytest.mark.parametrize(
    ("status", "words"),
    [
        ("clean", "the base model explains the identification runs"),
        ("explained", "traced to tool runout (radius 9.83 ± 0.31 µm, angle 41.2 ± 2.4°)"),
        ("partly_explained", "A significant residual remains"),
        ("undetermined", "Possible causes: tool wear or charge drift."),
        ("unexplained", "no effect of the library explains"),
        ("insufficient", "too few identification runs to decide"),
    ],
)
def test_every_status_has_its_sentence(status, words):
    entry = synthetic.observable(
        status, effects=[synthetic.RUNOUT], indistinguishable=[["tool_wear", "charge_drift"]]
    )
    assert words in verdict_words("force", entry)


def test_what_is_no_rival_is_named_beside_those_that_are():
    """The cause that was proven comes first, one that is only possible last; a rival is not said twice."""
    pairs = [["tool_wear", "charge_drift"]]
    proven = synthetic.observable("undetermined", effects=[synthetic.RUNOUT], indistinguishable=pairs)
    assert "traced to tool runout (radius 9.83 ± 0.31 µm" in verdict_words("force", proven)
    assert "Beside these" not in verdict_words("force", proven)
    lead = [
        {**synthetic.RUNOUT, "probability": 0.6},
        {**synthetic.RUNOUT, "effect": "tool_wear", "probability": 0.6},
    ]
    said = verdict_words("force", {**proven, "effects": lead})
    assert "Beside these, a possible cause is tool runout (radius 9.83 ± 0.31 µm, angle 41.2 ± 2.4°)." in said
    assert "these runs do not determine which one" in said
    assert said.count("tool wear") == 1


def test_a_cause_that_is_not_certain_is_a_lead_and_nothing_is_traced_to_it():
    doubtful = {**synthetic.RUNOUT, "probability": 0.63}
    alone = verdict_words("force", synthetic.observable("explained", effects=[doubtful]))
    assert (
        "a possible cause of the difference from the base model is tool runout (radius 9.83 ± 0.31 µm, angle "
        "41.2 ± 2.4°)."
    ) in alone
    assert "traced to" not in alone
    beside = {**doubtful, "effect": "tool_wear"}
    both = verdict_words("force", synthetic.observable("explained", effects=[synthetic.RUNOUT, beside]))
    assert "traced to tool runout" in both
    assert "A possible cause of a further part of it is tool wear (radius 9.83 ± 0.31 µm" in both


def test_an_error_that_did_not_change_is_said_once():
    assert "goes from" not in verdict_words("force", synthetic.observable("unexplained", 5.0, 5.0))


def test_a_change_that_is_smaller_than_what_is_printed_is_no_fall():
    entry = synthetic.observable(before=11.8, after=11.79, effects=[synthetic.RUNOUT])
    said = verdict_words("force", entry)
    assert "falls" not in said
    assert "the error does not change" in said
    assert "The identification runs alone show what was found." in said


@pytest.mark.parametrize("status", ["unexplained", "partly_explained"])
def test_an_error_of_the_held_out_runs_alone_is_not_said_to_be_in_the_others(status):
    verification = {"ratio": 3.0, "holds": False, "words": "Verification contradicts the model."}
    for alone in (True, False):
        rest = synthetic.REST | ({"held_out_only": True} if alone else {})
        effects = [] if status == "unexplained" else [synthetic.RUNOUT]
        entry = synthetic.observable(status, verification=verification, unexplained=rest, effects=effects)
        said = verdict_words("force", entry)
        contradicted = "explains the identification runs, but the held-out runs contradict it" in said
        assert contradicted is (alone and status == "unexplained")
        assert ("Remaining error: grows along the path." in said) is alone
        assert ("error of the identification runs: grows along the path." in said) is not alone


def test_where_nothing_was_added_it_is_said_what_changed_the_error():
    fell = verdict_words("lobes", synthetic.observable("insufficient", before=0.34, after=0.23, unit="1"))
    assert "with the effects found in other observables" in fell
    named = verdict_words("force", synthetic.observable(effects=[synthetic.RUNOUT]))
    assert "other observables" not in named


@pytest.mark.parametrize(
    ("ratio", "holds", "shown"), [(0.9, True, False), (1.2, True, True), (3.0, False, True)]
)
def test_what_the_held_out_runs_do_not_show_is_said_to_be_seen_in_the_others_alone(ratio, holds, shown):
    verification = {"ratio": ratio, "holds": holds, "words": "Verification on 2 held-out runs."}
    said = verdict_words("force", synthetic.observable("unexplained", verification=verification))
    assert "over the identification runs the base model has a significant error" in said
    assert ("The held-out runs do not show it." not in said) is shown


def test_parameters_lose_the_unit_in_their_name():
    assert parameter_name("radius_um", {"value": 1.0, "unit": "um"}) == "radius"
    assert parameter_name("slope_n_s", {"value": 1.0, "unit": "N/s"}) == "slope"
    assert parameter_name("factor", {"value": 1.0, "unit": "1"}) == "factor"
    assert parameter_name("joint", 3) == "joint"


def test_without_a_verdict_the_first_page_says_what_was_identified():
    silent = replace(synthetic.results(), verdict={}, loop={})
    assert (
        "Identified: 1 mode, cutting coefficients, joint stiffness and flatness of faces."
        in text_of(pdf_of(silent))[0]
    )


def test_single_values_per_run_and_axis_are_tabulated_and_not_drawn_as_curves():
    one = synthetic.tables()["comparison"].query("observable == 'deformation'").iloc[:1]
    text = " ".join(text_of(pdf_of(replace(synthetic.results(), tables={"comparison": one}))))
    assert "Errors on held-out runs, rms (mm)" in text
    assert "Parity on held-out runs" in text
    assert "residual of all held-out runs" not in text


def test_a_cause_is_explained_in_a_sentence_and_each_explanation_is_given_once():
    forms = [{**synthetic.RUNOUT, "probability": p, "meaning": "The axes differ."} for p in (0.99, 0.99)]
    said = verdict_words("force", synthetic.observable("explained", effects=forms))
    assert said.count("The axes differ.") == 1


def test_an_effect_that_the_held_out_runs_do_not_ask_for_is_said_to_come_from_the_others():
    within = "within the noise floor there; the effect was identified from the other runs"
    entry = synthetic.observable("explained", before=1.0, after=0.9)
    assert within in verdict_words("force", {**entry, "noise_floor": 1.1})
    assert within not in verdict_words("force", {**entry, "noise_floor": 0.95})


def test_of_stability_the_tests_on_the_predicted_side_come_before_the_error_of_a_probability():
    entry = synthetic.observable("clean", 0.4, 0.2, unit="1", verification={"words": "28 of 32 are right."})
    said = verdict_words("lobes", entry)
    assert said.index("28 of 32") < said.index("0.40")


def chart(caption):
    return Picture(lobe_figures.positions_chart(synthetic.boundary()), caption, caption)


def test_a_figure_that_the_first_page_has_is_not_drawn_again():
    """The boundary of a batch without tests, and that of held-out tests, were drawn twice."""
    other = Picture(lobe_figures.methods_chart(synthetic.methods()), "Methods.", "")
    sections = [
        Section("Results", [chart("Lowest.")]),
        Section("Identification", [other, chart("The same.")]),
    ]
    first, second = drawn_once(sections)
    assert first == sections[0]
    assert second.items[0] is other
    assert second.items[1] == Paragraph("Drawn in section “Results”: The same.", "note")


@pytest.mark.parametrize("look", ["verdict", "warning"])
def test_a_box_is_not_torn_over_the_end_of_a_page(look):
    box = " ".join(f"word{i}" for i in range(150))
    sections = [
        Section(f"Part {i}", [*[Paragraph("A line.")] * (6 + i % 5), Paragraph(box, look)]) for i in range(12)
    ]
    pages = text_of(compile_pdf(Cover("A title", "batch", "metro"), sections))
    assert len(pages) > 3
    assert sum("word149" in page for page in pages) > 3
    for page in pages:
        assert page.count("word0 ") == page.count("word149")


def test_the_uncertainty_of_errors_by_origin_is_half_of_a_95_percent_interval_as_any_other():
    parts = {"total": 0.03, "upstream": 0.01, "own": 0.039, "doubt": 0.005, "share": -0.7}
    made = replace(
        synthetic.results(), loop={"chain": {"deformation": {"unit": "mm", "before": parts, "after": parts}}}
    )
    table = upstream(made).items[-1]
    assert table.rows[0][table.header.index("uncertainty")] == "0.00980 mm"
    assert "standard deviation" not in table.caption
