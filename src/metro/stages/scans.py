"""The scans of a batch as parts of the canonical table: read piece by piece, checked by their extents."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from metro.batch.batch import Batch
from metro.batch.canonical import Part
from metro.batch.findings import Finding as Problem
from metro.observables.flatness.scenes import MARGIN, SCENE, fitting
from metro.signals import plausible, quality
from metro.signals.conversion import moved
from metro.signals.quality import EXTENT
from metro.stages.reading import Recordings
from metro.stages.recordings import POINT, files
from metro.surface.extent import extents, face_sides, misfit, misread
from metro.surface.points import drawn
from metro.surface.scene import LEAST_GROUP, clusters_of, planes_of
from metro.surface.scene_faces import scene_of
from metro.units import Array

PIECE = 1 << 18  # points in memory at a time
SAMPLE = 1 << 12  # points of a piece that are kept to estimate the extents from

SEEN = 20_000  # points that a scan which is no face is looked at with
PART = 0.1  # of them, on a plane or in a group of its own, that a message to the user names
THICK, APART = (
    0.01,
    6.0,
)  # of a plane, over the distance from the middle; of groups, over that to the tenth point
# Of the points of one face, that lie on a plane, and their distance from it over that from the middle: a
# machined face is flatter by far, and a scene of an open part with a face in it has half of them there.
FACE, FLAT = 0.9, 0.05
GROUPS = 5  # more are a cloud full of holes
# A pass may be as short as a face is wide, or cross it in part; a unit is 10, 25.4 or 1000 times another.
OF_A_CUT = 3.0
UNIT = "unit of length"
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
            recordings.note_read(file, run, table)
            kept, dropped = kept + len(points), dropped + table.attrs["dropped"]
            samples.append(_sample(points))
            if len(points):
                yield {"run": run, **dict(zip(POINT, points.T, strict=True))}
        if kept:
            recordings.note(file, run, [quality.missing_points(dropped, kept)])
            sample = np.concatenate(samples)
            path = recordings.paths.get(run)
            problem = _misfit(sample, batch, path) or _no_face(sample)
            cut = _faces_alone(sample, batch, path) if problem else None
            recordings.note(file, run, [*_size(sample, batch, run), *([cut] if cut else [])])
            recordings.problems += [Problem("error", file, problem)] if problem and not cut else []


def _size(points: Array, batch: Batch, run: str) -> Iterator[quality.Finding]:
    """Yield the size of a cloud, and a doubt of its unit where the length of the cut alone shows one."""
    placed = "to_work" in batch.instrument("scanner")
    try:
        size = extents(points, placed=placed)
    except ValueError:
        return
    spans = f"{' × '.join(f'{side:.4g}' for side in size)} mm"
    yield quality.Finding(EXTENT, float(size[0]), math.nan, True, f"the points span {spans}")
    row: Any = batch.runs.loc[run]
    length = float(row.get("cut_length_mm", math.nan))
    if not length > 0.0 or (batch.manifest.get("work") or {}).get("size_mm") is not None:
        return
    longest, low, high = (
        size[:2].max(keepdims=True),
        np.array([length / OF_A_CUT]),
        np.array([length * OF_A_CUT]),
    )
    unit = misfit(longest, low, high)
    taken = misread(longest, low, high) if unit == "" else ""
    if unit or taken:
        what = f"be in {unit}, not in millimetres" if unit else f"be millimetres that were taken for {taken}"
        message = f"the points span {spans}, but the cut is {length:g} mm long: coordinates seem to {what}"
        yield quality.Finding(UNIT, float(longest[0]), length, False, message)


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
        sides = face_sides(points, placed=placed)
    except ValueError as error:
        return f"{error}, expected a scan of a face"
    if size is not None:
        due = np.array(size[:2], float) if placed else np.sort(np.array(size[:2], float))[::-1]
        margin = 1.0 + float(scanner.get("extent_margin", MARGIN))
        what = f"the work is {due[0]:g} × {due[1]:g} mm"
    elif path is not None:
        sides, due, margin = sides.max(keepdims=True), path.max(keepdims=True), OF_A_PATH
        what = f"the path is {due[0]:g} mm long"
    else:
        return ""
    unit = misfit(sides, due / margin, due * margin)
    if unit is None:
        apart = placed and size is not None
        hint = "is scanner.to_work in batch.yaml that of this scan?"
        return plausible.beside(points, np.array(size, float), hint) if apart else ""
    spans = f"the points span {' × '.join(f'{side:.4g}' for side in sides)}, {what}"
    if unit:
        return f"{spans}: coordinates seem to be in {unit}, expected millimetres"
    if taken := misread(sides, due / margin, due * margin):
        return f"{spans}: coordinates seem to be millimetres that were taken for {taken}"
    least = " × ".join(f"{side:.4g}" for side in due / margin)
    most = " × ".join(f"{side:.4g}" for side in due * margin)
    hint = "is it a scan of another part, or of a part of the face (instruments.scanner.extent_margin)?"
    fits = np.sort(due / margin)[::-1], np.sort(due * margin)[::-1]
    return f"{spans}, expected {least} to {most} mm: {hint}{_scene(points, *fits)}"


def _faces_alone(points: Array, batch: Batch, path: Array | None) -> quality.Finding | None:
    """Say which faces are cut out of a scan of a scene; None where there are none, or a place is declared.

    Of a part of known size a face must have its size; a path alone does not say what of a scene it cut.
    """
    size = (batch.manifest.get("work") or {}).get("size_mm")
    if "to_work" in batch.instrument("scanner") or (size is None and path is not None):
        return None
    seen = scene_of(points, 1.0)
    faces = fitting(seen.faces, batch, 1.0)
    if not faces:
        return None
    each = [f"{' × '.join(f'{s:.3g}' for s in face.sides)} mm ({100 * face.share:.0f} %)" for face in faces]
    others = [f"no face: {reason}" for reason in seen.refused]
    others += [
        f"not the size of the part: {' × '.join(f'{s:.3g}' for s in face.sides)} mm"
        for face in seen.faces
        if face not in faces
    ]
    count = f"{len(faces)} face{'s' if len(faces) > 1 else ''} of it"
    said = f"the scan shows a scene, not one face; {count} {'are' if len(faces) > 1 else 'is'} measured: "
    return quality.Finding(SCENE, len(faces), math.nan, False, said + "; ".join([", ".join(each), *others]))


def _no_face(points: Array) -> str:
    """Say that a cloud is no scan of one face, or "": most of its points then lie on no common plane."""
    some = np.unique(drawn(points, SAMPLE), axis=0)
    size = float(np.median(np.linalg.norm(some - np.median(some, axis=0), axis=1)))
    planes = planes_of(some, FLAT * size, least_share=PART) if size > 0.0 else []
    share = len(planes[0].members) / len(some) if planes else 0.0
    if share >= FACE or size == 0.0:
        return ""
    found = f"{100 * share:.0f} % of the points lie within {FLAT * size:.2g} mm of one plane"
    sides = np.full(2, np.inf)
    return (
        f"{found}, expected {100 * FACE:.0f} % or more of a scan of one face: keep the points of the face "
        f"alone{_scene(points, sides, sides)}"
    )


def _scene(points: Array, low: Array, high: Array) -> str:
    """Say which planes and groups there are in a cloud that is not the face alone; "" where it is one plane.

    ``low``, ``high`` (k,) mm: limits of the face's sides, the longer one first.
    """
    points = np.unique(drawn(points, SEEN), axis=0)
    size = float(np.median(np.linalg.norm(points - np.median(points, axis=0), axis=1)))
    planes = planes_of(points, THICK * size, least_share=PART) if size > 0.0 else []
    said = ""
    if len(planes) > 1:
        each = [
            f"{' × '.join(f'{side:.3g}' for side in seen.sides)} mm "
            f"({100 * len(seen.members) / len(points):.0f} % of the points)"
            for seen in planes
        ]
        said = f"; the points lie on {len(planes)} planes: {', '.join(each)}"
        fitting = [i for i, seen in enumerate(planes, 1) if misfit(seen.sides[: len(low)], low, high) is None]
        if fitting:
            said = f"{said}; plane {fitting[0]} has the size of the face: keep its points alone"
    count = _groups(points)
    return f"{said}; the points lie in {count} groups apart" if 1 < count <= GROUPS else said


def _groups(points: Array) -> int:
    """Count the groups of points that are apart, each at least a ``PART`` of the cloud."""
    from scipy.spatial import cKDTree

    if len(points) <= LEAST_GROUP:
        return 1
    tenth = cKDTree(points).query(points, k=[LEAST_GROUP + 1])[0]
    label = clusters_of(points, APART * float(np.median(tenth)))
    return int((np.bincount(label[label >= 0], minlength=1) >= PART * len(points)).sum())
