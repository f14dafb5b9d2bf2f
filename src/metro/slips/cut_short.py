"""Force records that cover much less of their cut than the others of the batch: files that were cut off."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from metro.batch.batch import Batch
from metro.batch.findings import Finding
from metro.batch.processed import Tables
from metro.units import MM

LEAST_RUNS = 4  # of fewer, a median says little
SHORT = 0.2  # of the median: a part of a record that somebody chose is seldom so small


def cut_short(batch: Batch, read: Tables) -> Iterator[Finding]:
    """Yield a warning for each force record that covers less than ``SHORT`` of what is usual in the batch.

    How much of a cut is recorded is the lab's choice, so the records of a batch are compared with each other.
    """
    runs = batch.runs
    teeth = batch.manifest["tool"].get("teeth", np.nan)
    feed = runs["feed_per_tooth_mm"] * MM * teeth * runs["spindle_rpm"] / 60.0  # m/s
    share = {}
    for run in batch.with_files("dynamometer"):
        length = float(runs["cut_length_mm"][run]) * MM
        ends = [
            piece["t_s"].iloc[[0, -1]].to_numpy(float) for piece in read.pieces("force", run) if len(piece)
        ]
        if ends and length > 0.0 and feed[run] > 0.0:
            share[run] = float(ends[-1][-1] - ends[0][0]) * float(feed[run]) / length
    usual = float(np.median(list(share.values()))) if len(share) >= LEAST_RUNS else 0.0
    for run, covered in share.items():
        if covered < SHORT * usual:
            message = (
                f"covers {100.0 * covered:.2g} % of the cut, the records of this batch {100.0 * usual:.2g} % "
                "(median): the file may have been cut off; record or export it again, or leave it blank"
            )
            yield Finding("warning", str(runs["dynamometer"][run]), message, run=run)
