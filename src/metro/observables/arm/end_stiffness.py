"""A tabulated machine's end stiffness over its workspace, and the errors of leave-one-out ([T] fig. 4).

Tables ``end_stations`` (each station with the error of its stiffness as estimated from the other stations)
and ``end_surface`` (the surface through them in the plane of the two longest directions).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from metro.robot.stations import Stations, leave_one_out, leave_one_out_interval, left_out, stiffness_at
from metro.units import MM, N_UM, Array

AXES = "xyz"
PLACE = [f"{axis}_mm" for axis in AXES]
STIFFNESS = [f"k{axis}_n_um" for axis in AXES]
GRID = 21


def end_stiffness(read: Callable[..., pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Return both tables; none for a machine with fewer than three stations with all three stiffnesses."""
    table = read("stations")
    if table.empty or not set(STIFFNESS) <= set(table.columns):
        return {}
    table = table.dropna(subset=[*PLACE, *STIFFNESS])
    if len(table) < 3:
        return {}
    stations = Stations(table[PLACE].to_numpy(float) * MM, table[STIFFNESS].to_numpy(float) * N_UM)
    errors, (low, high) = left_out(stations), leave_one_out_interval(stations)
    table = table[["position", *PLACE, *STIFFNESS]].assign(method=stations.method)
    for k, axis in enumerate(AXES):
        table[f"error_{axis}_percent"] = 100 * errors[:, k]
        table[f"rms_{axis}_percent"] = 100 * leave_one_out(stations)[k]
        table[f"rms_{axis}_low_percent"], table[f"rms_{axis}_high_percent"] = 100 * low[k], 100 * high[k]
    return {"end_stations": table, "end_surface": _surface(stations)}


def _surface(stations: Stations) -> pd.DataFrame:
    """Stiffness on a grid over the stations' two longest directions, in the middle of the third."""
    low, high = stations.place.min(axis=0), stations.place.max(axis=0)
    first, second = sorted(np.argsort(high - low)[1:])
    place = np.tile((low + high) / 2, (GRID * GRID, 1))
    sides = (np.linspace(low[k], high[k], GRID) for k in (first, second))
    place[:, [first, second]] = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    value = np.stack([_value(stations, one) for one in place]) / N_UM
    columns = dict(zip([*PLACE, *STIFFNESS], np.hstack([place / MM, value]).T, strict=True))
    return pd.DataFrame({"first": AXES[first], "second": AXES[second], **columns})


def _value(stations: Stations, place: Array) -> Array:
    try:
        return stiffness_at(stations, place).value
    except ValueError:  # too far from every station
        return np.full(3, np.nan)
