"""Gains between printed values, against closed forms and tables whose answer can be worked out by hand."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from metro.report.content import Bullets, Picture, Table
from metro.report.sections.printed_bias import bias


def pairs(measured, predicted, quantity="mean force", axis="z", unit="N"):
    return pd.DataFrame(
        {"quantity": quantity, "axis": axis, "measured": measured, "predicted": predicted, "unit": unit}
    )


def told(table):
    shown, _, said = bias("7", table)
    assert isinstance(shown, Table)
    assert isinstance(said, Bullets)
    return shown.rows, " ".join(said.items)


def test_the_axial_force_of_the_kr160_table_is_a_gain_and_the_cross_force_is_none():
    z = pairs([-18.21, -34.71, -51.65], [-33.89, -54.66, -89.23])
    x = pairs([45.96, 78.125, 150.75], [56.21, 102.71, 127.13], axis="x")
    rows, text = told(pd.concat([x, z]))
    assert "mean force z: measured is 0.58 ± 0.12 times" in text
    assert "mean force x: no gain is shown" in text
    logs = np.log(np.array([18.21, 34.71, 51.65]) / np.array([33.89, 54.66, 89.23]))
    t = logs.mean() / (logs.std(ddof=1) / np.sqrt(3))
    assert float(rows[1][3]) == pytest.approx(2.0 * 2.0 * stats.t.sf(abs(t), 2), abs=5e-4)  # twice, by Holm


def test_rows_that_agree_on_the_mean_show_no_gain():
    _, text = told(pairs([1.1, 0.9, 1.05, 0.95], [1.0, 1.0, 1.0, 1.0]))
    assert "measured is" not in text


def test_the_slope_of_values_of_either_sign_covers_the_truth_and_an_offset_is_no_gain():
    rng = np.random.default_rng(1)
    predicted = rng.normal(0.0, 0.1, 25)
    alike = pairs(0.05 + predicted + rng.normal(0.0, 0.02, 25), predicted)
    more = pairs(0.05 + 1.5 * predicted + rng.normal(0.0, 0.02, 25), predicted)
    assert "no gain is shown" in told(alike)[1]
    rows, text = told(more)
    assert "measured is 1." in text
    value, half = (float(part) for part in rows[0][2].split(" ± "))
    assert value - half < 1.5 < value + half
    assert value == pytest.approx(np.polyfit(predicted, more["measured"], 1)[0], abs=0.01)


def test_the_figure_has_the_pairs_the_line_of_equals_and_that_of_the_gain():
    rng = np.random.default_rng(2)
    predicted = rng.normal(0.0, 0.1, 25)
    line = pairs(0.05 + 1.5 * predicted + rng.normal(0.0, 0.01, 25), predicted, "deviation", "", "mm")
    ratio = pairs([-1.0, -2.1, -2.9], [-2.0, -4.0, -6.0])
    _, picture, _ = bias("6", pd.concat([line, ratio]))
    assert isinstance(picture, Picture)
    assert "A gain is shown of deviation and mean force z (2 of 2)" in picture.caption
    first, second, unused = picture.figure.axes
    assert not unused.get_visible()
    for axes, told in ((first, line), (second, ratio)):
        equal, gain, points = axes.lines
        assert np.array_equal(equal.get_xdata(), equal.get_ydata())
        assert np.array_equal(points.get_xdata(), told["predicted"])
        assert np.array_equal(points.get_ydata(), told["measured"])
        low, high = axes.collections[0].get_datalim(axes.transData).intervaly
        assert low < np.interp(0.0, *gain.get_data()) < high
    slope, offset = np.polyfit(predicted, line["measured"], 1)
    x, y = first.lines[1].get_data()
    assert np.polyfit(x, y, 1) == pytest.approx([slope, offset])
    x, y = second.lines[1].get_data()
    assert y / x == pytest.approx(np.full(2, np.exp(np.mean(np.log(ratio["measured"] / ratio["predicted"])))))


def test_of_two_pairs_or_of_values_of_either_sign_nothing_is_told():
    assert bias("7", pairs([1.0, 2.0], [1.1, 2.1])) == []
    assert bias("7", pairs([1.0, 2.0, -3.0], [1.1, 2.1, 3.0])) == []
