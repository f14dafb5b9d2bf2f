"""A record that ends early is seen beside the others of its batch."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from metro.slips.cut_short import cut_short


class Tables:
    def __init__(self, seconds):
        self.seconds = seconds

    def pieces(self, _table, run):
        times = np.arange(0.0, self.seconds[run], 1e-3)
        for part in np.array_split(times, 2):
            yield pd.DataFrame({"run": run, "t_s": part})


def batch(runs, **changed):
    columns = {
        "dynamometer": [f"{run}.csv" for run in runs],
        "spindle_rpm": 6000.0,
        "feed_per_tooth_mm": 0.1,
        "cut_length_mm": 120.0,
        **changed,
    }
    table = pd.DataFrame(columns, index=list(runs))
    return SimpleNamespace(runs=table, manifest={"tool": {"teeth": 4}}, with_files=lambda _column: list(runs))


def found(seconds, **changed):
    return list(cut_short(batch(seconds, **changed), Tables(seconds)))


def test_a_file_that_was_cut_off_is_named_with_what_it_covers():
    # 40 mm/s: a cut of 120 mm takes 3 s.
    (finding,) = found({"a": 1.5, "b": 1.5, "c": 0.06, "d": 1.4})
    assert (finding.severity, finding.file, finding.run) == ("warning", "c.csv", "c")
    assert "covers 2 % of the cut, the records of this batch 48 % (median)" in finding.message


@pytest.mark.parametrize(
    "seconds",
    [{"a": 1.5, "b": 0.06, "c": 1.5}, {"a": 1.5, "b": 1.2, "c": 0.7, "d": 0.9, "e": 1.5}],
    ids=["three records", "parts that somebody chose"],
)
def test_what_may_be_meant_is_not_named(seconds):
    assert found(seconds) == []


def test_a_short_cut_has_a_short_record_and_one_of_unknown_length_is_not_compared():
    lengths = [120.0, 120.0, 5.0, 120.0]
    assert found({"a": 1.5, "b": 1.5, "c": 0.06, "d": 1.4}, cut_length_mm=lengths) == []
    assert found({"a": 1.5, "b": 1.5, "c": 0.06, "d": 1.4}, cut_length_mm=np.nan) == []
