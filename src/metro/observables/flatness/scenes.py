"""Scans of whole scenes: which faces of them are measured, and under which names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.surface.extent import misfit
from metro.surface.points import Points
from metro.surface.scene_faces import FaceSeen, scene_of
from metro.units import MM

SCENE = "scene"  # the check of the quality table that says that a scan shows more than one face
MARGIN = 0.25  # of the work's sides; scanner.extent_margin of batch.yaml


def fitting(faces: Sequence[FaceSeen], batch: Batch, unit: float) -> list[FaceSeen]:
    """Return the faces of the part's size, where batch.yaml states it; ``unit``: a millimetre in theirs."""
    size = (batch.manifest.get("work") or {}).get("size_mm")
    if size is None:
        return list(faces)
    due = np.sort(np.array(size[:2], float))[::-1]
    margin = 1.0 + float(batch.instrument("scanner").get("extent_margin", MARGIN))
    return [face for face in faces if misfit(face.sides / unit, due / margin, due * margin) is None]


def faces_of(batch: Batch, read: Tables, run: str, cloud: Points) -> Iterator[tuple[str, Points]]:
    """Yield the name and the cloud (n, 3), m, of each face that a scan shows.

    A scan of one face is that of the run. Of a scene, as the check of its points has found, each face has a
    number where there are several.
    """
    checks = read("qc", run)
    if not (checks["check"] == SCENE).any():
        yield run, cloud
        return
    faces = fitting(scene_of(cloud, MM).faces, batch, MM)
    for number, face in enumerate(faces, start=1):
        yield run if len(faces) == 1 else f"{run} face {number}", face.cut(cloud)
