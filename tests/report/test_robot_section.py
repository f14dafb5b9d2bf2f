"""The robot in the report: what is said from which table, and nothing where there is none."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import synthetic_results as synthetic

from metro.report.content import Bullets, Picture, Table
from metro.report.figures import joint_torques, tracking
from metro.report.figures import robot as figures
from metro.report.sections.robot import robot
from metro.report.sections.stiffness import arm_stiffness
from metro.report.style import to_svg

X = np.arange(-10.0, 60.0)


def force():
    shape = np.interp(X, [-5, 0, 50, 55], [0, 1, 1, 0])
    part = np.select([X < -5, X < 0, X <= 50, X <= 55], ["air", "cut-in", "steady", "cut-out"], "air")
    columns = {f"f{a}_n": f * shape for a, f in zip("xyz", (50.0, -170.0, -30.0), strict=True)}
    errors = {f"sd_f{a}_n": 2.0 for a in "xyz"}
    return pd.DataFrame({"run": "r1", "x_mm": X, "part": part, **columns, **errors})


def means(turn=None):
    """Means of two runs in the work's frame and, turned by ``turn``, in that of the tool."""
    parts = []
    for name, axes in (("work", np.eye(3)), ("tool", turn)) if turn is not None else (("work", np.eye(3)),):
        columns = {
            "sensorless_n": [50.0, -170.0, -30.0] @ axes,
            "dynamometer_n": [48.0, -160.0, -31.0] @ axes,
        }
        parts.append(pd.DataFrame({"frame": name, "axis": list("xyz"), **columns}))
    frame = pd.concat(parts).assign(
        run="r1", sensorless_sd_n=2.0, drives_sd_n=1.5, enough=True, condition=4.2
    )
    return pd.concat([frame, frame.assign(run="r2", dynamometer_n=np.nan, enough=False)])


def joints():
    frame = pd.DataFrame({"run": "r1", "joint": range(1, 7), "index": [9.0, 0.1, 4.0, 0.3, 5.0, 2.1]})
    frame = frame.assign(used=frame["index"] > 2, noise_nm=1.5, drift_nm=0.4, friction_nm=0.3, remark="")
    frame = frame.assign(threshold=2.0, whiteness=[0.001, 0.5, 0.5, 0.5, 0.5, 0.5])
    frame.loc[0, "remark"] = "the idle run was +10.0 % faster than the cut"
    return pd.concat([frame, frame.assign(run="r2", index=[9.0, 0.1, 4.0, 0.3, 0.5, 0.1], used=True)])


def courses_of_torque():
    parts = [
        pd.DataFrame({"run": "r1", "joint": joint, "x_mm": X, "bin_nm": joint * X, "level_nm": joint * X})
        for joint in range(1, 7)
    ]
    together = pd.DataFrame({"run": "r1", "log": ["cut"] * 2 + ["idle"] * 2, "joint": 1, "torque_nm": 1.0})
    return (
        together.assign(t_s=[0.0, 1.0, 0.5, 1.5], x_mm=[0.0, 1.0, 0.0, 1.0]),
        pd.concat(parts).assign(level_sd_nm=1.0),
    )


def strayed():
    """A tip that strays by joint 4, in a cut and an idle run, and the sizes of that."""
    wave = np.sin(X / 5.0)
    columns = {"x_mm": X, "flange_um": 2.0 * wave, "tip_um": 9.0 * wave}
    columns |= {f"joint{i}_um": (8.0 if i == 4 else 0.2) * wave for i in range(1, 7)}
    columns |= {f"error{i}_urad": 30.0 * wave for i in range(1, 7)}
    columns |= {f"torque{i}_nm": -5.0 * wave for i in range(1, 7)}
    columns |= {f"rate{i}_rad_s": np.where(X < 20.2, -1e-3, 1e-3) for i in range(1, 7)}
    course = pd.concat([pd.DataFrame({**columns, "log": name, "run": "r1"}) for name in ("cut", "idle")])
    size = {"flange_cut_um": 2.0, "tip_cut_um": 9.0, "flange_idle_um": 2.1, "tip_idle_um": 9.3, "joint": 4}
    size |= {"share": 0.889, "joint_um": 8.0, "correlation": -1.0, "run": "r1"}
    return course, pd.DataFrame([size])


def ellipsoids():
    axes = np.eye(3)
    columns = {f"axis_{a}": axes[i] for i, a in enumerate("xyz")}
    return pd.DataFrame({"pose": "cut", "stiffness_n_um": [0.4, 0.6, 7.0], "sd_n_um": 0.01, **columns})


def chart():
    x, y = (g.ravel() for g in np.meshgrid(np.linspace(0, 100, 7), np.linspace(0, 60, 7)))
    frame = pd.DataFrame({"x_mm": x, "y_mm": y, "k_least_n_um": 0.4 + 1e-3 * x, "soft_x": 1.0, "soft_y": 0.0})
    frame.loc[3, "k_least_n_um"] = np.nan
    return frame


def spectra():
    f = np.linspace(0.1, 40, 100)
    rows = [
        pd.DataFrame({"run": "r1", "domain": d, "axis": a, "frequency": f, "density_um2": 1 / f})
        for d in ("time", "path")
        for a in "xyz"
    ]
    return pd.concat(rows)


LINES = pd.DataFrame(
    {"run": ["r1"], "domain": "time", "axis": "z", "frequency": 0.6, "frequency_sd": 0.002,
     "amplitude_um": 8.0, "amplitude_sd_um": 0.5, "probability": 1e-6}
)  # fmt: skip
WAVES = pd.DataFrame(
    {"run": "r1", "x_mm": X, "wall_um": np.sin(X), "tip_um": 0.9 * np.sin(X), "idle_um": np.nan}
)


def results(**tables):
    return replace(synthetic.results(), tables=tables)


def content(**tables):
    section = robot(results(**tables))
    return [] if section is None else list(section.items)


def table_with(items, word):
    return next(i for i in items if isinstance(i, Table) and word in i.caption)


def test_a_batch_without_an_arm_has_no_such_section():
    bare = replace(synthetic.results(), tables={}, identified={})
    assert robot(bare) is None


def test_the_steady_means_stand_beside_the_dynamometers_with_their_error_and_joints():
    items = content(robot_means=means(), robot_force=force(), robot_joints=joints())
    table = table_with(items, "beside the dynamometer")
    assert table.rows[0][:2] + table.rows[0][5:8] == ["r1", "1 3 5 6", "−160", "−170.0 ± 3.9", "6.2"]
    assert "Mean of the absolute errors: 4.3 N (x 2.0, y 10, z 1.0)" in table.caption
    assert table.rows[1][:5] == ["r2", "1–6 *", "–", "50.0 ± 4.9", "–"]  # the drives in it: 1.96 √(2² + 1.5²)
    assert "by the rule of [K] there is no estimate" in table.caption


def test_frames_that_differ_have_a_table_each_and_frames_that_are_one_share_it():
    """The tool's axes of the paper: x of the tool is −z of the work, and so on."""
    turn = np.array([[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]])
    both = content(robot_means=means(turn), robot_joints=joints())
    work, tool = (table_with(both, f"in the {name}'s axes") for name in ("work", "tool"))
    assert work.rows[0][3::3] == ["50.0 ± 3.9", "−170.0 ± 3.9", "−30.0 ± 3.9"]
    assert tool.rows[0][3::3] == ["30.0 ± 3.9", "170.0 ± 3.9", "−50.0 ± 3.9"]
    one = content(robot_means=means(np.eye(3)), robot_joints=joints())
    assert sum("Mean force" in item.caption for item in one if isinstance(item, Table)) == 1
    assert table_with(one, "the work's axes, which are the tool's")


def test_without_a_dynamometer_there_is_a_column_per_axis():
    items = content(robot_means=means().query("run == 'r2'"), robot_joints=joints())
    table = table_with(items, "Mean force on the tool in the steady cut")
    assert table.rows == [["r2", "1–6 *", "50.0 ± 4.9", "−170.0 ± 4.9", "−30.0 ± 4.9"]]
    assert list(table.header) == ["run", "joints", "x (N)", "y (N)", "z (N)"]


def test_joints_that_pass_the_index_coloured_innovations_and_remarks_are_told():
    items = content(robot_means=means(), robot_joints=joints())
    [said] = [item for item in items if isinstance(item, Picture) and "bservability" in item.caption]
    assert "fewer than three joints reach in 1 of 2 runs" in said.caption
    assert "2 of 12 are below 0.05, where chance puts 0.60" in said.caption
    table = table_with(items, "What each joint's torque is weighted by")
    assert [row[1] for row in table.rows] == ["1.5", "0.40", "0.30"]
    remarks = [text for item in items if isinstance(item, Bullets) for text in item.items]
    assert remarks == ["r1 and r2: the idle run was +10.0 % faster than the cut."]


def test_the_indices_are_drawn_beside_the_threshold_and_the_p_values_in_order():
    figure = joint_torques.joints(joints(), 2.0)
    used, unused, threshold = figure.axes[0].get_lines()
    assert (len(used.get_xdata()), len(unused.get_xdata())) == (10, 2)
    assert set(threshold.get_ydata()) == {2.0}
    assert list(figure.axes[1].get_lines()[0].get_ydata()) == sorted([0.001, 0.001] + 10 * [0.5])
    assert to_svg(figure)


def test_torques_are_drawn_joint_by_joint_beside_the_logs_by_time_and_by_place():
    together, table = courses_of_torque()
    figure = joint_torques.torques(together, table, joints().query("run == 'r1'"))
    by_time, by_place = figure.axes[0], figure.axes[4]
    assert by_time.get_lines()[1].get_xdata()[0] == 0.5
    assert by_place.get_lines()[0].get_xdata()[0] == by_place.get_lines()[1].get_xdata()[0]
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles.count("joint 2, not used") == titles.count("joint 3") == 1
    items = content(robot_joints=joints(), robot_aligned=together, robot_torques=table)
    assert any("Torques of run r1" in item.caption for item in items if isinstance(item, Picture))


def test_flange_and_tip_are_drawn_with_the_joint_that_makes_most_of_it():
    course, sizes = strayed()
    figure = tracking.tracking(course, 4)
    flange, tip, alone, drive, torque = figure.axes
    heights = [np.ptp(axes.get_lines()[0].get_ydata()) for axes in (flange, tip)]
    assert heights[1] / heights[0] == pytest.approx(4.5)
    assert [line.get_label() for line in alone.get_lines()] == ["all joints", "joint 4 alone"]
    assert drive.get_lines()[1].get_xdata()[0] == pytest.approx(20.5)  # where it turns round
    assert np.corrcoef(drive.get_lines()[0].get_ydata(), torque.get_lines()[0].get_ydata())[0, 1] < -0.99
    items = content(robot_tracking=course, robot_tracking_size=sizes)
    [row] = table_with(items, "Amplitude of the path error").rows
    assert row == ["r1", "2.0", "2.1", "9.0", "9.3", "4", "8.0", "89", "−1.0"]
    [picture] = [item for item in items if isinstance(item, Picture)]
    assert picture.caption.startswith("The tip strays 4.5 times as far as the flange")
    assert "in 1 of 1 runs joint 4 makes most of it" in picture.caption


def test_the_legend_of_the_path_error_lies_on_no_curve():
    figure = tracking.tracking(strayed()[0], 4)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        *("cut", "idle run", "all joints", "joint 4 alone")
    ]
    assert not any(axes.get_legend() for axes in figure.axes)


def test_without_an_idle_run_the_cut_is_drawn_alone():
    course, sizes = strayed()
    figure = tracking.tracking(course[course["log"] == "cut"], 4)
    assert [line.get_label() for line in figure.axes[0].get_lines()] == ["cut"]
    bare = sizes.drop(columns=["flange_idle_um", "tip_idle_um"])
    without = content(robot_tracking=course, robot_tracking_size=bare)
    [row] = table_with(without, "Amplitude").rows
    assert row[:5] == ["r1", "2.0", "–", "9.0", "–"]
    drawn = content(robot_tracking=course, robot_tracking_size=sizes)
    said = [
        next(item.caption for item in items if getattr(item, "caption", "").count("Path error across"))
        for items in (drawn, without)
    ]
    assert ["in the cut and in the idle run;" in said[0], "in the cut;" in said[1]] == [True, True]


def test_the_steady_deformation_is_compared_as_a_share_of_the_measured():
    s = np.arange(0, 60.0)
    shape = 0.2 * np.clip(s / 8, 0, 1)
    frame = pd.DataFrame({"s_mm": s, "measured": shape, "before": 0.8 * shape, "after": 1.01 * shape})
    frame = frame.assign(observable="deformation", run="r9", axis="z", sigma=0.004, unit="mm")
    walls = {"arm": {"walls": {"r9": {"with_flange_rotation": 0.2, "without_flange_rotation": 0.12}}}}
    for identified, share in ((walls, "60"), ({}, "–")):
        section = robot(replace(results(comparison=frame), identified=identified))
        [row] = table_with(section.items, "Steady deformation").rows
        assert row[0] == "r9"
        assert row[-3:] == ["−20", "1.0", share]


def test_stiffness_is_drawn_with_its_principal_axes():
    items = content(arm_map=chart(), arm_ellipsoids=ellipsoids())
    assert table_with(items, "Principal").rows[0][:2] == ["cut", "0.400 ± 0.020"]
    [figure] = [item.figure for item in items if isinstance(item, Picture)]
    outline = figure.axes[1].get_lines()[0].get_xydata()
    np.testing.assert_allclose(np.abs(outline).max(axis=0), [0.4, 0.6], rtol=1e-3)
    assert to_svg(figure)


def test_a_line_is_tabulated_and_none_is_said():
    items = content(robot_spectra=spectra(), robot_lines=LINES)
    row = table_with(items, "Lines in the path error").rows[0]
    assert row[:4] == ["r1", "z", "0.6000 ± 0.0039 Hz", "8.00 ± 0.98"]
    said = [item.caption for item in content(robot_spectra=spectra()) if isinstance(item, Picture)]
    assert any("No line" in text for text in said)


def test_waves_are_drawn_without_an_idle_run_too():
    figure = figures.waviness(WAVES, ["r1"])
    assert [line.get_label() for line in figure.axes[0].get_lines()] == [
        "wall, by the profiler",
        "tip in the cut, by the encoders",
    ]
    assert to_svg(figure)


def test_courses_hold_the_dynamometers_level_over_the_steady_cut():
    figure = joint_torques.courses(force(), means(), ["r1"])
    level = figure.axes[0].collections
    spans = [c.get_segments()[0] for c in level if hasattr(c, "get_segments") and len(c.get_segments())]
    np.testing.assert_allclose(sorted(s[0][1] for s in spans), [-160.0, -31.0, 48.0])
    assert all(s[0][0] == 0.0 and s[1][0] == 50.0 for s in spans)
    assert to_svg(figure)


def end_tables():
    told = pd.DataFrame({"position": ["1", "2"], "x_mm": [0.0, 100.0], "y_mm": 0.0, "z_mm": [0.0, -300.0]})
    told = told.assign(method="linear polynomial")
    x, z = (g.ravel() for g in np.meshgrid([0.0, 50.0, 100.0], [-300.0, -150.0, 0.0]))
    surface = pd.DataFrame({"first": "x", "second": "z", "third": "y", "x_mm": x, "y_mm": 0.0, "z_mm": z})
    surface = surface.assign(level_mm=0.0, sd_percent=1.0 + 1e-2 * x)
    region = {"softest_n_um": 0.9, "x_mm": 0.0, "y_mm": 0.0, "z_mm": -60.0, "stiffest": "y"}
    region |= {"stiffest_count": 2, "stations": 2, "ratio_low": 3.3, "ratio_high": 3.4}
    for a in "xyz":
        told[f"k{a}_n_um"], told[f"error_{a}_percent"] = [1.0, 0.8], [3.0, -4.0]
        surface[f"k{a}_n_um"] = 1 + 1e-3 * x
        region |= {f"{a}_low_mm": -50.0, f"{a}_high_mm": 50.0}
        region |= {f"inner_k{a}_n_um": 1.0, f"outer_k{a}_n_um": 0.8}
    errors = pd.DataFrame({"entry": ["kx", "kxy"], "least_n_um": [0.8, -0.1], "greatest_n_um": [1.0, 0.2]})
    errors = errors.assign(rms_percent=3.5, rms_low_percent=2.0, rms_high_percent=9.0, within_percent=95.0)
    errors = errors.assign(kriging_rms_percent=3.0, kriging_sd_percent=3.2)
    return {
        "end_stations": told, "end_surface": surface, "end_errors": errors,
        "end_region": pd.DataFrame([region]),
    }  # fmt: skip


def test_stations_are_tabulated_with_what_the_others_make_of_them():
    items = content(**end_tables())
    table = table_with(items, "End stiffness at the stations")
    assert table.rows[1] == ["2", "100", "0", "−300", *3 * ["0.800"], *3 * ["−4.00"]]
    errors = table_with(items, "leave-one-out error")
    assert errors.rows[1] == ["kxy", "−0.100 … 0.200", "3.5 (2.0 … 9.0)", "3.0", "3.2", "95"]
    [figure] = [item.figure for item in items if isinstance(item, Picture)]
    assert figure.axes[0].get_lines()[0].get_xdata().tolist() == [0.0, 100.0]
    assert to_svg(figure)


def test_the_best_region_the_fall_to_the_border_and_the_dominating_direction_are_said():
    items = content(**end_tables())
    said = " ".join(text for item in items if isinstance(item, Bullets) for text in item.items)
    assert "k x 1.00 to 0.800 N/µm (−20 %)" in said
    assert "k y is the largest at 2 of 2 stations, 3.3 to 3.4 times" in said
    [picture] = [item for item in items if isinstance(item, Picture)]
    assert picture.caption.startswith("The softest direction is stiffest at (0, 0, −60) mm, 0.900 N/µm")


def test_of_many_stations_those_that_the_batch_names_are_tabulated():
    tables = end_tables()
    first = tables["end_stations"]
    tables["end_stations"] = pd.concat(
        [first, *(first.iloc[[1]].assign(position=f"s{i}") for i in range(20))], ignore_index=True
    )
    made = replace(results(**tables), identified={"modes": [{"position": 1}]})
    section = robot(made)
    assert section is not None
    table = table_with(section.items, "stations that the batch names")
    assert [row[0] for row in table.rows] == ["1"]


def frictions():
    table = pd.DataFrame({"joint": range(1, 7), "fastest_deg_s": 2.0, "noise_nm": 1.5, "remark": ""})
    table = table.assign(coulomb=45.0, coulomb_low=44.7, coulomb_high=45.3)
    table = table.assign(viscous=900.0, viscous_low=870.0, viscous_high=930.0)
    blank = [name for name in table if name.startswith("coulomb")]
    table.loc[[0, 2], blank], table.loc[[0, 2], "remark"] = np.nan, "one way only"
    speed = np.array([-2.0, -1.0, 1.0, 2.0])
    curve = pd.concat(
        [pd.DataFrame({"joint": joint, "speed_deg_s": speed, "sd_nm": 1.0}) for joint in range(1, 6)]
    )
    return table, curve.assign(friction_nm=45.0 * np.sign(curve["speed_deg_s"]) + 16.0 * curve["speed_deg_s"])


def test_friction_is_tabulated_and_what_the_runs_cannot_tell_is_said():
    table, curve = frictions()
    items = content(joint_friction=table, joint_friction_curve=curve)
    rows = table_with(items, "Friction of the joints").rows
    assert rows[1] == ["2", "45.00 ± 0.30", "900 ± 30", "31.4 ± 1.0", "2.00", "1.5"]
    assert rows[0][1] == "–"
    said = [text for item in items if isinstance(item, Bullets) for text in item.items]
    assert said == ["Joints 1 and 3: one way only."]


def test_the_line_of_friction_jumps_at_standstill_and_a_joint_without_points_has_none():
    table, curve = frictions()
    figure = figures.friction(curve, table)
    left, right = (line.get_ydata() for line in figure.axes[1].get_lines()[-2:])
    assert right[0] - left[-1] == pytest.approx(2 * (45.0 + 900.0 * np.pi / 180))
    assert len(figure.axes[5].get_lines()) == len(figure.axes[1].get_lines()) - 2
    assert to_svg(figure)


SOFTER = {
    "cause": "stiffness_scale",
    "where": {},
    "status": "confirmed",
    "seen_in": ["force", "deformation"],
    "parameters": {"factor": {"value": 0.5, "ci95": [0.48, 0.52], "unit": "1"}},
}


def stiffness_with(cause):
    shapes = pd.concat([ellipsoids(), ellipsoids().assign(pose="load tests p1")])
    made = results(arm_map=chart(), arm_ellipsoids=shapes)
    return arm_stiffness(replace(made, loop={"causes": [cause]}))


def test_the_stiffness_of_load_tests_is_compared_with_that_while_cutting():
    """One table had twice what a verdict had found, without a word."""
    _, table, use, picture = stiffness_with(SOFTER)
    rest, cutting = table.rows[:2]
    assert (rest[0], cutting[0]) == ("cut, by load tests", "cut, while cutting")
    values = [[float(cell.split(" ")[0]) for cell in row[1:4]] for row in (rest, cutting)]
    assert values[1] == pytest.approx([0.5 * value for value in values[0]], rel=0.02)
    assert use.text.startswith(
        "While cutting, the arm has 0.500 ± 0.020 times the stiffness of the load tests"
    )
    assert "for the deflection under cutting forces" in use.text
    assert "by load tests" in picture.caption


@pytest.mark.parametrize(
    "change", [{"status": "contradiction"}, {"where": {"joint": 3}}, {"cause": "tip_give"}]
)
def test_without_one_factor_of_all_joints_nothing_is_compared(change):
    _, table, picture = stiffness_with({**SOFTER, **change})
    assert [row[0] for row in table.rows if row[0].startswith("cut")] == ["cut"]
    assert "load tests" not in picture.caption


def test_waviness_names_its_band():
    runs = pd.DataFrame({"run": ["r1"], "shortest_mm": [0.8]})
    waves = {"wa_measured": {"value": 0.5, "ci95": [0.4, 0.6], "unit": "um"}, "correlation": 0.9}
    waves |= {"wa_predicted": waves["wa_measured"]}
    parameters = pd.DataFrame({"run": ["r1"], "profile": ["W"]})
    made = results(waviness_runs=runs, profile_parameters=parameters)
    table = table_with(
        robot(replace(made, identified={"arm": {"waviness": {"r1": waves}}})).items, "Waviness"
    )
    assert table.caption.startswith("Waviness of the wall from waves of 0.8 to 8 mm, measured and predicted")
    assert "“Surface texture” are larger" in table.caption
    assert table.header[1:3] == ["Wa wall", "Wa predicted"]
