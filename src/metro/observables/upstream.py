"""The force that an observable starts from, put in as it was measured and as it was predicted.

A wall or a face follows from the mean force on the tool. Where a dynamometer was on a run, the error of the
predicted force is known, and the run can be predicted with both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from metro.observables.deformation_model import CutWall
from metro.observables.flatness_model import FaceSetting
from metro.observables.problem import Block
from metro.observables.tip_force import SYSTEMATIC
from metro.units import Array

AXES = ["x", "y", "z"]
COLUMNS = ("measured", "before", "after")
OFF = ("off in x", "off in y", "off in z")  # the measured force as it may be if the dynamometer is off
Forces = Mapping[str, Array]


def mean_forces(comparison: pd.DataFrame) -> dict[str, Forces]:
    """Mean force on the tool of each held-out run, (3,) N, work frame: ``measured``, ``before``, ``after``.

    ``comparison``: rows of the comparison table. In helical runs, whose frame turns, no wall and no face is
    compared: they are not asked for.
    """
    rows = comparison[(comparison["observable"] == "force") & comparison["angle_deg"].notna()]
    means = rows.groupby(["run", "axis"])[list(COLUMNS)].mean()
    return {
        str(run): {name: part[name].droplevel("run").loc[AXES].to_numpy(dtype=float) for name in COLUMNS}
        for run, part in means.groupby(level="run")
        if set(AXES) <= set(part.index.get_level_values("axis"))
    }


def with_forces(block: Block, forces: Forces, sources: Mapping[str, str]) -> dict[str, Block] | None:
    """Return a block fed with the force as measured, and as predicted before and after; None: it takes none.

    And with what would have been measured if the dynamometer were off along x, y or z, by the share of the
    whole force to which it is known.

    ``sources``: by run, where the force of a wall is taken from; it is changed by what the prediction is off,
    where it is measured. The transients of a face stay those of the force that it was made with: what the
    forces differ by is followed as it stands.
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
