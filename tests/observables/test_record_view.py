"""Raw records in the report: spans that miss no sample, and hits with the spectrum of their pulse."""

import numpy as np
import pandas as pd
import pytest
from fake_tables import FakeTables

from metro.batch.batch import Batch
from metro.batch.processed import COLUMNS
from metro.observables.cut.record_view import MOST_RUNS, STRETCHES, record_tables

RATE = 10_000.0


def batch(names):
    runs = pd.DataFrame(
        {"order": range(len(names)), "dynamometer": "a.csv"}, index=pd.Index(names, name="run")
    )
    return Batch("b", {}, {}, runs, {})


def record(samples):
    rng = np.random.default_rng(1)
    force = rng.normal(0, 1, (samples, 3))
    force[samples // 3, 1] = 70.0  # a single sample that stands out
    table = pd.DataFrame(force, columns=["fx_n", "fy_n", "fz_n"])
    return table.assign(run="r1", t_s=5.0 + np.arange(samples) / RATE, spindle_deg=np.nan)


def tables(force, hit=None):
    empty = pd.DataFrame(columns=list(COLUMNS["hit"]))
    return FakeTables(lambda name, *_: force if name == "force" else empty if hit is None else hit)


@pytest.mark.parametrize("stretch", [1 << 19, 1_000, 77])
def test_the_span_of_a_record_holds_every_sample_however_it_is_read(stretch, monkeypatch):
    monkeypatch.setattr("metro.observables.cut.long_record.STRETCH", stretch)
    force = record(10_007)
    found = record_tables(batch(["r1"]), tables(force), None)["force_records"]
    along = found[found["axis"] == "y"]
    assert len(along) == STRETCHES
    assert along["high_n"].max() == 70.0
    spike = float(along.loc[along["high_n"].idxmax(), "t_s"])
    assert spike == pytest.approx(5.0 + 10_007 // 3 / RATE, abs=10_007 / RATE / STRETCHES)
    for axis in "xyz":
        part = found[found["axis"] == axis]
        assert part["low_n"].min() == force[f"f{axis}_n"].min()
        assert (part["low_n"] <= part["high_n"]).all()


def test_of_many_records_those_that_failed_a_check_are_shown():
    names = [f"r{i:02d}" for i in range(MOST_RUNS + 6)]
    checks = pd.DataFrame({"run": names, "ok": [name != names[-1] for name in names]})
    found = record_tables(batch(names), tables(record(500)), checks)["force_records"]
    shown = list(found["run"].unique())
    assert shown == [*names[: MOST_RUNS - 1], names[-1]]


def hits(time, force, reference="1x", response="1x"):
    place = {"test": "h", "position": "1", "reference": reference, "response": response, "replicate": 1}
    return pd.DataFrame({"t_s": time, "force_n": force, **place})


def test_hits_along_other_axes_are_hits_of_their_own_and_responses_to_one_are_not():
    time = np.arange(2_000) / 50_000.0
    force = np.where(np.abs(time - 0.02) < 2e-4, 100.0, 0.0)
    both = pd.concat(
        [hits(time, force), hits(time, force, response="2x"), hits(time, 3.0 * force, "1z", "1z")]
    )
    found = record_tables(batch([]), tables(None, both), None)["hit_records"]
    pulses = found[found["part"] == "pulse"].groupby("hit")["value"]
    assert pulses.max().to_list() == [100.0, 300.0]
    assert pulses.size().nunique() == 1


def test_a_hit_has_the_spectrum_of_its_pulse():
    """Half a sine of 1 ms: |cos(π f T) / (1 − 4 f² T²)|, the Fourier transform in closed form."""
    lasting, time = 1e-3, np.arange(20_000) / 50_000.0
    inside = (time > 0.1) & (time < 0.1 + lasting)
    force = np.where(inside, 300.0 * np.sin(np.pi * (time - 0.1) / lasting), 0.0)
    hit = hits(time, force)
    found = record_tables(batch([]), tables(None, hit), None)["hit_records"]
    pulse, spectrum = (found[found["part"] == part] for part in ("pulse", "spectrum"))
    assert pulse["value"].max() == pytest.approx(300.0, rel=1e-3)
    assert pulse["x"].min() < -0.5 < 0.5 < pulse["x"].max()
    low = spectrum[(spectrum["x"] > 300) & (spectrum["x"] < 1200)]
    ft = low["x"].to_numpy() * lasting
    exact = 20 * np.log10(np.abs(np.cos(np.pi * ft) / (1 - 4 * ft**2)))
    offset = low["value"].to_numpy() - exact  # its level at low frequency is that of a stretch of the band
    assert np.ptp(offset) < 0.2
    assert abs(offset.mean()) < 1.0


def test_a_batch_without_records_has_neither_table():
    assert record_tables(batch([]), tables(None), None) == {}
