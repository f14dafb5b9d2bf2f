"""Figures show what is in the frame, name their units, and are the same for the same data."""

import numpy as np
import pandas as pd
import pytest
import synthetic_results as synthetic

from metro.report.figures import comparison, face_pairing, study, surface, verdicts
from metro.report.style import to_svg


def rows(observable):
    frame = synthetic.tables()["comparison"]
    return frame[frame["observable"] == observable].reset_index(drop=True)


def lines(axes):
    return {line.get_label(): line.get_ydata() for line in axes.get_lines()}


def test_overlay_draws_measured_and_both_predictions_with_units():
    frame = rows("deformation")
    figure = comparison.overlay(frame, "deformation")
    axes = figure.axes[0]
    drawn = lines(axes)
    assert np.allclose(drawn["measured"], frame["measured"])
    assert np.allclose(drawn["base model"], frame["before"])
    assert np.allclose(drawn["with effects found"], frame["after"])
    assert figure.get_supylabel() == "deformation (mm)"
    assert axes.get_xlabel().endswith("(mm)")


def test_overlay_of_force_has_a_panel_per_run_and_axis_and_one_revolution_in_each():
    figure = comparison.overlay(rows("force"), "force")
    assert len(figure.axes) == 6
    assert all(lines(axes)["measured"].size == 120 for axes in figure.axes)


def test_an_observable_that_is_alone_is_drawn_for_more_runs():
    frame = rows("force")
    runs = [frame[frame["run"] == frame["run"].iloc[0]].assign(run=f"r{i}") for i in range(8)]
    many = pd.concat(runs, ignore_index=True)
    drawn = [len(comparison.overlay(many, "force", alone=alone).axes) // 3 for alone in (False, True)]
    assert drawn == [3, 6]


def test_a_line_is_broken_where_nothing_was_measured():
    frame = rows("deformation")
    gap = frame[(frame["s_mm"] < 20) | (frame["s_mm"] > 30)]
    axes = comparison.overlay(gap, "deformation").axes[0]
    for name, column in (("measured", "measured"), ("base model", "before")):
        drawn = lines(axes)[name]
        assert np.flatnonzero(np.isnan(drawn)).tolist() == [20]
        assert np.allclose(np.delete(drawn, 20), gap[column])


def test_what_is_left_is_drawn_as_a_share_of_the_signal_and_full_where_it_counts():
    left = [
        {"axis": "z", "label": "all", "amplitude": 0.43, "relative": 0.0, "significant": False},
        {"axis": "z", "label": "pass 2", "amplitude": 0.01, "relative": 0.05, "significant": True},
    ]
    axes = verdicts.signature(left).axes[0]
    bars = [(bar.get_width(), bar.get_facecolor()[:3] == (1, 1, 1)) for bar in axes.patches[1:]]
    assert bars == [(0.0, True), (5.0, False)]
    assert [t.get_text() for t in axes.get_yticklabels()] == ["throughout", "pass 2"]
    assert axes.get_xlim()[1] > 5.0


def test_axes_of_what_is_left_are_told_apart_in_grey_print():
    left = [
        {"axis": axis, "label": label, "amplitude": 1.0, "relative": 0.02, "significant": False}
        for axis in "xyz"
        for label in ("all", "order 1")
    ]
    bars = verdicts.signature(left).axes[0].patches
    of_axis = [{bar.get_hatch() for bar in bars[3 * k : 3 * k + 3]} for k in range(3)]
    assert [len(hatches) for hatches in of_axis] == [1, 1, 1]  # that of the legend and of each bar
    assert len(set().union(*of_axis)) == 3


def test_residual_and_parity_of_one_axis_stand_in_one_figure():
    frame = rows("deformation")
    left, middle, right = comparison.judged(frame, "deformation").axes
    assert np.allclose(lines(left)["base model"], frame["measured"] - frame["before"])
    assert np.allclose(sorted(middle.collections[0].get_offsets()[:, 1]), sorted(frame["before"]))
    assert right.get_xlabel() == "measured − predicted (mm)"


def test_rows_without_coordinates_are_drawn_by_their_place_in_the_table():
    frame = rows("deformation").assign(s_mm=np.nan)
    assert comparison.coordinate(frame) == ""
    axes = comparison.overlay(frame, "deformation").axes[0]
    assert axes.get_xlabel() == "place in the table"


def test_residual_bands_hold_the_median_of_every_bin():
    axes = comparison.residuals(rows("deformation"), "deformation").axes[0]
    frame = rows("deformation")
    assert np.allclose(lines(axes)["base model"], frame["measured"] - frame["before"])


def test_changes_show_the_errors_they_are_given():
    change = verdicts.Change("force", 8.3, 1.5, (8.0, 8.6), None, 1.2)
    axes = verdicts.changes([change], "error (%)").axes[0]
    marks = sorted(float(c.get_offsets()[0][0]) for c in axes.collections)
    assert marks == [1.5, 8.3]
    assert [t.get_text() for t in axes.get_yticklabels()] == ["force"]


def test_the_same_data_give_the_same_bytes():
    first, second = (to_svg(comparison.parity(rows("force"), "force")) for _ in range(2))
    assert first == second
    assert b"<dc:date>" not in first


def test_maps_have_a_colour_scale_symmetric_about_zero():
    figure = surface.face_maps(synthetic.tables()["face_map"])
    low, high = figure.axes[0].collections[0].get_clim()
    assert low == -high


def test_a_groove_in_a_face_does_not_set_the_scale_and_its_depth_is_written_at_its_place():
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(20.0), np.arange(20.0)))
    flat = pd.DataFrame({"run": "a", "x_mm": x, "y_mm": y, "deviation_um": 5.0 * np.cos(x / 4)})
    grooved = flat.assign(run="b", deviation_um=flat["deviation_um"].where(x > 0, -200.0))
    figure = surface.face_maps(pd.concat([flat, flat.assign(run="c"), grooved]))
    (_, high), grooved_axes = figure.axes[0].collections[0].get_clim(), figure.axes[2]
    assert high <= 5.0
    assert grooved_axes.get_title(loc="left") == "b"
    groove = next(text for text in grooved_axes.texts if text.get_text() == "−200")
    assert groove.xy[0] == 0.0
    assert "+4.8" in {text.get_text() for text in grooved_axes.texts}


def test_deviations_at_points_of_the_path_are_drawn_in_micrometres():
    figure = surface.face_points(synthetic.face_rows())
    measured = figure.axes[0].collections[0].get_array()
    assert np.ptp(measured) == pytest.approx(1e3 * np.ptp(synthetic.face_rows()["measured"]))


def test_the_parity_of_faces_bears_the_unit_of_the_comparison():
    columns = ("measured", "before", "after", "similar_before", "similar_after")
    faces = pd.DataFrame({"run": ["r1", "r2"], **dict.fromkeys(columns, (0.1, 0.2))})
    left = face_pairing.parity(faces, "mm").axes[0]
    assert (left.get_xlabel(), left.get_ylabel()) == ("X_m measured (mm)", "predicted (mm)")


def drawn(figure):
    """Draw a figure, so that its layout is made; return what measures its texts."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas.get_renderer()


@pytest.mark.parametrize("name", ["r{}", "table 6, {}-66"])
def test_long_names_of_runs_leave_the_residuals_their_room(name):
    """The names had left a sixth of an inch of the axis, and its title was longer than the figure."""
    blocks = [
        {"run": name.format(56 + i), "role": "identify", "order": i, "rms_before": 0.03 + 0.01 * i}
        for i in range(3)
    ]
    figure = verdicts.runs(blocks, "mm", 0.035)
    renderer = drawn(figure)
    axes = figure.axes[0]
    assert axes.get_window_extent(renderer).height > 0.6 * figure.dpi
    label = axes.yaxis.label.get_window_extent(renderer)
    assert label.y0 >= 0.0
    assert label.y1 <= figure.bbox.height


def test_the_title_of_the_axis_of_patterns_is_not_cut_off():
    entries = [
        {"axis": "z", "label": f"pass {i} differs from the others", "relative": 0.01} for i in range(8)
    ]
    figure = verdicts.signature(entries)
    renderer = drawn(figure)
    assert figure.axes[0].xaxis.label.get_window_extent(renderer).x1 <= figure.bbox.width


def test_the_legends_of_interactions_lie_on_no_point():
    levels = [{"wrist": w, "depth": d, "side": o} for w in "AB" for d in "123" for o in "LT"]
    ranking = [{"levels": one, "xm": {"value": 60.0 + 9 * i}} for i, one in enumerate(levels)]
    figure = study.interactions(ranking)
    renderer = drawn(figure)
    for axes in figure.axes:
        legend = axes.get_legend().get_window_extent(renderer)
        assert legend.y0 >= axes.get_window_extent(renderer).y1 - 1.0
        assert legend.y1 <= figure.bbox.height + 1.0


def test_the_numbers_of_the_extremes_of_a_face_lie_apart():
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(0, 200, 5.0), np.arange(0, 100, 5.0)))
    height = np.zeros(x.size)
    height[np.flatnonzero((x == 150) & (y == 50))] = 46.0
    height[np.flatnonzero((x == 155) & (y == 45))] = -139.0
    frame = pd.DataFrame({"run": "r1", "x_mm": x, "y_mm": y, "deviation_um": height})
    figure = surface.face_maps(pd.concat([frame.assign(run=f"r{i}") for i in range(8)]))
    renderer = drawn(figure)
    high, low = (text.get_window_extent(renderer) for text in figure.axes[0].texts)
    assert min(high.y1, low.y1) <= max(high.y0, low.y0) + 1.0
