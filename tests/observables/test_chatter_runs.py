"""From the records of test cuts to measured labels: what counts, where, and what is refused."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from fake_tables import FakeTables

from metro.batch.batch import Batch
from metro.batch.processed import COLUMNS
from metro.cutting.cutter import Cutter
from metro.dynamics.system import Structure
from metro.observables.problem import Refusal
from metro.observables.stability import observable as lobes
from metro.observables.stability.boundary import Cutting, run_probabilities, solve
from metro.observables.stability.chatter import measured, observe_chatter, observe_records
from metro.observables.stability.positions import Tip

RATE, TEETH, RPM = 2000.0, 4, 1200.0
MODES = pd.DataFrame({"used": [True], "frequency_hz": [52.0], "damping": [0.05]})


def record(order, rpm=RPM, revolutions=60, orbit=0.0, tacho=False):
    """Runout and tooth passing, with a vibration at an order; in the work frame, where the feed turns."""
    rng = np.random.default_rng(int(rpm + 100 * order))
    time = np.arange(int(revolutions * 60 / rpm * RATE)) / RATE
    turned = 2 * np.pi * rpm / 60 * time
    relative, feed = turned + orbit * time, orbit * time
    wave = [
        amplitude * np.array([np.cos(k * relative + phase), np.sin(k * relative), np.cos(k * relative)])
        for k, amplitude, phase in ((TEETH, 50.0, 0.3), (1, 20.0, 1.0), (order, 40.0 if order else 0.0, 0.0))
    ]
    x, y, z = sum(wave) + np.array([[80.0], [120.0], [30.0]])
    c, s = np.cos(feed), np.sin(feed)
    force = np.column_stack([c * x - s * y, s * x + c * y, z]) + rng.standard_normal((len(time), 3))
    columns = dict(zip(["fx_n", "fy_n", "fz_n"], force.T, strict=True))
    degrees = np.degrees(turned) % 360 if tacho else np.full(len(time), np.nan)
    return pd.DataFrame({"t_s": time, **columns, "spindle_deg": degrees})


def batch(**columns):
    names = [f"c{i}" for i in range(len(next(iter(columns.values()))))]
    runs = pd.DataFrame(
        {
            "spindle_rpm": RPM,
            "axial_depth_mm": 0.1,
            "radial_depth_mm": 12.0,
            "operation": "slot",
            "direction": "slot",
            "feed_direction_deg": 0.0,
            "orbit_rpm": np.nan,
            "pose": "1",
            "stable": "",
            "dynamometer": "a.csv",
            **columns,
        },
        index=pd.Index(names, name="run"),
    )
    return Batch("tests", {"tool": {"diameter_mm": 12, "teeth": TEETH}}, {"cell": "c"}, runs, {})


def observe(made, records, **tables):
    source = {"force": dict(zip(made.runs.index, records, strict=True)), **tables}
    return observe_chatter(made, FakeTables(lambda name, run: source[name][run]), MODES).set_index("run")


def test_a_vibration_off_the_orders_is_chatter_and_runout_is_not():
    found = observe(batch(stable=["yes", "no"]), [record(2.63), record(0)])
    assert list(found["probability"] > 0.5) == [True, False]
    assert found["chatter_hz"]["c0"] == pytest.approx(2.63 * RPM / 60, abs=0.02)
    assert list(found["labelled"]) == [0, 1]
    assert list(found["kind"]) == ["hopf", "forced"]


def test_forces_that_turn_with_the_orbit_are_no_chatter():
    made = batch(operation=["helical"], orbit_rpm=[60.0])
    (one,) = observe(made, [record(0, revolutions=180, orbit=2 * np.pi)])["probability"]
    assert one < 0.05


def test_with_a_tacho_a_nominal_speed_that_is_wrong_by_three_percent_does_not_matter():
    made = batch(spindle_rpm=[1.03 * RPM])
    assert observe(made, [record(0, tacho=True)])["kind"].tolist() == ["forced"]
    assert observe(made, [record(2.63, tacho=True)])["chatter_hz"].iloc[0] == pytest.approx(52.6, abs=0.02)


def test_a_short_record_gives_no_answer_and_says_why():
    found = observe(batch(stable=["no"]), [record(2.63, revolutions=25)])
    assert found["probability"].isna().all()
    assert "at least 40" in found["note"].iloc[0]
    assert measured(found.reset_index()).empty


@pytest.mark.parametrize("manifest", [{}, {"tool": {"diameter_mm": 12}}])
def test_without_the_number_of_teeth_there_is_no_answer_and_the_row_says_why(manifest):
    found = observe(replace(batch(stable=["no"]), manifest=manifest), [record(2.63)])
    assert found["probability"].isna().all()
    assert "without tool.teeth" in found["note"].iloc[0]


def test_runs_without_depth_record_or_trace_are_left_out():
    made = batch(dynamometer=["a.csv", None, "a.csv"], axial_depth_mm=[0.1, 0.1, np.nan])
    assert list(observe(made, [record(0)] * 3).index) == ["c0"]


def test_one_frequency_at_several_speeds_is_a_mode_of_the_robot():
    speeds = [1000.0, 1130.0, 1270.0, 1390.0]
    found = observe(batch(spindle_rpm=speeds), [record(52.0 * 60 / n, rpm=n) for n in speeds])
    assert set(found["kind"]) == {"low_frequency"}


def test_the_trace_gives_the_roughness():
    x = np.arange(0.0, 8.0, 0.005)
    trace = pd.DataFrame({"x_mm": x, "z_mm": 2e-3 * np.sin(2 * np.pi * x / 0.1)})
    found = observe(batch(profile=["p.csv"]), [record(0)], profile={"c0": trace})
    assert found["ra_um"].iloc[0] == pytest.approx(4 / np.pi, rel=0.02)


def lobes_of(made, told):
    structure = Structure(np.array([0, 1]), np.full(2, 330.0), np.full(2, 0.05), np.full(2, 4e6))
    tip = Tip("1", structure, ("x1", "y1"), np.zeros(6))
    found = Cutting(2e9, 8e8, np.zeros(2), Cutter(6e-3, 0.0, tuple(np.arange(4) * np.pi / 2)))
    lobes = solve(tip, found, made.runs.iloc[0], np.array([RPM]), check=False)
    return run_probabilities(made, lobes, made.runs, told)["unstable"].tolist()


def test_the_record_counts_more_than_the_label_where_the_modes_are_those_of_the_pose():
    stable = ["yes", "yes", "no", "", "no"]
    made = batch(stable=stable, pose=["1", "2", "1", "1", "1"])
    told = pd.DataFrame({"unstable": [1, 1, 0, 1]}, index=["c0", "c1", "c2", "c3"])
    assert lobes_of(made, told) == [1, 0, 0, 1, 1]


def test_without_record_and_label_nothing_is_known():
    made = batch(stable=["", "yes"])
    assert lobes_of(made, pd.DataFrame({"unstable": []}, dtype=float)) == [-1, 0]


def test_what_cannot_be_told_from_the_record_is_left_to_the_label():
    chatter = pd.DataFrame({"run": ["a", "b", "c", "d"], "probability": [0.5, 0.9, np.nan, 0.1]})
    assert measured(chatter)["unstable"].to_dict() == {"b": 1, "d": 0}


def shown_of(made, records):
    source = {"force": dict(zip(made.runs.index, records, strict=True))}

    def read(name, run):
        return source[name][run]

    tables = FakeTables(read)
    return observe_records(made, tables, observe_chatter(made, tables, MODES))


def test_chatter_is_shown_beside_the_stable_cut_nearest_in_speed_then_depth():
    speeds = [RPM, RPM, RPM, 1.5 * RPM]
    made = batch(spindle_rpm=speeds, axial_depth_mm=[0.1, 0.02, 0.05, 0.1])
    records = [record(2.63), record(0), record(0), record(0, rpm=speeds[3])]
    shown = shown_of(made, records)
    assert list(shown["run"].drop_duplicates()) == ["c0", "c2"]
    spectrum = shown[(shown["run"] == "c0") & (shown["part"] == "spectrum")].set_index("x")
    off = spectrum[~spectrum["on_order"]]["value"]
    # 40 N in each of three directions; over 59 turns a line lies up to half a bin beside one
    assert off.idxmax() == pytest.approx(2.63 * RPM / 60, abs=0.2)
    assert 0.84 * np.sqrt(3) * 40 < off.max() < 1.02 * np.sqrt(3) * 40
    assert spectrum["value"].idxmax() == pytest.approx(TEETH * RPM / 60, abs=0.2)
    stable = shown[(shown["run"] == "c2") & (shown["part"] == "spectrum")]
    assert stable["value"][~stable["on_order"]].max() < 1.0
    trace = shown[(shown["run"] == "c0") & (shown["part"] == "force")]
    # of the record's sixty turns the last twelve
    assert trace["x"].min() == pytest.approx(48 * 60 / RPM, abs=0.01)
    assert np.ptp(trace["x"]) == pytest.approx(12 * 60 / RPM, abs=0.01)


def test_without_an_answer_no_record_is_shown():
    made = batch(stable=["no"])
    assert shown_of(made, [record(2.63, revolutions=25)]).empty


@pytest.mark.parametrize("wander", [0.005, 0.02])
def test_a_speed_that_wanders_without_a_tacho_alarms_nobody_and_hides_no_chatter(wander):
    made = batch(dynamometer=["a.csv", "a.csv"])
    stable, chatter = (record(order, revolutions=80) for order in (0, 2.63))
    for table in (stable, chatter):  # the same cut, at times that run ahead and fall back
        time = table["t_s"].to_numpy()
        slow = 2 * np.pi / time[-1]
        ahead = time + wander / slow * (1 - np.cos(slow * time))
        for axis in ("fx_n", "fy_n", "fz_n"):
            table[axis] = np.interp(ahead, time, table[axis])
    found = observe(made, [stable, chatter])
    assert list(found["probability"] > 0.5) == [False, True]
    assert found["probability"]["c0"] <= 0.5


@pytest.mark.parametrize("order", [2.63, 0])
def test_without_a_modal_test_the_records_still_tell_chatter_and_the_lobes_are_refused(order):
    made, records = batch(stable=[""]), [record(order)]
    source = {"force": dict(zip(made.runs.index, records, strict=True))}

    def read(name, run=None):
        return source[name][run] if name in source else pd.DataFrame(columns=list(COLUMNS[name]))

    found = lobes.observe(made, FakeTables(read), {})
    assert (found["chatter_runs"]["probability"].iloc[0] > 0.5) == bool(order)
    refused = lobes.problem(made, found, {})
    assert isinstance(refused, Refusal)
    assert "impacts.csv" in refused.reason
    assert lobes.report(made, found, {}, refused, None) == {}
