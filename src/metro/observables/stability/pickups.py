"""How much of each measured response the modes reconstruct, by its distance from the blow ([T] fig. 16).

Tables ``mode_pickups`` (a row per pair of points in one direction) and ``mode_cross`` (a row per pair across
two directions: how large it is beside the response along the blow, [T] section 4.2).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from metro.observables.stability.receptance import Receptance
from metro.units import Array, ComplexArray

PICKUP_COLUMNS = (
    *("position", "direction", "reference", "response", "distance_mm", "error", "noise", "level"),
)
CROSS_COLUMNS = ("position", "reference", "response", "share", "noise")


def pickups(used: pd.DataFrame, distances: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the error of reconstruction of each pair, with its distance where impacts.csv has it.

    ``level`` is the rms of the receptance beside that of the same position's driving point in the direction;
    NaN where none was measured.
    """
    if used.empty:
        return pd.DataFrame(columns=list(PICKUP_COLUMNS))
    size = used.assign(power=used["real_m_n"] ** 2 + used["imag_m_n"] ** 2)
    keys = ["position", "reference", "response"]
    rows = size.groupby(keys, sort=False).agg(
        error=("error", "first"), noise=("noise", "first"), power=("power", "mean")
    )
    rows = rows.reset_index().assign(direction=lambda t: t["response"].str[-1])
    driving = rows[rows["reference"] == rows["response"]].set_index(["position", "reference"])["power"]
    at = pd.MultiIndex.from_frame(rows[["position", "reference"]])
    rows["level"] = np.sqrt(rows["power"].to_numpy() / driving.reindex(at).to_numpy())
    rows = rows.merge(distances.astype({"position": str}), on=keys, how="left")
    return rows[list(PICKUP_COLUMNS)]


def crossed(measured: Sequence[Receptance], used: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the rms of each response across the blow, as a share of that along it where the blow fell.

    In the band of the modes; ``noise`` is that of the response across, likewise.
    """
    rows = []
    along = {(item.position, item.reference): item for item in measured if item.driving}
    for item in measured:
        direct = along.get((item.position, item.reference))
        if item.reference[-1] == item.response[-1] or direct is None or used.empty:
            continue
        band = used.loc[used["position"].astype(str) == item.position, "frequency_hz"]
        whole = _rms(direct.frf, direct.frequency, band)
        noise = np.nan if item.variance is None else _rms(np.sqrt(item.variance), item.frequency, band)
        share = _rms(item.frf, item.frequency, band) / whole
        rows.append((item.position, item.reference, item.response, share, noise / whole))
    return pd.DataFrame(rows, columns=list(CROSS_COLUMNS))


def _rms(values: Array | ComplexArray, frequency: Array, band: pd.Series) -> float:
    inside = (frequency >= band.min()) & (frequency <= band.max())
    return float(np.sqrt(np.mean(np.abs(values[inside]) ** 2)))
