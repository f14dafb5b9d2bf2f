"""The proof of planned runs: what counts as decided, and one batch all the way."""

import pytest

from proof.layout import Layout
from proof.planned import Asked, asked_and_cut, tables


def asked(status, named, runs=3):
    return Asked("few-1", ("tool_runout",), (("tool_runout", "chipped_tooth"),), "", 0.9, runs, status, named)


def test_what_is_no_longer_undetermined_is_decided_and_right_where_the_cause_alone_is_named():
    right = asked("explained", ("tool_runout",))
    wrong = asked("explained", ("pitch_error",))
    both = asked("partly_explained", ("tool_runout", "pitch_error"))
    still = asked("undetermined", ("tool_runout",))
    assert [one.decided for one in (right, wrong, both, still)] == [True, True, True, False]
    assert [one.right for one in (right, wrong, both, still)] == [True, False, False, False]


def test_a_batch_for_which_no_run_was_planned_is_not_decided():
    assert not asked("explained", ("tool_runout",), runs=0).decided


def test_the_tables_say_how_many_of_how_many():
    figures, one_by_one = tables([asked("explained", ("tool_runout",)), asked("undetermined", ())], 20)
    assert "2 of 20" in figures.note
    assert figures.rows[0][1] == "50.0 %"
    assert [row[5] for row in one_by_one.rows] == ["explained", "undetermined"]


@pytest.mark.slow
def test_planned_runs_decide_what_was_undetermined(tmp_path):
    found, batches = asked_and_cut(Layout(tmp_path), batches=1, seed=9, jobs=1)
    assert batches == 1
    assert found, "the batch was not undetermined: nothing is tested"
    assert all(one.decided and one.right for one in found)
