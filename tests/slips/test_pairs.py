"""A hammer record and an FRF file of the same pair of points are compared, and a wrong unit is found."""

import numpy as np
import pytest

from metro.observables.stability.receptance import Receptance
from metro.slips.pairs import pair_slips

FREQUENCY = np.arange(20.0, 1500.0, 1.0)


def structure(frequency):
    """Receptance of two modes, m/N."""
    return sum(
        1.0 / (k * (1.0 - (frequency / f) ** 2 + 2j * zeta * frequency / f))
        for f, zeta, k in ((310.0, 0.03, 9e6), (840.0, 0.02, 4e7))
    )


def receptance(frequency, frf, usable_to=np.inf, pair=("1x", "1x")):
    rng = np.random.default_rng(3)
    noise = 1e-10 * (rng.standard_normal(len(frf)) + 1j * rng.standard_normal(len(frf)))
    return Receptance(
        "1", *pair, frequency, frf + noise, None, np.zeros((0, len(frf))), (), frequency <= usable_to
    )


FILE = receptance(FREQUENCY, structure(FREQUENCY))


def struck(factor, pair=("1x", "1x")):
    """A record on other lines than the file, whose hammer reaches 1100 Hz."""
    lines = np.arange(5.0, 3000.0, 1.7)
    return receptance(lines, factor(lines) * structure(lines), 1100.0, pair)


@pytest.mark.parametrize("gain", [1.0, 1.2, 0.8])
def test_two_measurements_of_a_pair_that_agree_are_no_contradiction(gain):
    assert pair_slips([struck(lambda f: gain + 0 * f), FILE]) == ()


def test_other_pairs_are_not_compared():
    assert pair_slips([struck(lambda f: 10.0 + 0 * f, ("2x", "1x")), FILE]) == ()
    assert pair_slips([FILE]) == ()


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (lambda f: 9.80665 + 0 * f, "response in g"),
        (lambda f: 0.1 + 0 * f, "sensitivity of the accelerometer or the hammer, wrong by a factor of 10"),
        (lambda f: -1.0 + 0 * f, "points the other way"),
        (lambda f: 2j * np.pi * f, "an acceleration, m/s², given as a velocity"),
        (lambda f: 1.0 / (2j * np.pi * f), "an acceleration, m/s², given as a velocity"),
    ],
)
def test_a_wrong_unit_or_sign_of_the_record_is_stated_with_what_is_likely(factor, words):
    (slip,) = pair_slips([struck(factor), FILE])
    assert words in slip.remedy
    assert slip.file == "impacts.csv"
    assert "1x to 1x" in slip.found


def test_without_lines_in_common_nothing_is_said():
    far = receptance(FREQUENCY + 5000.0, 10.0 * structure(FREQUENCY))
    assert pair_slips([far, FILE]) == ()
