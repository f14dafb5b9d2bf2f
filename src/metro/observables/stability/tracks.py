"""The modes of a machine followed over the positions where they were measured ([T] section 4.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from metro.dynamics.tracking import Seen, follow
from metro.units import Array

TRACK_COLUMNS = ("position", "direction", "mode", "frequency_hz", "compared_with", "mac")


def track(modes: pd.DataFrame, shapes: pd.DataFrame, where: Mapping[str, Array]) -> pd.DataFrame:
    """Name each mode by its direction and the number of the mode that it is at all positions, "x2".

    Returns
    -------
    A row per row of ``modes``: ``mode``, the position that it was ``compared_with`` ("" for the first), and
    the modal assurance criterion ``mac`` with the mode there (NaN where there is none).
    """
    parts = [_of_direction(rows, shapes, where) for _, rows in modes.groupby("direction", sort=False)]
    table = pd.concat(parts) if parts else pd.DataFrame(columns=list(TRACK_COLUMNS))
    return table.loc[modes.index, list(TRACK_COLUMNS)].reset_index(drop=True)


def _of_direction(rows: pd.DataFrame, shapes: pd.DataFrame, where: Mapping[str, Array]) -> pd.DataFrame:
    direction = rows["direction"].iloc[0]
    positions = [str(position) for position in rows["position"].unique()]
    tests = []
    for position in positions:
        frequency = np.sort(
            rows.loc[rows["position"].astype(str) == position, "frequency_hz"].to_numpy(float)
        )
        there = (shapes["position"].astype(str) == position) & (shapes["direction"] == direction)
        tests.append(_seen(frequency, shapes[there]))
    tracks = follow(tests, _apart(positions, where))
    parts = []
    for position, one in zip(positions, tracks, strict=True):
        own = rows[rows["position"].astype(str) == position].sort_values("frequency_hz")
        parts.append(
            own[["position", "direction", "frequency_hz"]].assign(
                mode=[f"{str(direction).lstrip('+-')}{number}" for number in one.number],
                compared_with=positions[one.before] if one.before >= 0 else "",
                mac=one.alike,
            )
        )
    return pd.concat(parts)


def _seen(frequency: Array, shapes: pd.DataFrame) -> Seen:
    """Return the modes at ``frequency`` (m,) with their shapes over the pairs of points."""
    pairs = list(dict.fromkeys(zip(shapes["reference"], shapes["response"], strict=True)))
    values = shapes.assign(value=shapes["real"] + 1j * shapes["imag"])
    shape = np.zeros((len(frequency), len(pairs)), dtype=np.complex128)
    for of_mode, rows in values.groupby("frequency_hz", sort=False):
        i = int(np.argmin(np.abs(frequency - float(str(of_mode)))))
        at = [pairs.index(pair) for pair in zip(rows["reference"], rows["response"], strict=True)]
        shape[i, at] = rows["value"].to_numpy()
    return Seen(frequency, shape, tuple(pairs))


def _apart(positions: Sequence[str], where: Mapping[str, Array]) -> Array | None:
    """Distances (n, n), m, of the positions' poses; None if one of them has no place."""
    poses = [position.split("/")[0] for position in positions]
    if not all(pose in where for pose in poses):
        return None
    at = np.stack([where[pose] for pose in poses])
    distance: Array = np.linalg.norm(at[:, None] - at[None], axis=2)
    return distance
