"""Stiffness of the tip at rest: what the load tests show at each point that was loaded."""

from __future__ import annotations

import pandas as pd

from metro.report.content import Facts, Heading, Item, Table
from metro.report.numbers import number, with_interval
from metro.report.results import Results
from metro.report.sections.stiffness import LONGEST, more

ABOUT = (
    "Force along an axis over the displacement along the same axis at rest, work frame, with 95 % intervals "
    "by the scatter of the displacements about a linear spring. These hold no error of load cell and gauge "
    "that all tests share. A dash: no test shows it."
)


def load_points(results: Results) -> list[Item]:
    """Tabulate the stiffness at every loaded point; nothing for a batch without load tests."""
    table = results.tables.get("load_points")
    if table is None:
        return []
    rows = [
        [_name(row), str(row["tests"]), number(row["force_n"])]
        + [_stiffness(row, axis) for axis in "xyz"]
        + [number(row["scatter_um"], 2)]
        for _, row in table.head(LONGEST).iterrows()
    ]
    header = ["pose, point", "tests", "up to (N)", "k x (N/µm)", "k y", "k z", "scatter (µm)"]
    return [
        Heading("Stiffness by load tests"),
        Table(header, rows, ABOUT + more(len(table)), [1.4, 0.6, 0.8, 1.4, 1.4, 1.4, 0.9], small=True),
    ]


def first_loaded(results: Results) -> list[Item]:
    """Give the softest of the directions that were loaded, of all points."""
    table = results.tables.get("load_points")
    columns = {f"k{axis}_n_um": axis for axis in "xyz"}
    if table is None or table[list(columns)].isna().all(axis=None):
        return []
    softest, column = table[list(columns)].stack().idxmin()
    row, axis = table.loc[softest], columns[str(column)]
    tests = int(table["tests"].sum())
    about = f"{_name(row)}, of {tests} load tests at {len(table)} point{'' if len(table) == 1 else 's'}"
    return [Facts([(f"least stiffness at rest, along {axis}", f"{_stiffness(row, axis)} N/µm", about)])]


def _name(row: pd.Series) -> str:
    return ", ".join(filter(None, [str(row["pose"]), str(row["point"])])) or "not named"


def _stiffness(row: pd.Series, axis: str) -> str:
    ends = [float(row[f"k{axis}_{end}_n_um"]) for end in ("low", "high")]
    return with_interval(float(row[f"k{axis}_n_um"]), [*ends])
