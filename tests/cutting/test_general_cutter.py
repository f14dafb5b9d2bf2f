"""Forces of a ball end, a bull nose and a taper against slices, closed forms and the cylindrical tool."""

import math
from dataclasses import replace

import numpy as np
import pytest

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import engagement
from metro.cutting.entry import entry_basis
from metro.cutting.envelope import edge_length, mean_inclination, meridian, place_at
from metro.cutting.force import ANGLES, force_basis, mean_basis
from metro.cutting.law import EdgeLaw

R = 8e-3
FLAT = Cutter(R, math.radians(30), evenly_pitched(3))
BALL = replace(FLAT, corner=R)
NOSE = replace(FLAT, corner=2e-3)
CONE = replace(FLAT, corner=1e-3, taper=math.radians(20))
SLOT = Cut(0.1e-3, 3e-3, engagement("slot", "slot", 2 * R, R))
UP = replace(SLOT, engagement=engagement("side", "up", 5e-3, R))
DOWN = replace(SLOT, engagement=engagement("side", "down", 11e-3, R))


def sliced(cutter, cut, angles, slices=40_000, exponent=0.0):
    """Sum slices of equal height, or of equal edge angle on the corner: (angles, 3, 6), circular paths."""
    rc, steep = cutter.corner, math.pi / 2 - cutter.taper
    top = rc * (1 - math.cos(steep))
    shares = (np.arange(slices) + 0.5) / slices
    end = math.acos(max(1 - cut.axial_depth / rc, math.cos(steep))) if rc else 0.0
    kappa = end * shares
    parts = [(rc * (1 - np.cos(kappa)), kappa, np.full(slices, rc * end / slices))]
    if cut.axial_depth > top:
        z = top + (cut.axial_depth - top) * shares
        width = (cut.axial_depth - top) / slices / math.sin(steep)
        parts.append((z, np.full(slices, steep), np.full(slices, width)))
    z, kappa, db = (np.concatenate(each) for each in zip(*parts, strict=True))
    on_corner = np.where(kappa < steep, rc * np.sin(kappa), 0.0)
    radius = cutter.radius - rc + on_corner
    flank = cutter.radius - rc + rc * math.sin(steep) + (z - top) / math.tan(steep)
    radius = np.where(kappa < steep, radius, flank)
    lag = math.tan(cutter.helix) / cutter.radius * z
    ds = np.sqrt(db**2 + (radius * np.gradient(lag, z) * db * np.sin(kappa)) ** 2) * math.cos(cutter.helix)
    result = np.zeros((len(angles), 3, 6))
    places = np.array(cutter.tooth_angles)
    pitch = np.diff(np.append(places, 2 * math.pi + places[0]))
    off = cutter.runout_radius * np.cos(cutter.runout_angle - places[:, None] + lag)
    teeth = len(places)
    for i, angle in enumerate(angles):
        for j in range(teeth):
            phi = angle + places[j] - lag
            s, c = np.sin(phi), np.cos(phi)
            before = [
                cut.feed_per_tooth * teeth / (2 * math.pi) * sum(np.roll(pitch, -j)[:m]) * s
                + off[j]
                - off[(j + m) % teeth]
                for m in range(1, teeth + 1)
            ]
            chip = np.min(before, axis=0)
            y = radius * c
            low, high = R * math.cos(cut.engagement.exit), R * math.cos(cut.engagement.entry)
            there = (chip > 0) & ((y < high) | (cut.engagement.entry == 0))
            there &= (y > low) | (cut.engagement.exit == math.pi)
            normal = np.where(there, chip * np.sin(kappa), 0.0)
            shear = normal if not exponent else normal * (np.maximum(normal, 1e-9) / 1e-4) ** -exponent
            sk, ck = np.sin(kappa), np.cos(kappa)
            for column, size in ((0, shear * db), (3, np.where(there, ds, 0.0))):
                result[i, :, column] += [-size @ c, size @ s, 0.0]
                result[i, :, column + 1] += [-size @ (sk * s), -size @ (sk * c), size @ ck]
                result[i, :, column + 2] += [size @ (ck * s), size @ (ck * c), size @ sk]
    return result


@pytest.mark.parametrize("tool", [BALL, NOSE, CONE], ids=["ball", "bull nose", "taper"])
@pytest.mark.parametrize("cut", [SLOT, UP, DOWN], ids=["slot", "up", "down"])
@pytest.mark.parametrize("uneven", [False, True], ids=["even", "uneven"])
def test_the_forces_are_those_of_slices(tool, cut, uneven):
    if uneven:
        angles = tuple(np.radians([0.0, 110.0, 245.0]).tolist())
        tool = replace(tool, tooth_angles=angles, runout_radius=20e-6, runout_angle=0.7)
    at = np.arange(0, ANGLES, 17)
    ours = force_basis(tool, EdgeLaw(), cut)[at]
    slices = sliced(tool, cut, 2 * math.pi * at / ANGLES)
    for column in range(6):
        largest = np.abs(slices[:, :, column]).max()
        assert np.abs(ours[:, :, column] - slices[:, :, column]).max() < 1e-4 * largest


def test_a_law_that_is_not_linear_takes_the_chip_normal_to_the_edge():
    at = np.arange(0, ANGLES, 29)
    ours = force_basis(BALL, EdgeLaw(size_exponent=0.3), SLOT)[at, :, :3]
    slices = sliced(BALL, SLOT, 2 * math.pi * at / ANGLES, exponent=0.3)[:, :, :3]
    assert ours == pytest.approx(slices, abs=1e-4 * np.abs(slices).max())


def trochoids(cutter, cut, angles, heights, slices=40_000):
    """Edge force per unit of each coefficient, (angles, 3, 6), of a ball between two heights, in a slot.

    The chip is what is left on a ray of the tooth before the path of the earlier tooth, which crosses it at
    an immersion larger by the root of r sin δ = f (p − δ) cos φ.
    """
    r_ball, teeth = cutter.corner, cutter.teeth
    low, high = np.arccos(1 - np.array(heights) / r_ball)
    kappa = low + (high - low) * (np.arange(slices) + 0.5) / slices
    z, radius = r_ball * (1 - np.cos(kappa)), r_ball * np.sin(kappa)
    lag = math.tan(cutter.helix) / cutter.radius
    db = r_ball * (high - low) / slices
    ds = db * np.sqrt(1 + (radius * lag * np.sin(kappa)) ** 2) * math.cos(cutter.helix)
    feed, pitch = cut.feed_per_tooth * teeth / (2 * math.pi), 2 * math.pi / teeth
    sk, ck = np.sin(kappa), np.cos(kappa)
    result = np.zeros((len(angles), 3, 6))
    for i, angle in enumerate(angles):
        for place in cutter.tooth_angles:
            phi = angle + place - lag * z
            s, c = np.sin(phi), np.cos(phi)
            delta = np.zeros_like(phi)
            for _ in range(30):
                delta = np.arcsin(feed * (pitch - delta) * c / radius)
            chip = radius - (radius * np.cos(delta) - feed * (pitch - delta) * s)
            # An earlier path is in front of the tooth, not behind it across the tool's axis.
            there = (chip > 0) & (s > -0.5)
            for column, size in ((0, np.where(there, chip * sk, 0.0) * db), (3, np.where(there, ds, 0.0))):
                result[i, :, column] += [-size @ c, size @ s, 0.0]
                result[i, :, column + 1] += [-size @ (sk * s), -size @ (sk * c), size @ ck]
                result[i, :, column + 2] += [size @ (ck * s), size @ (ck * c), size @ sk]
    return result


def test_on_true_paths_near_the_tip_an_edge_leaves_the_cut_and_comes_back_to_it():
    """The tooth leaves the later the closer to the tip, and the later the higher: the middle leaves first."""
    tool = replace(BALL, helix=math.radians(45))
    at = np.arange(ANGLES)[4:220:3]
    low, high = 0.1e-3, 3e-3  # below, paths are not taken as true ones
    ours = [force_basis(tool, EdgeLaw(), replace(SLOT, axial_depth=z), True)[at] for z in (low, high)]
    slices = trochoids(tool, SLOT, 2 * math.pi * at / ANGLES, (low, high))
    off = np.abs(ours[1] - ours[0] - slices).max(axis=1) / np.abs(slices).max(axis=(0, 1))
    # Where the edge only just comes to leave the cut, what is out of it grows as a square root.
    assert off.max() < 0.03
    assert off.mean() < 3e-4


@pytest.mark.parametrize("cut", [SLOT, UP, DOWN], ids=["slot", "up", "down"])
@pytest.mark.parametrize("true_path", [False, True], ids=["circles", "true paths"])
@pytest.mark.parametrize("runout", [0.0, 20e-6])
def test_a_vanishing_corner_and_a_vanishing_taper_leave_the_cylinder(cut, true_path, runout):
    flat = replace(FLAT, runout_radius=runout, runout_angle=0.4)
    exact = force_basis(flat, EdgeLaw(), cut, true_path)
    largest = np.abs(exact).max(axis=(0, 1))
    for almost in (replace(flat, corner=1e-10), replace(flat, taper=1e-9)):
        ours = force_basis(almost, EdgeLaw(), cut, true_path)
        assert np.all(np.abs(ours - exact).max(axis=(0, 1)) < 1e-6 * largest)


@pytest.mark.parametrize("true_path", [False, True], ids=["circles", "true paths"])
def test_above_the_ball_the_tool_is_a_cylinder(true_path):
    def added(tool):
        deep, deeper = (replace(SLOT, axial_depth=depth) for depth in (9e-3, 12e-3))
        return force_basis(tool, EdgeLaw(), deeper, true_path) - force_basis(tool, EdgeLaw(), deep, true_path)

    assert added(BALL) == pytest.approx(added(FLAT), rel=1e-6, abs=1e-6 * np.abs(added(FLAT)).max())


def test_mean_forces_of_a_ball_in_a_slot_as_deep_as_its_radius_are_the_closed_forms():
    straight = replace(BALL, helix=0.0)
    n, s = 3, SLOT.feed_per_tooth
    mean = mean_basis(straight, EdgeLaw(), replace(SLOT, axial_depth=R))
    expected = np.zeros((3, 6))
    expected[1, 0] = n * s * R / 4
    expected[0, 1], expected[2, 1] = -n * s * R * math.pi / 16, n * s * R / (2 * math.pi)
    expected[0, 2], expected[2, 2] = n * s * R / 8, n * s * R / 4
    expected[1, 3] = n * R / 2
    expected[0, 4], expected[2, 4] = -n * R / math.pi, n * R / 2
    expected[0, 5], expected[2, 5] = n * R / math.pi, n * R / 2
    assert mean[:, :3] == pytest.approx(expected[:, :3], abs=1e-5 * n * s * R)
    # An edge without helix is spread over a step of the table (half a degree) by its height, so that more
    # than half of its length enters and leaves ahead of the step's middle: by a third of 0.0087 rad / π.
    assert mean[:, 3:] == pytest.approx(expected[:, 3:], abs=0.0087 / 3 / math.pi * n * R)


def test_the_edge_of_a_ball_has_the_length_of_its_curve():
    line = meridian(BALL, R, BALL.lag_per_depth)
    shares, weights = np.polynomial.legendre.leggauss(4)
    length = sum(
        0.5 * weight * line.length[panel] * edge_length(line, place_at(line, panel, 0.5 * (share + 1)))
        for panel in range(len(line.length))
        for share, weight in zip(shares, weights, strict=True)
    )
    z = R * (1 - np.cos(np.linspace(0, math.pi / 2, 200_001)))  # the curve itself, as a polygon
    r, psi = np.sqrt(2 * R * z - z**2), math.tan(BALL.helix) / R * z
    polygon = np.linalg.norm(np.diff([r * np.cos(psi), r * np.sin(psi), z], axis=1), axis=0).sum()
    assert length == pytest.approx(polygon * math.cos(BALL.helix), rel=1e-6)


@pytest.mark.parametrize("tool", [BALL, NOSE, CONE], ids=["ball", "bull nose", "taper"])
def test_mean_tangential_power_is_the_pressure_times_the_volume_removed(tool):
    """The tangential force of a ring has the ring's radius as its lever."""
    depths = np.linspace(0.0, 3e-3, 201)
    means = np.array([mean_basis(tool, EdgeLaw(), replace(SLOT, axial_depth=d))[1, 0] for d in depths])
    lines = [meridian(tool, d, 1.0) for d in 0.5 * (depths[1:] + depths[:-1])]
    radius = np.array([place_at(line, len(line.length) - 1, 1.0).radius for line in lines])
    # F_t ∝ sin φ over half a turn: its mean is 4/π of that of F_t sin φ.
    power = 2 * math.pi * np.sum(4 / math.pi * np.diff(means) * radius)
    removed = 3 * SLOT.feed_per_tooth * np.sum(2 * radius * np.diff(depths))
    assert power == pytest.approx(removed, rel=1e-4)


def test_a_ball_that_enters_a_block_meets_its_face_at_the_local_radius():
    none = entry_basis(BALL, EdgeLaw(), SLOT, -0.99 * R)
    assert np.abs(entry_basis(FLAT, EdgeLaw(), SLOT, -0.99 * R)).max() > 0.0
    # 3 mm above its tip a ball of 8 mm has a radius of 6.24 mm, so that nothing is inside yet
    assert np.abs(none).max() == 0.0
    assert np.abs(entry_basis(BALL, EdgeLaw(), SLOT, -0.7 * R)).max() > 0.0


def test_the_mean_inclination_of_a_ball_is_the_closed_form():
    sine, cosine = mean_inclination(BALL, R)
    assert (sine, cosine) == (pytest.approx(math.pi / 4, rel=1e-6), pytest.approx(0.5, rel=1e-6))
    assert mean_inclination(FLAT, 3e-3) == (pytest.approx(1.0), pytest.approx(0.0, abs=1e-12))
    assert mean_inclination(replace(FLAT, taper=0.3), 3e-3)[0] == pytest.approx(math.cos(0.3))
