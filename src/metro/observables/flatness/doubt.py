"""The error of a predicted face that follows from the error of the damping."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.flatness.model import FlatnessModel
from metro.observables.flatness.pose_field import PoseField
from metro.units import Array


def damping_doubt(field: PoseField, setting: FaceSetting) -> Array | None:
    """Heights (n, k), m, by which a face changes as the damping changes by one standard deviation each.

    None if there is no ringing. The damping is not fitted to a face, because a large residual with another
    cause would bias it.
    """
    ringing = setting.ringing
    if ringing is None:
        return None
    model = FlatnessModel((field,))
    share, _ = model.finished(setting, np.zeros(1))
    known = ringing.heights(model.structure, setting.middle)
    columns = []
    for weight, damping in ringing.damping.doubts():
        other = replace(ringing, damping=damping).heights(model.structure, setting.middle)
        columns.append(weight * setting.mean((share * (other - known)).sum(axis=1)))
    return np.column_stack(columns)
