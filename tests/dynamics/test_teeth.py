"""Windows of engagement against brute force over the immersion angle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.dynamics.system import Cut
from metro.dynamics.teeth import (
    Engagement,
    Window,
    eccentric_teeth,
    equal_teeth,
    mean_directional_factors,
    unequal_teeth,
)

FEED = 0.05e-3


def test_equal_teeth_meet_what_the_tooth_before_left():
    cut = Cut(3, 0.2, 1.4, 1e9, 4e8)
    assert {(w.delay, w.entry, w.exit) for w in equal_teeth(cut).windows} == {(cut.pitch, 0.2, 1.4)}


def test_uneven_teeth_meet_what_was_left_the_pitch_ahead_of_them_ago():
    pitch = np.radians([100.0, 140.0, 120.0])
    windows = unequal_teeth(Cut(3, 0.2, 1.4, 1e9, 4e8), pitch).windows
    assert [w.delay for w in windows] == pytest.approx(list(pitch))
    assert [w.angle for w in windows] == pytest.approx([0.0, pitch[0], pitch[0] + pitch[1]])


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-0.06e-3, 0.06e-3), min_size=3, max_size=3),
    st.floats(0.0, 1.0),
    st.floats(1.2, np.pi),
)
def test_windows_of_eccentric_teeth_are_where_the_thinnest_chip_says(reach, entry, leave):
    cut, reach = Cut(3, entry, leave, 1e9, 4e8), np.array(reach)
    found = eccentric_teeth(cut, np.full(3, cut.pitch), reach, FEED).windows
    phi = np.linspace(entry, leave, 401)[1:-1]
    for j in range(3):
        chips = np.array([m * FEED * np.sin(phi) + reach[j] - reach[(j + m) % 3] for m in (1, 2, 3)])
        order = np.sort(chips, axis=0)
        clear = (order[1] - order[0] > 1e-9) & (np.abs(order[0]) > 1e-9)  # away from where it changes
        expected = np.where(order[0] > 0, chips.argmin(axis=0) + 1, 0)
        told = np.zeros(len(phi))
        for w in found:
            if w.angle == pytest.approx(j * cut.pitch):
                told[(phi > w.entry) & (phi < w.exit)] += round(w.delay / cut.pitch)
        np.testing.assert_array_equal(told[clear], expected[clear])


def brute_force(cut, lag, depth, steps, tooth_angles):
    """Mean of the factors over a fine grid of time and of height."""
    theta = (np.arange(steps * 200) + 0.5) / (steps * 200) * cut.pitch
    z = (np.arange(300) + 0.5) / 300 * depth
    total = np.zeros((steps, 2, 2))
    for angle in tooth_angles:
        for turn in (-2 * np.pi, 0.0):
            phi = theta[:, None] + angle + turn - lag * z
            inside = (phi > cut.entry) & (phi < cut.exit)
            s, c = np.sin(phi), np.cos(phi)
            fx, fy = -(cut.ktc * c + cut.krc * s), cut.ktc * s - cut.krc * c
            rows = np.array([[fx * s, fx * c], [fy * s, fy * c]]) * inside
            total += rows.mean(axis=3).reshape(2, 2, steps, 200).mean(axis=3).transpose(2, 0, 1)
    return total


@pytest.mark.parametrize("lag", [0.0, 140.0])
@pytest.mark.parametrize("window", [(0.0, 1.0), (2.2, np.pi), (-0.5, 2.6)])
def test_mean_factors_match_a_fine_grid(lag, window):
    cut, depth, steps = Cut(3, *window, 1e9, 4e8), 6e-3, 12
    means, delays = mean_directional_factors(equal_teeth(cut, lag), np.array([depth]), steps)
    expected = brute_force(cut, lag, depth, steps, cut.pitch * np.arange(3))
    assert list(delays) == [cut.pitch]
    np.testing.assert_allclose(means[0, :, 0], expected, atol=2e-3 * np.abs(expected).max())


def test_a_window_anywhere_on_the_circle_counts_once():
    cut = Cut(1, 0.3, 0.9, 1e9, 0.0)
    for shift in (0.0, 2.0, 4.0, 6.0):
        engagement = Engagement(cut, (Window(shift, 2 * np.pi, 0.3, 0.9),), 2 * np.pi)
        means, _ = mean_directional_factors(engagement, np.ones(1), 50)
        # mean of cos² over the turn times -ktc is (1, 2) of the matrix … of sin² is (2, 1)
        sine_squared = (0.6 - (np.sin(1.8) - np.sin(0.6)) / 2) / 2 / (2 * np.pi)
        assert means[0, :, 0, 1, 0].mean() == pytest.approx(1e9 * sine_squared, rel=1e-9)


@pytest.mark.parametrize(
    ("pitch", "reach", "message"),
    [
        ([120, 120], [0, 0, 0], "2 pitch angles: expected 3"),
        ([120, 120, 121], [0, 0, 0], "361.000 deg"),
    ],
)
def test_teeth_that_do_not_add_up_are_refused(pitch, reach, message):
    with pytest.raises(ValueError, match=message):
        eccentric_teeth(Cut(3, 0.2, 1.4, 1e9, 4e8), np.radians(pitch), np.array(reach), FEED)
