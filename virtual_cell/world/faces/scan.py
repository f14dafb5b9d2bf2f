"""An optical scanner as it is: spikes, soft edges, burr, holes, drift, correlated noise, and its place.

Heights are along the work's z. The place of the scanner is declared and wrong, or not declared at all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from virtual_cell.arm import rotation_rpy
from virtual_cell.hidden import drawn_size
from virtual_cell.units import DEG, MM, UM, Array
from virtual_cell.world.draws import uniform
from virtual_cell.write import Row

_STEP_MM = 1e-4  # in which coordinates are written
Place = Literal["declared", "outline", "sides"]
_MOST = 30_000  # points of a scan


@dataclass(frozen=True)
class Scanner:
    """An optical scanner and how it is used; lengths in m.

    Attributes
    ----------
    spacing, sigma : between points; noise of one. length, correlated : over which noise is correlated, and
        the share of its variance that is. spikes, spike : share of points that are, and how far off in sigma.
    soft, rolled : how far from an edge heights fall off, and by how much. burr, wide, kept : height and width
        of a burr on the edges where the tool leaves, and along which share of them.
    holes, hole : share of the face without points, and width of such a place. missing : share of the face
        along one edge that is not scanned. drift, steady : change of the reading over a scan, and the share
        of it that is the same in all scans. direction : rad, along which the scanner proceeds, in the work.
    place : whether its place is declared, unknown with the cloud on the work's outline, or unknown with the
        sides of the block scanned, too. to_work : (4, 4), mm, as declared.
    shift, turn : error of its declared place along z, m, and about x and y, rad, standard deviations.
    again : (m, rad), standard deviations by which these differ from scan to scan.
    sides : how far down the sides are scanned, 0: not at all.
    """

    spacing: float
    sigma: float
    length: float
    correlated: float
    spikes: float
    spike: float
    soft: float
    rolled: float
    burr: float
    wide: float
    kept: float
    holes: float
    hole: float
    missing: float
    drift: float
    steady: float
    direction: float
    place: Place
    to_work: Array
    shift: float
    turn: float
    again: tuple[float, float]
    sides: float


@dataclass(frozen=True)
class Placing:
    """Error of the scanner's place that all faces of a batch share: (3,) m, rad, rad; sign of its drift."""

    off: Array
    drifts: float


def placing(scanner: Scanner, rng: np.random.Generator) -> Placing:
    """Draw the errors that all scans of a batch share."""
    size = np.array([scanner.shift, scanner.turn, scanner.turn])
    return Placing(size * rng.standard_normal(3), float(rng.choice([-1.0, 1.0])))


def scanned(
    scanner: Scanner,
    placed: Placing,
    size: tuple[float, float],
    *,
    leaving: tuple[int, float],
    height: Callable[[Array], Array],
    rng: np.random.Generator,
) -> Array:
    """Return a cloud (n, 3), mm, scanner coordinates, of a face with ``height(points)``.

    Parameters
    ----------
    leaving : axis and coordinate, m, of the edge over which the passes leave the plate, where the burr is.
    """
    points = _seen(scanner, size, rng)
    z = height(points) + _noise(scanner, points, size, rng)
    z += _edges(scanner, points, size, leaving, rng)
    z += _drifted(scanner, placed, points, size, rng)
    spikes = rng.uniform(size=len(z)) < scanner.spikes
    far = scanner.sigma * scanner.spike * np.exp(rng.normal(0.0, 0.7, int(spikes.sum())))
    z[spikes] += far * rng.choice([-1.0, 1.0], int(spikes.sum()))
    if scanner.place == "outline":  # the software has laid its best plane on that of the drawing
        terms = np.column_stack([np.ones(len(points)), points])
        z = z - terms @ np.linalg.lstsq(terms, z, rcond=None)[0]
    else:
        own, turn = scanner.again
        off = placed.off + np.array([own, turn, turn]) * rng.standard_normal(3)
        about_x, about_y = off[1:].tolist()
        z += off[0] + (points - np.array(size) / 2.0) @ np.array([-about_y, about_x])
    cloud = np.column_stack([points, z])
    if scanner.sides > 0.0:
        cloud = np.vstack([cloud, _sides(scanner, size, rng)])
    return _as_written(scanner, cloud, rng)


def _seen(scanner: Scanner, size: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return the points (n, 2), m, of the plate that the scanner sees."""
    grid = [np.arange(0.5, extent / scanner.spacing) * scanner.spacing for extent in size]
    points = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 2)
    points = points + rng.uniform(-0.35, 0.35, points.shape) * scanner.spacing
    points = np.clip(points, 1e-5, np.array(size) - 1e-5)
    dull = _field(points, size, scanner.hole, rng)
    kept = dull >= np.quantile(dull, scanner.holes)
    axis, far = int(rng.integers(2)), bool(rng.integers(2))
    share = points[:, axis] / size[axis]
    kept &= (share < 1.0 - scanner.missing) if far else (share > scanner.missing)
    return np.asarray(points[kept])


def _noise(scanner: Scanner, points: Array, size: tuple[float, float], rng: np.random.Generator) -> Array:
    share = scanner.correlated
    noise = math.sqrt(share) * _field(points, size, scanner.length, rng)
    return np.asarray(scanner.sigma * (noise + math.sqrt(1.0 - share) * rng.standard_normal(len(points))))


def _edges(
    scanner: Scanner,
    points: Array,
    size: tuple[float, float],
    leaving: tuple[int, float],
    rng: np.random.Generator,
) -> Array:
    """Return what edges do to the reading (n,), m: they round it off, and a burr stands on one of them."""
    near = np.minimum(points, np.array(size) - points).min(axis=1)
    axis, edge = leaving
    along, from_edge = points[:, 1 - axis], np.abs(points[:, axis] - edge)
    waves = np.cos(2.0 * math.pi * (along / (9.0 * MM) + rng.uniform()))
    waves += np.cos(2.0 * math.pi * (along / (23.0 * MM) + rng.uniform()))
    stands = waves > np.quantile(waves, 1.0 - scanner.kept)
    burr = scanner.burr * np.exp(-from_edge / scanner.wide) * stands
    return np.asarray(burr - scanner.rolled * np.exp(-near / scanner.soft))


def _drifted(
    scanner: Scanner, placed: Placing, points: Array, size: tuple[float, float], rng: np.random.Generator
) -> Array:
    """Return the change of the reading (n,), m, while the scanner proceeds: a slope and a slow wander."""
    towards = np.array([math.cos(scanner.direction), math.sin(scanner.direction)])
    reach = float(np.abs(towards) @ np.array(size))
    course = ((points - np.array(size) / 2.0) @ towards) / reach + 0.5
    grid = np.linspace(0.0, 1.0, 60)
    wander = np.cumsum(rng.standard_normal(60))
    wander -= np.polynomial.Polynomial.fit(grid, wander, 1)(grid)
    slope = placed.drifts * scanner.steady + (1.0 - scanner.steady) * rng.uniform(-1.0, 1.0)
    bent = 0.3 * np.interp(course, grid, wander / max(float(np.ptp(wander)), 1e-30))
    return np.asarray(scanner.drift * (slope * (course - 0.5) + bent))


def _sides(scanner: Scanner, size: tuple[float, float], rng: np.random.Generator) -> Array:
    """Return points (n, 3), m, of the two sides of the block that are turned to the scanner."""
    sides = []
    for axis in range(2):
        count = round(size[1 - axis] * scanner.sides / scanner.spacing**2)
        some = np.empty((count, 3))
        some[:, 1 - axis] = rng.uniform(0.0, size[1 - axis], count)
        some[:, axis] = 1.5 * scanner.sigma * rng.standard_normal(count)
        some[:, 2] = rng.uniform(-scanner.sides, -scanner.soft, count)
        sides.append(some)
    return np.vstack(sides)


def _as_written(scanner: Scanner, cloud: Array, rng: np.random.Generator) -> Array:
    """Bring a cloud (n, 3), m, in the work frame into the scanner's, mm, and round it."""
    if scanner.place == "outline":  # laid on the drawing by its outline, by eye
        return _rounded(cloud / MM + np.append(0.15 * rng.standard_normal(2), 0.0))
    inverse = np.linalg.inv(scanner.to_work)
    return _rounded(cloud / MM @ inverse[:3, :3].T + inverse[:3, 3])


def _rounded(cloud: Array) -> Array:
    return np.asarray(np.round(cloud / _STEP_MM) * _STEP_MM)


def _field(points: Array, size: tuple[float, float], length: float, rng: np.random.Generator) -> Array:
    """Return noise of unit variance (n,) at points, correlated over ``length``, m."""
    from scipy.interpolate import RegularGridInterpolator
    from scipy.ndimage import gaussian_filter

    pitch = max(0.4 * length, 0.2 * MM)
    shape = [max(4, math.ceil(extent / pitch) + 1) for extent in size]
    field = gaussian_filter(rng.standard_normal(shape), length / pitch / math.sqrt(2.0), mode="wrap")
    axes = [np.arange(n) * pitch for n in shape]
    return np.asarray(RegularGridInterpolator(axes, field / field.std())(points))


def drawn(rng: np.random.Generator, size: tuple[float, float], *, known: float, sides: float) -> Scanner:
    """Draw a scanner.

    Spikes on 0.1–1 % of the points, edges that round off over 0.1–1 mm, drift of 1–20 µm over a scan, noise
    that is correlated over 0.3–5 mm, a place that is wrong by 5–200 µm and 0.05–1 mrad and repeats to 1–10 µm
    and 0.01–0.08 mrad. Without a declared place the software needs the whole outline.

    Parameters
    ----------
    known : probability that its place is declared. sides : that the sides of the block are in the cloud.
    """
    seen = bool(rng.uniform() < sides)
    place: Place = "declared" if rng.uniform() < known else ("sides" if seen else "outline")
    missing = uniform(rng, 0.02, 0.15) if rng.uniform() < 0.35 else 0.0
    spacing = max(uniform(rng, 0.5, 1.3) * MM, math.sqrt(size[0] * size[1] / _MOST))
    yaw = uniform(rng, -12.0, 12.0) if place == "sides" else uniform(rng, -180.0, 180.0)
    to_work = np.eye(4)
    roll, pitch = (rng.uniform(-2.5, 2.5, 2) * DEG).tolist()
    to_work[:3, :3] = rotation_rpy(roll, pitch, yaw * DEG)
    to_work[:3, 3] = rng.uniform(-350.0, 350.0, 3).round(2)
    return Scanner(
        spacing=round(spacing / MM, 2) * MM,
        sigma=drawn_size(rng, 5.0, 25.0) * UM,
        length=drawn_size(rng, 0.3, 5.0) * MM,
        correlated=uniform(rng, 0.15, 0.8),
        spikes=drawn_size(rng, 0.001, 0.01),
        spike=drawn_size(rng, 6.0, 25.0),
        soft=drawn_size(rng, 0.1, 1.0) * MM,
        rolled=drawn_size(rng, 10.0, 80.0) * UM,
        burr=drawn_size(rng, 20.0, 250.0) * UM,
        wide=drawn_size(rng, 0.1, 0.5) * MM,
        kept=uniform(rng, 0.1, 0.7),
        holes=drawn_size(rng, 0.003, 0.05),
        hole=drawn_size(rng, 1.5, 7.0) * MM,
        missing=missing if place != "outline" else 0.0,
        drift=drawn_size(rng, 1.0, 20.0) * UM,
        steady=uniform(rng, 0.2, 0.9),
        direction=float(rng.choice([0.0, 90.0])) * DEG + uniform(rng, -5.0, 5.0) * DEG,
        place=place,
        to_work=to_work,
        shift=drawn_size(rng, 5.0, 200.0) * UM,
        turn=drawn_size(rng, 5e-5, 1e-3),
        again=(drawn_size(rng, 1.0, 10.0) * UM, drawn_size(rng, 1e-5, 8e-5)),
        sides=uniform(rng, 0.05, 0.09) * size[0] * size[1] / sum(size) if seen else 0.0,
    )


def declared(scanner: Scanner) -> Row:
    """Return what the manifest says of the scanner; nobody has measured its noise better than to a third."""
    row: Row = {"spacing_mm": round(scanner.spacing / MM, 6), "sigma_mm": round(scanner.sigma / MM, 4)}
    if scanner.place == "declared":
        row["to_work"] = [[round(float(v), 9) for v in line] for line in scanner.to_work]
    return row


def as_written(scanner: Scanner, placed: Placing) -> Row:
    """Return what was drawn, for the truth."""
    in_um = {
        "sigma": scanner.sigma,
        "drift": scanner.drift,
        "edge_rolled": scanner.rolled,
        "burr": scanner.burr,
    }
    in_mm = {"noise_length": scanner.length, "edge_soft": scanner.soft, "hole": scanner.hole}
    row: Row = {f"{name}_um": round(value / UM, 2) for name, value in in_um.items()}
    row |= {f"{name}_mm": round(value / MM, 3) for name, value in in_mm.items()}
    row |= {
        "noise_correlated": scanner.correlated,
        "spike_share": scanner.spikes,
        "spike_sigmas": scanner.spike,
    }
    row |= {"hole_share": scanner.holes, "missing_share": scanner.missing, "place": scanner.place}
    row |= {"sides_mm": round(scanner.sides / MM, 2)}
    if scanner.place != "outline":
        row |= {
            "place_error_um": round(scanner.shift / UM, 1),
            "place_error_mrad": round(scanner.turn * 1e3, 3),
            "place_repeats_um": round(scanner.again[0] / UM, 1),
            "place_repeats_mrad": round(scanner.again[1] * 1e3, 4),
            "place_off_um": round(float(placed.off[0]) / UM, 1),
            "place_off_mrad": [round(float(angle) * 1e3, 4) for angle in placed.off[1:]],
        }
    return row
