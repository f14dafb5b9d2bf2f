"""Each check of a record's quality, on signals made to have the fault or to look as if they had it."""

import numpy as np
import pytest

from metro.signals import quality

TIME = np.arange(2000) * 1e-3


def by_name(findings):
    return {finding.check: finding for finding in findings}


def test_a_regular_record_at_its_declared_rate_has_no_fault():
    found = by_name(quality.sampling(TIME, 1000.0))
    assert all(finding.ok for finding in found.values())
    assert found["sampling rate"].value == pytest.approx(1000.0)
    assert found["gaps"].value == 0


def test_another_rate_than_the_declared_one_is_reported():
    found = by_name(quality.sampling(TIME, 1024.0))["sampling rate"]
    assert not found.ok
    assert found.limit == 1024.0
    assert "declared 1024 Hz" in found.message


def test_without_a_declared_rate_the_rate_is_stated():
    found = by_name(quality.sampling(TIME))["sampling rate"]
    assert found.ok
    assert np.isnan(found.limit)


def test_rounded_time_stamps_do_not_spoil_the_rate():
    rounded = np.round(np.arange(51200) / 51200.0, 6)
    found = by_name(quality.sampling(rounded, 51200.0))["sampling rate"]
    assert found.value == pytest.approx(51200.0, rel=1e-4)


def test_gaps_are_counted_and_do_not_spoil_the_rate():
    time = np.delete(TIME, [*range(100, 110), 500])
    found = by_name(quality.sampling(time, 1000.0))
    assert found["gaps"].value == 2
    assert not found["gaps"].ok
    assert "the longest 11 ms" in found["gaps"].message
    assert "11 samples missing" in found["gaps"].message
    assert found["sampling rate"].value == pytest.approx(1000.0)


def test_jitter_is_the_scatter_of_the_step_relative_to_it():
    steps = 1e-3 * (1.0 + 0.2 * (-1.0) ** np.arange(2000))
    found = by_name(quality.sampling(np.cumsum(steps)))["jitter"]
    assert found.value == pytest.approx(0.2, rel=1e-3)
    assert not found.ok


WAVE = 100.0 * np.sin(2.0 * np.pi * 13.7 * TIME)


@pytest.mark.parametrize("values", [np.minimum(WAVE, 80.0), np.maximum(WAVE, -80.0)])
def test_a_flat_top_at_the_records_extreme_is_a_clip(values):
    found = quality.flat_tops("Fx", values)
    assert not found.ok
    assert found.value >= 5
    assert "80" in found.message


def test_a_wave_is_not_clipped():
    assert quality.flat_tops("Fx", WAVE, 5000.0).ok


def test_full_scale_is_a_clip_even_where_noise_rides_on_it():
    noisy = np.minimum(WAVE, 80.0) + np.where(WAVE > 80.0, np.abs(np.sin(1e3 * TIME)), 0.0)
    assert quality.flat_tops("Fx", noisy).ok
    assert not quality.flat_tops("Fx", noisy, 80.0).ok


def test_four_samples_at_the_extreme_are_no_clip_and_five_are():
    values = np.sin(np.arange(100.0))
    values[50:54] = 2.0
    assert quality.flat_tops("Fx", values).ok
    values[54] = 2.0
    assert quality.flat_tops("Fx", values).value == 5


def test_the_top_of_a_slow_wave_sampled_coarsely_is_no_clip():
    coarse = 2.5 * np.round(100.0 * np.sin(2.0 * np.pi * 3.0 * TIME) / 2.5)
    assert np.max(np.diff(np.flatnonzero(np.diff(coarse)))) > 10
    assert quality.flat_tops("Fx", coarse).ok


def test_a_gated_hammer_force_is_not_clipped_at_zero():
    force = np.where((TIME > 0.1) & (TIME < 0.11), 200.0 * np.sin((TIME - 0.1) * np.pi / 0.01), 0.0)
    assert quality.flat_tops("force", force).ok


def test_a_constant_channel_is_dead_and_not_clipped():
    assert not quality.dead("Fz", np.full(50, 3.0)).ok
    assert quality.flat_tops("Fz", np.full(50, 3.0)).ok
    assert quality.dead("Fz", WAVE).ok


def air_offset(names, values):
    return quality.zero_in_air(names, quality.blocks_of(values), float(np.abs(values).max()))


def cut(offset, air):
    random = np.random.default_rng(3)
    force = 200.0 * np.sin(2.0 * np.pi * 50.0 * TIME) + 150.0
    in_cut = np.searchsorted(TIME, [air[0], 2.0 - air[1]])
    force[: in_cut[0]] = force[in_cut[1] :] = 0.0
    return np.column_stack([force, 0.5 * force]) + offset + random.normal(size=(len(TIME), 2))


@pytest.mark.parametrize("air", [(0.4, 0.0), (0.0, 0.4), (0.3, 0.3)])
def test_the_zero_is_read_where_the_tool_cuts_air(air):
    found = air_offset(("Fx", "Fy"), cut(np.array([40.0, -1.0]), air))
    assert [finding.ok for finding in found] == [False, True]
    assert found[0].value == pytest.approx(40.0, abs=0.3)
    assert found[1].value == pytest.approx(-1.0, abs=0.3)


def test_a_record_of_the_cut_alone_tells_nothing_of_its_zero():
    assert air_offset(("Fx", "Fy"), cut(np.array([40.0, 0.0]), (0.0, 0.0))) == []


@pytest.mark.parametrize("entry", [0.0, 0.3], ids=["in the cut from the start", "entering"])
def test_a_cut_that_is_calm_before_it_chatters_is_no_air(entry):
    """Chatter of ten times the force; before, the teeth alone."""
    random = np.random.default_rng(5)
    engaged = np.clip(TIME / entry, 0.0, 1.0) if entry else np.ones(len(TIME))
    teeth = engaged * (30.0 + 15.0 * np.sin(2.0 * np.pi * 50.0 * TIME))
    chatter = 300.0 * np.clip((TIME - 0.4) / 0.1, 0.0, 1.0) * np.sin(2.0 * np.pi * 331.0 * TIME)
    force = teeth + chatter + random.normal(size=len(TIME))
    assert air_offset(("Fx", "Fy"), np.column_stack([force, -1.4 * force])) == []


def test_a_record_too_short_for_blocks_tells_nothing_of_its_zero():
    assert air_offset(("Fx",), np.ones((60, 1))) == []


def test_missing_points_are_reported_as_a_share():
    assert quality.missing_points(0, 100).ok
    found = quality.missing_points(75, 25)
    assert found.value == 0.75
    assert not found.ok


def test_a_driving_point_that_gives_out_power_is_conjugated():
    assert quality.conjugated(-0.5).ok
    assert "e^{+iωt}" in quality.conjugated(0.5).message
    reversed_sensor = quality.conjugated(0.5, -0.2)
    assert (reversed_sensor.check, reversed_sensor.ok) == ("FRF sign", False)
    assert "points the other way" in reversed_sensor.message
