"""The least-squares plane: NIST reference sets, and what must not change it."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.surface.plane import Plane, fit_plane, moments, plane_of_moments

ROOT = Path(__file__).resolve().parents[2]
PLANES = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real")) / "reference/planes"
SETS = (1, 2, 3, 5, 8, 10, 12, 14, 16, 18, 20, 21, 22, 25, 27)
EXTENT = np.array([200.0, 100.0, 0.05])


def face(seed: int, count: int = 400) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-0.5, 0.5, (count, 3)) * EXTENT


def rotation(seed: int) -> np.ndarray:
    turned = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return turned * np.sign(np.linalg.det(turned))


def angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(min(np.linalg.norm(a - b), np.linalg.norm(a + b)))


@pytest.mark.skipif(not PLANES.is_dir(), reason="METRO_REAL_DATA has no reference/planes")
@pytest.mark.parametrize("number", SETS)
def test_nist_reference_planes_are_met(number: int) -> None:
    points = np.loadtxt(PLANES / f"pla{number}.ds", skiprows=1)
    certified = np.loadtxt(PLANES / f"pla{number}.fit")
    plane = fit_plane(points)
    normal = certified[3:] / np.linalg.norm(certified[3:])
    assert angle(plane.normal, normal) < 1e-13
    assert abs((plane.point - certified[:3]) @ normal) < 2e-12


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 10**6))
def test_motion_and_order_of_the_points_do_not_change_the_deviations(seed: int, other: int) -> None:
    points, turn = face(seed), rotation(other)
    shuffle = np.random.default_rng(other).permutation(len(points))
    moved = (points @ turn.T + np.array([3.0, -700.0, 40.0]))[shuffle]
    before = fit_plane(points).deviations(points)[shuffle]
    after = fit_plane(moved).deviations(moved)
    assert min(np.abs(before - after).max(), np.abs(before + after).max()) < 1e-11


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([1e-3, 25.4, 1e3]))
def test_deviations_scale_with_the_unit(seed: int, unit: float) -> None:
    points = face(seed)
    expected = unit * fit_plane(points).deviations(points)
    np.testing.assert_allclose(
        fit_plane(unit * points).deviations(unit * points), expected, atol=unit * 1e-12
    )


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.lists(st.integers(1, 399), max_size=6, unique=True))
def test_chunks_give_the_plane_of_the_whole(seed: int, cuts: list[int]) -> None:
    points = face(seed)
    whole, streamed = fit_plane(points), fit_plane(iter(np.split(points, sorted(cuts))))
    np.testing.assert_allclose(streamed.normal, whole.normal, atol=1e-14)
    np.testing.assert_allclose(streamed.point, whole.point, atol=1e-12)


def test_ten_kilometres_away_the_deviations_are_those_of_a_singular_value_decomposition() -> None:
    # a grid of multiples of 2^-12 mm, so that the offset itself rounds nothing away
    near = np.round(face(4) * 4096) / 4096
    far = near + 1e7
    centred = near - near.mean(axis=0)
    normal = np.linalg.svd(centred, full_matrices=False)[2][2]
    distance = fit_plane(far).deviations(far)
    assert (
        np.abs(np.abs(distance) - np.abs(centred @ normal)).max() < 1e-8
    )  # the centroid's own rounding: 2e-9
    assert angle(fit_plane(far).normal, normal) < 1e-12


def test_single_precision_points_lose_nothing_beyond_their_own_rounding() -> None:
    points = (face(5, 200_000) + np.array([1000.0, 0.0, 0.0])).astype(np.float32)
    exact = fit_plane(points.astype(np.float64))
    assert angle(fit_plane(points).normal, exact.normal) < 1e-14


def test_deviations_are_orthogonal_not_vertical() -> None:
    x, y = np.meshgrid(np.arange(10.0), np.arange(10.0))
    ripple = 0.1 * np.where((x + y) % 2, 1.0, -1.0)
    flat = np.column_stack([x.ravel(), y.ravel(), ripple.ravel()])
    tilt = np.deg2rad(30.0)
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    tilted = flat @ turn.T
    assert np.ptp(fit_plane(tilted).deviations(tilted)) == pytest.approx(
        np.ptp(fit_plane(flat).deviations(flat))
    )


def test_axes_and_normal_are_a_frame_with_the_longest_extent_first() -> None:
    points = face(6) @ rotation(3).T
    plane = fit_plane(points)
    frame = np.vstack([plane.axes, plane.normal])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-14)
    spread = np.ptp(plane.coordinates(points), axis=0)
    assert spread[0] > spread[1]


@pytest.mark.parametrize(
    "points",
    [np.empty((0, 3)), np.zeros((2, 3)), np.outer(np.arange(9.0), [1, 2, 3]), np.full((5, 3), np.nan)],
)
def test_points_without_a_plane_are_refused(points: np.ndarray) -> None:
    with pytest.raises(ValueError, match="plane"):
        fit_plane(points)


def test_the_plane_of_three_points_passes_through_them() -> None:
    corner = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
    plane: Plane = plane_of_moments(moments(corner))
    assert np.abs(plane.deviations(corner)).max() < 1e-15
