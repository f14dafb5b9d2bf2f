"""Load tests of the tip: pulled by hand or by a cylinder, watched by a tracker."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from virtual_cell.hidden import drawn_size
from virtual_cell.units import DEG, MM, UM, Array
from virtual_cell.world.draws import uniform
from virtual_cell.world.faces.structure import Structure, pulled
from virtual_cell.write import Row

_Pull = tuple[int, tuple[float, float], int, float, int]  # point, place in mm, axis, force in N, replicate


@dataclass(frozen=True)
class LoadTest:
    """How the tip is loaded and how its motion is measured.

    Attributes
    ----------
    places : mm, work frame. newtons : pulls. repeats : of each. noise : m, of the tracker, per axis.
    outliers : share of readings taken while the beam was broken, off by ``lost`` m.
    gain : of the load cell, relative error. askew : rad, standard deviation of the direction of a pull.
    """

    places: tuple[tuple[float, float], ...]
    newtons: tuple[float, ...]
    repeats: int
    noise: float
    outliers: float
    lost: float
    gain: float
    askew: float


def rows(test: LoadTest, pose: str, structure: Structure, rng: np.random.Generator) -> list[Row]:
    """Pull the tip along x, y and z at all places; return the rows of loads.csv."""
    plan: list[_Pull] = [
        (point, place, axis, newton, replicate)
        for point, place in enumerate(test.places, start=1)
        for axis in range(3)
        for newton in test.newtons
        for replicate in range(1, test.repeats + 1)
    ]
    towards = np.eye(3)[[axis for _, _, axis, _, _ in plan]]
    towards = towards + test.askew * rng.standard_normal(towards.shape) * (1.0 - towards)
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    newtons = np.array([newton for _, _, _, newton, _ in plan])
    points = np.array([place for _, place, _, _, _ in plan]) * MM
    moved = pulled(structure, points, newtons[:, None] * (1.0 + test.gain) * towards)
    read = moved + test.noise * rng.standard_normal(moved.shape)
    broken = rng.uniform(size=len(moved)) < test.outliers
    read[broken] += test.lost * rng.standard_normal((int(broken.sum()), 3))
    axis = np.array([axis for _, _, axis, _, _ in plan])
    while True:  # whoever sees the tip move against the pull pulls again
        wrong = read[np.arange(len(read)), axis] <= 0.0
        if not wrong.any():
            break
        read[wrong] = moved[wrong] + test.noise * rng.standard_normal((int(wrong.sum()), 3))
    return [_row(pose, one, at) for one, at in zip(plan, (read / MM).tolist(), strict=True)]


def _row(pose: str, pull: _Pull, read: list[float]) -> Row:
    point, (x, y), axis, newton, replicate = pull
    row: Row = {"pose": pose, "point": f"P{point}", "x_mm": x, "y_mm": y, "z_mm": 0.0}
    row |= {f"f{name}_n": newton if i == axis else 0.0 for i, name in enumerate("xyz")}
    row |= {f"d{name}_mm": round(read[i], 4) for i, name in enumerate("xyz")}
    return row | {"replicate": replicate}


def drawn(rng: np.random.Generator, size: tuple[float, float], *, many: bool) -> LoadTest:
    """Draw load tests at nine places of a plate, or at twelve.

    A tracker reads to 5–40 µm; 0.2–2 % of its readings are of a broken beam; the load cell is wrong by
    0.5–2 % and pulls go 0.3–1.5° beside the axis.
    """
    along = np.linspace(15.0, size[0] / MM - 15.0, 4 if many else 3).round(1).tolist()
    across = np.linspace(12.0, size[1] / MM - 12.0, 3).round(1).tolist()
    newtons = ((180.0, 360.0), (120.0, 240.0, 480.0), (200.0, 420.0))[int(rng.integers(3))]
    gain = math.copysign(uniform(rng, 0.005, 0.02), rng.uniform(-1.0, 1.0))
    return LoadTest(
        tuple((x, y) for x in along for y in across),
        newtons,
        int(rng.integers(2, 5)),
        drawn_size(rng, 5.0, 40.0) * UM,
        drawn_size(rng, 0.002, 0.02),
        drawn_size(rng, 0.08, 0.4) * MM,
        gain,
        uniform(rng, 0.3, 1.5) * DEG,
    )


def as_written(test: LoadTest) -> Row:
    """Return what was drawn, for the truth."""
    noise, lost = round(test.noise / UM, 1), round(test.lost / UM)
    return {
        "tracker_noise_um": noise,
        "broken_beam_share": test.outliers,
        "broken_beam_um": lost,
        "load_cell_gain_error": round(test.gain, 4),
        "pull_askew_deg": round(test.askew / DEG, 2),
    }


def mass_error(rng: np.random.Generator, mass: Array) -> Array:
    """Return a reduced mass (3, 3), kg, as it is declared: its entries are known to 2–8 %."""
    stretch = np.eye(3) + 0.5 * drawn_size(rng, 0.02, 0.08) * rng.standard_normal((3, 3))
    return np.asarray(stretch @ mass @ stretch.T)
