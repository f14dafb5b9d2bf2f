"""Figures of a predicted force against closed forms and waveforms whose answer is known."""

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import t

from metro.observables.force.metrics import metrics, order_spectrum, phase_shift, tooth_sectors

ANGLE = np.arange(120) * 3.0
TEETH = 4


def waveform(shift=0.0, heights=(1.0,)):
    """Band-limited teeth with different heights: a mean, the tooth passing and its harmonic, and order 1."""
    a = np.radians(ANGLE - shift)
    return 40 + 30 * np.cos(4 * a) + 10 * np.sin(8 * a + 0.3) + 6 * (heights[0] - 1) * np.cos(a)


def rows(measured, before, after=None, sigma=1.0):
    """Comparison rows of one run and axis; measured as (blocks, angles)."""
    after = before if after is None else after
    parts = [
        pd.DataFrame({"angle_deg": ANGLE, "measured": block, "before": before, "after": after})
        .assign(run="r1", axis="x", t_s=0.5 * i, sigma=sigma, unit="N")
        for i, block in enumerate(np.atleast_2d(measured))
    ]  # fmt: skip
    return pd.concat(parts, ignore_index=True)


def figure(table, metric, model="before", tooth=0):
    chosen = (table["metric"] == metric) & (table["model"] == model) & (table["tooth"] == tooth)
    (row,) = table[chosen].to_dict("records")
    return row


def test_a_prediction_that_is_ten_percent_low_is_ten_percent_wrong_in_every_figure():
    table = metrics(rows(waveform(), 0.9 * waveform()), TEETH)
    assert figure(table, "nrmse")["value"] == pytest.approx(10.0)
    assert figure(table, "peak")["percent"] == pytest.approx(-10.0)
    assert figure(table, "mean")["value"] == pytest.approx(-4.0)
    assert figure(table, "mean")["percent"] == pytest.approx(-10.0)
    assert figure(table, "phase")["value"] == pytest.approx(0.0, abs=1e-9)
    assert [figure(table, "tooth_peak", tooth=k)["percent"] for k in (1, 2, 3, 4)] == pytest.approx(
        [-10.0] * 4
    )


def test_nrmse_is_rms_of_the_difference_over_rms_of_the_measured_of_all_blocks():
    rng = np.random.default_rng(3)
    measured = waveform() + rng.normal(0, 5, (3, 120))
    value = figure(metrics(rows(measured, waveform()), TEETH), "nrmse")["value"]
    difference = (measured - waveform()).ravel()
    assert value == pytest.approx(100 * np.linalg.norm(difference) / np.linalg.norm(measured))


def test_before_and_after_are_told_apart():
    table = metrics(rows(waveform(), 0.8 * waveform(), waveform()), TEETH)
    assert figure(table, "nrmse", "before")["value"] == pytest.approx(20.0)
    assert figure(table, "nrmse", "after")["value"] == pytest.approx(0.0)


@settings(max_examples=60, deadline=None)
@given(st.floats(-44.0, 44.0))
def test_a_shift_between_the_samples_is_found(shift):
    assert phase_shift(waveform(shift), waveform(), TEETH) == pytest.approx(shift, abs=0.01)


def test_a_shift_by_a_whole_pitch_is_none_when_the_teeth_are_equal():
    assert phase_shift(waveform(90.0), waveform(), TEETH) == pytest.approx(0.0, abs=1e-6)


def test_a_constant_force_has_no_phase():
    assert math.isnan(phase_shift(waveform(), np.full(120, 7.0), TEETH))


def test_the_largest_magnitude_counts_whatever_its_sign():
    table = metrics(rows(-waveform(), -0.5 * waveform()), TEETH)
    top = waveform().max()
    assert figure(table, "peak")["measured"] == pytest.approx(top)
    assert figure(table, "peak")["value"] == pytest.approx(-0.5 * top)


@pytest.mark.parametrize("turn", [0, 13, 29, 71])
@pytest.mark.parametrize("teeth", [2, 3, 4, 7])
def test_each_tooth_has_its_own_peak_wherever_the_record_starts(turn, teeth):
    heights = 10.0 + np.arange(teeth)
    centre = (np.arange(teeth) + 0.5) * 360 / teeth
    off = (ANGLE[:, None] - centre + 180) % 360 - 180
    force = np.roll((heights * np.exp(-0.5 * (off * teeth / 40) ** 2)).sum(axis=1), turn)
    table = metrics(rows(force, force), teeth)
    found = [figure(table, "tooth_peak", tooth=k + 1)["measured"] for k in range(teeth)]
    start = found.index(min(found))
    assert found[start:] + found[:start] == pytest.approx(heights, rel=0.04)


def test_sectors_are_as_wide_as_the_pitch():
    sectors = tooth_sectors(np.roll(waveform(), 5)[None, :], TEETH)
    assert np.bincount(sectors).tolist() == [30] * 4
    assert np.count_nonzero(np.diff(sectors)) in {3, 4}


def test_the_interval_is_students_over_the_blocks():
    offsets = np.array([0.5, -1.0, 2.0, 0.9])
    table = metrics(rows(waveform() + offsets[:, None], waveform()), TEETH)
    row = figure(table, "mean")
    half = t.ppf(0.975, 3) * offsets.std(ddof=1) / 2
    assert row["value"] == pytest.approx(-offsets.mean())
    assert (row["lo"], row["hi"]) == pytest.approx((-offsets.mean() - half, -offsets.mean() + half))


def test_intervals_over_blocks_cover_the_truth_as_often_as_they_say():
    rng = np.random.default_rng(11)
    truth, hits = waveform(), 0
    for _ in range(200):
        table = metrics(rows(truth + rng.normal(0, 3, (4, 120)), truth), TEETH)
        row = figure(table, "mean")
        hits += row["lo"] <= 0.0 <= row["hi"]
    assert 180 <= hits <= 198


def test_one_block_has_its_interval_from_sigma():
    row = figure(metrics(rows(waveform(), 0.9 * waveform(), sigma=2.0), TEETH), "peak")
    assert row["hi"] - row["lo"] == pytest.approx(2 * 1.96 * 2.0)


def test_a_shift_within_sigma_is_within_the_interval_of_the_phase():
    slope = np.sqrt(np.mean(np.gradient(waveform(), 3.0) ** 2))
    row = figure(metrics(rows(waveform(0.5), waveform(), sigma=0.5 * slope), TEETH), "phase")
    assert row["lo"] <= 0.0 <= row["hi"]
    assert row["hi"] - row["lo"] == pytest.approx(2 * 1.96 * 0.5, rel=0.05)


def test_blocks_with_other_angles_are_refused_by_name():
    with pytest.raises(ValueError, match="run r1, axis x"):
        metrics(rows(np.stack([waveform(), waveform()]), waveform()).iloc[:-1], TEETH)


def test_the_spectrum_holds_the_amplitudes_that_were_put_in():
    table = order_spectrum(rows(np.stack([waveform(0.0, (2.0,))] * 2), waveform())).set_index("order")
    assert table["measured"].loc[[0, 1, 4, 8]].tolist() == pytest.approx([40, 6, 30, 10])
    assert table["before"].loc[[0, 1, 4, 8]].tolist() == pytest.approx([0, 6, 0, 0], abs=1e-9)
    assert table.index.max() == 8


def test_the_spectrum_is_the_rms_over_runs_and_blocks():
    table = order_spectrum(rows(np.stack([waveform(), 3 * waveform()]), waveform())).set_index("order")
    assert table["measured"][4] == pytest.approx(30 * math.sqrt((1 + 9) / 2))
