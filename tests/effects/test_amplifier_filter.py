"""The amplifier's filter against scipy's Butterworth filters, and in the order averages of a model."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.law import EdgeLaw
from metro.effects.amplifier_filter import EFFECT, OPEN, LowPass, butterworth
from metro.observables.force.model import ForceModel

RATIO = np.linspace(0.0, 3.0, 61)


@pytest.mark.parametrize("order", range(1, 9))
def test_a_whole_order_is_the_filter_of_scipy(order):
    b, a = signal.butter(order, 1.0, analog=True)
    _, expected = signal.freqs(b, a, RATIO)
    np.testing.assert_allclose(butterworth(RATIO, order), expected, atol=1e-12)


def test_between_two_orders_the_phase_is_between_theirs():
    low, middle, high = (np.unwrap(np.angle(butterworth(RATIO[1:], order))) for order in (2.0, 2.5, 3.0))
    assert (middle < low).all()
    assert (middle > high).all()


@pytest.mark.parametrize("order", range(2, 9))
def test_the_response_does_not_bend_at_a_whole_order(order):
    """A filter that there is has one, and a descent along a bend ends before it."""
    step = 1e-5
    below, at, above = (butterworth(RATIO[1:], order + off) for off in (-step, 0.0, step))
    slopes = np.log(at / below) / step, np.log(above / at) / step
    np.testing.assert_allclose(slopes[0], slopes[1], atol=1e-4 * np.abs(slopes[0]).max())


@pytest.mark.parametrize(("order", "error"), [(1.5, 0.025), (2.5, 0.002), (6.5, 1e-4)])
def test_between_two_orders_the_amplitude_is_nearly_that_of_a_maximally_flat_response(order, error):
    flat = 1.0 / np.sqrt(1.0 + RATIO ** (2.0 * order))
    np.testing.assert_allclose(np.abs(butterworth(RATIO, order)), flat, rtol=error)


def test_the_response_is_that_at_the_frequencies_of_the_orders_alike_on_all_axes():
    setting = SimpleNamespace(recording=SimpleNamespace(speed=80.0))
    gain = LowPass(800.0, 2.0).gain(None, setting, 24)
    assert gain.shape == (24, 3)
    assert gain[0] == pytest.approx([1.0, 1.0, 1.0])
    assert abs(gain[10]) == pytest.approx([math.sqrt(0.5)] * 3)
    assert (gain == gain[:, :1]).all()
    assert LowPass(OPEN, 2.0).gain(None, setting, 24) is None


def test_the_effect_adds_one_term_and_none_of_its_starts_leaves_its_bounds():
    model = EFFECT.apply(
        ForceModel(Cutter(6e-3, 0.5, evenly_pitched(3)), EdgeLaw()), {"corner_hz": 900.0, "order": 3.0}
    )
    assert model.terms == (LowPass(900.0, 3.0),)
    for parameter in EFFECT.parameters:
        assert all(parameter.lower <= start <= parameter.upper for start in parameter.starts)
