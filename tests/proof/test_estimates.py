"""Parameters against the truth: periods, cyclic shifts, intervals."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proof.estimates import estimates


def quantity(value, half):
    return {"value": value, "ci95": [value - half, value + half], "unit": ""}


def test_the_error_is_relative_and_the_interval_covers_or_does_not():
    near, far = (
        estimates("tool_wear", {"edge_growth_per_m": 0.1}, {"edge_growth_per_m": quantity(value, 0.01)}, 3)[0]
        for value in (0.105, 0.12)
    )
    assert near.error == pytest.approx(0.05)
    assert near.covered
    assert not far.covered


@pytest.mark.parametrize(
    ("doubt", "holds"), [(0.0, False), ({"edge_growth_per_m": 0.019}, True), (0.19, True), (0.15, False)]
)
def test_a_truth_that_has_another_form_is_known_to_its_own_error(doubt, holds):
    """0.02 off with an interval of 0.01: the errors add as independent ones do, √(0.01² + 0.0173²)."""
    truth, found = {"edge_growth_per_m": 0.1}, {"edge_growth_per_m": quantity(0.12, 0.01)}
    one = estimates("tool_wear", truth, found, 3, doubt)[0]
    assert one.covered is holds
    assert one.error == pytest.approx(0.2)


@given(teeth=st.integers(2, 6), turns=st.integers(-5, 5))
def test_the_angle_of_runout_is_known_up_to_the_pitch(teeth, turns):
    found = {"angle_deg": quantity(291.5 + turns * 360.0 / teeth, 1.0)}
    one = estimates("tool_runout", {"angle_deg": 291.0}, found, teeth)[0]
    assert one.error == pytest.approx(0.5)
    assert one.covered


def test_a_wrong_angle_of_runout_stays_wrong():
    one = estimates("tool_runout", {"angle_deg": 10.0}, {"angle_deg": quantity(60.0, 5.0)}, 4)[0]
    assert one.error == pytest.approx(-40.0)  # 60 is 40 short of 10 + 90
    assert not one.covered


def test_the_phase_of_the_orbit_is_not_known_up_to_the_pitch():
    one = estimates("orbit_stiffness", {"phase_deg": 350.0}, {"phase_deg": quantity(80.0, 5.0)}, 4)[0]
    assert one.error == pytest.approx(90.0)


@pytest.mark.parametrize("shift", range(4))
def test_pitch_errors_are_compared_in_the_cyclic_order_that_fits(shift):
    true = [0.5, -0.2, 0.1, -0.4]
    found = true[shift:] + true[:shift]
    result = estimates(
        "pitch_error", {"pitch_deg": true}, {"pitch_deg": [quantity(v, 0.01) for v in found]}, 4
    )
    assert [one.error for one in result] == pytest.approx([0.0] * 4)
    assert all(one.covered for one in result)


def test_pitch_errors_in_reverse_are_another_tool():
    true = [0.5, -0.2, 0.1, -0.4]
    found = [quantity(value, 0.01) for value in reversed(true)]
    assert not all(
        one.covered for one in estimates("pitch_error", {"pitch_deg": true}, {"pitch_deg": found}, 4)
    )


def test_axes_keep_their_order():
    found = {"slope_n_s": [quantity(value, 0.1) for value in (2.0, 1.0, 3.0)]}
    result = estimates("charge_drift", {"slope_n_s": [1.0, 2.0, 3.0]}, found, 3)
    assert [one.covered for one in result] == [False, False, True]


def test_an_interval_that_is_not_stated_counts_neither_way():
    found = {"exponent": {"value": 0.2, "ci95": [None, None], "unit": "1"}}
    assert estimates("chip_size_effect", {"exponent": 0.2}, found, 3)[0].covered is None


def test_another_form_of_an_effect_has_no_parameter_to_compare():
    found = {"time_constant_s": [quantity(1.0, 0.1)] * 3}
    assert estimates("charge_drift", {"slope_n_s": [1.0, 2.0, 3.0]}, found, 3) == []


def test_modes_that_are_turned_by_half_a_turn_are_where_they_were():
    found = {"angle_deg": quantity(-85.0, 5.0)}
    one = estimates("mode_coupling", {"angle_deg": 92.0}, found, 3)[0]
    assert one.error == pytest.approx(3.0)
    assert one.covered


def test_a_word_is_not_compared():
    found = {"axis": {"value": "x", "ci95": None, "unit": ""}, "damping": quantity(0.03, 0.01)}
    result = estimates("missing_mode", {"axis": "x", "damping": 0.03}, found, 3)
    assert [one.parameter for one in result] == ["damping"]


def test_entries_of_a_vector_are_off_relative_to_the_largest_of_them():
    true = {"about_x_mrad": -2.0, "about_y_mrad": 0.01}
    found = {"about_x_mrad": quantity(-2.2, 0.1), "about_y_mrad": quantity(0.11, 0.2)}
    x, y = estimates("spindle_tilt", true, found, 3)
    assert x.error == pytest.approx(-0.1)
    assert y.error == pytest.approx(0.05)
    assert not x.covered
    assert y.covered
