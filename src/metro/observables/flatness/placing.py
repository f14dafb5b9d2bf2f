"""A scan brought into the work frame: by the declared transform, by its side faces, or unchanged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.batch.batch import Batch
from metro.surface.points import Points, box, changed
from metro.surface.registration import register, see_block
from metro.units import MM, UM, Array

WITHIN = 3 * MM  # largest distance of an unplaced cloud without sides from the outline of the work
DEPTH = (
    1 * MM
)  # distance from the top's plane within which points belong to the top if sides are scanned, too


@dataclass(frozen=True)
class Placed:
    """A cloud (n, 3) m of a face alone, and the way in which it was placed in the work frame.

    Attributes
    ----------
    method : ``to_work``, ``3-2-1``, ``box``, ``outline``, or "" if the place is not known.
    sd : (2,) standard deviation of x and y, m; NaN if it is not known.
    remark : for the report; the reason if the place is not known.
    """

    cloud: Points
    method: str
    sd: Array
    remark: str


def place(batch: Batch, cloud: Points, path: Array | None) -> Placed:
    """Place a cloud (n, 3) m in the work frame; points of side faces are removed.

    Parameters
    ----------
    path : (k, 3) points of the programmed path, m, which replace the outline of a work of unknown size.
    """
    unknown = np.full(2, np.nan)
    size = (batch.manifest.get("work") or {}).get("size_mm")
    declared = "to_work" in batch.instrument("scanner")
    if declared and (size is None or np.subtract(*box(cloud))[2] >= -2 * DEPTH):
        return Placed(cloud, "to_work", unknown, "")
    if size is None:
        return _as_it_lies(
            cloud, path, None, "its work has no size_mm, so no block can be sought in its scan"
        )
    block = see_block(cloud, np.array(size, float) * MM)
    top = changed(cloud, lambda each: each[block.on_top(each, DEPTH)]) if block.has_sides else cloud
    lost = len(cloud) - len(top)
    off = f"{lost} points of side faces and edges are left out" if lost else ""
    if declared:
        return Placed(top, "to_work", unknown, off)
    try:
        registered = register(block, np.array(size, float) * MM)
    except ValueError as error:
        return _as_it_lies(top, path, size, str(error))
    sides = ", ".join(name for name in registered.faces if name != "z+")
    u, v = registered.sd / UM
    known = f"x is known to {u:.1f} µm, y to {v:.1f} µm, height and tilt are those of the face itself"
    remark = f"its scan is placed by its top and the sides {sides} ({registered.method}): {known}"
    remark = f"{remark}; {off}" if off else remark
    return Placed(changed(top, registered.apply), registered.method, registered.sd, remark)


def _as_it_lies(cloud: Points, path: Array | None, size: list[float] | None, why: str) -> Placed:
    """Accept a cloud as placed already if its outline is that of the work (its corner is the origin)."""
    unknown = np.full(2, np.nan)
    if size is not None:
        low, high = np.zeros(2), np.array(size[:2], dtype=float) * MM
    elif path is not None:
        low, high = path[:, :2].min(axis=0), path[:, :2].max(axis=0)
    else:
        return Placed(cloud, "", unknown, why)
    misses = np.abs([corner[:2] - due for corner, due in zip(box(cloud), (low, high), strict=True)])
    if misses.max() > WITHIN:
        reason = (
            f"its scan does not lie on the work's outline (it misses by {misses.max() / MM:.3g} mm), and "
            f"{why}"
        )
        return Placed(cloud, "", unknown, f"instruments.scanner.to_work is not given, {reason}")
    off = misses.max() / MM
    remark = f"its scan is taken as it lies: its outline is that of the work within {off:.2g} mm"
    return Placed(cloud, "outline", unknown, remark)


def plane_directions(x: Array, y: Array) -> Array:
    """Directions of an offset and two tilts, (n, 3); each tilt is ±1 at the edges."""
    across = [(c - (c.min() + c.max()) / 2) / (np.ptp(c) / 2 or 1.0) for c in (x, y)]
    return np.column_stack([np.ones(len(x)), *across])
