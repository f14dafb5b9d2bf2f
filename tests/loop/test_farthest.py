"""How far along a step its end is, where the model bends more than its derivatives say."""

import numpy as np
import pytest
from strd import Curve

from metro.effects.effect import Effect, EffectParameter
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.descent import _moved, descend, farthest
from metro.loop.fitting.noise import Noise
from metro.loop.fitting.system import State, linearised
from metro.observables.problem import Block


def at(function, measured, start):
    """Return the arguments of ``farthest`` for a model of one parameter at a start."""
    n = len(measured)
    block = Block(
        *("r", "c", "identify", 0, np.array(measured), np.ones(n), None, np.full(n, "y")),
        *(np.zeros((n, 0)), np.zeros(0), {}),
    )
    candidate, noise = Candidate(Curve(function, 1)), Noise(0.0, np.zeros(1), {"c": 1.0})
    state = State(np.zeros(0), np.array([start]), {"r": np.zeros(0)})
    return candidate, [block], noise, state


def share(function, measured, start=0.0):
    candidate, blocks, noise, state = at(function, measured, start)
    return farthest(candidate, blocks, state, linearised(candidate, blocks, noise, state))


def bent(b):
    """Its sum of squares from 1 and -1, (1 - b)² + (1 + 5 b²)², is lowest at b = 0.083; a step goes to 1."""
    return np.array([b[0], 5.0 * b[0] ** 2])


def backwards(b):
    """A model whose derivative promises what no step keeps."""
    return np.array([-b[0].real + 1j * b[0].imag])


def test_a_linear_model_has_its_end_at_the_whole_step():
    assert share(lambda b: np.array([2.0 * b[0]]), [1.0]) == 1.0


def test_a_bent_model_has_its_end_short_of_it():
    assert share(bent, [1.0, -1.0]) == pytest.approx(0.1)


def test_where_no_share_keeps_what_was_promised_the_whole_step_counts():
    assert share(backwards, [1.0]) == 1.0


def test_a_descent_is_given_up_only_where_another_is_lower_than_it_can_come():
    away = at(lambda b: np.array([b[0] ** 2]), [1.0], 3.0)
    followed, cost = descend(*away)
    assert followed.beta[0] == pytest.approx(1.0, abs=0.05)
    given_up, higher = descend(*away, rival=cost - 1e6)
    assert given_up.beta[0] == 3.0
    assert higher > cost
    assert descend(*away, rival=cost + 1.0)[1] == pytest.approx(cost)


def test_a_length_and_its_angle_go_straight_on():
    parameters = (
        EffectParameter("radius_um", "um", 0.0, 200.0, 5.0, (4.0,)),
        EffectParameter("angle_deg", "deg", 0.0, 360.0, 30.0, (0.0,), period=360.0, length="radius_um"),
    )
    runout = Effect("runout", ("toy",), parameters, lambda model, _: model, "", "", "")
    candidate = Candidate(Curve(bent, 1), (runout,))
    begun = State(np.array([3.0, 90.0]), np.zeros(1), {})
    sideways = np.array([0.0, 0.0, np.degrees(4.0 / 3.0)])  # 4 µm across a vector of 3 µm: 5 µm long
    after = _moved(candidate, begun, sideways, {}).theta
    assert after == pytest.approx([5.0, 90.0 + np.degrees(np.arctan2(4.0, 3.0))])
    backwards_through_nothing = np.array([0.0, -8.0, 0.0])
    assert _moved(candidate, begun, backwards_through_nothing, {}).theta == pytest.approx([5.0, 270.0])


def test_a_step_of_a_stiffness_is_one_of_its_reciprocal():
    """From 6 to 2: a step of what is in proportion to 1/k is exact along 1/k, and goes past 0 along k."""
    parameters = (
        EffectParameter("k", "N/um", 0.8, 200.0, 1.0, (6.0,), neutral=200.0, reciprocal=True),
        EffectParameter("plain", "N/um", 0.8, 200.0, 1.0, (6.0,), neutral=200.0),
    )
    soft = Effect("soft", ("toy",), parameters, lambda model, _: model, "", "", "")
    candidate = Candidate(Curve(bent, 1), (soft,))
    step = np.array([0.0, *[-36.0 * (1.0 / 2.0 - 1.0 / 6.0)] * 2])
    there = _moved(candidate, State(np.array([6.0, 6.0]), np.zeros(1), {}), step, {})
    assert there.theta == pytest.approx([2.0, 0.8])
    beyond = _moved(candidate, State(np.array([6.0, 6.0]), np.zeros(1), {}), -10.0 * step, {})
    assert beyond.theta == pytest.approx([200.0, 126.0])
