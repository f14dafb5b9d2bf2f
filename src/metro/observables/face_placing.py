"""A scan brought into the work frame: by the declared transform, by its side faces, or as it lies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.batch.batch import Batch
from metro.surface.points import Points, box, changed
from metro.surface.registration import register, see_block
from metro.units import MM, UM, Array

WITHIN = 3 * MM  # how far a cloud without a transform and without sides may miss the outline of the work
DEPTH = 1 * MM  # from the top's plane, within which points belong to the top where sides are scanned, too


@dataclass(frozen=True)
class Placed:
    """A cloud (n, 3) m of a face alone, and how it came into the work frame.

    Attributes
    ----------
    method : ``to_work``, ``3-2-1``, ``box``, ``outline``, or "" where the place is not known.
    sd : (2,) standard deviation of x and y, m; NaN where it is not known.
    remark : what the report says of it; the reason, where the place is not known.
    """

    cloud: Points
    method: str
    sd: Array
    remark: str


def place(batch: Batch, cloud: Points, path: Array | None) -> Placed:
    """Place a cloud (n, 3) m in the work frame; points of side faces are taken off it.

    Parameters
    ----------
    path : (k, 3) points of the programmed path, m, which stand for the outline of a work of unknown size.
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
        found = register(block, np.array(size, float) * MM)
    except ValueError as error:
        return _as_it_lies(top, path, size, str(error))
    sides = ", ".join(name for name in found.faces if name != "z+")
    u, v = found.sd / UM
    known = f"x is known to {u:.1f} µm, y to {v:.1f} µm, height and tilt are those of the face itself"
    remark = f"its scan is placed by its top and the sides {sides} ({found.method}): {known}"
    remark = f"{remark}; {off}" if off else remark
    return Placed(changed(top, found.apply), found.method, found.sd, remark)


def _as_it_lies(cloud: Points, path: Array | None, size: list[float] | None, why: str) -> Placed:
    """Take a cloud whose outline is that of the work (its corner is the origin) as placed already."""
    unknown = np.full(2, np.nan)
    if size is not None:
        low, high = np.zeros(2), np.array(size[:2], dtype=float) * MM
    elif path is not None:
        low, high = path[:, :2].min(axis=0), path[:, :2].max(axis=0)
    else:
        return Placed(cloud, "", unknown, why)
    misses = np.abs([found[:2] - due for found, due in zip(box(cloud), (low, high), strict=True)])
    if misses.max() > WITHIN:
        reason = f"its scan does not lie on the work's outline (off by {misses.max() / MM:.3g} mm), and {why}"
        return Placed(cloud, "", unknown, f"instruments.scanner.to_work is not given, {reason}")
    off = misses.max() / MM
    remark = f"its scan is taken as it lies: its outline is that of the work within {off:.2g} mm"
    return Placed(cloud, "outline", unknown, remark)
