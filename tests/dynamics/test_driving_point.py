"""A declared driving point that the data contradict is none: reversed, or another place."""

import numpy as np
import pytest

from metro.dynamics.driving import Standing, power_given_out, turning
from metro.dynamics.modal import identify_modes

HZ, ZETA = np.array([40.0, 71.0, 110.0]), np.array([0.02, 0.015, 0.01])
FREQUENCY = np.arange(20.0, 140.0, 0.25)


def response(hammer, sensor, seed=0):
    """Receptance between two places with modal amplitudes (3,), 1 % of noise."""
    ratio, rng = FREQUENCY[:, None] / HZ, np.random.default_rng(seed)
    exact = 1e-7 / (1 - ratio**2 + 2j * ZETA * ratio) @ (np.array(hammer) * np.array(sensor))
    sd = 0.01 * np.sqrt(np.mean(np.abs(exact) ** 2) / 2)
    return exact + sd * (rng.normal(size=exact.shape) + 1j * rng.normal(size=exact.shape))


def declared(frf):
    return identify_modes(FREQUENCY, frf[:, None], driving=0)


@pytest.mark.parametrize("seed", range(3))
def test_a_driving_point_is_taken_for_one(seed):
    model = declared(response([1.0, 0.8, -0.5], [1.0, 0.8, -0.5], seed))
    assert model.declared[0] is Standing.THERE
    assert all(mode.stiffness > 0.0 for mode in model.modes)


def test_a_sensor_that_points_the_other_way_is_named():
    model = declared(-response([1.0, 0.8, -0.5], [1.0, 0.8, -0.5]))
    assert model.declared[0] is Standing.REVERSED
    np.testing.assert_allclose([mode.frequency for mode in model.modes], HZ, rtol=1e-3)
    assert np.isnan([mode.stiffness for mode in model.modes]).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_power_of_the_force_tells_the_sign_where_modes_overlap(sign):
    ratio, rng = FREQUENCY[:, None] / np.array([60.0, 70.0]), np.random.default_rng(0)
    exact = sign * (1e-7 / (1 - ratio**2 + 2j * 0.08 * ratio)).sum(axis=1)
    sd = 0.01 * np.sqrt(np.mean(np.abs(exact) ** 2) / 2)
    model = declared(exact + sd * (rng.normal(size=exact.shape) + 1j * rng.normal(size=exact.shape)))
    assert model.declared[0] is (Standing.THERE if sign > 0.0 else Standing.REVERSED)


def test_another_place_is_named():
    model = declared(response([1.0, 0.8, -0.5], [0.9, -0.6, 0.7]))
    assert model.declared[0] is Standing.ELSEWHERE
    assert np.isnan([mode.stiffness for mode in model.modes]).all()


def test_a_second_driving_point_takes_the_place_of_a_false_one():
    first, second = [1.0, 0.8, -0.5], [0.6, -0.9, 0.7]
    frf = np.stack([response(first, [0.9, -0.6, 0.7]), response(second, second, 1)], axis=1)
    model = identify_modes(FREQUENCY, frf, driving=0, others=[1])
    assert model.declared == {0: Standing.ELSEWHERE, 1: Standing.THERE}
    stiffness = [mode.stiffness for mode in model.modes]
    np.testing.assert_allclose(stiffness, 1e7 / np.square(second), rtol=0.02)


def test_a_hammer_a_little_beside_the_sensor_at_a_node_is_no_other_place():
    model = declared(response([1.0, 0.8, -0.06], [1.0, 0.8, 0.06]))
    assert model.declared[0] is Standing.THERE
    assert np.isfinite([mode.stiffness for mode in model.modes]).tolist() == [True, True, False]


def test_conjugated_and_reversed_responses_are_told_apart():
    frf = response([1.0, 0.8, 0.5], [1.0, 0.8, 0.5])
    assert power_given_out(FREQUENCY, frf) < -0.9
    assert power_given_out(FREQUENCY, -frf) > 0.9
    assert power_given_out(FREQUENCY, frf.conj()) > 0.9
    assert turning(frf) < 0.0
    assert turning(-frf) < 0.0
    assert turning(frf.conj()) > 0.0


def test_conjugated_responses_without_a_driving_point_are_refused():
    places = [[1.0, 0.8, 0.5], [0.3, -0.9, 0.7], [-0.6, 0.2, 0.9]]
    frf = np.stack([response(places[0], place, seed) for seed, place in enumerate(places[1:])], axis=1)
    assert len(identify_modes(FREQUENCY, frf).modes) == 3
    with pytest.raises(ValueError, match=r"conjugated \(e\^\{-iωt\}\)"):
        identify_modes(FREQUENCY, frf.conj())
