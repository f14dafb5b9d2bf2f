"""The axes of a sensor in the work frame, as a manifest names them: x, -y and so on."""

from __future__ import annotations

import numpy as np

from metro.units import JSON, Array

AXES = ("x", "y", "z")


def signed_axes(axes: JSON) -> Array:
    """Return the (3, 3) matrix whose column k is the direction of sensor axis k in the work frame."""
    columns = np.zeros((3, 3))
    for k, axis in enumerate(AXES):
        direction = str(axes.get(axis, axis))
        columns[AXES.index(direction[-1]), k] = -1.0 if direction.startswith("-") else 1.0
    return columns
