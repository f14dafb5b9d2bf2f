"""Stiffness of the tip at rest: what the load tests show at each point that was loaded."""

from __future__ import annotations

from metro.report.content import Heading, Item, Table
from metro.report.numbers import number, with_interval
from metro.report.results import Results
from metro.report.sections.stiffness import LONGEST, more
from metro.units import JSON

ABOUT = (
    "Force along an axis over the displacement along the same axis at rest, work frame, with 95 % intervals "
    "by the scatter of the displacements about a linear spring. These hold no error of load cell and gauge "
    "that all tests share. A dash: no test shows it."
)


def load_points(results: Results) -> list[Item]:
    """Tabulate the stiffness at every loaded point; nothing for a batch without load tests."""
    points = _points(results)
    if not points:
        return []
    rows = [
        [_name(row), str(row["tests"]), number(row["force_n"])]
        + [_stiffness(row, axis) for axis in "xyz"]
        + [number(row["scatter_um"], 2)]
        for row in points[:LONGEST]
    ]
    header = ["pose, point", "tests", "up to (N)", "k x (N/µm)", "k y", "k z", "scatter (µm)"]
    return [
        Heading("Stiffness by load tests"),
        Table(header, rows, ABOUT + more(len(points)), [1.4, 0.6, 0.8, 1.4, 1.4, 1.4, 0.9], small=True),
    ]


def _points(results: Results) -> list[JSON]:
    table = results.tables.get("load_points")
    return [] if table is None else [{str(k): v for k, v in row.items()} for row in table.to_dict("records")]


def _name(row: JSON) -> str:
    return ", ".join(filter(None, [str(row["pose"]), str(row["point"])])) or "not named"


def _stiffness(row: JSON, axis: str) -> str:
    return with_interval(row[f"k{axis}_n_um"], [row[f"k{axis}_{end}_n_um"] for end in ("low", "high")])
