"""Corrected joint targets of a batch, in the columns of the contract, with the errors that remain."""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.joint_columns import axes_of
from metro.robot.calibration.compensation import corrected
from metro.robot.calibration.held_out import HeldOut
from metro.robot.calibration.poses import Poses
from metro.robot.calibration.study import Calibration
from metro.units import JSON, MM

MRAD = 1e-3


def corrected_targets(
    run: str, rows: pd.DataFrame, found: Calibration, poses: Poses, held: tuple[HeldOut, ...]
) -> tuple[pd.DataFrame, JSON]:
    """Return the table of corrected targets of a run, and what ``identified.json`` says of it.

    ``q1_deg`` …: what to command; ``q1_target_deg`` …: what was asked for.
    """
    axes = axes_of(rows)
    q = rows[axes.positions].to_numpy(dtype=float) * axes.units
    one = corrected(q, found.fits[0], found.final, poses, held)
    table = pd.DataFrame(one.q / axes.units, columns=axes.positions)
    for name, values in zip(axes.positions, (q / axes.units).T, strict=True):
        joint, unit = name.split("_")
        table[f"{joint}_target_{unit}"] = values
    after = dict(zip(("after_mm", "after_low_mm", "after_high_mm"), one.after.T / MM, strict=True))
    table = table.assign(
        run=run,
        target=np.arange(1, len(q) + 1),
        before_mm=one.before / MM,
        **after,
        turned_mrad=one.turned / MRAD,
        inside=one.inside,
    )
    summary: JSON = {
        "targets": len(q),
        "before": {"value": float(np.median(one.before)) / MM, "unit": "mm"},
        "after": _median(table),
        "turned": {"value": float(np.max(one.turned)) / MRAD, "unit": "mrad"},
        "outside": int((~one.inside).sum()),
    }
    return table, summary


def _median(table: pd.DataFrame) -> JSON:
    """Return the median over the targets of the remaining error, and of the ends of its interval."""
    value, low, high = (float(table[f"after{end}_mm"].median()) for end in ("", "_low", "_high"))
    return {"value": value, "ci95": [low, high], "unit": "mm"}
