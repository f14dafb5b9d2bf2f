"""The campaign's memory in the summary."""

import numpy as np
import pypdfium2
import pytest

from metro.report.campaign import campaign_report
from metro.report.content import Bullets, Picture, Table
from metro.report.figures.memory import courses
from metro.report.sections.memory import memory_section


def row(course="trend", q=0.001, **more):
    n = 6
    value = np.linspace(14.0, 17.0, n)
    track = np.stack([value - 0.3, value, value + 0.3], axis=1)
    change = {"value": 3.0, "ci95": [2.4, 3.6], "unit": "N/mm"}
    return {
        "owner": "cell-a, tool 12 mm",
        "observable": "",
        "effect": "",
        "quantity": "cutting coefficient kte",
        "unit": "N/mm",
        "clock": "batches",
        "batches": [f"b-{i}" for i in range(1, n + 1)],
        "found": [],
        "t": list(range(1, n + 1)),
        "value": value.tolist(),
        "sd": [0.2] * n,
        "course": course,
        "p_value": q,
        "q_value": q,
        "weights": {"constant": 0.0, "trend": 0.7, "levels off": 0.3},
        "mean": {"value": 15.5, "ci95": [14.5, 16.5], "unit": "N/mm"},
        "change": change if course != "steady" else None,
        "step_between": ["b-3", "b-4"] if course == "step" else None,
        "track": track.tolist(),
        "next": {"t": 7, "value": 17.6, "ci95": [16.9, 18.3], "unit": "N/mm"},
        "scatter": 0.1,
    } | more


POOLED = {
    "owner": "cell-a",
    "observable": "flatness",
    "effect": "thermal_growth",
    "quantity": "rate_um_per_min",
    "unit": "um/min",
    "batches": [f"b-{i}" for i in range(1, 7)],
    "estimate": {"value": 0.5, "ci95": [0.3, 0.7], "unit": "um/min"},
    "same_sign": 6,
    "best_alone": 1.7,
    "p_value": 0.001,
    "q_value": 0.004,
    "size": 0.012,
    "budget": 0.007,
    "shown": True,
    "below_budget": False,
}


def told(memory):
    (section,) = memory_section(memory)
    return section, " ".join(
        sentence for item in section.items if isinstance(item, Bullets) for sentence in item.items
    )


def test_a_trend_is_told_with_its_size_its_doubt_and_the_next_value():
    section, text = told({"series": [row(), row("steady", 0.6)]})
    assert "cutting coefficient kte goes by 3.00 ± 0.60 N/mm from b-1 to b-6, steadily" in text
    assert "changes, then levels off 30 %" in text
    assert "next batch is to measure 17.60 ± 0.70 N/mm" in text
    (table,) = (item for item in section.items if isinstance(item, Table))
    assert [line[5] for line in table.rows] == ["trend", "no change shown"]
    assert sum(isinstance(item, Picture) for item in section.items) == 1


@pytest.mark.parametrize(
    ("clocks", "words"),
    [
        (["hours", "days"], "in which their first runs started."),
        (["batches", "batches"], "in the order of their names, because"),
        (["hours", "batches"], "those of 1 in the order of their names"),
    ],
)
def test_it_is_said_by_what_the_batches_are_ordered(clocks, words):
    section, _ = told({"series": [row(clock=clock) for clock in clocks]})
    assert words in section.items[0].text


def test_a_step_names_the_batches_that_it_lies_between():
    _, text = told({"series": [row("step")]})
    assert "between b-3 and b-4: what was changed there?" in text


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({}, "thermal growth, rate is 0.50 ± 0.20 µm/min by 6 batches together"),
        ({"shown": False, "below_budget": True}, "within the stated model accuracy"),
        ({"shown": False}, "All batches together show no effect that none shows alone."),
    ],
)
def test_what_only_all_batches_show_is_told_with_its_size_or_that_it_is_nobodys(more, words):
    _, text = told({"pooled": [POOLED | more]})
    assert words in text


def test_what_comes_back_and_what_it_says_of_an_undecided_batch():
    share = {"value": 0.8, "ci95": [0.5, 0.95], "unit": "1"}
    known = {"cell": "cell-a", "observable": "force", "effect": "tool_runout", "share": share}
    known |= {"found": ["b-1"], "tried": ["b-1", "b-2"]}
    elsewhere = {"tool_runout": [1, 2], "pitch_error": [0, 2]}
    undecided = [{"batch": "b-3", "observable": "force", "elsewhere": elsewhere}]
    section, text = told({"recurring": [known], "undecided": undecided})
    (table,) = (item for item in section.items if isinstance(item, Table))
    assert table.rows[0][3] == "1 of 2"
    assert "tool runout in 1 of 2 and pitch error in 0 of 2" in text


def test_without_history_there_is_no_section():
    assert memory_section({"series": [], "pooled": [], "recurring": [], "undecided": []}) == []


def test_the_figure_has_a_panel_per_series_with_the_next_batch_beyond_the_last():
    figure = courses([row(), row("step"), row()], ["one", "two", "three"])
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title(loc="left") for axes in shown] == ["one", "two", "three"]
    assert shown[0].get_xlim()[1] > 7


def test_the_summary_shows_the_memory():
    pdf = pypdfium2.PdfDocument(campaign_report({}, {}, {"series": [row()], "pooled": [POOLED]}))
    text = " ".join(" ".join(page.get_textpage().get_text_range() for page in pdf).split())
    assert "Over the batches" in text
    assert "What only all batches show" in text
