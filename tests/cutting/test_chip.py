"""Chip thickness against intersected trochoids, and how far the true paths are from circles."""

import math

import numpy as np
import pytest

from metro.cutting.chip import Cut, chip_thickness, path_difference
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement

SLOT = Engagement(0.0, math.pi)


def cutter(teeth=4, helix=40.0, radius=6e-3, **runout):
    return Cutter(radius, math.radians(helix), evenly_pitched(teeth), **runout)


def true_chip(tool, feed, phi_now, tooth, height=0.0):
    """Follow the tooth that cut before, back along its trochoid, until it crosses the ray."""
    n = tool.teeth
    per_radian = feed * n / (2 * math.pi)
    lag = height * math.tan(tool.helix) / tool.radius

    def radius(j):
        return tool.radius + tool.runout_radius * math.cos(tool.runout_angle - tool.tooth_angles[j % n] + lag)

    best = math.inf
    for m in range(1, n + 1):
        pitch = 2 * math.pi * m / n

        def off_ray(turned, pitch=pitch, m=m):
            phi = phi_now + pitch - turned
            x = -per_radian * turned + radius(tooth + m) * math.sin(phi)
            y = radius(tooth + m) * math.cos(phi)
            return x * math.cos(phi_now) - y * math.sin(phi_now), x * math.sin(phi_now) + y * math.cos(
                phi_now
            )

        low, high = pitch - 0.3, pitch + 0.3
        for _ in range(80):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if off_ray(middle)[0] > 0 else (low, middle)
        best = min(best, radius(tooth) - off_ray(low)[1])
    return best


@pytest.mark.parametrize("degrees", [5.0, 40.0, 90.0, 140.0, 175.0])
@pytest.mark.parametrize("runout", [0.0, 8e-6])
def test_true_chip_thickness_is_that_of_intersected_trochoids(degrees, runout):
    tool = cutter(runout_radius=runout, runout_angle=0.4)
    phi = math.radians(degrees)
    cut = Cut(0.1e-3, 1e-3, SLOT)
    found = chip_thickness(tool, cut, np.full((1, 1, 4), phi), np.zeros(1), true_path=True)
    expected = [true_chip(tool, 0.1e-3, phi, j) for j in range(4)]
    assert found[0, 0] == pytest.approx(expected, abs=2e-9)


@pytest.mark.parametrize("teeth", [2, 4])
def test_true_paths_differ_from_circles_by_the_square_of_the_feed_over_the_radius(teeth):
    feed, radius = 0.1e-3, 6e-3
    phi = np.linspace(0.0, math.pi, 2001)
    # Second order in feed/radius: the turn of the earlier tooth, and the curvature of its path.
    second = feed**2 / radius * (0.5 * np.cos(phi) ** 2 - teeth / (2 * math.pi) * np.sin(phi) * np.cos(phi))
    difference = path_difference(cutter(teeth=teeth, radius=radius), Cut(feed, 1e-3, SLOT))
    assert difference.largest == pytest.approx(np.abs(second).max(), rel=0.05)
    assert difference.rms == pytest.approx(math.sqrt(np.mean(second**2)), rel=0.05)
