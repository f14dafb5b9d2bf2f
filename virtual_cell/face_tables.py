"""Tables of a batch of faces: the programmed path, the load tests of the tip, its reduced mass."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from virtual_cell.face import Passes
from virtual_cell.units import MM, Array
from virtual_cell.write import Row

PATH_STEP = 2.0 * MM  # of the programmed path
_MASS = {"mxx": (0, 0), "mxy": (0, 1), "mxz": (0, 2), "myy": (1, 1), "myz": (1, 2), "mzz": (2, 2)}


def path_rows(passes: Passes) -> list[Row]:
    """Programmed tip path, a point every 2 mm."""
    count = round((passes.length + 2.0 * passes.lead) / PATH_STEP) + 1
    s = -passes.lead + np.arange(count) * PATH_STEP
    rows: list[Row] = []
    for number in range(len(passes.axes)):
        for x, y in passes.points(s, number) / MM:
            at = {"x_mm": round(float(x), 3), "y_mm": round(float(y), 3), "z_mm": 0}
            rows.append({"point": len(rows) + 1, "pass": number + 1, **at})
    return rows


def load_rows(
    pose: str,
    compliance: Callable[[Array], Array],
    places_mm: Sequence[tuple[float, float]],
    newtons: Sequence[float],
    *,
    gauge: float,
    rng: np.random.Generator,
    repeats: int = 1,
) -> list[Row]:
    """Pull the tip along x, y and z at some places; gauges read its displacement to ``gauge``, m."""
    rows = []
    for point, place in enumerate(places_mm, start=1):
        matrix = compliance(np.array([place]) * MM)[0]
        for axis in range(3):
            for newton in newtons:
                for replicate in range(1, repeats + 1):
                    moved = matrix[:, axis] * newton + rng.normal(0.0, gauge, 3)
                    row: Row = {"pose": pose, "point": f"P{point}"}
                    row |= {"x_mm": place[0], "y_mm": place[1], "z_mm": 0.0}
                    row |= {f"f{name}_n": newton if i == axis else 0.0 for i, name in enumerate("xyz")}
                    row |= {f"d{name}_mm": round(float(moved[i] / MM), 4) for i, name in enumerate("xyz")}
                    rows.append(row | {"replicate": replicate})
    return rows


def mass_row(pose: str, point: str, at_mm: tuple[float, float], mass: Array) -> Row:
    """Reduced mass (3, 3), kg, of the tip at a place."""
    entries = {name: float(mass[at]) for name, at in _MASS.items()}
    return {"pose": pose, "point": point, "x_mm": at_mm[0], "y_mm": at_mm[1], "z_mm": 0.0, **entries}
