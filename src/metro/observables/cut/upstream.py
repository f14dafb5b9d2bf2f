"""The force that enters the model of a wall or a face, once as measured and once as predicted.

A wall or a face follows from the mean force on the tool. If a dynamometer recorded the run, the error of the
predicted force is known, and the run can be predicted with both forces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from metro.observables.arm.tip_force import SYSTEMATIC
from metro.observables.deformation.setting import CutWall
from metro.observables.flatness.face_setting import FaceSetting
from metro.observables.problem import Block
from metro.units import Array

AXES = ["x", "y", "z"]
COLUMNS = ("measured", "before", "after")
OFF = ("off in x", "off in y", "off in z")  # the measured force with an error of the dynamometer
Forces = Mapping[str, Array]


def mean_forces(comparison: pd.DataFrame) -> dict[str, Forces]:
    """Mean force on the tool of each held-out run, (3,) N, work frame: ``measured``, ``before``, ``after``.

    ``comparison``: rows of the comparison table. Helical runs, whose frame turns, are omitted, because they
    have no wall and no face to compare.
    """
    rows = comparison[(comparison["observable"] == "force") & comparison["angle_deg"].notna()]
    means = rows.groupby(["run", "axis"])[list(COLUMNS)].mean()
    return {
        str(run): {name: part[name].droplevel("run").loc[AXES].to_numpy(dtype=float) for name in COLUMNS}
        for run, part in means.groupby(level="run")
        if set(AXES) <= set(part.index.get_level_values("axis"))
    }


def with_forces(block: Block, forces: Forces, sources: Mapping[str, str]) -> dict[str, Block] | None:
    """Return a block with the force as measured and as predicted before and after; None if it has no force.

    Further blocks have the force that a dynamometer with an error along x, y or z would have measured. The
    error is the calibration's share of the whole force.

    ``sources``: by run, the source of the force of a wall. A measured force is changed by the error of the
    prediction. The transients of a face remain those of the force that it was made with; the difference of
    the forces is taken without them.
    """
    setting: Any = block.setting
    if isinstance(setting, CutWall) and sources.get(block.run) == "dynamometer":
        values = {name: setting.force + (force - forces["measured"]) for name, force in forces.items()}
    elif isinstance(setting, FaceSetting):
        values = dict(forces)
    else:
        return None
    size = SYSTEMATIC["dynamometer"] * float(np.linalg.norm(forces["measured"]))
    values |= {name: values["measured"] + size * axis for name, axis in zip(OFF, np.eye(3), strict=True)}
    return {
        name: replace(block, setting=replace(setting, force=np.asarray(force)))
        for name, force in values.items()
    }
