"""How far a predicted face may be off because the damping is known to some error only, if at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.observables.flatness_model import FaceSetting, FlatnessModel, PoseField
from metro.units import Array


def damping_doubt(field: PoseField, setting: FaceSetting) -> Array | None:
    """Heights (n, k), m, of what the damping may be instead, each of one standard deviation.

    None where nothing rings. The damping is not fitted to a face: one that misses much for another cause
    would take any damping for it.
    """
    ringing = setting.ringing
    if ringing is None:
        return None
    model = FlatnessModel((field,))
    chosen, _ = model.finished(setting, np.zeros(1))
    known = ringing.rest(model.structure, setting.middle)[chosen]
    columns = []
    for weight, damping in ringing.damping.doubts():
        other = replace(ringing, damping=damping).rest(model.structure, setting.middle)[chosen]
        columns.append(weight * setting.mean(other - known))
    return np.column_stack(columns)
