"""The first page begins with what contradicts the batch."""

from types import SimpleNamespace

from metro.report.content import Paragraph, Section
from metro.report.sections.contradictions import with_contradictions

FIRST = Section("Summary", [Paragraph("what was measured")])


def page(contradictions, entries):
    results = SimpleNamespace(verdict={"contradictions": contradictions}, verdicts=lambda: entries)
    return [item.text for item in with_contradictions(FIRST, results).items]


def test_a_contradiction_comes_before_everything_else():
    slip = {"words": "K_tc is negative. Likely: axes: {x: -y}.", "observables": ["force"]}
    texts = page([slip], {"force": {"misses": 0.9}})
    assert texts[0].startswith("Correct this first")
    assert texts[1:] == [slip["words"], "what was measured"]


def test_a_model_that_misses_half_of_the_signal_says_so_first_and_what_to_check():
    texts = page([], {"flatness": {"misses": 0.62}, "force": {}})
    assert "misses 62 % of the signal" in texts[1]
    assert "which scan belongs to which run" in texts[1]


def test_a_page_without_either_is_as_it_was():
    assert page([], {"force": {}}) == ["what was measured"]
