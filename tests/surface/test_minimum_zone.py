"""The minimum zone: sets with exact answers, and brute force over all planes that can bound a hull."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.surface.minimum_zone import minimum_zone
from metro.surface.plane import fit_plane

R1 = [(0, 0, 0), (100, 0, 0), (0, 100, 0), (30, 30, 0.01), (20, 40, 0.005), (60, 10, 0.0025)]
R2 = [
    *((0, 0, 0.01), (100, 100, 0.01), (100, 0, 0), (0, 100, 0)),
    *((50, 50, 0.005), (20, 70, 0.005), (80, 60, 0.0025)),
]
R3 = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
R4 = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
R5 = [(x, y, z) for x in (0, 3) for y in (0, 4) for z in (0, 5)]
TURN = np.array([[1, -8, 4], [4, 4, 7], [-8, 1, 4]]) / 9
R6 = np.array(R2) @ TURN.T + np.array([1200, -350, 780])
R7 = [(11.5, 7, 1.1), (18.5, 6.9, 1.03), (4.5, 13, 1.02), (25.5, 30, 1.03), (11.5, 37.5, 1.02)]
EXACT = {
    "R1": (R1, 0.01),
    "R2": (R2, 0.01),
    "R3": (R3, 2.0),
    "R4": (R4, 2 / np.sqrt(3)),
    "R5": (R5, 3.0),
    "R6": (R6, 0.01),
    "R7": (R7, 0.067262057528119),
}


def brute_force(points: np.ndarray) -> float:
    """Least width over every normal that a facet, or an edge and an edge, of the points can define."""
    edges = [points[j] - points[i] for i, j in combinations(range(len(points)), 2)]
    normals = np.array([np.cross(a, b) for a, b in combinations(edges, 2)])
    length = np.linalg.norm(normals, axis=1)
    normals = normals[length > 1e-9 * length.max()] / length[length > 1e-9 * length.max(), None]
    return float(np.ptp(points @ normals.T, axis=0).min())


@pytest.mark.parametrize("name", EXACT)
def test_reference_sets_are_met_to_their_digits(name: str) -> None:
    points, width = np.array(EXACT[name][0], dtype=float), EXACT[name][1]
    zone = minimum_zone(points)
    assert zone.width == pytest.approx(width, rel=2e-11 if name == "R6" else 1e-13)  # R6: coordinates of 1200
    assert zone.bound == pytest.approx(zone.width, rel=1e-11)


@pytest.mark.parametrize(("points", "width"), [(R1, 0.010547445), (R2, 0.010639565), (R7, 0.072097300)])
def test_the_least_squares_reading_is_wider_by_the_published_amount(points: list, width: float) -> None:
    cloud = np.array(points, dtype=float)
    assert np.ptp(fit_plane(cloud).deviations(cloud)) == pytest.approx(width, abs=1e-9)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.integers(5, 9))
def test_no_pair_of_planes_is_nearer_on_flat_sets(seed: int, count: int) -> None:
    points = np.random.default_rng(seed).uniform(-1, 1, (count, 3)) * [100.0, 60.0, 0.05]
    assert minimum_zone(points).width == pytest.approx(brute_force(points), rel=1e-9)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6))
def test_the_zone_is_never_wider_than_the_least_squares_range_and_holds_every_point(seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(3000, 3)) * [80.0, 50.0, 0.02]
    zone = minimum_zone(points)
    heights = points @ zone.normal
    assert np.ptp(heights) <= zone.width * (1 + 1e-11)
    assert zone.width <= np.ptp(fit_plane(points).deviations(points))
    assert zone.width - zone.bound <= 1e-11 * zone.width


def test_the_contacts_certify_the_zone() -> None:
    """Upper and lower contacts overlap, seen along the normal: no tilt can narrow the zone."""
    from scipy.optimize import linprog

    points = np.random.default_rng(8).uniform(-1, 1, (500, 3)) * [100.0, 60.0, 0.05]
    zone = minimum_zone(points)
    assert len(zone.upper) + len(zone.lower) == 4
    across = np.linalg.svd(zone.normal[None])[2][1:]
    upper, lower = points[zone.upper] @ across.T, points[zone.lower] @ across.T
    weights = np.block(
        [
            [upper.T, -lower.T],
            [np.ones(len(upper)), np.zeros(len(lower))],
            [np.zeros(len(upper)), np.ones(len(lower))],
        ]
    )
    assert linprog(np.zeros(4), A_eq=weights, b_eq=[0, 0, 1, 1], bounds=(-1e-9, None)).status == 0


def test_coplanar_points_have_no_width() -> None:
    x, y = np.meshgrid(np.arange(4.0), np.arange(5.0))
    assert minimum_zone(np.column_stack([x.ravel(), y.ravel(), (0.5 * x - y).ravel()])).width < 1e-14
