"""The floor that an orbit leaves on a helix, against a disc that is moved, and forces slice by slice."""

import math

import numpy as np
import pytest

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.floor import Floor, floor_at
from metro.cutting.force import ANGLES, force_basis, mean_basis
from metro.cutting.law import EdgeLaw

RADIUS, PITCH = 5e-3, 1.8e-3
SLOT = Engagement(0.0, math.pi)


def left_by_a_disc(orbit, turning, immersion):
    """Height of the floor at the rim: the share of an orbit since the disc last covered the place."""
    back = np.linspace(0.0, 2.0 * math.pi, 200_001)[1:]  # of the axis about the hole's, going back in time
    centre = np.exp(-1j * turning * back) * orbit  # the axis is at +x now, and is fed along +y · turning
    feed, left = 1j * turning, -turning  # in the plane: feed, and the +y axis of the feed frame left of it
    place = orbit + RADIUS * (math.sin(immersion) * feed + math.cos(immersion) * left)
    covered = np.abs(centre - place) < RADIUS
    return PITCH * (back[np.argmax(covered)] / (2.0 * math.pi) if covered.any() else 1.0)


@pytest.mark.parametrize("turning", [1.0, -1.0])
@pytest.mark.parametrize("orbit", [2e-3, 3.5e-3, 7e-3])
@pytest.mark.parametrize("immersion", [0.2, 0.9, 1.7, 2.6, 3.0])
def test_the_floor_is_as_old_as_the_disc_left_it(orbit, turning, immersion):
    floor = Floor(PITCH, orbit, RADIUS, turning)
    seen = floor_at(floor, math.sin(immersion), math.cos(immersion))
    assert seen == pytest.approx(left_by_a_disc(orbit, turning, immersion), abs=2e-5 * PITCH)


@pytest.mark.parametrize(("helix", "turning"), [(35.0, 1), (35.0, -1), (-25.0, 1), (0.0, 1)])
def test_forces_on_a_helix_are_those_of_slices_below_the_floor(helix, turning):
    """Circular paths, linear law: each slice of each tooth by itself."""
    orbit, feed = 3.2e-3, 8e-5
    cutter = Cutter(RADIUS, math.radians(helix), evenly_pitched(3))
    cut = Cut(feed, PITCH, SLOT, turning / orbit, PITCH)
    found = force_basis(cutter, EdgeLaw(), cut)
    slices, floor = 4000, Floor(PITCH, orbit, RADIUS, float(turning))
    height = (np.arange(slices) + 0.5) * PITCH / slices
    for row in range(0, ANGLES, 37):
        force = np.zeros((3, 6))
        for tooth in cutter.tooth_angles:
            phi = 2.0 * math.pi * row / ANGLES + tooth - cutter.lag_per_depth * height
            below = [h < floor_at(floor, math.sin(p), math.cos(p)) for h, p in zip(height, phi, strict=True)]
            s, c = np.sin(phi), np.cos(phi)
            width = np.where((s > 0.0) & np.array(below), PITCH / slices, 0.0)
            for column, size in ((0, width * feed * s), (3, width)):
                force[:, column] += [-(size * c).sum(), (size * s).sum(), 0.0]
                force[:, column + 1] += [-(size * s).sum(), -(size * c).sum(), 0.0]
                force[2, column + 2] += size.sum()
        largest = np.abs(found).max(axis=(0, 1))
        step = (
            1.0 if helix else 0.02 * len(cutter.tooth_angles) * PITCH
        )  # without a helix edges enter at once
        assert np.all(np.abs(found[row] - force) < (2e-3 * largest if helix else step)), row


def test_before_a_tool_on_a_very_wide_orbit_all_of_the_pitch_is_left():
    floor = Floor(PITCH, 1e3, RADIUS, 1.0)
    assert floor_at(floor, 1.0, 0.0) == pytest.approx(PITCH, rel=1e-5)


def test_the_mean_on_a_helix_is_less_than_in_a_slot_of_its_pitch():
    cutter = Cutter(RADIUS, math.radians(30.0), evenly_pitched(4))
    level = mean_basis(cutter, EdgeLaw(), Cut(8e-5, PITCH, SLOT, 1.0 / 3e-3))
    sunk = mean_basis(cutter, EdgeLaw(), Cut(8e-5, PITCH, SLOT, 1.0 / 3e-3, PITCH))
    phi = (np.arange(20_000) + 0.5) * math.pi / 20_000
    height = np.array([floor_at(Floor(PITCH, 3e-3, RADIUS, 1.0), math.sin(p), math.cos(p)) for p in phi])
    share = float((height * np.sin(phi)).mean() / (PITCH * np.sin(phi)).mean())
    assert sunk[2, 2] / level[2, 2] == pytest.approx(share, rel=1e-3)
    assert 0.4 < share < 0.7
