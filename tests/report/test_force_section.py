"""Figures of merit of the force, an orbit of a helical cut, and failed checks, in the report."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import synthetic_results as synthetic

from metro.observables.force.metrics import metrics, order_spectrum
from metro.report.content import Facts, Picture, Table
from metro.report.figures import force as figures
from metro.report.sections.force import force_items, mean_items
from metro.report.sections.quality import quality
from metro.report.sections.summary import summary
from metro.report.sections.verdict import error_text

TEETH = 4


@pytest.fixture(scope="module")
def tables():
    rows = synthetic.tables()["comparison"].query("observable == 'force'")
    return {"force_metrics": metrics(rows, TEETH), "force_orders": order_spectrum(rows)}


def test_the_table_has_a_row_per_run_and_axis_and_the_base_model_in_grey(tables):
    table = force_items(replace(synthetic.results(), tables=tables))[0]
    assert isinstance(table, Table)
    assert [row[:2] for row in table.rows] == [[run, axis] for run in ("r07", "r08") for axis in "xyz"]
    assert [table.header[i] for i in table.faint] == ["before"] * 4
    merit = tables["force_metrics"].query("run == 'r07' and axis == 'x' and metric == 'nrmse'")
    before = float(merit.query("model == 'before'")["value"].iloc[0])
    assert float(table.rows[0][table.faint[0]]) == pytest.approx(before, rel=5e-3)


def test_where_nothing_was_added_there_is_no_second_column(tables):
    same = synthetic.tables()["comparison"].query("observable == 'force'").assign(after=lambda f: f["before"])
    both = {"force_metrics": metrics(same, TEETH), "force_orders": order_spectrum(same)}
    table = force_items(replace(synthetic.results(), tables=both))[0]
    assert not table.faint
    assert len(table.header) == 6


def mean_table():
    cuts = [("slot", "slot", 12.0, 100.0), ("side", "up", 4.0, 60.0)]
    rows = [
        {"run": f"r{i}{j}", "axis": axis, "role": "validate" if j == 2 else "identify",
         "operation": operation, "direction": direction, "radial_depth_mm": width,
         "axial_depth_mm": 2.0, "spindle_rpm": 6000.0,
         "feed_per_tooth_mm": feed, "fitted_n": per_mm * feed + 10.0, "measured_n": per_mm * feed + 10.0}
        for i, (operation, direction, width, per_mm) in enumerate(cuts)
        for j, feed in enumerate((0.05, 0.1, 0.15))
        for axis in "xyz"
    ]  # fmt: skip
    table = pd.DataFrame(rows)
    off = (table["run"] == "r02") & (table["axis"] == "y")
    return table.assign(measured_n=table["measured_n"] + 3.0 * off)


def test_mean_forces_stand_on_the_lines_of_their_cuts_and_the_one_missed_most_is_named():
    (picture,) = mean_items(mean_table())
    assert "most in r02 along y, by 3.00 N" in picture.caption
    panel = picture.figure.axes[0]
    legend = [text.get_text() for text in picture.figure.legends[0].get_texts()]
    assert legend == ["slot, 12 mm wide", "up, 4 mm wide"]
    line, filled, held = panel.get_lines()[:3]
    np.testing.assert_allclose(line.get_ydata(), [15.0, 20.0, 25.0])
    assert len(filled.get_xdata()) == 2
    assert (held.get_xdata().tolist(), held.get_markerfacecolor()) == ([0.15], "none")


def test_of_one_feed_there_is_no_line_to_draw():
    assert mean_items(mean_table().query("feed_per_tooth_mm == 0.1")) == []
    assert mean_items(None) == []


def test_a_batch_without_measured_forces_has_no_figures_of_merit():
    assert force_items(replace(synthetic.results(), tables={})) == []


def test_spectrum_and_peaks_have_a_panel_per_axis_and_tell_what_they_show(tables):
    items = force_items(replace(synthetic.results(), tables=tables))[1:]
    assert all(isinstance(item, Picture) for item in items)
    assert [len(item.figure.axes) for item in items] == [3, 3]
    assert "every 4 orders" in items[0].caption


def test_bars_are_as_high_as_the_measured_peaks(tables):
    peaks = tables["force_metrics"].query("metric == 'tooth_peak'")
    axes = figures.tooth_peaks(peaks).axes[0]
    heights = sorted(patch.get_height() for patch in axes.patches)
    assert heights == pytest.approx(sorted(peaks.query("axis == 'x' and model == 'after'")["measured"]))


def test_an_orbit_is_drawn_as_the_span_of_its_revolutions():
    time = np.arange(0, 1.0, 0.03 / 120)
    force = 5.0 + np.cos(2 * np.pi * time / 0.03)
    frame = pd.DataFrame({"t_s": time, "fx_n": force, "fy_n": force, "fz_n": force})
    axes = figures.orbit(frame, 2000.0).axes[0]
    span = axes.collections[0].get_datalim(axes.transData)
    assert (span.y0, span.y1) == pytest.approx((4.0, 6.0), abs=0.01)
    assert axes.get_lines()[0].get_ydata() == pytest.approx(5.0)


def test_failures_of_one_kind_share_a_row_with_the_list_of_their_runs():
    qc = pd.DataFrame(
        [
            {"file": f"r{i}.csv", "run": f"r{i}", "check": "gaps", "value": float(i), "limit": 0.0,
             "ok": False, "message": f"{i} samples missing"}
            for i in range(1, 6)
        ]
    )  # fmt: skip
    items = quality(replace(synthetic.results(), tables={"qc": qc})).items
    failures = items[1]
    assert len(failures.rows) == 1
    assert failures.rows[0] == [
        "gaps", "1.00 … 5.00", "0", "1 samples missing (and 4 more alike)", "r1, r2, r3, r4 and r5",
    ]  # fmt: skip


def test_the_error_of_one_held_out_condition_stands_alone_and_the_first_page_says_why():
    point = {"rms": 21.4, "nrmse": 0.1, "ci95": [21.4, 21.4]}
    assert error_text(point, "N") == "21.4 N"
    runs = synthetic.batch().runs.assign(condition="the same")
    results = replace(synthetic.results(), batch=replace(synthetic.batch(), runs=runs))
    assert results.verdicts()["force"]["before"]["ci95"] is None
    assert synthetic.results().verdicts()["force"]["before"]["ci95"] is not None
    only = {"observables": {"force": synthetic.results().verdict["observables"]["force"]}}
    for told, said in ((results, True), (synthetic.results(), False)):
        facts = [i for i in summary(replace(told, verdict=only)).items if isinstance(i, Facts)]
        assert ("one condition: no interval" in facts[0].items[1][2]) is said
