"""Texture of the traces of a batch: which runs are repeats, what has an interval, and what is refused."""

import numpy as np
import pandas as pd
import pytest

from metro.batch.batch import Batch
from metro.observables.texture.observable import observe

X = np.arange(0.0, 6.0, 0.001)  # mm


def batch(operations, **profiler):
    names = [f"r{i + 1}" for i in range(len(operations))]
    runs = pd.DataFrame(
        {"profile": "p.csv", "condition": "c1", "operation": operations, "order": range(len(names))},
        index=pd.Index(names, name="run"),
    )
    return Batch("b", {"instruments": {"profiler": profiler}}, {"cell": "unknown"}, runs, {})


def reader(level=False):
    def read(_table, run=None):
        z = 0.001 * np.sin(2 * np.pi * X / 0.1) * (1.0 + 0.01 * int(run[1:]))
        return pd.DataFrame({"x_mm": X, "z_mm": 0.0 * z if level else z})

    return read


def test_a_trace_alone_has_all_its_parameters():
    tables, blocks = observe(batch([""]), reader())
    assert blocks["texture"]["r1"]["Pa"]["value"] == pytest.approx(1.01 * 2 / np.pi, rel=1e-3)
    assert blocks["texture"]["r1"]["Pa"]["ci95"] == [None, None]
    assert blocks["texture"]["r1"]["Ra"]["interval"] == "scatter over 6 sections"
    assert set(tables["profile_parameters"]["profile"]) == {"P", "W", "R"}
    assert set(tables["profile_traces"]["run"]) == {"r1"}


def test_traces_of_one_place_give_the_interval_of_each_and_replicate_cuts_do_not():
    again = observe(batch(["", "", ""]), reader())[1]["texture"]["r2"]["Pa"]
    assert again["interval"] == "scatter of 3 traces"
    assert again["ci95"][1] - again["value"] == pytest.approx(4.303 * 0.01 * 2 / np.pi, rel=1e-2)
    cut = observe(batch(["side", "side"]), reader())[1]["texture"]["r2"]["Pa"]
    assert cut["ci95"] == [None, None]


def test_the_noise_of_the_profiler_gives_an_interval_where_nothing_else_does():
    found = observe(batch([""], sigma_mm=1e-5), reader())[1]["texture"]["r1"]["Pq"]
    assert found["interval"] == "noise of the points"
    assert found["ci95"][0] <= 1.01 / np.sqrt(2) <= found["ci95"][1]


def test_a_level_trace_is_refused_with_its_reason():
    tables, blocks = observe(batch([""]), reader(level=True))
    assert tables == {}
    assert blocks["texture"] == {"not_identified": {"r1": "all heights of the profile are the same"}}
