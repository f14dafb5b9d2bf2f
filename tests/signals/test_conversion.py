"""Axes, signs and units of what sensors read."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from metro.batch.axes import signed_axes
from metro.signals.conversion import driving_point_sign, moved, receptance, response_si, sensor_to_tool

AXES = [
    {"x": "x", "y": "y", "z": "z"},
    {"x": "-y", "y": "-x", "z": "-z"},
    {"x": "y", "y": "-x", "z": "z"},
    {"x": "z", "y": "x", "z": "y"},
]


def test_a_sensor_whose_x_points_along_work_y_and_reads_the_tool():
    to_tool = sensor_to_tool(signed_axes({"x": "y", "y": "-x", "z": "z"}), 0.0, "tool")
    np.testing.assert_allclose(to_tool @ [7.0, 0.0, 0.0], [0.0, 7.0, 0.0])
    np.testing.assert_allclose(to_tool @ [0.0, 7.0, 0.0], [-7.0, 0.0, 0.0])


def test_under_the_work_the_sensor_reads_the_opposite():
    to_tool = sensor_to_tool(signed_axes({}), 0.0, "work")
    np.testing.assert_allclose(to_tool @ [1.0, 2.0, 3.0], [-1.0, -2.0, -3.0])


def test_a_sensor_turned_counter_clockwise_by_90_degrees_reads_work_y_on_its_x():
    to_tool = sensor_to_tool(signed_axes({}), 90.0, "tool")
    np.testing.assert_allclose(to_tool @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)


def test_the_rotation_is_about_work_z_even_where_the_sensor_is_upside_down():
    # sensor x along work −y, turned by +30° about work +z: that direction is (sin 30°, −cos 30°)
    to_tool = sensor_to_tool(signed_axes(AXES[1]), 30.0, "tool")
    np.testing.assert_allclose(to_tool @ [1.0, 0.0, 0.0], [0.5, -np.sqrt(0.75), 0.0], atol=1e-15)


@given(
    axes=st.sampled_from(AXES),
    rotation=st.floats(-720.0, 720.0),
    reads=st.sampled_from(["work", "tool"]),
    force=st.lists(st.floats(-1e4, 1e4), min_size=3, max_size=3),
)
def test_the_conversion_keeps_the_force_s_size_and_can_be_undone(axes, rotation, reads, force):
    to_tool = sensor_to_tool(signed_axes(axes), rotation, reads)
    converted = to_tool @ force
    assert np.linalg.norm(converted) == pytest.approx(np.linalg.norm(force), rel=1e-12, abs=1e-9)
    np.testing.assert_allclose(to_tool.T @ converted, force, atol=1e-9)
    assert np.linalg.det(to_tool) == pytest.approx(-1.0 if reads == "work" else 1.0)


def test_gravities_are_metres_per_second_squared():
    np.testing.assert_allclose(response_si(np.array([2.0]), "g"), [19.6133])
    np.testing.assert_array_equal(response_si(np.array([2.0]), "m/s"), [2.0])


@pytest.mark.parametrize(
    ("unit", "scale", "order"), [("m", 1.0, 0), ("m/s", 1.0, 1), ("m/s2", 1.0, 2), ("g", 9.80665, 2)]
)
def test_receptance_is_recovered_from_its_time_derivatives(unit, scale, order):
    frequency = np.array([0.0, 10.0, 25.0])
    omega = 2.0 * np.pi * frequency
    expected = 1.0 / (1e6 - 4.0 * omega**2 + 30j * omega)
    found = receptance(frequency, expected * (1j * omega) ** order / scale, unit)
    np.testing.assert_allclose(found[1:], expected[1:], rtol=1e-13)
    assert np.isnan(found[0]) == (order > 0)


def oscillator(frequency):
    omega = 2.0 * np.pi * frequency
    return 1.0 / (1e6 - 0.5 * omega**2 + 40j * omega)


def test_a_driving_point_takes_in_power_and_its_conjugate_gives_it_out():
    frequency = np.linspace(0.0, 500.0, 501)
    sign = driving_point_sign(frequency, oscillator(frequency))
    assert -1.0 <= sign < 0.0
    assert driving_point_sign(frequency, oscillator(frequency).conj()) == pytest.approx(-sign)


def test_noise_of_an_integrated_acceleration_at_low_frequency_does_not_turn_the_sign():
    frequency = np.linspace(1.0, 1000.0, 1000)
    accelerance = -((2.0 * np.pi * frequency) ** 2) * oscillator(frequency)
    noisy = receptance(frequency, accelerance - 2e-2j, "m/s2")
    assert np.mean(noisy.imag) > 0.0
    assert driving_point_sign(frequency, noisy) < 0.0


def test_points_are_turned_then_shifted():
    quarter = np.array(
        [[0.0, -1.0, 0.0, 10.0], [1.0, 0.0, 0.0, 20.0], [0.0, 0.0, 1.0, 30.0], [0.0, 0.0, 0.0, 1.0]]
    )
    np.testing.assert_array_equal(moved(np.array([[1.0, 2.0, 3.0]]), quarter), [[8.0, 21.0, 33.0]])
