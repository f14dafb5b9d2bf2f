"""A pass that finds less left to cut than is declared has another force, and is not compared."""

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.observables.flatness.path import make_path, narrow_passes

RADIUS = 0.016


def batch(width_mm, declared=20.0, size=True):
    work = {"work": {"size_mm": [160.0, width_mm, 12.0]}} if size else {}
    runs = pd.DataFrame({"radial_depth_mm": [declared]}, index=["f1"])
    return Batch("b", work, {}, runs, {})


def path(*places, along_x=True):
    """Straight passes at some places across, mm, from outside the block to beyond it."""
    rows = [
        {"pass": number, "x_mm": x if along_x else at, "y_mm": at if along_x else x}
        for number, at in enumerate(places)
        for x in (-20.0, 180.0)
    ]
    return make_path(pd.DataFrame(rows))


# The left edge of the cutter, 16 mm from its axis, starts at the block's edge and moves on by 20 mm a pass.
EVEN = (4.0, 24.0, 44.0, 64.0)


@pytest.mark.parametrize("along_x", [True, False])
def test_the_last_pass_of_a_width_that_does_not_divide_is_narrow(along_x):
    one = (
        batch(90.0) if along_x else Batch("b", {"work": {"size_mm": [90.0, 160.0]}}, {}, batch(90.0).runs, {})
    )
    made = path(*EVEN, 84.0, along_x=along_x)
    assert narrow_passes(one, "f1", made, RADIUS).tolist() == [False] * 4 + [True]
    whole = path(*EVEN, along_x=along_x)
    assert not narrow_passes(one, "f1", whole, RADIUS).any()


def test_a_path_in_the_other_order_has_its_narrow_pass_where_it_cuts_last():
    made = path(86.0, 66.0, 46.0, 26.0, 6.0)
    assert narrow_passes(batch(90.0), "f1", made, RADIUS).tolist() == [False] * 4 + [True]


def test_without_the_size_of_the_work_or_a_declared_width_no_pass_is_narrow():
    made = path(*EVEN, 84.0)
    assert not narrow_passes(batch(90.0, size=False), "f1", made, RADIUS).any()
    assert not narrow_passes(batch(90.0, declared=np.nan), "f1", made, RADIUS).any()
