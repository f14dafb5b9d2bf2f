"""The orientation of the dynamometer: 24 right-handed sets of axes, each reading work or tool."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations, product

import numpy as np

from metro.batch.axes import AXES, signed_axes
from metro.slips.hypothesis import Hypothesis
from metro.slips.waveform import Design, Record
from metro.units import DEG, JSON, Array

COLUMN = "instruments.dynamometer.axes"
OTHER = {"work": "tool", "tool": "work"}


def orientations(sensor: JSON, records: Sequence[Record], designs: Sequence[Design]) -> Iterator[Hypothesis]:
    """Yield the 47 other orientations: the axes a permutation with signs, of either handedness.

    A left-handed one is the right-handed one with all signs turned, by a sensor that reads the other body.

    Parameters
    ----------
    sensor : the entry of the manifest.
    """
    declared = signed_axes(sensor.get("axes") or {})
    reads = str(sensor.get("reads", "work"))
    angle = float(sensor.get("rotation_deg", 0.0)) * DEG
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    for matrix in signed_permutations():
        if np.array_equal(matrix, np.eye(3)):
            continue
        right_handed = np.linalg.det(matrix) > 0.0
        axes = matrix @ declared if right_handed else -matrix @ declared
        moved = turn @ matrix @ turn.T
        yield Hypothesis(
            "axes",
            _remedy(axes, reads if right_handed else OTHER[reads], matrix, reads, declared),
            COLUMN,
            [record.mapped(moved) for record in records],
            designs,
        )


def signed_permutations() -> Iterator[Array]:
    """Yield the 48 matrices (3, 3) that take axes to axes with signs."""
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[order, range(3)] = signs
            yield matrix


def axes_text(axes: Array) -> str:
    """Write the axes as batch.yaml does: {x: -y, y: -x, z: -z}."""
    named = [
        f"{name}: {'-' if column.sum() < 0 else ''}{AXES[int(np.argmax(np.abs(column)))]}"
        for name, column in zip(AXES, axes.T, strict=True)
    ]
    return f"{{{', '.join(named)}}}"


def _remedy(axes: Array, reads: str, matrix: Array, declared_reads: str, declared: Array) -> str:
    """Name the line; of a left-handed change also what else does the same."""
    line = f"axes: {axes_text(axes)}"
    if reads == declared_reads:
        return line
    only_reads = np.array_equal(axes, declared)
    line = f"reads: {reads}" if only_reads else f"reads: {reads}, {line}"
    signs = np.diag(declared.T @ matrix @ declared)
    if np.abs(signs).sum() == 3.0 and not only_reads:
        turned = [f"f{name}" for name, sign in zip(AXES, signs, strict=True) if sign < 0]
        line += f" (the same as the sign of {' and '.join(turned)} turned in the files)"
    return line
