"""The proof of a campaign: what counts as followed, on records whose truth is known."""

import numpy as np
import pytest

from metro.memory.history import Record
from proof.campaign import FIRST, Followed, compared, figures, tables

BATCHES = 14
SD = {"kte": 0.2, "ktc": 5.0}


def campaign(offset=0.0, seed=1):
    """Records of batches whose kte grows and whose ktc does not; their truth, kte ``offset`` too high."""
    rng, records, truth = np.random.default_rng(seed), [], {}
    for i in range(BATCHES):
        true = {"kte": 10.0 + 0.5 * i, "ktc": 800.0}
        read = {name: value + rng.normal(0.0, SD[name]) for name, value in true.items()}
        waveform = {
            name: {"value": value, "ci95": [value - 1.96 * SD[name], value + 1.96 * SD[name]], "unit": "N/mm"}
            for name, value in read.items()
        }
        name = f"b-{i + 1}"
        records.append(Record(name, {"cell": "a"}, None, {}, {}, {"force": {"waveform": waveform}}))
        truth[name] = {"coefficients": {**true, "kte": true["kte"] + offset}, "growth": 0.0}
    return records, truth


def test_a_course_that_grows_is_followed_and_the_next_batch_foretold():
    worn, fresh = compared(*campaign())
    assert (worn.name, worn.course, worn.changes) == ("kte", "trend", True)
    assert (fresh.name, fresh.course, fresh.changes) == ("ktc", "steady", False)
    assert all(worn.inside)
    assert len(worn.ahead) == BATCHES - FIRST
    assert sum(worn.came) >= len(worn.came) - 1
    assert [figure.met for figure in figures([worn, fresh])[:2]] == [True, True]


def test_a_truth_beside_the_course_is_missed_and_what_was_measured_is_not():
    worn = compared(*campaign(offset=3.0))[0]
    assert not any(worn.inside)
    assert not any(worn.held)
    assert sum(worn.came) >= len(worn.came) - 1
    named = {figure.label: figure for figure in figures([worn])}
    assert named["courses: batches at which the interval holds the truth"].missed_for_sure


def test_a_prediction_is_made_of_the_batches_before_alone():
    records, truth = campaign()
    first = compared(records[: FIRST + 1], truth)[0].ahead
    assert len(first) == 1
    assert first[0] == pytest.approx(compared(records, truth)[0].ahead[0])


def test_the_table_has_a_row_for_each_parameter():
    one = Followed("kte", "steady", True, (1.0, 2.0), ((0.9, 1.0, 1.1),) * 2, ((0.0, 1.0, 2.0, 0.5),))
    demanded, rows = tables([one])
    assert demanded.rows[0][1] == "0.0 %"
    assert rows.rows[0][-2:] == ("1 of 2", "0 of 1")
