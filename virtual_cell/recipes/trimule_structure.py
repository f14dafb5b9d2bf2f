"""The structure of the helical-milling batch: 73 stations of end stiffness, a modal test at seven of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from virtual_cell.hybrid import DISTANCE_M, POINTS, end_stiffness, modes_at, positions, shapes
from virtual_cell.modes import Modes
from virtual_cell.roving import blows
from virtual_cell.units import N_UM, Array
from virtual_cell.write import Row, write_csv, write_signal

# table 5: x, y, z (mm)
SEVEN = {
    "1": (0.0, 0.0, 0.0),
    "2": (0.0, 0.0, -320.0),
    "3": (0.0, 200.0, -320.0),
    "4": (-200.0, 0.0, -320.0),
    "5": (-400.0, 0.0, -320.0),
    "6": (-200.0, 0.0, 50.0),
    "7": (0.0, 200.0, 0.0),
}
_MESH = 0.005  # scatter of a calculated stiffness, by another mesh for every position
_ELSEWHERE = 4  # points of the other positions
_RATE, _DURATION, _HITS = 2048.0, 2.0, 5
_FLOOR = 0.015  # noise of each accelerometer, of the rms at the tip
_CROSS = 0.02  # of the motion along a blow that is seen across it at the tip
_COUNTS = 2**12  # of a converter, between zero and the largest value: its range fits the channel
# One file for each blow: the force and what every accelerometer felt, a record each.
FILES = {"impacts/*.parquet": {"columns": {"response": {"from": "response_{record}", "unit": "m/s2"}}}}


def write_stations(folder: Path, rng: np.random.Generator) -> None:
    """Write the calculated end stiffness at 73 positions, with the stiffness across."""
    rows: list[Row] = []
    for name, place in positions(SEVEN).items():
        matrix = end_stiffness(place) / N_UM
        size = np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
        scatter = _MESH * rng.standard_normal((3, 3))
        matrix = np.round(matrix + size * 0.5 * (scatter + scatter.T), 5)
        row: Row = {"position": name, **dict(zip(("x_mm", "y_mm", "z_mm"), place.tolist(), strict=True))}
        row |= {f"k{a}_n_um": matrix[i, i] for i, a in enumerate("xyz")}
        row |= {f"k{a}{b}_n_um": matrix["xyz".index(a), "xyz".index(b)] for a, b in ("xy", "xz", "yz")}
        rows.append(row)
    write_csv(folder / "stations.csv", rows)


def write_modal_tests(folder: Path, at_first: dict[str, Modes], rng: np.random.Generator) -> None:
    """Write five blows on the tip in each direction at every position, heard at four points each.

    At the first position they are heard at all six points, and at the tip across the blow, too.
    """
    first = np.array(SEVEN["1"])
    rows: list[Row] = []
    for name, place in SEVEN.items():
        for direction, modes in modes_at(np.array(place), at_first, first).items():
            shape = shapes(np.array(place), len(modes.damped))
            tested = blows(modes, shape, [0], rng, hits=_HITS, rate=_RATE, duration=_DURATION)
            for _, replicate, force, felt in tested:
                motion = felt + _FLOOR * felt[0].std() * rng.standard_normal(felt.shape)
                points = POINTS if name == "1" else POINTS[:_ELSEWHERE]
                heard = {f"{point}{direction}": motion[POINTS.index(point)] for point in points}
                if name == "1":
                    other = next(axis for axis in at_first if axis != direction)
                    noise = _FLOOR * felt[0].std() * rng.standard_normal(len(force))
                    heard[f"1{other}"] = _CROSS * motion[0] + noise
                file = f"impacts/{name}{direction}-{replicate}.parquet"
                _write_blow(folder / file, force, list(heard.values()))
                rows += [
                    {
                        "test": "tip",
                        "position": name,
                        "reference": f"1{direction}",
                        "response": point,
                        "replicate": replicate,
                        "kind": "record",
                        "file": f"{file}#{number}",
                        "response_unit": "m/s2",
                        "distance_mm": float(1000.0 * DISTANCE_M[POINTS.index(point[0])]),
                    }
                    for number, point in enumerate(heard, 1)
                ]
    write_csv(folder / "impacts.csv", rows)


def _write_blow(path: Path, force: Array, motion: list[Array]) -> None:
    columns = {"t_s": np.arange(len(force)) / _RATE, "force_n": _counted(force)}
    columns |= {f"response_{i}": _counted(each) for i, each in enumerate(motion, 1)}
    write_signal(path, columns)


def _counted(values: Array) -> Array:
    """Return values as a converter gives them."""
    step = float(np.abs(values).max()) / _COUNTS
    counted: Array = np.round(values / step) * step
    return counted
