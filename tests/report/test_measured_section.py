"""What was measured, in a sentence: runs with files are recorded, runs with a label alone are not."""

import pandas as pd
import pytest

from metro.report.sections.measured import _run_words


def runs(files):
    count = len(files)
    return pd.DataFrame(
        {"operation": "side", "role": ["identify"] * (count - 1) + ["validate"], "dynamometer": files,
         "stable": "yes"}
    )  # fmt: skip


@pytest.mark.parametrize(
    ("files", "words"),
    [
        (["a.csv", "b.csv", "c.csv"], "3 of them recorded"),
        (["a.csv", None, ""], "1 of them recorded"),
        ([None, None, ""], "none of them recorded"),
    ],
)
def test_runs_are_recorded_that_have_a_file(files, words):
    assert _run_words(runs(files)) == f"3 cutting runs (side), {words} and 1 held out from all fits."
