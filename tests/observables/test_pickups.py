"""Reconstruction by distance from the blow, and responses across it, on receptances written out."""

import numpy as np
import pandas as pd
import pytest

from metro.observables.stability.pickups import crossed, pickups
from metro.observables.stability.receptance import Receptance

FREQUENCY = np.linspace(1.0, 50.0, 50)


def used(response, size, error=0.02):
    frf = size * np.exp(1j * FREQUENCY)
    columns = {"position": "1", "reference": "1x", "response": response, "frequency_hz": FREQUENCY}
    return pd.DataFrame(
        {**columns, "real_m_n": frf.real, "imag_m_n": frf.imag, "error": error, "noise": 0.5 * error}
    )


def test_each_response_has_its_distance_and_its_level_beside_the_driving_point():
    table = pd.concat([used("1x", 2e-6), used("2x", 0.5e-6, 0.1), used("3x", 1e-6, 0.05)])
    distances = pd.DataFrame(
        {"position": ["1", "1"], "reference": "1x", "response": ["1x", "2x"], "distance_mm": [0.0, 900.0]}
    )
    found = pickups(table, distances).set_index("response")
    np.testing.assert_allclose(found["level"], [1.0, 0.25, 0.5])
    np.testing.assert_allclose(found["distance_mm"], [0.0, 900.0, np.nan])
    np.testing.assert_allclose(found["error"], [0.02, 0.1, 0.05])
    assert set(found["direction"]) == {"x"}


def test_without_a_driving_point_there_is_no_level():
    found = pickups(used("2x", 1e-6), distances=none())
    assert np.isnan(found["level"]).all()


def none():
    return pd.DataFrame(columns=["position", "reference", "response", "distance_mm"])


def receptance(reference, response, size, variance=None):
    frf = size * np.exp(-1j * FREQUENCY)
    return Receptance(
        "1", reference, response, FREQUENCY, frf, variance, np.zeros((0, 50)), (), np.ones(50, dtype=bool)
    )


def test_a_response_across_is_a_share_of_that_along_the_blow():
    scatter = np.full(50, (1e-8) ** 2)
    measured = [
        receptance("1x", "1x", 2e-6), receptance("1x", "1z", 4e-8, scatter), receptance("1z", "1z", 1e-7),
        receptance("1z", "1x", 5e-8), receptance("2z", "1x", 9e-6),
    ]  # fmt: skip
    found = crossed(measured, used("1x", 1.0)).set_index(["reference", "response"])
    assert len(found) == 2  # of the third blow no response along it was measured
    assert found.loc[("1x", "1z"), "share"] == pytest.approx(0.02)
    assert found.loc[("1x", "1z"), "noise"] == pytest.approx(0.005)
    assert found.loc[("1z", "1x"), "share"] == pytest.approx(0.5)
    assert np.isnan(found.loc[("1z", "1x"), "noise"])


def test_only_the_band_of_the_modes_counts():
    outside = np.where(FREQUENCY > 40.0, 100.0, 1.0)
    along, across = receptance("1x", "1x", 1e-6), receptance("1x", "1z", 1e-7 * outside)
    band = used("1x", 1.0)
    found = crossed([along, across], band[band["frequency_hz"] < 40.0])
    assert found["share"].iloc[0] == pytest.approx(0.1)
