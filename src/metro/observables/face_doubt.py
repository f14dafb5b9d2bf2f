"""How far a predicted face may be off because the damping from impacts is known to some error only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from metro.observables.flatness_model import FaceSetting, FlatnessModel, PoseField
from metro.units import Array


def damping_doubt(field: PoseField, setting: FaceSetting) -> Array | None:
    """Heights (n, 2), m, of one standard error of a0 and a1 in each of two independent directions.

    None where each face tells its damping itself, or nothing rings.
    """
    ringing = setting.ringing
    if ringing is None or ringing.damping is None:
        return None
    model, own = FlatnessModel((field,)), ringing.starts[0]
    chosen, _ = model.finished(setting, np.zeros(1))
    known = ringing.rest(model.structure, own, setting.middle)
    size, directions = np.linalg.eigh(ringing.damping.covariance)
    columns = []
    for sd in (directions * np.sqrt(np.maximum(size, 0.0))).T:
        moved = replace(ringing, damping=ringing.damping.shifted(sd))
        apart = moved.rest(model.structure, own, setting.middle) - known
        columns.append(setting.mean(apart[chosen]))
    return np.column_stack(columns)
