"""Effects from outside of the library, and the styles of measurement."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from virtual_cell.chips import Tool
from virtual_cell.dynamometer import Dynamometer, record
from virtual_cell.recipes import force
from virtual_cell.recipes.slot import ALUMINIUM
from virtual_cell.session import Plan, Session, cut_all
from virtual_cell.units import DEG, MM, MS, RPM, UM

QUIET = {"noise": 0.0, "offset": 0.0, "step": 1e-6}
TOOL = Tool(6.0 * MM, 30.0 * DEG, np.arange(3) * 120.0 * DEG)
EXACT = Session(
    TOOL,
    ALUMINIUM,
    Dynamometer(8192.0, "tool", np.eye(3), **QUIET),
    hole_radius=9.6 * MM,
    scatter=0.0,
    speed_error=0.0,
    speed_reference=6000.0 * RPM,
)
SLOT = Plan("slot", "identify", "slot", 6000.0, 0.08, 1.0, 12.0, full_s=0.2, replicates=2)
HOLE = replace(SLOT, condition="hole", operation="helical", full_s=0.6, replicates=1)


def cut(session, plan, folder):
    """Force (n, 3) of each run, in the order of cutting; nothing but the start phase is random."""
    rows = cut_all(session, (plan,), folder, np.random.default_rng(4))
    return [pd.read_parquet(folder / row["dynamometer"])[["fx_n", "fy_n", "fz_n"]].to_numpy() for row in rows]


def turns(force, per_turn=81.92):
    """Mean force of every revolution, (revolutions, 3)."""
    edges = np.round(np.arange(int(len(force) / per_turn) + 1) * per_turn).astype(int)
    return np.array([force[a:b].mean(axis=0) for a, b in itertools.pairwise(edges)])


def test_a_channel_that_lags_passes_a_sine_as_a_first_order_low_pass_and_the_others_pass_all_of_it():
    sensor = Dynamometer(10000.0, "tool", np.eye(3), lag=(0.3 * MS, 0.0, 0.0), **QUIET)
    _, read = record(
        sensor,
        lambda t: np.sin(2 * np.pi * 400.0 * t)[:, None] * np.ones(3),
        0.2,
        np.random.default_rng(0),
    )
    expected = 1.0 / np.hypot(1.0, 2 * np.pi * 400.0 * 0.3 * MS)
    size = np.sqrt(2.0) * np.std(read[500:1500], axis=0)
    assert size == pytest.approx([expected, 1.0, 1.0], rel=0.01)


def test_a_tilted_surface_makes_the_mean_force_grow_with_the_depth_along_the_feed(tmp_path):
    flat, tilted = (
        turns(cut(replace(EXACT, tilt=t), SLOT, tmp_path / str(t))[0]) for t in (0.0, 10.0 * UM / MM)
    )
    speed = 0.08 * 3 * 100.0  # mm/s
    middle = (np.arange(len(flat)) + 0.5) * 0.01
    deeper = 0.010 * speed * middle / 1.0  # of the nominal depth
    np.testing.assert_allclose((tilted / flat - 1.0)[2:-2, :2], np.tile(deeper[2:-2, None], 2), atol=2e-3)


def test_slow_growth_deepens_the_cut_over_the_session_up_to_its_size(tmp_path):
    plan = replace(SLOT, replicates=6)
    plain = [run.mean(axis=0) for run in cut(EXACT, plan, tmp_path / "plain")]
    grown = [run.mean(axis=0) for run in cut(replace(EXACT, growth=50.0 * UM), plan, tmp_path / "grown")]
    gain = np.array([b[1] / a[1] - 1.0 for a, b in zip(plain, grown, strict=True)])
    assert gain[0] == pytest.approx(0.0, abs=1e-6)
    assert (np.diff(gain) > 0.0).all()
    assert 0.04 < gain[-1] < 0.05


def test_a_hard_spot_begins_where_it_is_said_to(tmp_path):
    plan = replace(SLOT, replicates=4)
    plain = cut(EXACT, plan, tmp_path / "plain")
    hard = cut(replace(EXACT, hard_spot=0.1, hard_from=0.75), plan, tmp_path / "hard")
    changed = [not np.allclose(a, b) for a, b in zip(plain, hard, strict=True)]
    assert changed == [False, False, False, True]


def test_shear_falls_with_speed_by_the_exponent(tmp_path):
    no_edge = replace(EXACT, coefficients=replace(ALUMINIUM, kte=0.0, kre=0.0, kae=0.0))
    fast = replace(SLOT, spindle_rpm=9000.0)
    one = cut(no_edge, fast, tmp_path / "one")[0].mean(axis=0)
    other = cut(replace(no_edge, speed_exponent=0.2), fast, tmp_path / "other")[0].mean(axis=0)
    np.testing.assert_allclose(other / one, 1.5**-0.2, rtol=1e-5)


def test_axial_stiffness_changes_twice_per_orbit(tmp_path):
    plain = cut(EXACT, HOLE, tmp_path / "plain")[0][:, 2]
    twice = replace(EXACT, orbit_stiffness=(0.2, 0.0), orbit_harmonic=2)
    ratio = cut(twice, HOLE, tmp_path / "twice")[0][:, 2] / plain
    orbit = 0.08 * 3 * 100.0 / 3.6  # rad/s
    t = np.arange(len(ratio)) / 8192.0
    waves = np.stack([np.ones_like(t), np.cos(2.0 * orbit * t), np.sin(2.0 * orbit * t)], axis=1)
    mean, cosine, sine = np.linalg.lstsq(waves, ratio, rcond=None)[0]
    assert mean == pytest.approx(1.0, abs=0.01)
    assert np.hypot(cosine, sine) == pytest.approx(0.2, abs=0.01)


def test_style_b_measures_in_another_way_and_records_the_spindle(tmp_path):
    seen = set()
    for seed in range(2):
        force.make(tmp_path / f"b{seed}", {}, seed, "b")
        manifest = yaml.safe_load((tmp_path / f"b{seed}/batch.yaml").read_text())
        runs = pd.read_csv(tmp_path / f"b{seed}/runs.csv")
        record_ = pd.read_parquet(tmp_path / f"b{seed}" / runs.dynamometer[0])
        rate = manifest["instruments"]["dynamometer"]["rate_hz"]
        assert runs.spindle_rpm.nunique() == 3
        assert np.diff(record_.t_s[:100]).mean() == pytest.approx(1.0 / rate, rel=1e-3)
        if "spindle_deg" in record_:
            speed = np.unwrap(record_.spindle_deg * DEG)[-1] - np.unwrap(record_.spindle_deg * DEG)[0]
            speed /= record_.t_s.iloc[-1] - record_.t_s.iloc[0]
            assert speed / RPM == pytest.approx(runs.spindle_rpm[0], rel=0.006)
        seen.add((rate, "spindle_deg" in record_, runs.condition.nunique()))
    assert len(seen) > 1
