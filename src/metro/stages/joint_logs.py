"""Joint logs of an arm that moved and cut nothing, as parts of a canonical table."""

from __future__ import annotations

from collections.abc import Iterator

from metro.batch.batch import Batch
from metro.batch.canonical import Part
from metro.joint_columns import JOINT_COLUMNS, positions
from metro.signals import plausible, quality
from metro.stages.reading import Recordings
from metro.stages.recordings import files
from metro.stages.robot_logs import joint_doubt
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
        if recordings.doubt(file, plausible.clock(time, rate) or joint_doubt(batch, table)):
            continue
        recordings.note(file, run, quality.sampling(time - time[0], rate))
        recordings.note_read(file, run, table)
        drives = [name for name in table if str(name).startswith(("tau", "current"))]
        angles = table[positions([str(name) for name in table.columns])].to_numpy()
        checks = [quality.motion(angles), *(quality.dead(str(n), table[n].to_numpy()) for n in drives)]
        if recordings.fit(file, run, "joint_log", checks):
            yield {"run": run, "t_s": time - time[0], **{n: table[n] for n in JOINT_COLUMNS if n in table}}
