"""Identification of a batch of 36 runs of one second at 10 kHz: order tracking, speeds, phases, coefficients.

From the records in memory to the coefficients with their covariance. How it grows with the length of the
records is drawn by ``benchmarks/growth.py``. Run: ``pytest benchmarks/bench_identification.py -s``.
"""

import math

import numpy as np
import pandas as pd
from bench_forces import seconds

from metro.batch.batch import Batch
from metro.cutting.chip import Cut
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.law import EdgeLaw
from metro.cutting.time_signal import time_signal
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise
from metro.observables.force import observable as force

BETA = np.array([850e6, 320e6, 180e6, 15e3, 18e3, 4e3])
TOOL = Cutter(6e-3, math.radians(40), evenly_pitched(4))
RATE, RPM, FEEDS, RUNS = 10_000, 6000.0, (0.03, 0.05, 0.08, 0.12), 36


class Records:
    """Force records in memory, where the tables of a folder are expected."""

    def __init__(self, records):
        self._records = records

    def __call__(self, _table, run):
        return self._records[run]

    def pieces(self, _table, run):
        yield self._records[run]


def batch_of(seconds):
    """Make batch and records in memory: four feeds, nine repeats, noise, speeds off by up to 0.5 %."""
    rng = np.random.default_rng(1)
    names = [f"r{i:02d}" for i in range(RUNS)]
    feeds = np.array([FEEDS[i % len(FEEDS)] for i in range(RUNS)])
    runs = pd.DataFrame(
        {
            "run": names,
            "role": "identify",
            "condition": [f"f{feed}" for feed in feeds],
            "order": np.arange(RUNS),
            "operation": "slot",
            "direction": "slot",
            "spindle_rpm": RPM,
            "feed_per_tooth_mm": feeds,
            "axial_depth_mm": 2.0,
            "radial_depth_mm": 12.0,
            "feed_direction_deg": 0.0,
            "orbit_rpm": np.nan,
            "cut_length_mm": 50.0,
            "cut_before_m": 0.0,
            "dynamometer": names,
        }
    ).set_index("run")
    tool = {"diameter_mm": 12.0, "teeth": 4, "helix_deg": 40.0}
    moments = np.arange(round(seconds * RATE)) / RATE
    records = {}
    for name, feed in zip(names, feeds, strict=True):
        speed = RPM / 60 * 2 * math.pi * (1 + 0.005 * rng.uniform(-1, 1))
        cut = Cut(feed * 1e-3, 2e-3, Engagement(0.0, math.pi))
        own = BETA * (1 + 0.01 * rng.normal(size=6))
        signal = time_signal(TOOL, EdgeLaw(), cut, own, speed=speed, time=moments, true_path=True)
        signal += rng.normal(0.0, 2.0, signal.shape)
        columns = {"t_s": moments, "fx_n": signal[:, 0], "fy_n": signal[:, 1], "fz_n": signal[:, 2]}
        records[name] = pd.DataFrame({**columns, "spindle_deg": np.nan})
    return Batch("bench", {"tool": tool}, {}, runs, {}), Records(records)


def identified(batch, read):
    observed = force.observe(batch, read, {})
    task = force.problem(batch, observed, {})
    return fit(Candidate(task.base), task.blocks, first_noise(0.007, task.scatter, task.blocks))


def test_36_runs_of_one_second_take_at_most_three(benchmark):
    batch, read = batch_of(1.0)
    found = benchmark.pedantic(identified, (batch, read), rounds=3, warmup_rounds=1)
    assert np.abs(found.beta / BETA - 1).max() < 0.03
    spent = seconds(identified, batch, read, repeats=3)
    print(f"\n{RUNS} runs of 1 s at {RATE} Hz: {spent:.2f} s")
    assert spent <= 3.0
