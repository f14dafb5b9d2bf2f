"""Rows of load tests as the canonical table has them: what a test does not give is blank."""

import pandas as pd

from metro.batch.processed import COLUMNS

GIVEN = [f"{form}{axis}{unit}" for form, unit in (("", "_mm"), ("f", "_n"), ("d", "_mm")) for axis in "xyz"]


def load_table(rows):
    """Table of rows: pose, point, place (mm), force (N) and displacement (mm) along x, y, z, replicate."""
    known = ["pose", "point", *GIVEN, "replicate"]
    return pd.DataFrame(rows, columns=known).reindex(columns=list(COLUMNS["loads"]))
