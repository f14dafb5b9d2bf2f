"""Work on a fixture: bent over its supports by clamps at its edges while it is cut, and free afterwards."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.hidden import drawn_size
from virtual_cell.units import UM, Array
from virtual_cell.world.draws import either_sign, uniform
from virtual_cell.world.faces.finish import Cutting, FaceRun, Influence, over_plate

_POISSON = 0.33  # of aluminium
_NODES = 401


@dataclass(frozen=True)
class Fixture:
    """A plate over two rows of supports each way, held down outside of them.

    A clamp bends the plate over its support: its moment grows from the edge to the support, and goes over to
    that of the other clamp between the supports. The supports need not lie in a plane: that twists it.

    Attributes
    ----------
    supports : where they are along x and y, as shares of the half lengths. moments : along x and y, of the
        clamps, so that a moment that is constant over the plate gives the height moment/2 u²; m.
    uneven : along x and y: a clamp pulls so much more than the mean of both, the other one less; relative.
    twist : m, height of one corner. repeat : relative standard deviation of the clamps' pull in each face.
    """

    supports: tuple[float, float]
    moments: tuple[float, float]
    uneven: tuple[float, float]
    twist: float
    repeat: float = 0.0

    def shape(self, points: Array, size: tuple[float, float]) -> Array:
        """Return how high the face is (n,), m, once the work is free."""
        u, v = over_plate(points, size)
        (mx, my), slender = self.moments, (size[1] / size[0]) ** 2
        along = mx * (_bent(u, self.supports[0], self.uneven[0]) - 0.5 * _POISSON * slender * v**2)
        across = my * (_bent(v, self.supports[1], self.uneven[1]) - 0.5 * _POISSON / slender * u**2)
        return np.asarray(along + across + self.twist * u * v)

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return the form of the free plate; its clamps pull a little otherwise each time."""
        pull = 1.0 + self.repeat * rng.standard_normal()
        size = run.passes.size

        def form(cutting: Cutting) -> Array:
            return pull * self.shape(cutting.points, size)

        return Influence(height=form)


def _bent(place: Array, support: float, uneven: float) -> Array:
    """Return the deflection (n,) over −1 to 1 of a beam that clamps at its ends bend with a moment of 1."""
    grid = np.linspace(-1.0, 1.0, _NODES)
    at = [-1.0, -support, support, 1.0]
    moment = np.interp(grid, at, [0.0, 1.0 - uneven, 1.0 + uneven, 0.0])
    slope = np.concatenate([[0.0], np.cumsum(0.5 * (moment[1:] + moment[:-1]) * np.diff(grid))])
    height = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(grid))])
    height -= np.polynomial.Polynomial.fit(grid, height, 1)(grid)
    return np.asarray(np.interp(place, grid, height))


def second_degree(shape: Array, points: Array, size: tuple[float, float]) -> tuple[Array, float]:
    """Return xx, xy, yy (3,), m, of a shape (n,), m, and what is no form of second degree, over what is."""
    u, v = over_plate(points, size)
    terms = np.column_stack([u * u, u * v, v * v, np.ones(len(u)), u, v])
    found = np.linalg.lstsq(terms, shape, rcond=None)[0]
    of_plane = terms[:, 3:]
    curved = terms[:, :3] @ found[:3]
    curved = curved - of_plane @ np.linalg.lstsq(of_plane, curved, rcond=None)[0]
    rest = shape - terms @ found
    return found[:3], float(np.sqrt(np.mean(rest**2) / np.mean(curved**2)))


def grid(size: tuple[float, float]) -> Array:
    """Return points (n, 2), m, all over a plate."""
    x, y = (np.linspace(0.0, extent, 31) for extent in size)
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)


def drawn(rng: np.random.Generator) -> Fixture:
    """Draw a fixture that bends the work by 1–5 µm; hand-tightened clamps repeat to 3–15 %."""
    share = rng.standard_normal(3)
    share *= drawn_size(rng, 1.0, 5.0) * UM / np.linalg.norm(share)
    supports = uniform(rng, 0.5, 0.85), uniform(rng, 0.5, 0.85)
    uneven = either_sign(rng) * uniform(rng, 0.0, 0.3), either_sign(rng) * uniform(rng, 0.0, 0.3)
    twist, repeat = float(share[2]), drawn_size(rng, 0.03, 0.15)
    return Fixture(supports, (2.0 * float(share[0]), 2.0 * float(share[1])), uneven, twist, repeat)


def bending(
    fixture: Fixture, entries: tuple[float, float, float], size: tuple[float, float]
) -> tuple[Fixture, float]:
    """Return a fixture whose bow has the ``entries`` xx, xy, yy, m, in least squares, and what it has beside.

    The latter is relative: the form that is no second degree and the scatter from face to face.
    """
    points = grid(size)
    units = [
        replace(fixture, moments=(1.0, 0.0), twist=0.0),
        replace(fixture, moments=(0.0, 0.0), twist=1.0),
        replace(fixture, moments=(0.0, 1.0), twist=0.0),
    ]
    made = np.column_stack([second_degree(unit.shape(points, size), points, size)[0] for unit in units])
    mx, twist, my = np.linalg.solve(made, np.array(entries)).tolist()
    bent = replace(fixture, moments=(mx, my), twist=twist)
    beside = second_degree(bent.shape(points, size), points, size)[1]
    return bent, math.hypot(beside, fixture.repeat)
