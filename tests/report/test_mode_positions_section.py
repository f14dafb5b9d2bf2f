"""Modes over positions and reconstruction by distance in the report."""

import numpy as np
import pandas as pd

from metro.report.content import Bullets, Picture, Table
from metro.report.sections.mode_positions import over_positions, reconstruction
from metro.report.style import to_svg


def tracked():
    rows = []
    for position, factor in (("1", 1.0), ("2", 1.1), ("3", 0.99)):
        for mode, frequency in (("x1", 20.0), ("x2", 50.0)):
            stiffness = 4e6 * (factor if mode == "x2" else 1.0)
            rows.append((position, "x", mode, frequency * factor, 0.05, stiffness))
    modes = pd.DataFrame(
        rows, columns=["position", "direction", "mode", "frequency_hz", "damping", "stiffness_n_m"]
    )
    modes = modes.assign(frequency_sd_hz=0.01, damping_sd=0.001, stiffness_sd=1e4)
    tracks = modes[["position", "direction", "mode", "frequency_hz"]].assign(compared_with="1", mac=0.98)
    tracks.loc[tracks["position"] == "1", "mac"] = np.nan
    return {"modes": modes, "mode_tracks": tracks}


def test_each_mode_has_its_range_over_the_positions_and_its_least_likeness():
    _, table, picture = over_positions(tracked())
    assert table.rows[1] == ["x2", "3 of 3", "49.5 … 55.0", "5.00 … 5.00", "3.96 … 4.40", "0.980"]
    assert "frequency by up to 11 % (x1; 2 of 2 modes)" in picture.caption
    assert "damping by up to 0 % (x1; 0 of 2 modes)" in picture.caption
    assert "stiffness by up to 11 % (x2; 1 of 2 modes)" in picture.caption


def test_the_change_of_each_mode_is_drawn_from_its_mean():
    figure = over_positions(tracked())[-1].figure
    first = np.asarray(figure.axes[0].containers[0].lines[0].get_ydata(), dtype=float)
    mean = np.mean([1.0, 1.1, 0.99])
    np.testing.assert_allclose(first, 100 * (np.array([1.0, 1.1, 0.99]) / mean - 1))
    assert to_svg(figure)


def test_one_position_has_nothing_to_compare():
    one = {name: table[table["position"] == "1"] for name, table in tracked().items()}
    assert over_positions(one) == []


def pickups():
    table = pd.DataFrame(
        {"direction": ["x", "x", "x", "z"], "reference": "1", "response": list("1231"),
         "distance_mm": [0.0, 900.0, 1700.0, 0.0], "error": [0.03, 0.06, 0.25, 0.05],
         "noise": [0.02, 0.05, 0.2, 0.03], "level": [1.0, 0.2, 0.05, 1.0]}
    )  # fmt: skip
    return table.assign(position="1")


def test_errors_are_tabulated_and_drawn_by_distance():
    table, picture = reconstruction({"mode_pickups": pickups()})
    assert isinstance(table, Table)
    assert isinstance(picture, Picture)
    assert table.rows[0] == ["0", "2", "100", "3.0 … 4.0 … 5.0", "2.0 … 2.5 … 3.0"]
    assert table.rows[2] == ["1700", "1", "5.0", "25", "20"]
    said = "the error of the modes is 3.0 % to 5.0 % of a response, at 1700 mm 25 % in the median"
    assert said in picture.caption
    drawn = picture.figure.axes[0].get_lines()[0]
    np.testing.assert_allclose(drawn.get_xydata(), [[0, 3], [900, 6], [1700, 25]])
    assert to_svg(picture.figure)


def test_without_distances_there_is_no_such_table():
    assert reconstruction({"mode_pickups": pickups().assign(distance_mm=np.nan)}) == []


def test_responses_across_are_said_beside_those_along():
    cross = pd.DataFrame({"share": [0.022, 0.03], "noise": 0.001})
    [said] = reconstruction({"mode_cross": cross})
    assert isinstance(said, Bullets)
    assert "is 2.2 % to 3.0 % of that along it, over 2 pairs" in said.items[0]
