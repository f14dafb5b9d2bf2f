"""Labels against predicted probabilities."""

import numpy as np
import pytest

from metro.loop.labels import log_likelihood, surprise

RNG = np.random.default_rng(1)
PROBABILITY = RNG.uniform(0.02, 0.98, 40)


def test_log_likelihood_is_that_of_coin_tosses():
    label = np.array([1.0, 0.0, 1.0])
    assert log_likelihood(label, np.array([0.9, 0.2, 0.5])) == pytest.approx(np.log(0.9 * 0.8 * 0.5))
    assert np.isfinite(log_likelihood(label, np.array([0.0, 1.0, 0.0])))
    many = np.stack([label, 1 - label])
    assert log_likelihood(many, np.array([0.9, 0.2, 0.5])) == pytest.approx(
        np.log([0.9 * 0.8 * 0.5, 0.1 * 0.2 * 0.5])
    )


def test_surprise_is_uniform_when_the_prediction_is_right():
    rng = np.random.default_rng(2)
    found = np.array([surprise(rng.random(40) < PROBABILITY, PROBABILITY, seed) for seed in range(300)])
    for level in (0.1, 0.25, 0.5, 0.75, 0.9):
        assert np.mean(found <= level) == pytest.approx(level, abs=0.09)


def test_surprise_is_small_when_labels_contradict_a_confident_prediction():
    confident = np.where(np.arange(12) < 6, 0.02, 0.98)
    agreeing = (confident > 0.5).astype(float)
    assert surprise(agreeing, confident, 1) > 0.5
    assert surprise(1 - agreeing, confident, 1) < 0.001
    two_wrong = agreeing.copy()
    two_wrong[:2] = 1.0
    exact = 1 - 0.98**12 - 12 * 0.02 * 0.98**11  # two or more of twelve wrong
    assert surprise(two_wrong, confident, 1) == pytest.approx(exact, abs=0.012)


def test_an_undecided_prediction_is_never_surprised():
    assert surprise(np.ones(20), np.full(20, 0.5), 1) == pytest.approx(1.0)
