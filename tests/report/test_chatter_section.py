"""Chatter in the report: points on the lobes, records against labels and prediction, roughness."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import synthetic_results as synthetic

from metro.report.content import Bullets, Paragraph, Picture, Section, Table
from metro.report.figures import chatter as figures
from metro.report.sections.chatter import chatter_flags, chatter_items
from metro.report.sections.quality import with_flags
from metro.report.style import to_svg

RUNS = pd.DataFrame(
    {
        "run": ["a", "b", "c", "d", "e"],
        "rpm": [1500.0, 1500.0, 2000.0, 2500.0, 3000.0],
        "depth_mm": [0.5, 1.5, 1.8, 1.2, 1.0],
        "probability": [0.01, 0.99, 0.97, 0.5, 0.02],
        "chatter_hz": [None, 68.0, 80.5, None, None],
        "chatter_sd_hz": [None, 0.03, 0.1, None, None],
        "kind": ["forced", "hopf", "flip", "unknown", "forced"],
        "separable": [True, True, True, False, True],
        "labelled": [0, 0, 1, 1, -1],
        "ra_um": [0.4, 0.6, 0.8, 0.5, 0.2],
        "rz_um": [2.0, 3.0, 4.0, 2.5, 1.0],
    }
)
CHANCES = [0.1, 0.9, 0.8, 0.5, 0.7]
LOBES = RUNS[["run"]].assign(position="1", own_modes=True, predicted_hz=66.0, probability_unstable=CHANCES)


@pytest.fixture
def items():
    tables = {**synthetic.tables(), "chatter_runs": RUNS, "lobe_runs": LOBES}
    made = synthetic.results()
    teeth = replace(made.batch, manifest={**made.batch.manifest, "tool": {"teeth": 4}})
    return chatter_items(replace(made, batch=teeth, tables=tables))


def tables_of(items):
    return [item for item in items if isinstance(item, Table)]


def test_each_run_has_its_frequency_and_the_phase_from_tooth_to_tooth(items):
    row = tables_of(items)[0].rows[1]
    assert row[3:6] == ["0.990", "Hopf", "68.000 ± 0.059"]
    assert row[6:] == ["0.68", "0.66"]  # 68 and 66 Hz at 100 passings per second
    assert tables_of(items)[0].rows[0][5:] == ["–", "–", "–"]


def test_records_are_counted_against_labels_and_prediction(items):
    label, predicted = tables_of(items)[1].rows
    # a stable/stable, b chatter/stable, c chatter/chatter; d is not told, e has no label
    assert label[1:] == ["1", "0", "1", "1", "67 %"]
    assert predicted[1:] == ["1", "1", "0", "2", "75 %"]


def test_a_prediction_with_the_modes_of_another_place_is_not_compared():
    tables = {**synthetic.tables(), "chatter_runs": RUNS, "lobe_runs": LOBES.assign(own_modes=False)}
    made = synthetic.results()
    teeth = replace(made.batch, manifest={**made.batch.manifest, "tool": {"teeth": 4}})
    items = chatter_items(replace(made, batch=teeth, tables=tables))
    assert [row[0] for row in tables_of(items)[1].rows] == ["label of the operator"]
    assert all(row[7] == "–" for row in tables_of(items)[0].rows)


def test_contradicted_labels_and_hidden_chatter_are_named(items):
    words = " ".join(next(item for item in items if isinstance(item, Bullets)).items)
    assert "2 of 5 records hold chatter" in words
    assert "contradicts the label of b;" in words
    assert "Not separable at this speed: d." in words


def test_roughness_is_compared(items):
    assert isinstance(items[-1], Picture)
    assert "stable 0.300 µm, unstable 0.700 µm" in items[-1].caption


def test_every_kind_is_drawn_where_it_was_cut_and_wrong_labels_are_circled():
    tests = RUNS.assign(position="1", wrong_label=RUNS["run"] == "b")
    axes = figures.tests_chart(synthetic.boundary(), tests, advised={}, deepest_mm=np.inf).axes[0]
    drawn = {c.get_label(): c.get_offsets().tolist() for c in axes.collections}
    assert drawn["chatter (Hopf)"] == [[1500.0, 1.5]]
    assert drawn["chatter (flip)"] == [[2000.0, 1.8]]
    assert drawn["kind unknown or not determined"] == [[2500.0, 1.2]]
    assert drawn["stable"] == [[1500.0, 0.5], [3000.0, 1.0]]
    assert drawn["labelled otherwise"] == [[1500.0, 1.5]]


RECORDS = pd.DataFrame(
    {
        "run": ["c", "c", "c", "a", "a", "a"],
        "part": ["spectrum", "spectrum", "force", "spectrum", "spectrum", "force"],
        "x": [80.5, 133.3, 0.0, 50.0, 100.0, 0.0],
        "value": [40.0, 60.0, 1.0, 2.0, 70.0, 1.0],
        "on_order": [False, True, False, False, True, False],
    }
)


def test_the_chatter_frequency_is_marked_in_the_spectrum_of_the_cut_that_chattered_alone():
    tests = RUNS.assign(unstable=[0, 1, 1, -1, 0])
    chattering, _, stable, _ = figures.records_chart(RECORDS, tests, 4).axes
    assert [note.get_text() for note in chattering.texts] == ["chatter 80.5 Hz"]
    assert chattering.texts[0].xy == (80.5, 40.0)
    assert not stable.texts
    assert chattering.get_title(loc="left") == "c: chatter, 2000 rpm, 1.8 mm"


def test_a_record_of_each_kind_is_shown_where_there_is_one():
    made = synthetic.results()
    teeth = replace(made.batch, manifest={**made.batch.manifest, "tool": {"teeth": 4}})
    tables = {**synthetic.tables(), "chatter_runs": RUNS, "lobe_runs": LOBES}
    without, shown = (
        [i for i in chatter_items(replace(made, batch=teeth, tables=t)) if isinstance(i, Picture)]
        for t in (tables, tables | {"chatter_records": RECORDS})
    )
    assert len(shown) == len(without) + 1


def test_without_records_there_is_nothing():
    assert chatter_items(synthetic.results()) == []


def test_the_same_tests_give_the_same_bytes():
    tests = RUNS.assign(position="1", wrong_label=False)
    first, second = (
        to_svg(figures.tests_chart(synthetic.boundary(), tests, advised={}, deepest_mm=np.inf))
        for _ in range(2)
    )
    assert first == second


@pytest.fixture
def forces():
    """Return what gives the results of a batch of forces with the records of its cuts, and no lobes."""
    made = synthetic.results()
    batch = replace(made.batch, manifest={**made.batch.manifest, "tool": {"teeth": 4}})
    tables = {name: table for name, table in synthetic.tables().items() if not name.startswith("lobe")}

    def results(runs):
        return replace(made, batch=batch, tables={**tables, "chatter_runs": runs})

    return results


def test_a_cut_that_chatters_among_measurements_of_the_force_is_flagged_on_the_first_page(forces):
    results = forces(RUNS.assign(labelled=-1))
    flags = chatter_flags(results)
    assert [flag.split(":")[0] for flag in flags] == ["b", "c"]
    assert "68" in flags[0]
    first = with_flags(Section("Summary", [Paragraph("all is well")]), results)
    assert any("b: chatters at 68" in getattr(item, "text", "") for item in first.items)


def test_a_cut_that_may_chatter_is_not_said_to(forces):
    doubtful = RUNS.assign(labelled=-1)
    doubtful.loc[doubtful["run"] == "b", "probability"] = 0.51
    (flag,) = [flag for flag in chatter_flags(forces(doubtful)) if flag.startswith("b:")]
    assert flag.startswith("b: may chatter at 68")


def test_tests_of_the_lobes_that_chatter_are_no_flaw():
    tables = {**synthetic.tables(), "chatter_runs": RUNS, "lobe_runs": LOBES}
    assert "lobes_final" in tables
    assert chatter_flags(replace(synthetic.results(), tables=tables)) == []


def test_where_nothing_chatters_and_nothing_is_predicted_a_sentence_is_enough(forces):
    quiet = RUNS.assign(probability=0.02, labelled=-1, separable=True)
    items = chatter_items(forces(quiet))
    assert not tables_of(items)
    assert "None of the 5" in items[-1].items[0]
