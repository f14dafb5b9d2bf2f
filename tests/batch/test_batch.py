"""What a batch tells of its runs."""

import numpy as np
import pandas as pd

from metro.batch.batch import Batch


def batch(rows):
    table = pd.DataFrame(rows, columns=["run", "order", "robot_log", "profile"]).set_index("run")
    return Batch("b", {}, {"cell": "arm"}, table, {})


def test_runs_are_listed_by_their_files_in_the_order_of_cutting():
    rows = [("c", 3, "c.csv", "c.txt"), ("a", 2, "a.csv", ""), ("b", 1, np.nan, "b.txt"), ("d", 4, "", None)]
    found = batch(rows)
    assert found.with_files("robot_log") == ["a", "c"]
    assert found.with_files("robot_log", "profile") == ["c"]
    assert found.with_files("robot_log", "profile", any_of=True) == ["b", "a", "c"]


def test_without_runs_none_is_listed():
    assert batch([]).with_files("robot_log", "profile") == []
