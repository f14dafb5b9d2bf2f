"""A force record that is read in stretches tells what the whole of it does."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fake_tables import FakeTables

from metro.batch.batch import Batch
from metro.batch.processed import Processed, read_batch
from metro.observables.cut.long_record import LongRecord
from metro.observables.deformation import observable as deformation
from metro.observables.force import orders as force_orders
from metro.observables.joint_force import observable as joint_force
from metro.stages.ingest import ingest

ROOT = Path(__file__).parents[2]
RATE, RPM, TEETH = 5000.0, 6000.0, 2
MANIFEST = {"tool": {"diameter_mm": 12, "teeth": TEETH, "helix_deg": 30}}
ROW = {"order": 1, "dynamometer": "a.csv", "operation": "slot", "spindle_rpm": RPM, "feed_per_tooth_mm": 0.1}
LEVEL = np.array([80.0, -40.0, 20.0])


def record(seconds=8.0, wander=0.0, tacho=False):
    """Two uneven teeth that cut from 1 s to 1 s before the end; their speed grows by a share ``wander``."""
    rng, time = np.random.default_rng(3), np.arange(round(seconds * RATE)) / RATE
    turned = 2.0 * math.pi * RPM / 60.0 * (time + 0.5 * wander * time**2 / seconds)
    wave = LEVEL + np.stack(
        [
            a * np.cos(TEETH * turned + p) + b * np.cos(turned + p)
            for a, b, p in ((60, 15, 0.2), (40, 9, 1), (10, 3, 2))
        ],
        axis=1,
    )
    cutting = (time > 1.0) & (time < seconds - 1.0)
    force = cutting[:, None] * wave + rng.normal(2.0, 1.0, (len(time), 3))
    table = pd.DataFrame(dict(zip(("fx_n", "fy_n", "fz_n"), force.T, strict=True)))
    degrees = np.degrees(turned) % 360.0 if tacho else np.nan
    return table.assign(run="r1", t_s=10.0 + time, spindle_deg=degrees)


def observed(table, stretch, monkeypatch):
    monkeypatch.setattr("metro.observables.cut.long_record.STRETCH", stretch)
    runs = pd.DataFrame([ROW], index=["r1"])
    batch = Batch("small", MANIFEST, {"cell": "c"}, runs, {})
    return force_orders.observe(batch, FakeTables(lambda *_: table), {})


@pytest.mark.parametrize("stretch", [100_000, 20_000, 7_777, 5_000])
def test_stretches_are_the_record_and_parts_of_it(stretch, monkeypatch):
    table = record()
    monkeypatch.setattr("metro.observables.cut.long_record.STRETCH", stretch)
    found = LongRecord(FakeTables(lambda *_: table), "r1")
    assert (found.samples, found.start) == (len(table), 10.0)
    assert found.rate == pytest.approx(RATE)
    for place in (None, slice(100, 39_000), slice(14_000, 14_010)):
        parts = list(found.stretches(place))
        expected = table.iloc[place or slice(None)]
        np.testing.assert_array_equal(np.concatenate([part.time for part in parts]), expected["t_s"])
        assert np.ptp([len(part.time) for part in parts]) <= 1
        assert max(len(part.time) for part in parts) < 1.5 * stretch
    turns = found.turns(50)
    np.testing.assert_allclose(turns.mean[17], table[["fx_n", "fy_n", "fz_n"]].iloc[850:900].mean())


def sizes(coefficients):
    """Of each order: without a tacho a record's angle counts from anywhere."""
    return np.sqrt((coefficients**2).groupby(["block", "axis", "order"]).sum())


@pytest.mark.parametrize("tacho", [True, False])
def test_the_averages_of_stretches_are_those_of_the_whole(tacho, monkeypatch):
    table = record(tacho=tacho)
    whole, parts = (observed(table, size, monkeypatch) for size in (10**6, 8_000))
    one, many = (each["spindle"].iloc[0] for each in (whole, parts))
    np.testing.assert_allclose([many[f"mean_{a}_n"] for a in "xyz"], LEVEL, atol=0.1)
    for name in ("zero_x_n", "zero_at_s", "contact_s", "steady_from_s", "steady_to_s", "air_s"):
        assert many[name] == pytest.approx(one[name], rel=1e-9)
    assert many["spindle_rpm"] == pytest.approx(RPM, abs=4.0 * many["spindle_rpm_sd"] + 1e-9)
    a, b = (each["orders"].set_index(["block", "axis", "order", "part"]) for each in (whole, parts))
    assert list(a.index) == list(b.index)
    first = b["force_n"].unstack("block")
    size, other = (each["force_n"] if tacho else sizes(each["force_n"]) for each in (a, b))
    error = np.sqrt(float((a["variance_n2"] + b["variance_n2"]).mean()))
    assert np.abs(size - other).max() < 5.0 * error
    # all blocks are turned to one place: the teeth are where they are in the first
    assert first.sub(first[0], axis=0).abs().to_numpy().max() < 1.0
    assert np.median(b["variance_n2"] / a["variance_n2"]) == pytest.approx(1.0, rel=0.5)


def test_a_speed_that_changes_over_a_long_record_smears_neither_the_whole_nor_stretches(monkeypatch):
    table = record(wander=5e-3)
    strongest = []
    for size in (10**6, 4_000):
        orders = observed(table, size, monkeypatch)["orders"]
        passing = orders[(orders["order"] == TEETH) & (orders["axis"] == "x")]
        power = (passing["force_n"] ** 2).groupby(passing["block"]).sum()
        strongest.append(np.sqrt(2.0 * power.min()))
    assert strongest == pytest.approx([60.0, 60.0], abs=0.6)


def test_the_force_on_a_robots_tool_is_the_same_in_stretches(tmp_path, monkeypatch):
    """Per revolution every 5 ms, and its mean over the steady cut."""
    ingest(ROOT / "data" / "raw" / "kr160-side", ROOT / "config" / "cells", tmp_path / "out", {}, "test")
    batch, found = read_batch(tmp_path / "out"), []
    for size in (10**6, 3_000):
        monkeypatch.setattr("metro.observables.cut.long_record.STRETCH", size)
        read = Processed(tmp_path / "out")
        tables = joint_force.observe(batch, read, {}), deformation.observe(batch, read, {})
        found.append((tables[0]["tool_force"], tables[1]["tip_force"]))
    for whole, parts in zip(*found, strict=True):
        pd.testing.assert_frame_equal(whole, parts, rtol=1e-9, atol=1e-9)
