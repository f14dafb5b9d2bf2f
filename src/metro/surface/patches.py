"""A cloud of a block as small flat patches, each with its normal, and the faces that they make up.

A patch is a cubic cell whose points lie in a plane; cells over an edge do not and are left out, so that an
edge, rounded or with a burr, has no influence on the place of a face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.units import MM, Array

CELL = 6.0  # pitches across a cell
LEAST_POINTS = 10
NARROW = 0.02  # least second over largest spread (variance) of a patch: a strip, not a line
THIN = 0.1  # most that the least spread is of the second
FLAT = 4.0  # times the median variance across a patch
ALIKE = 0.8  # least cosine between a patch's normal and the axis that its face is named by
FAR = 3.5  # robust deviations from a face's plane


@dataclass(frozen=True)
class Patches:
    """Centres (m, 3), unit normals (m, 3; of either sign) of patches, and the width of their cells.

    ``scatter`` : (m, 3, 3) covariance of the points of each.
    """

    centres: Array
    normals: Array
    cell: float
    scatter: Array

    def __getitem__(self, which: np.ndarray) -> Patches:
        """Return some of the patches."""
        return Patches(self.centres[which], self.normals[which], self.cell, self.scatter[which])

    def __len__(self) -> int:
        """Return the number of patches."""
        return len(self.centres)

    @property
    def normal(self) -> Array:
        """Normal (3,), of either sign, of the plane of them all.

        It is that of their points: the centres of a single row of patches lie in many planes.
        """
        centred = self.centres - self.centres.mean(axis=0)
        between = centred.T @ centred / len(self)
        return np.asarray(np.linalg.eigh(between + self.scatter.mean(axis=0))[1][:, 0])


def find_patches(points: Array, pitch: float) -> Patches:
    """Part ``points`` (n, 3) into cubic cells of six ``pitch``, at least 1 mm, and keep the flat ones."""
    cell = max(CELL * pitch, MM)
    corner = points.min(axis=0)
    number = ((points - corner) / cell).astype(np.int64)
    reach = number.max(axis=0) + 1
    key = (number[:, 0] * reach[1] + number[:, 1]) * reach[2] + number[:, 2]
    _, home, count = np.unique(key, return_inverse=True, return_counts=True)

    def means(values: Array) -> Array:
        return np.bincount(home, weights=values) / count

    centres = np.stack([means(each) for each in points.T], axis=1)
    centred = points - centres[home]
    scatter = np.empty((len(count), 3, 3))
    for i in range(3):
        for j in range(i, 3):
            scatter[:, i, j] = scatter[:, j, i] = means(centred[:, i] * centred[:, j])
    enough = count >= LEAST_POINTS
    spread, vectors = np.linalg.eigh(scatter[enough])
    shaped = spread[:, 1] > NARROW * spread[:, 2]
    shaped &= spread[:, 0] < THIN * spread[:, 1]
    flat = shaped & (spread[:, 0] <= FLAT * np.median(spread[shaped, 0])) if shaped.any() else shaped
    return Patches(centres[enough][flat], vectors[flat, :, 0], cell, scatter[enough][flat])


def block_faces(patches: Patches, middle: Array) -> dict[str, Patches]:
    """Sort patches into the faces ``x-``, ``x+``, ``y-``, ``y+``, ``z+`` of a block about along the axes.

    A face is the plane that most of the patches on its side of ``middle`` (3,) lie in; other planes there
    (clamps, steps) are left out. The top is taken to be the plane of most patches that face along z.
    """
    faces = {}
    axes = np.argmax(np.abs(patches.normals), axis=1)
    alike = np.abs(patches.normals).max(axis=1) >= ALIKE
    for axis, name in enumerate("xyz"):
        own = alike & (axes == axis)
        above = patches.centres[:, axis] > middle[axis]
        sides = {"z+": own} if name == "z" else {f"{name}-": own & ~above, f"{name}+": own & above}
        for side, members in sides.items():
            face = _largest_plane(patches[members], axis)
            if len(face):
                faces[side] = face
    return faces


def _largest_plane(patches: Patches, axis: int) -> Patches:
    """Keep the patches of the plane that most of them lie in, by their own normals' mean direction."""
    if not len(patches):
        return patches
    signed = patches.normals * np.sign(patches.normals[:, axis])[:, None]
    direction = np.median(signed, axis=0)
    offsets = patches.centres @ (direction / np.linalg.norm(direction))
    ordered = np.sort(offsets)
    begins = np.searchsorted(ordered, ordered + patches.cell, side="right") - np.arange(len(ordered))
    first = ordered[np.argmax(begins)]
    kept = patches[(offsets >= first) & (offsets <= first + patches.cell)]
    for _ in range(10):
        distance = _from_own_plane(kept)
        near = np.abs(distance) <= FAR * 1.4826 * max(float(np.median(np.abs(distance))), np.finfo(float).eps)
        if near.all() or near.sum() < 3:
            break
        kept = kept[near]
    return kept


def _from_own_plane(patches: Patches) -> Array:
    return np.asarray((patches.centres - patches.centres.mean(axis=0)) @ patches.normal)
