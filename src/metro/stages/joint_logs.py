"""Joint logs of an arm that moved and cut nothing, as parts of a canonical table."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from metro.batch.arm import axes_of
from metro.batch.batch import Batch
from metro.batch.canonical import Part
from metro.joint_columns import JOINT_COLUMNS, positions
from metro.signals import plausible, quality
from metro.stages.reading import Recordings
from metro.stages.recordings import files
from metro.units import MS


def joint(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each joint log, its time from its own start."""
    period_ms = batch.instrument("robot_log").get("period_ms")
    rate = None if period_ms is None else 1.0 / (period_ms * MS)
    for run, file in files(batch, "joint_log"):
        table = recordings.table(file, "joints")
        if table is None:
            continue
        time = table["t_s"].to_numpy()
        if recordings.doubt(file, plausible.clock(time, rate) or _doubt(batch, table)):
            continue
        recordings.note(file, run, quality.sampling(time - time[0], rate))
        recordings.note(file, run, [quality.Finding(*note) for note in table.attrs.get("notes", ())])
        drives = [name for name in table if str(name).startswith(("tau", "current"))]
        angles = table[positions([str(name) for name in table.columns])].to_numpy()
        checks = [quality.motion(angles), *(quality.dead(str(n), table[n].to_numpy()) for n in drives)]
        if recordings.fit(file, run, "joint_log", checks):
            yield {"run": run, "t_s": time - time[0], **{n: table[n] for n in JOINT_COLUMNS if n in table}}


def _doubt(batch: Batch, table: pd.DataFrame) -> str:
    """Check the unit of the angles, and that the arm of the cell has as many axes."""
    names = positions([str(name) for name in table.columns])
    turning = [name for name in names if name.endswith("_deg")]
    doubt = plausible.angles(turning, table[turning].to_numpy()) if turning else ""
    pairs = [(name.replace("_", "_set_"), name) for name in turning if name.replace("_", "_set_") in table]
    if not doubt and pairs:
        doubt = plausible.following(
            table[[name for name, _ in pairs]].to_numpy(), table[[name for _, name in pairs]].to_numpy()
        )
    own = axes_of(batch.cell)
    if not doubt and own and own != len(names):
        doubt = f"has the positions of {len(names)} axes, expected {own} as the arm of the cell has"
    return doubt
