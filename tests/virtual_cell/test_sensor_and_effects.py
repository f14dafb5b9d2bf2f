"""What the dynamometer reads, and what hidden effects do to it."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
import yaml

from virtual_cell.__main__ import main
from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.hidden import EFFECTS
from virtual_cell.noise import sensor_noise
from virtual_cell.recipes import force
from virtual_cell.recipes.slot import ALUMINIUM
from virtual_cell.session import Plan, Session, cut_all
from virtual_cell.units import DEG, MM

QUIET = {"noise": 0.0, "offset": 0.0, "step": 1e-6}


def constant(*newton):
    return lambda t: np.tile(np.array(newton, dtype=float), (len(t), 1))


def read(sensor, load, duration=0.05):
    return record(sensor, load, duration, np.random.default_rng(0))


def test_a_dynamometer_under_the_work_reads_the_opposite_along_its_axes():
    axes = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    _, values = read(Dynamometer(5000.0, "work", axes, **QUIET), constant(1.0, 2.0, 3.0))
    np.testing.assert_allclose(values.mean(axis=0), [2.0, 1.0, 3.0], atol=1e-3)


def test_a_sensor_turned_counter_clockwise_sees_work_x_on_its_x_and_minus_y():
    sensor = Dynamometer(5000.0, "tool", np.eye(3), rotation=30.0 * DEG, **QUIET)
    _, values = read(sensor, constant(1.0, 0.0, 0.0))
    np.testing.assert_allclose(values.mean(axis=0), [np.cos(30 * DEG), -np.sin(30 * DEG), 0.0], atol=1e-3)


def test_resonance_amplifies_by_its_transfer_function():
    sensor = Dynamometer(10000.0, "tool", np.eye(3), resonance=((1000.0, 0.05), None, None), **QUIET)
    _, values = read(sensor, lambda t: np.sin(2 * np.pi * 800.0 * t)[:, None] * np.ones(3), 0.2)
    tail = values[-1000:]
    expected = 1.0 / abs(1.0 - 0.8**2 + 2j * 0.05 * 0.8)
    assert np.std(tail[:, 0]) / np.std(tail[:, 1]) == pytest.approx(expected, rel=0.02)


def test_charge_drift_adds_a_slope_and_a_time_constant_discharges():
    sloped = Dynamometer(1000.0, "tool", np.eye(3), slope=(5.0, 0.0, 0.0), **QUIET)
    t, values = read(sloped, constant(0.0, 0.0, 0.0), 1.0)
    np.testing.assert_allclose(values[:, 0], 5.0 * t, atol=1e-5)
    leaky = Dynamometer(1000.0, "tool", np.eye(3), time_constant=(0.5, 1e6, 1e6), **QUIET)
    t, values = read(leaky, lambda t: np.where(t > 0.1, 10.0, 0.0)[:, None] * np.ones(3), 1.0)
    np.testing.assert_allclose(values[200:-20, 0], 10.0 * np.exp(-(t[200:-20] - 0.1) / 0.5), rtol=0.01)


def test_noise_has_its_standard_deviation_and_more_power_at_low_frequency():
    noise = sensor_noise(100_000, 2.0, np.random.default_rng(1))
    assert noise.std() == pytest.approx(2.0 * np.hypot(1.0, 0.3), rel=0.02)
    spectrum = np.abs(np.fft.rfft(noise)) ** 2
    assert spectrum[1:50].mean() > 10.0 * spectrum[-5000:].mean()


SETTINGS = {"spindle_rpm": 6000.0, "axial_depth_mm": 1.0, "radial_depth_mm": 12.0, "cut_length_mm": 500.0}
PLANS = (
    Plan("slot", "identify", "slot", feed_per_tooth_mm=0.08, full_s=0.05, replicates=2, **SETTINGS),
    Plan("helical", "identify", "helical", feed_per_tooth_mm=0.08, full_s=0.3, **SETTINGS),
)


@pytest.fixture(scope="module")
def session():
    tool = Tool(6.0 * MM, 30.0 * DEG, np.arange(3) * 120.0 * DEG)
    sensor = Dynamometer(8192.0, "work", np.eye(3), 1.0)
    return Session(tool, ALUMINIUM, sensor, hole_radius=9.6 * MM, depth=1.0 * MM, mean_chip=0.05 * MM)


def cut(session, folder):
    rows = cut_all(session, PLANS, folder, np.random.default_rng(4))
    return np.concatenate([pd.read_parquet(folder / row["dynamometer"]).to_numpy().ravel() for row in rows])


@pytest.mark.parametrize("effect", EFFECTS)
def test_every_effect_changes_what_is_recorded(effect, session, tmp_path):
    hidden = EFFECTS[effect]
    changed = hidden.apply(session, hidden.draw(np.random.default_rng(6), session))
    difference = cut(changed, tmp_path / "hidden") - cut(session, tmp_path / "plain")
    assert np.abs(difference).max() > 1.0


def test_what_is_hidden_does_not_change_what_describes_the_batch(tmp_path):
    force.make(tmp_path / "one" / "blind", {}, 5)
    truth = force.make(tmp_path / "two" / "blind", {"tool_wear": None}, 5)
    assert set(truth["effects"]) == {"tool_wear"}
    plain, hidden = tmp_path / "one" / "blind", tmp_path / "two" / "blind"
    assert (plain / "batch.yaml").read_text() == (hidden / "batch.yaml").read_text()
    rows = [pd.read_csv(folder / "runs.csv") for folder in (plain, hidden)]
    settings = ["operation", "spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "direction", "replicate"]
    pd.testing.assert_frame_equal(*(r.groupby("condition")[settings].first() for r in rows))


def test_the_command_line_writes_the_truth_beside_the_batch(tmp_path):
    main(
        [
            "force",
            str(tmp_path / "b"),
            "--effect",
            "tool_runout",
            "radius_um=9",
            "angle_deg=40",
            "--seed",
            "2",
        ]
    )
    truth = json.loads((tmp_path / "b.truth.json").read_text())
    assert truth["effects"] == {"tool_runout": {"radius_um": 9, "angle_deg": 40}}
    assert not list((tmp_path / "b").rglob("*.json"))
    assert yaml.safe_load((tmp_path / "b" / "batch.yaml").read_text())["source"] == "simulated"


def test_an_unknown_effect_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(SystemExit, match="tool_runout"):
        main(["force", str(tmp_path / "b"), "--effect", "gremlins"])
