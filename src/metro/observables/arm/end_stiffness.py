"""A tabulated machine's end stiffness over its workspace, with the errors of interpolation ([T] fig. 4).

Tables ``end_stations`` (each station with the error of its stiffness as estimated from the other stations),
``end_errors`` (a row per entry of the stiffness: its range, and how well it is interpolated), ``end_surface``
(slices through the workspace) and ``end_region`` (one row: where the machine is stiffest).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from metro.kriging import krige
from metro.observables.arm.station_table import AXES, PLACE, STIFFNESS, stations_of
from metro.robot.stations import (
    MARGIN,
    Stations,
    beyond_hull,
    leave_one_out,
    leave_one_out_interval,
    left_out,
    stiffness_over,
)
from metro.units import MM, N_UM, Array

GRID = 21
VOLUME = (15, 9, 15)  # places along x, y, z where the stiffest one is sought
FEW_LEVELS = 4  # so many heights of stations are each a slice; of more, three slices are drawn
FEWEST_FOR_SLICES = 10
NEAR_BEST = 0.95  # share of the greatest stiffness that counts as the best region
BORDER = 0.7  # of the way from the middle to the border
PAIRS = (("x", "x"), ("y", "y"), ("z", "z"), ("x", "y"), ("x", "z"), ("y", "z"))
_WITHIN = 1.96


def end_stiffness(read: Callable[..., pd.DataFrame]) -> dict[str, pd.DataFrame]:
    """Return the tables; none for a machine with fewer than three stations with all three stiffnesses."""
    table = read("stations")
    if table.empty or not set(STIFFNESS) <= set(table.columns):
        return {}
    table = table.dropna(subset=[*PLACE, *STIFFNESS]).reset_index(drop=True)
    if len(table) < 3:
        return {}
    stations = stations_of(table)
    errors = 100.0 * left_out(stations)
    stations_table = table[["position", *PLACE, *STIFFNESS]].assign(method=stations.method)
    for k, axis in enumerate(AXES):
        stations_table[f"error_{axis}_percent"] = errors[:, k, k]
    return {
        "end_stations": stations_table,
        "end_errors": _errors(stations),
        "end_surface": _surface(stations),
        "end_region": _region(stations),
    }


def _errors(stations: Stations) -> pd.DataFrame:
    """How well each entry of the stiffness is interpolated: by leaving stations out, and by kriging.

    In percent of the entry; of stiffness across two axes, of the root of the product of those along them.
    """
    rms, (low, high) = leave_one_out(stations), leave_one_out_interval(stations)
    residual, sd = krige(_cube(stations, stations.place), stations.logarithm).left_out()
    kriged, expected = (np.sqrt(np.mean(values**2, axis=0)).reshape(3, 3) for values in (residual, sd))
    within = (np.abs(residual) <= _WITHIN * sd).mean(axis=0).reshape(3, 3)
    rows = []
    for first, second in PAIRS:
        i, j = AXES.index(first), AXES.index(second)
        value = stations.stiffness[:, i, j] / N_UM
        percent = (100.0 * each[i, j] for each in (rms, low, high, kriged, expected, within))
        rows.append((f"k{first}{second}" if i != j else f"k{first}", value.min(), value.max(), *percent))
    columns = ["entry", "least_n_um", "greatest_n_um", "rms_percent", "rms_low_percent", "rms_high_percent"]
    columns += ["kriging_rms_percent", "kriging_sd_percent", "within_percent"]
    return pd.DataFrame(rows, columns=columns).assign(stations=len(stations.place))


def _cube(stations: Stations, places: Array) -> Array:
    """Return places (m, 3) in the unit cube about the stations."""
    low, high = stations.place.min(axis=0), stations.place.max(axis=0)
    return np.asarray((places - low) / np.where(high > low, high - low, 1.0))


def _surface(stations: Stations) -> pd.DataFrame:
    """Stiffness on grids over the stations' two longest directions, at levels of the third.

    ``sd_percent`` is the largest standard deviation of kriging, over the directions.
    """
    low, high = stations.place.min(axis=0), stations.place.max(axis=0)
    first, second = sorted(np.argsort(high - low, kind="stable")[1:])
    third = 3 - first - second
    sides = (np.linspace(low[k], high[k], GRID) for k in (first, second))
    flat = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    parts = []
    for level in _levels(stations, third):
        places = np.full((len(flat), 3), level)
        places[:, [first, second]] = flat
        parts.append(places)
    places = np.concatenate(parts)
    table = pd.DataFrame(places / MM, columns=PLACE)
    table[STIFFNESS] = np.diagonal(stiffness_over(stations, places), axis1=1, axis2=2) / N_UM
    _, sd = krige(_cube(stations, stations.place), stations.logarithm)(_cube(stations, places))
    table["sd_percent"] = 100.0 * sd.reshape(-1, 3, 3)[:, range(3), range(3)].max(axis=1)
    reach = MARGIN * stations.extent
    outside = np.array([beyond_hull(stations.place, place) > reach for place in places])
    table.loc[outside, [*STIFFNESS, "sd_percent"]] = np.nan
    names = {"first": AXES[first], "second": AXES[second], "third": AXES[third]}
    return table.assign(**names, level_mm=table[f"{AXES[third]}_mm"])


def _levels(stations: Stations, axis: int) -> Array:
    """Heights of the slices, m: those where the stations are, if they are few; else three or one."""
    along = stations.place[:, axis]
    known = np.unique(np.round(along, 6))
    middle = (along.min() + along.max()) / 2.0
    if len(along) < FEWEST_FOR_SLICES:
        return np.array([middle])
    half = (along.max() - along.min()) / 2.0
    return known if len(known) <= FEW_LEVELS else middle + half * np.array([-2 / 3, 0.0, 2 / 3])


def _region(stations: Stations) -> pd.DataFrame:
    """Where the machine is stiffest, and how stiffness falls towards the border; one row.

    The stiffness that counts is that in the softest direction, the least eigenvalue of the matrix.
    """
    low, high = stations.place.min(axis=0), stations.place.max(axis=0)
    sides = (np.linspace(a, b, count) for a, b, count in zip(low, high, VOLUME, strict=True))
    places = np.unique(np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3), axis=0)
    places = places[[beyond_hull(stations.place, place) < 1e-6 for place in places]]
    places = np.concatenate([places, stations.place])
    over = stiffness_over(stations, places)
    softest = np.linalg.eigvalsh(0.5 * (over + np.swapaxes(over, 1, 2)))[:, 0]
    best = places[softest.argmax()]
    good = places[softest >= NEAR_BEST * softest.max()]
    row = {"softest_n_um": softest.max() / N_UM, "least_n_um": softest.min() / N_UM}
    for k, axis in enumerate(AXES):
        row |= {f"{axis}_mm": best[k] / MM, f"{axis}_low_mm": good[:, k].min() / MM}
        row |= {f"{axis}_high_mm": good[:, k].max() / MM}
    way = np.linalg.norm(2.0 * _cube(stations, stations.place) - 1.0, axis=1)
    inner, outer = way <= np.quantile(way, 1.0 - BORDER), way >= np.quantile(way, BORDER)
    along = np.diagonal(stations.stiffness, axis1=1, axis2=2) / N_UM
    for k, axis in enumerate(AXES):
        row |= {f"inner_k{axis}_n_um": along[inner, k].mean(), f"outer_k{axis}_n_um": along[outer, k].mean()}
    order = np.argsort(along, axis=1)
    stiffest = np.bincount(order[:, 2], minlength=3)
    ratio = np.sort(along, axis=1)[:, 2] / np.sort(along, axis=1)[:, 1]
    row |= {"stiffest_count": int(stiffest.max()), "stations": len(along)}
    row |= {"ratio_low": ratio.min(), "ratio_high": ratio.max()}
    return pd.DataFrame([row]).assign(stiffest=AXES[int(stiffest.argmax())])
