"""The modes in the report: table, responses with their error, stabilisation diagram."""

import numpy as np
import pandas as pd
import synthetic_results as synthetic

from metro.report.content import Bullets, Picture, Table
from metro.report.figures import modal
from metro.report.sections.modes import largest_response, modes


def diagram():
    return pd.DataFrame(
        {
            "position": "1",
            "direction": "x",
            "order": [8, 10, 12, 8, 10, 12],
            "frequency_hz": [35.0, 35.1, 35.2, 50.0, 60.0, 70.0],
            "recurs": [True, True, True, False, False, False],
        }
    )


def used():
    frequency = np.linspace(20, 80, 50)
    rows = [
        pd.DataFrame(
            {"reference": "1x", "response": r, "frequency_hz": frequency, "measured_m_n": m, "modal_m_n": m}
        )
        for r, m in (("1x", 2e-6), ("2x", 3e-6), ("2y", 5e-6))
    ]
    return pd.concat(rows).assign(position="1", error=0.034)


def test_the_diagram_shows_every_pole_at_its_order_over_the_responses_of_its_direction():
    axes, behind = modal.stabilisation(diagram(), used()).axes
    drawn = {line.get_label(): line for line in axes.get_lines()}
    assert drawn["recurring pole"].get_xdata().tolist() == [35.0, 35.1, 35.2]
    assert drawn["other pole"].get_ydata().tolist() == [8, 10, 12]
    np.testing.assert_allclose(behind.get_lines()[0].get_ydata(), 5e-6)
    assert axes.get_xlabel() == "frequency (Hz)"


def test_each_response_names_what_the_modes_leave_of_it():
    titles = [axes.get_title(loc="left") for axes in modal.responses(used()).axes]
    assert "position 1: 1x → 1x (3.4 %)" in titles


def test_a_mode_that_is_not_resolved_is_marked():
    found = 2 * synthetic.identified()["modes"]
    marked = [{**found[0], "resolved": False}, *found[1:]]
    table = next(item for item in modes(marked, {}) if isinstance(item, Table))
    assert table.rows[0][0].endswith(" *")
    assert not table.rows[1][0].endswith(" *")
    assert "not resolved" in table.caption
    plain = next(item for item in modes(found, {}) if isinstance(item, Table))
    assert "not resolved" not in plain.caption


def test_what_a_test_leaves_in_doubt_is_said_under_its_modes():
    tables = {"mode_notes": pd.DataFrame({"note": ["position 1: hit 2 rejected: double hit"]})}
    (bullets,) = [
        item for item in modes(synthetic.identified()["modes"], tables) if isinstance(item, Bullets)
    ]
    assert bullets.items == ["Position 1: hit 2 rejected: double hit."]


def shapes():
    """Three modes at three points: the first two alike but for their size, the third against them."""
    values = {30.0: [1.0, 0.5, 0.2], 50.0: [2.0, 1.0, 0.4], 80.0: [1.0, -0.5, -0.2]}
    rows = [
        {"position": "1", "direction": "x", "frequency_hz": f, "resolved": f != 80.0, "reference": f"{i}x",
         "response": "1x", "real": v, "imag": 0.0}
        for f, shape in values.items()
        for i, v in enumerate(shape, start=1)
    ]  # fmt: skip
    pairs = [(a, b, 1.0 if a == b or {a, b} == {30.0, 50.0} else 0.5) for a in values for b in values]
    alike = pd.DataFrame(pairs, columns=["first_hz", "second_hz", "mac"]).assign(position="1", direction="x")
    return {"mode_shapes": pd.DataFrame(rows), "mode_mac": alike}


def test_shapes_are_drawn_to_their_largest_and_like_ones_are_counted():
    picture = next(
        item for item in modes(synthetic.identified()["modes"], shapes()) if isinstance(item, Picture)
    )
    assert "have 1 of 3 pairs of modes at the 3 points" in picture.caption
    panels = [axes for axes in picture.figure.axes if axes.get_title(loc="left")]
    drawn = [axes.get_lines()[1].get_ydata() for axes in panels]
    np.testing.assert_allclose(drawn, [[1.0, 0.5, 0.2], [1.0, 0.5, 0.2], [1.0, -0.5, -0.2]])
    assert [axes.get_title(loc="left") for axes in panels] == ["30.00 Hz", "50.00 Hz", "80.00 Hz *"]


def test_the_response_on_the_first_page_is_that_of_a_driving_point():
    frf = synthetic.responses()
    larger = frf.assign(reference="2x", real_m_n=9 * frf["real_m_n"], imag_m_n=9 * frf["imag_m_n"])
    (picture,) = largest_response({"frf_used": pd.concat([frf, larger])})
    assert "of a driving point" in picture.caption
    assert picture.figure.axes[0].get_title(loc="left").startswith("position 1: 1x → 1x")
    (other,) = largest_response({"frf_used": larger})
    assert "of a driving point" not in other.caption


def test_where_hits_rove_and_several_responses_are_read_a_shape_is_seen_from_one_of_them():
    both = shapes()
    other = both["mode_shapes"].assign(response="2x", real=9.0)
    both["mode_shapes"] = pd.concat([both["mode_shapes"], other])
    picture = next(item for item in modes(synthetic.identified()["modes"], both) if isinstance(item, Picture))
    assert "at the 3 points" in picture.caption
    (first, *_) = [axes for axes in picture.figure.axes if axes.get_title(loc="left")]
    np.testing.assert_allclose(first.get_lines()[1].get_ydata(), [1.0, 0.5, 0.2])


def test_two_points_make_no_shape():
    few = shapes()
    few["mode_shapes"] = few["mode_shapes"][few["mode_shapes"]["reference"] != "3x"]
    assert not [item for item in modes(synthetic.identified()["modes"], few) if isinstance(item, Picture)]


def test_the_section_has_the_diagram_where_the_batch_has_one():
    tables = synthetic.tables()
    without = [item for item in modes(synthetic.identified()["modes"], tables) if isinstance(item, Picture)]
    tables["stabilisation"] = diagram()
    pictures = [item for item in modes(synthetic.identified()["modes"], tables) if isinstance(item, Picture)]
    assert len(pictures) == len(without) + 1
