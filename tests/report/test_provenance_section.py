"""The report says by what code and settings each stage made it, and leaves room for who answers for it."""

from dataclasses import replace

import pandas as pd
from synthetic_results import results

from metro.report.content import Bullets, Paragraph, Table
from metro.report.sections.provenance import provenance


def test_every_stage_stands_with_its_code_and_settings():
    items = provenance(results()).items
    (made,) = (item for item in items if isinstance(item, Table) and item.header[0] == "stage")
    assert [list(row) for row in made.rows[:-1]] == [
        ["ingest", "1" * 12, "holdout: null"],
        ["loop", "2" * 12, "seed: 1"],
        ["report", "c0de", 'style: "plain"'],
    ]
    assert made.rows[-1][0] == "sources"
    notes = [item.text for item in items if isinstance(item, Paragraph) and item.look == "note"]
    assert any("numpy 2.1.0" in note for note in notes)


def test_who_measured_evaluated_and_approved_can_sign():
    tables = [item for item in provenance(results()).items if isinstance(item, Table)]
    (signed,) = (table for table in tables if list(table.header[1:]) == ["name", "date", "signature"])
    assert [row[0] for row in signed.rows] == ["measured", "evaluated", "approved"]


def limits(batch):
    items = provenance(batch).items
    return [text for item in items[:2] if isinstance(item, Bullets) for text in item.items]


def test_a_batch_without_a_prediction_states_the_limits_of_what_it_identified():
    modes = [{"position": "1", "direction": "x"}]
    lone = replace(results(), verdict={}, loop={}, identified={"modes": modes, "lobes": [{"position": "1"}]})
    used = pd.DataFrame({"frequency_hz": [4.0, 128.0]})
    told = limits(replace(lone, tables={"frf_used": used}))
    assert any("4.00 to 128 Hz" in text for text in told)
    assert any(text.startswith("Stability: ") and "linear delay equation" in text for text in told)
    assert any("the frequencies that were measured" in text for text in limits(replace(lone, tables={})))
    assert not limits(replace(lone, identified={}))
