"""Repeat scans: runs of a batch that show one face, which was not cut in between, and the noise from them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.surface.face import NESTING_INDEX
from metro.surface.face_noise import Noise, repeat_noise
from metro.surface.points import Points, Spool
from metro.units import MM


def repeat_scans(batch: Batch) -> dict[str, tuple[str, ...]]:
    """Return, for each run whose face was scanned more than once, the runs with these scans, itself included.

    Runs of one condition show one face if no more than one of them was cut: a row without an operation is a
    scan and no cut. (Replicates that were each cut have different faces, which differ by cutting and noise.)
    """
    runs = batch.runs
    scans = runs[runs["scan"].fillna("").astype(str) != ""]
    scans_of_run: dict[str, tuple[str, ...]] = {}
    for _, group in scans.groupby("condition", sort=False):
        cut = group["operation"].fillna("").astype(str) != ""
        if len(group) > 1 and cut.sum() <= 1:
            scans_of_run |= dict.fromkeys(map(str, group.index), tuple(map(str, group.index)))
    return scans_of_run


def scanned_again(batch: Batch, run: str) -> bool:
    """Whether a run is another scan of a face that an earlier run shows, and no new face."""
    same = repeat_scans(batch).get(run, (run,))
    operation = batch.runs["operation"].fillna("").astype(str)
    first = next((name for name in same if operation[name]), same[0])
    return run != first


def cloud_of(read: Tables, run: str) -> Points:
    """Return the scan of a run, (n, 3) m, read piece by piece."""
    pieces = read.pieces("scan", run)
    return Spool(piece[["x_mm", "y_mm", "z_mm"]].to_numpy(dtype=float) * MM for piece in pieces)


def noise_by_repeats(batch: Batch, read: Tables) -> Callable[[str], Noise | str | None]:
    """Return a function of the run: the noise by repeat scans, the reason for none, or None without scans."""
    groups = repeat_scans(batch)
    nesting = float(batch.instrument("scanner").get("nesting_index_mm", NESTING_INDEX / MM)) * MM

    @cache
    def of_group(runs: tuple[str, ...]) -> Noise | str:
        try:
            return repeat_noise([cloud_of(read, run) for run in runs], nesting)
        except ValueError as error:
            return f"its repeat scans give no noise: {error}"

    return lambda run: of_group(groups[run]) if run in groups else None
