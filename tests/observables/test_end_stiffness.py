"""Stations of a tabulated machine for the report, on stiffness that is known everywhere."""

import numpy as np
import pandas as pd
import pytest

from metro.observables.arm.end_stiffness import STIFFNESS, end_stiffness

PLACES = np.array([[0, 0, 0], [0, 0, -320], [0, 200, -320], [-200, 0, -320], [-400, 0, -320], [-200, 0, 50]])
GRADIENT = 1e-3 * np.array([[0.4, 0.1, 0.0], [0.0, -0.6, 0.2], [0.5, 0.0, 0.8]])


def truth(places):
    return np.array([0.9, 30.0, 9.0]) * np.exp(places @ GRADIENT)


def stations(factor=1.0):
    table = pd.DataFrame(PLACES.astype(float), columns=["x_mm", "y_mm", "z_mm"])
    table[STIFFNESS] = truth(PLACES) * np.where(np.arange(6) == 1, factor, 1.0)[:, None]
    return table.assign(position=[str(i) for i in range(1, 7)])


def test_the_surface_is_the_truth_between_stations_that_carry_it():
    found = end_stiffness(lambda _name: stations())
    surface = found["end_surface"].dropna()
    assert set(surface["first"] + surface["second"]) == {"xz"}
    places = surface[["x_mm", "y_mm", "z_mm"]].to_numpy()
    np.testing.assert_allclose(surface[STIFFNESS], truth(places), rtol=1e-6)
    assert len(surface) > 100


def test_a_station_that_is_off_is_told_so_by_the_others():
    told = end_stiffness(lambda _name: stations(1.25))["end_stations"].set_index("position")
    assert told.loc["2", "error_y_percent"] == pytest.approx(-20.0, abs=1e-6)
    rms = np.sqrt((told["error_y_percent"] ** 2).mean())
    np.testing.assert_allclose(told["rms_y_percent"], rms)
    assert (told["rms_y_low_percent"] < rms).all()
    assert (told["rms_y_high_percent"] > rms).all()


@pytest.mark.parametrize("table", [pd.DataFrame(), stations().drop(columns="kx_n_um"), stations()[:2]])
def test_too_little_is_nothing(table):
    assert end_stiffness(lambda _name: table) == {}
