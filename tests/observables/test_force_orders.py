"""The spindle speed of a record with a tacho, from records written here."""

import math

import numpy as np
import pandas as pd
import pytest
from fake_tables import FakeTables

from metro.batch.batch import Batch
from metro.observables.force.orders import observe

NOMINAL, TRUE, RATE = 6000.0, 6021.0, 10_000.0
MANIFEST = {"tool": {"diameter_mm": 12, "teeth": 2, "helix_deg": 30}}
ROW = {"order": 1, "dynamometer": "a.csv", "operation": "slot", "spindle_rpm": NOMINAL}


def speed_of(reading_deg, seconds=0.5, seed=1):
    """Speed and its deviation, rpm, of a record whose tacho's readings are off by ``reading_deg``."""
    rng, time = np.random.default_rng(seed), np.arange(round(seconds * RATE)) / RATE
    turned = 50.0 + 360.0 * TRUE / 60.0 * time
    wave = np.array([2.0, 1.0, 1.0]) + np.cos(np.radians(turned)[:, None] * [2, 2, 4] + [0.0, 1.0, 2.0])
    tacho = np.mod(turned + reading_deg * rng.normal(size=len(time)), 360.0)
    record = pd.DataFrame(100.0 * wave + rng.normal(size=wave.shape), columns=["fx_n", "fy_n", "fz_n"])
    record = record.assign(t_s=time, spindle_deg=tacho)
    runs = pd.DataFrame([ROW | {"feed_per_tooth_mm": 0.1}], index=["r1"])
    found = observe(Batch("small", MANIFEST, {"cell": "c"}, runs, {}), FakeTables(lambda *_: record), {})
    (row,) = found["spindle"].to_dict("records")
    return row["spindle_rpm"], row["spindle_rpm_sd"]


@pytest.mark.parametrize("reading_deg", [0.5, 2.0])
def test_a_tacho_tells_the_speed_and_its_readings_how_sure_it_is_whatever_the_nominal_speed(reading_deg):
    speed, deviation = speed_of(reading_deg)
    # One reading at either end of the record: its angle turned is off by √2 readings.
    ends = 60.0 * math.sqrt(2.0) * reading_deg / 360.0 / 0.5
    assert deviation == pytest.approx(ends, rel=0.03)
    assert speed == pytest.approx(TRUE, abs=deviation)
    assert abs(speed - NOMINAL) > 10.0 * deviation


def test_a_longer_record_of_a_tacho_tells_the_speed_better():
    assert speed_of(1.0, seconds=2.0)[1] == pytest.approx(speed_of(1.0)[1] / 4.0, rel=0.03)
