"""Dust is told from a rough wall, from steps and from waves."""

import numpy as np
import pytest

from metro.surface.dust import dust
from metro.surface.profile import even, part
from metro.units import MM, UM

X = np.arange(0.0, 0.1, 5e-5)
RNG = np.random.default_rng(3)
MARKS = 2e-6 * (np.abs(((X / 1e-4) % 1.0) - 0.5) * 2.0) ** 2  # cusps of a feed of 0.1 mm
WAVES = 20e-6 * np.sin(2 * np.pi * X / 0.01) + 3e-6 * np.sin(2 * np.pi * X / 2.5e-3)
WALL = WAVES + MARKS + 0.5e-6 * RNG.normal(size=len(X))


def grain(place, height, width=1e-4):
    return height * np.exp(-(((X - place) / (width / 2)) ** 2))


@pytest.mark.parametrize("height", [30e-6, 70e-6, -40e-6])
def test_a_grain_is_found_and_nothing_else(height):
    found = dust(X, WALL + grain(0.031, height))
    at = X[found]
    assert 2 <= found.sum() <= 12
    assert np.all(np.abs(at - 0.031) < 3e-4)


@pytest.mark.parametrize(
    "wall",
    [
        WALL,
        WALL + 40e-6 * (X > 0.05),
        WALL + 30e-6 * np.exp(-(((X - 0.05) / 1e-3) ** 2)),
        5e-6 * RNG.normal(size=len(X)),
        np.zeros(len(X)),
    ],
    ids=["marks and waves", "a step", "a bulge", "roughness", "flat"],
)
def test_what_is_of_the_wall_is_no_dust(wall):
    assert not dust(X, wall).any()


def test_dust_changes_the_waviness_by_little_once_it_is_left_out():
    dusty = WALL + sum(grain(place, 50e-6) for place in (0.02, 0.045, 0.071))
    clean, without = (part(even(X, z)[1], 5e-5, 8e-3).waviness for z in (WALL, dusty))
    spoilt = np.abs(part(dusty, 5e-5, 8e-3).waviness - clean).max()
    assert spoilt > 3e-6
    assert np.abs(without - clean).max() < 0.2 * spoilt


def test_dust_is_no_gap_in_the_trace():
    """A grain may be wider than the ten points that a trace may lack."""
    wide = WALL + 60e-6 * (np.abs(X - 0.031) < 1.9e-4)
    assert dust(X, wide).sum() > 10
    assert len(even(X, wide)[0]) == len(X)


def test_a_trace_of_few_points_is_left_as_it_is():
    assert not dust(X[::20], WALL[::20] + grain(0.031, 70e-6)[::20]).any()
    assert not dust(X[:1], WALL[:1]).any()


@pytest.mark.parametrize("starts_mm", [2.0, 4.0, 6.0])
def test_sharp_marks_of_chatter_that_start_half_way_are_no_dust(starts_mm):
    x = np.arange(0.0, 8 * MM, 10 * UM)
    grown = 1.0 - np.exp(-np.maximum(x - starts_mm * MM, 0.0) / (1 * MM))
    cusps = (np.abs(np.cos(np.pi * x / (0.9 * MM))) ** 3 - 0.4) * 5 * UM * grown
    ripple = 0.2 * UM * np.sin(2 * np.pi * x / (0.22 * MM))
    z = cusps + ripple + np.random.default_rng(5).normal(0.0, 0.02 * UM, len(x))
    assert not dust(x, z).any()
