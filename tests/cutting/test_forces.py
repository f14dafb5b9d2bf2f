"""The mechanistic force model against closed forms and limits."""

import math

import numpy as np
import pytest
from scipy.special import beta
from validation import mean_force_by_hand

from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement, engagement
from metro.cutting.force import ANGLES, force_basis, mean_basis, mean_force
from metro.cutting.law import EdgeLaw

SLOT = Engagement(0.0, math.pi)
# [T] table 4, N/m² and N/m
TITANIUM = np.array([10145e6, 11036.5e6, 5000e6, 591.92e3, 100.03e3, 214.32e3])


def cutter(teeth=4, helix=40.0, radius=6e-3, **runout):
    return Cutter(radius, math.radians(helix), evenly_pitched(teeth), **runout)


def test_mean_slot_force_is_the_closed_form():
    a, c, n = 0.2e-3, 0.06e-3, 4
    ktc, krc, kac, kte, kre, kae = TITANIUM
    expected = [
        -n * a / 4 * krc * c - n * a / math.pi * kre,
        n * a / 4 * ktc * c + n * a / math.pi * kte,
        n * a / math.pi * kac * c + n * a / 2 * kae,
    ]
    assert expected[1] == pytest.approx(272.47, abs=0.01)
    assert mean_force(cutter(), EdgeLaw(), Cut(c, a, SLOT), TITANIUM) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("true_limit", [False, True])
@pytest.mark.parametrize(("direction", "sign"), [("up", -1.0), ("down", 1.0), ("symmetric", -1.0)])
def test_mean_force_at_any_immersion_is_the_integral_over_the_arc(direction, sign, true_limit):
    engaged = engagement("side", direction, 2e-3, 6e-3)
    tool, feed = cutter(), 0.05e-3
    if true_limit:  # so large a tool that its teeth run on circles: the integrals are then those of a spline
        tool = cutter(radius=6e7)
    expected = mean_force_by_hand(engaged, feed, 1e-3, 4, TITANIUM)
    found = mean_basis(tool, EdgeLaw(), Cut(feed, 1e-3, engaged), true_limit) @ TITANIUM
    assert found == pytest.approx(expected, rel=1e-10)
    assert (
        math.copysign(1.0, found[0]) == sign
    )  # climb milling pulls the tool along, up milling holds it back


@pytest.mark.parametrize("exponent", [0.15, 0.4])
def test_mean_force_of_a_power_law_in_a_slot_is_a_beta_function(exponent):
    law = EdgeLaw(size_exponent=exponent, reference_thickness=5e-5)
    feed, depth = 0.05e-3, 1e-3  # of the feed's own thickness: shear = feed × sinφ^(1−m)
    found = mean_basis(cutter(), law, Cut(feed, depth, SLOT))
    scale = 4 * depth * feed / (2 * math.pi)
    assert found[1, 0] == pytest.approx(scale * beta((3 - exponent) / 2, 0.5), rel=1e-10)
    assert found[2, 2] == pytest.approx(scale * beta((2 - exponent) / 2, 0.5), rel=1e-10)


@pytest.mark.parametrize("helix", [0.0, 0.3, 40.0])
def test_the_table_has_the_mean_of_the_arc(helix):
    cut = Cut(0.05e-3, 3e-3, engagement("side", "down", 4e-3, 6e-3))
    exact = mean_basis(cutter(helix=helix), EdgeLaw(), cut) @ TITANIUM
    table = force_basis(cutter(helix=helix), EdgeLaw(), cut).mean(axis=0) @ TITANIUM
    assert table == pytest.approx(exact, rel=1e-12 if helix == 0.0 else 5e-4)


def test_unequal_pitch_leaves_the_mean_alone_but_not_its_spectrum():
    uneven = Cutter(6e-3, math.radians(40), (0.0, 1.4, 3.3, 4.9))
    cut = Cut(0.05e-3, 3e-3, SLOT)
    # What one tooth cuts more another cuts less: over a turn the pitches add up to the same feed.
    even = mean_basis(cutter(), EdgeLaw(), cut)
    assert mean_basis(uneven, EdgeLaw(), cut) == pytest.approx(even, rel=1e-12)
    waves = [force_basis(tool, EdgeLaw(), cut)[:, 1] @ TITANIUM for tool in (uneven, cutter())]
    first, none = (abs(np.fft.rfft(wave)[1]) for wave in waves)
    assert first > 100 * none


@pytest.mark.parametrize("runout", [0.0, 4e-6])
def test_mean_torque_times_speed_is_the_tangential_power(runout):
    # One tooth without helix: its tangential force is recovered from x and y at its immersion.
    one = Cutter(6e-3, 0.0, (0.0,), runout_radius=runout)
    force = force_basis(one, EdgeLaw(), Cut(0.2e-3, 2e-3, SLOT)) @ TITANIUM
    phi = 2 * math.pi * np.arange(ANGLES) / ANGLES
    tangential = -force[:, 0] * np.cos(phi) + force[:, 1] * np.sin(phi)
    energy_per_turn = tangential.mean() * 2 * math.pi * 6e-3
    chip_volume = 0.2e-3 * 2 * 6e-3 * 2e-3
    edge_work = TITANIUM[3] * 2e-3 * math.pi * 6e-3
    assert energy_per_turn == pytest.approx(TITANIUM[0] * chip_volume + edge_work, rel=1e-5)


def test_a_helix_that_spans_one_pitch_makes_the_force_constant():
    tool = cutter(teeth=4, helix=40.0)
    depth = 2 * math.pi / 4 / tool.lag_per_depth
    force = force_basis(tool, EdgeLaw(), Cut(0.02e-3, depth, SLOT)) @ TITANIUM
    assert np.ptp(force, axis=0).max() < 1e-12 * np.abs(force.mean(axis=0)).max()


def test_many_teeth_make_the_force_constant():
    def ripple(teeth):
        force = force_basis(cutter(teeth=teeth, helix=0.0), EdgeLaw(), Cut(0.02e-3, 1e-3, SLOT)) @ TITANIUM
        return np.ptp(force, axis=0).max() / np.abs(force.mean(axis=0)).max()

    # What a tooth adds when it enters stays, the mean grows with the number of teeth.
    assert ripple(60) == pytest.approx(ripple(6) / 10, rel=0.2)
    assert ripple(60) < 0.1


def test_little_helix_tends_to_none():
    cut = Cut(0.05e-3, 1e-3, SLOT)
    none, little = (force_basis(cutter(helix=helix), EdgeLaw(), cut) for helix in (0.0, 1e-9))
    assert little == pytest.approx(none, abs=1e-9 * np.abs(none).max())
    phi = 2 * math.pi * 100 / ANGLES  # all of the edge at one immersion
    assert none[100, 1, 3] == pytest.approx(1e-3 * (math.sin(phi) + math.cos(phi)), rel=1e-5)


@pytest.mark.parametrize("true_path", [False, True])
def test_little_runout_tends_to_none(true_path):
    cut = Cut(0.05e-3, 3e-3, Engagement(0.5, 2.4))
    none = force_basis(cutter(), EdgeLaw(), cut, true_path)
    little = force_basis(cutter(runout_radius=1e-13), EdgeLaw(), cut, true_path)
    scale = np.abs(none).max(axis=(0, 1))
    assert little / scale == pytest.approx(none / scale, abs=1e-4 if true_path else 1e-8)


def test_without_helix_a_tooth_cuts_only_inside_the_engagement():
    force = force_basis(Cutter(6e-3, 0.0, (0.0,)), EdgeLaw(), Cut(0.1e-3, 1e-3, SLOT)) @ TITANIUM
    degrees = np.arange(ANGLES) * 360 / ANGLES
    assert np.all(force[(degrees > 181) & (degrees < 359)] == 0.0)
    phi = np.radians(degrees)
    tangential = -force[:, 0] * np.cos(phi) + force[:, 1] * np.sin(phi)
    assert np.all(tangential[(degrees > 1) & (degrees < 179)] > 0.0)


def test_runout_leaves_the_mean_alone_while_every_tooth_cuts():
    cut = Cut(0.1e-3, 1e-3, engagement("side", "down", 4e-3, 6e-3))
    without = mean_force(cutter(), EdgeLaw(), cut, TITANIUM)
    shear_only = TITANIUM * [1, 1, 1, 0, 0, 0]
    within = mean_force(cutter(runout_radius=3e-6, runout_angle=0.7), EdgeLaw(), cut, shear_only)
    assert within == pytest.approx(mean_force(cutter(), EdgeLaw(), cut, shear_only), rel=2e-3)
    assert not np.allclose(without, within)


def test_first_order_of_runout_does_not_depend_on_the_feed():
    tool = cutter(runout_radius=3e-6, runout_angle=0.7)
    shear_only = TITANIUM * [1, 1, 1, 0, 0, 0]
    engaged = Engagement(0.6, 2.4)  # where the chip is never thinner than the runout

    def first_order(feed):
        return np.abs(
            np.fft.rfft(force_basis(tool, EdgeLaw(), Cut(feed, 1e-3, engaged)) @ shear_only, axis=0)[1]
        )

    assert first_order(0.2e-3) == pytest.approx(first_order(0.1e-3), rel=1e-3)


def test_teeth_of_equal_radius_make_no_order_but_their_own():
    spectrum = np.abs(
        np.fft.rfft(force_basis(cutter(), EdgeLaw(), Cut(0.05e-3, 1e-3, SLOT)) @ TITANIUM, axis=0)
    )
    orders = np.arange(len(spectrum))
    assert spectrum[orders % 4 != 0].max() < 1e-9 * spectrum.max()


def test_up_and_down_milling_mirror_each_other():
    assert engagement("side", "up", 2e-3, 6e-3).exit == pytest.approx(math.acos(1 - 2 / 6))
    assert engagement("side", "down", 2e-3, 6e-3).entry == pytest.approx(math.pi - math.acos(1 - 2 / 6))


def test_a_cut_wider_than_the_tool_is_refused():
    with pytest.raises(ValueError, match="not within the diameter"):
        engagement("side", "up", 13e-3, 6e-3)


def test_size_effect_without_exponent_is_the_linear_law():
    h = np.linspace(0.0, 1e-4, 11)
    assert EdgeLaw().shear(h) == pytest.approx(h)
    power = EdgeLaw(size_exponent=0.2, reference_thickness=5e-5)
    assert power.shear(np.array([5e-5])) == pytest.approx([5e-5])
    assert power.shear(np.array([2.5e-5])) == pytest.approx([2.5e-5 * 2**0.2])


def test_pitch_over_all_teeth_is_one_turn():
    tool = Cutter(6e-3, 0.0, (0.0, 1.5, 3.3, 4.9))
    assert tool.pitch(4) == pytest.approx(np.full(4, 2 * math.pi))
    assert tool.pitch(1) == pytest.approx([1.5, 1.8, 1.6, 2 * math.pi - 4.9])


def test_a_face_cut_in_the_middle_is_symmetric_about_the_feed():
    engaged = engagement("face", "slot", 6e-3, 6e-3)
    assert engaged.entry == pytest.approx(math.radians(60))
    assert engaged.exit == pytest.approx(math.radians(120))
