"""The table of checks says on which side of a limit a value passes."""

import pandas as pd
import pytest

from metro.report.sections.quality import _limit


def checks(*rows):
    return pd.DataFrame(rows, columns=["value", "limit", "ok"])


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([(0.0, 5.0, True), (7.0, 5.0, False)], "≤ 5.00"),
        ([(7.0, 5.0, False)], "≤ 5.00"),
        ([(0.0, 0.0, True), (3.0, 0.0, False)], "0"),
        ([(80.0, 60.0, True), (20.0, 60.0, False)], "≥ 60.0"),
        ([(26.7, 0.0, True), (700.0, 0.0, True)], "> 0"),
        ([(8192.0, 8192.0, True)], "8192"),
        ([(8192.0, 8192.0, True), (8000.0, 8192.0, False), (9000.0, 8192.0, False)], "8192"),
        ([(1.0, 5.0, True), (1.0, 6.0, True)], "differs"),
        ([(1.0, None, True)], "–"),
    ],
)
def test_limit(rows, said):
    assert _limit(checks(*rows)) == said
