"""The scans of a batch as parts of the canonical table: read piece by piece, checked by their extents."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from metro.batch.batch import Batch
from metro.batch.canonical import Part
from metro.batch.findings import Finding as Problem
from metro.signals import plausible, quality
from metro.signals.conversion import moved
from metro.stages.reading import Recordings
from metro.stages.recordings import POINT, files
from metro.surface.extent import face_sides, misfit
from metro.units import Array

PIECE = 1 << 18  # points in memory at a time
SAMPLE = 1 << 12  # points of a piece that are kept to tell the extents from
MARGIN = 0.25  # of the work's sides; scanner.extent_margin of batch.yaml
OF_A_PATH = 2.0  # a path runs past the face at both ends and stays within it across


def scan(batch: Batch, recordings: Recordings) -> Iterator[Part]:
    """Yield each point cloud piece by piece, in the work frame where ``to_work`` is known.

    A cloud whose extents are not those of the work is a problem: the points are in another unit of length,
    or of another part.
    """
    declared = batch.instrument("scanner").get("to_work")
    to_work = None if declared is None else np.array(declared, float)
    for run, file in files(batch, "scan"):
        kept, dropped, samples = 0, 0, []
        for table in recordings.pieces(file, "cloud", PIECE):
            points = table[list(POINT)].to_numpy()
            points = points if to_work is None else moved(points, to_work)
            recordings.note(file, run, [quality.Finding(*found) for found in table.attrs.get("notes", ())])
            kept, dropped = kept + len(points), dropped + table.attrs["dropped"]
            samples.append(_sample(points))
            if len(points):
                yield {"run": run, **dict(zip(POINT, points.T, strict=True))}
        if kept:
            recordings.note(file, run, [quality.missing_points(dropped, kept)])
            problem = _misfit(np.concatenate(samples), batch, recordings.paths.get(run))
            recordings.problems += [Problem("error", file, problem)] if problem else []


def _sample(points: Array) -> Array:
    if len(points) <= SAMPLE:
        return points
    # drawn at random, since every k-th point of a raster may be the same column of it
    return points[np.random.default_rng(0).choice(len(points), SAMPLE, replace=False)]


def _misfit(points: Array, batch: Batch, path: Array | None) -> str:
    """Say what is wrong with the extents of a cloud, or "": by the work's sides, else by the path."""
    scanner = batch.instrument("scanner")
    placed = "to_work" in scanner
    size = (batch.manifest.get("work") or {}).get("size_mm")
    try:
        found = face_sides(points, placed=placed)
    except ValueError as error:
        return f"{error}, expected a scan of a face"
    if size is not None:
        due = np.array(size[:2], float) if placed else np.sort(np.array(size[:2], float))[::-1]
        margin = 1.0 + float(scanner.get("extent_margin", MARGIN))
        what = f"the work is {due[0]:g} × {due[1]:g} mm"
    elif path is not None:
        found, due, margin = found.max(keepdims=True), path.max(keepdims=True), OF_A_PATH
        what = f"the path is {due[0]:g} mm long"
    else:
        return ""
    unit = misfit(found, due / margin, due * margin)
    if unit is None:
        apart = placed and size is not None
        hint = "is scanner.to_work in batch.yaml that of this scan?"
        return plausible.beside(points, np.array(size, float), hint) if apart else ""
    spans = f"the points span {' × '.join(f'{side:.4g}' for side in found)}, {what}"
    if unit:
        return f"{spans}: coordinates seem to be in {unit}, expected millimetres"
    least = " × ".join(f"{side:.4g}" for side in due / margin)
    most = " × ".join(f"{side:.4g}" for side in due * margin)
    hint = "is it a scan of another part, or of a part of the face (instruments.scanner.extent_margin)?"
    return f"{spans}, expected {least} to {most} mm: {hint}"
