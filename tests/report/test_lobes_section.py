"""Stability in the report: what the charts hold, and what is said of the methods."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import synthetic_results as synthetic

from metro.report.content import Bullets, Picture, Table
from metro.report.figures import lobes as figures
from metro.report.sections import lobes
from metro.report.style import to_svg

TESTS = pd.DataFrame(
    {"position": ["1", "1"], "rpm": [2000.0, 3000.0], "depth_mm": [1.5, 0.5], "measured": [1.0, 0.0]}
)
STATIONS = pd.DataFrame(
    {"position": ["1", "2"], "x_mm": 0.0, "y_mm": 0.0, "z_mm": [0.0, -320.0], "lowest_mm": [1.0, 1.2],
     "lowest_from_others_mm": [1.2, np.nan], "depth_error_percent": [18.2, np.nan]}
)  # fmt: skip


def labels(axes):
    return axes.get_legend_handles_labels()[1]


def test_a_chart_of_lobes_marks_chatter_and_stable_cuts_apart():
    axes = figures.lobes_chart(synthetic.boundary(), TESTS).axes[0]
    points = {
        c.get_label(): c.get_offsets().tolist()
        for c in axes.collections
        if c.get_label() in {"stable cut", "chatter"}
    }
    assert points == {"stable cut": [[3000.0, 0.5]], "chatter": [[2000.0, 1.5]]}


def test_both_bands_flips_and_islands_are_in_the_legend():
    axes = figures.lobes_chart(synthetic.boundary(), TESTS, synthetic.islands()).axes[0]
    expected = {"95 %, with model error", "5–95 %, modes and forces", "boundary", "flip", "stable island"}
    assert expected <= set(labels(axes))


def test_flips_are_drawn_where_the_boundary_is_one():
    axes = figures.lobes_chart(synthetic.boundary(), TESTS).axes[0]
    flip = next(line for line in axes.get_lines() if line.get_label() == "flip")
    drawn = flip.get_xdata()[np.isfinite(flip.get_ydata())]
    assert drawn.min() > 3000


def test_without_a_flip_there_is_none_in_the_legend():
    plain = synthetic.boundary().assign(kind="hopf")
    assert "flip" not in labels(figures.lobes_chart(plain, TESTS).axes[0])


def test_every_method_is_drawn():
    axes = figures.methods_chart(synthetic.methods()).axes[0]
    drawn = {line.get_label(): line.get_ydata() for line in axes.get_lines()}
    for column, label, *_ in figures.METHODS:
        np.testing.assert_allclose(drawn[label], synthetic.methods()[column])


def test_the_governing_mode_changes_colour_where_it_changes():
    axes = figures.governing_modes(synthetic.methods()).axes[0]
    colours = {patch.get_facecolor() for patch in axes.patches}
    assert len(colours) == 2
    low = [p.get_facecolor() for p in axes.patches if p.get_x() + p.get_width() < 1990]
    assert len(set(low)) == 1


def test_positions_share_a_panel_and_interpolated_ones_are_dashed():
    both = pd.concat([synthetic.boundary(), synthetic.boundary().assign(position="2", interpolated=True)])
    lines = figures.positions_chart(both).axes[0].get_lines()
    assert [line.get_linestyle() for line in lines] == ["-", "--"]


def test_each_of_many_positions_has_a_colour_of_its_own():
    many = pd.concat([synthetic.boundary().assign(position=str(i)) for i in range(12)])
    lines = figures.positions_chart(many).axes[0].get_lines()
    assert len({line.get_color() for line in lines}) == 12


def test_the_words_give_the_differences_between_methods():
    told = " ".join(lobes.agreement(synthetic.methods(), synthetic.boundary()))
    assert "Two resolutions of the default method differ by at most 0.010 %" in told
    assert "Semi-discretisation, which shares no step with it, differs by 0.020 to 0.020 %" in told
    assert "declared runout the boundary differs by 3.0 to 3.0 %" in told
    assert "CDSEM differs from the exact boundary of single modes by 1.0 to 1.0 %" in told
    assert "all modes together by −10 to −10 %" in told


def test_no_difference_is_told_as_none():
    same = synthetic.methods().assign(tool_mm=lambda table: table["depth_mm"] * (1 + 1e-9))
    assert any("differs by less than 0.001 %" in words for words in lobes.agreement(same, None))


def test_speeds_without_a_boundary_are_counted():
    gaps = synthetic.methods()
    gaps.loc[gaps.index[:3], "tool_mm"] = np.nan
    assert any("At 3 speeds" in words for words in lobes.agreement(gaps, None))


def test_the_section_has_methods_and_governing_modes():
    items = lobes.boundaries(synthetic.results())
    assert [type(item) for item in items[1:]] == [Table, Picture, Bullets, Picture]
    assert "x4" in items[-1].alt


def test_several_positions_are_compared():
    tables = synthetic.tables()
    both = pd.concat([tables["lobes_final"], tables["lobes_final"].assign(position="2")])
    made = replace(synthetic.results(), tables={**tables, "lobes_final": both, "lobe_stations": STATIONS})
    items = lobes.boundaries(made)
    chart, limits, stations = items[-3:]
    assert isinstance(chart, Picture)
    assert limits.rows[0][0] == "1000"
    assert limits.rows[0][1] == limits.rows[0][2]
    assert limits.rows[0][3] == "1.0"
    assert stations.rows == [["1", "0", "0", "0", "1.00", "1.20", "18.2"]]
    assert "Position 2: too far" in stations.caption


def test_limits_are_at_the_speeds_of_the_runs_with_the_best_and_the_worst_position():
    tables = synthetic.tables()
    own = tables["lobes_final"]
    deeper = own.assign(position="2", depth_mm=own["depth_mm"] * np.where(own["rpm"] < 2500, 1.5, 0.25))
    made = synthetic.results()
    made = replace(made, tables={**tables, "lobes_final": pd.concat([own, deeper])})
    [limits] = [
        item
        for item in lobes.boundaries(made)
        if isinstance(item, Table) and "by speed and position" in item.caption
    ]
    ratios = {float(row[0]): row[3:] for row in limits.rows}
    assert set(np.sign(np.array(list(ratios)) - 2500)) == {-1, 1}
    assert all(said == (["1.5", "2 / 1"] if rpm < 2500 else ["4.0", "1 / 2"]) for rpm, said in ratios.items())
    assert "times the least" in limits.caption


def test_the_course_of_the_governing_mode_over_the_speed_is_said_of_each_position():
    one = synthetic.methods()
    falling = one.assign(position="2", governing_mode=np.where(one["rpm"] < 2500, "x4", "x2"))
    rising = one.assign(governing_mode=np.where(one["rpm"] < 2500, "x2", "y4"))
    words = lobes._governing_words(pd.concat([rising, falling]))
    assert "its number rises with the speed at position 1 and it falls again at position 2" in words


def test_without_a_boundary_there_is_nothing():
    assert lobes.boundaries(replace(synthetic.results(), identified={})) == []


@pytest.mark.parametrize("draw", [figures.methods_chart, figures.governing_modes])
def test_the_same_table_gives_the_same_bytes(draw):
    first, second = (to_svg(draw(synthetic.methods())) for _ in range(2))
    assert first == second


def test_a_boundary_deeper_than_any_cutting_edge_ends_at_the_depth_that_a_tool_can_cut():
    """Diagrams of a tool of 16 mm had reached to 300 mm."""
    deep = synthetic.boundary().assign(depth_mm=lambda line: 14 * (line["rpm"] / 1000) ** 2)
    none = TESTS[:0]
    assert figures.top_of(deep["depth_mm"], none) > 100
    assert figures.top_of(deep["depth_mm"], none, 64.0) == 64.0
    assert figures.top_of(deep["depth_mm"], TESTS.assign(depth_mm=70.0), 64.0) == 70.0
    # what lies wholly deeper is not left out: its least depth is drawn
    assert figures.top_of(deep["depth_mm"] + 200, none, 64.0) > 214


def test_depths_that_no_tool_cuts_are_named_and_not_tabulated():
    tables = synthetic.tables()
    own = tables["lobes_final"]
    both = pd.concat([own, own.assign(position="2", depth_mm=1000.0)])
    made = replace(synthetic.results(), tables={**tables, "lobes_final": both})
    *_, chart, limits = [item for item in lobes.boundaries(made) if isinstance(item, Picture | Table)]
    diameter = made.batch.manifest["tool"]["diameter_mm"]
    assert f"beyond {4 * diameter} mm, 4 diameters of the tool, are not shown" in chart.caption
    assert {row[2] for row in limits.rows} == {f"> {4 * diameter}"}
    assert chart.figure.axes[0].get_ylim()[1] < 10  # of the position that can be cut


def test_a_method_that_found_no_boundary_has_no_entry_in_the_legend():
    lacking = synthetic.methods().assign(cdsem_mm=np.nan)
    figure = figures.methods_chart(lacking)
    drawn = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "single modes by CDSEM" not in drawn
    assert len(drawn) == len(figures.METHODS) - 1


@pytest.mark.parametrize("depth", [1.2, 9.0])
def test_the_recommended_cut_is_a_star_on_the_boundary_of_its_position(depth):
    cut = {"position": "1", "spindle_rpm": 2100.0, "axial_depth_mm": depth, "removal_cm3_min": 1.0}
    verdict = {"recommended_cuts": [{**cut, "advice": "use"}, {**cut, "advice": "do_not"}]}
    made = replace(synthetic.results(), verdict=verdict)
    (picture,) = lobes.tested_boundary(made, made.compared("lobes"))
    axes = picture.figure.axes[0]
    (star,) = [line for line in axes.get_lines() if line.get_label() == "recommended cut"]
    assert star.get_xydata().tolist() == [[2100.0, depth]]
    assert axes.get_ylim()[1] > depth
    assert "Star: the recommended cut." in picture.caption


def test_a_cut_that_is_advised_against_is_no_star():
    cut = {"position": "1", "spindle_rpm": 2100.0, "axial_depth_mm": 1.0, "removal_cm3_min": 1.0}
    made = replace(synthetic.results(), verdict={"recommended_cuts": [{**cut, "advice": "do_not"}]})
    (picture,) = lobes.tested_boundary(made, made.compared("lobes"))
    assert "recommended cut" not in labels(picture.figure.axes[0])
