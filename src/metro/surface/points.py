"""Clouds that need not fit in memory: rows of x, y, z that are read in slices, over and over."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

import numpy as np
import numpy.typing as npt

from metro.units import Array

CHUNK = 1 << 16
IN_MEMORY = 4_000_000  # points of a spooled cloud that stay in memory; more go to a file without a name
_ROW = np.dtype((np.float64, 3))


class Points(Protocol):
    """Rows of x, y, z that can be sliced again and again: an array, or a file that is read on demand."""

    def __len__(self) -> int:
        """Return the number of points."""

    def __getitem__(self, rows: slice, /) -> npt.NDArray[np.floating]:
        """Return some of the points, (k, 3)."""


class Spool:
    """Points that were given piece by piece, kept in memory while they are few, else on disk."""

    def __init__(self, pieces: Iterable[Array]) -> None:
        self._file = _nameless()
        self._count = 0
        for piece in pieces:
            self._file.write(np.ascontiguousarray(piece, dtype=np.float64).tobytes())
            self._count += len(piece)

    def __len__(self) -> int:
        """Return the number of points."""
        return self._count

    def __getitem__(self, rows: slice) -> Array:
        """Return successive points, (k, 3)."""
        first, last, _ = rows.indices(self._count)
        self._file.seek(first * _ROW.itemsize)
        return np.frombuffer(self._file.read(max(last - first, 0) * _ROW.itemsize)).reshape(-1, 3)


def _nameless() -> tempfile.SpooledTemporaryFile[bytes]:
    """Open a file that is closed, and gone, with the cloud that holds it."""
    return tempfile.SpooledTemporaryFile(max_size=IN_MEMORY * _ROW.itemsize)


def slices(points: Points) -> Iterator[tuple[int, Array]]:
    """Give the place of the first point of each slice, and x, y, z of the slice as columns (3, k)."""
    # glibc keeps pages for blocks up to the largest that was freed; all others cost a page fault per 4 KiB
    np.empty(16 * CHUNK * _ROW.itemsize, dtype=np.uint8)
    for start in range(0, len(points), CHUNK):
        yield start, np.array(points[start : start + CHUNK].T, dtype=np.float64, order="C")


def changed(points: Points, change: Callable[[Array], Array]) -> Spool:
    """Return what ``change`` makes of the points (k, 3) of each slice: they are moved, or some left out."""
    return Spool(change(xyz.T) for _, xyz in slices(points))


def box(points: Points) -> tuple[Array, Array]:
    """Return the lowest and highest corner (3,) of the box that holds the points; infinite without any."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for _, xyz in slices(points):
        low, high = np.minimum(low, xyz.min(axis=1)), np.maximum(high, xyz.max(axis=1))
    return low, high


def drawn(points: Points, most: int) -> Array:
    """Return the points (k, 3), or ``most`` of them drawn at random, always the same."""
    if len(points) <= most:
        return np.asarray(points[:], dtype=np.float64)
    chosen = np.sort(np.random.default_rng(0).choice(len(points), most, replace=False))
    parts = []
    for start, xyz in slices(points):
        first, last = np.searchsorted(chosen, [start, start + xyz.shape[1]])
        parts.append(xyz[:, chosen[first:last] - start].T)
    return np.concatenate(parts)
