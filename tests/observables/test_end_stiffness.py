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
    found = end_stiffness(lambda _name: stations(1.25))
    told, errors = found["end_stations"].set_index("position"), found["end_errors"].set_index("entry")
    assert told.loc["2", "error_y_percent"] == pytest.approx(-20.0, abs=1e-6)
    rms = np.sqrt((told["error_y_percent"] ** 2).mean())
    assert errors.loc["ky", "rms_percent"] == pytest.approx(rms)
    assert errors.loc["ky", "rms_low_percent"] < rms < errors.loc["ky", "rms_high_percent"]


def dome(count=73, turn=0.0):
    """Stations of a machine that is stiffest at (20, 10, -30) mm, its axes turned about z everywhere."""
    rng = np.random.default_rng(8)
    places = rng.uniform(-1.0, 1.0, (count, 3)) * (400.0, 200.0, 300.0)
    peak = (
        np.array([2.0, 30.0, 9.0])
        * np.exp(-(((places - (20, 10, -30)) / (400, 200, 300)) ** 2).sum(axis=1) / 4)[:, None]
    )
    c, s = np.cos(turn), np.sin(turn)
    table = pd.DataFrame(places, columns=["x_mm", "y_mm", "z_mm"])
    table["kx_n_um"], table["ky_n_um"] = (
        peak.T[0] * c**2 + peak.T[1] * s**2,
        peak.T[0] * s**2 + peak.T[1] * c**2,
    )
    table["kz_n_um"], table["kxy_n_um"] = peak[:, 2], (peak[:, 0] - peak[:, 1]) * s * c
    return table.assign(position=[str(i) for i in range(count)])


def test_the_best_region_is_about_the_summit_and_the_dominating_direction_is_named():
    [region] = end_stiffness(lambda _name: dome())["end_region"].to_dict("records")
    assert region["softest_n_um"] == pytest.approx(2.0, rel=0.02)
    for axis, summit, half in zip("xyz", (20, 10, -30), (400, 200, 300), strict=True):
        assert abs(region[f"{axis}_mm"] - summit) < 0.15 * half
        assert region[f"{axis}_low_mm"] < summit < region[f"{axis}_high_mm"]
        assert region[f"inner_k{axis}_n_um"] > region[f"outer_k{axis}_n_um"]
    assert (region["stiffest"], region["stiffest_count"]) == ("y", 73)
    assert (region["ratio_low"], region["ratio_high"]) == pytest.approx((30 / 9, 30 / 9))


def test_stiffness_across_the_axes_is_interpolated_with_the_rest():
    found = end_stiffness(lambda _name: dome(turn=0.1))
    across = found["end_errors"].set_index("entry").loc["kxy"]
    assert across["least_n_um"] == pytest.approx(-28.0 * np.sin(0.1) * np.cos(0.1), rel=0.1)
    assert across["rms_percent"] < 2.0
    # the same machine, seen in its own axes: the softest direction is as stiff
    own = end_stiffness(lambda _name: dome())["end_region"]
    np.testing.assert_allclose(found["end_region"]["softest_n_um"], own["softest_n_um"], rtol=1e-9)


def test_slices_are_where_the_stations_are_and_kriging_is_surest_there():
    table = dome().assign(y_mm=np.repeat([-200.0, 0.0, 200.0], [25, 24, 24]))
    surface = end_stiffness(lambda _name: table)["end_surface"]
    assert list(surface["level_mm"].unique()) == [-200.0, 0.0, 200.0]
    assert set(surface["third"]) == {"y"}
    near = [
        np.hypot(*(surface.loc[i, ["x_mm", "z_mm"]].to_numpy(float) - other).T).min() < 30.0
        for i, other in (
            (i, table.loc[table["y_mm"] == level, ["x_mm", "z_mm"]].to_numpy())
            for i, level in surface["level_mm"].items()
        )
    ]
    known = surface["sd_percent"].notna().to_numpy()
    near = np.array(near)
    assert surface["sd_percent"][near & known].median() < 0.7 * surface["sd_percent"][~near & known].median()


@pytest.mark.parametrize("table", [pd.DataFrame(), stations().drop(columns="kx_n_um"), stations()[:2]])
def test_too_little_is_nothing(table):
    assert end_stiffness(lambda _name: table) == {}
