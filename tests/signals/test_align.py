"""Alignment of two logs by position."""

from __future__ import annotations

import numpy as np
import pytest

from metro.signals.align import align, along_path, bin_means, moving, projected


def log(start, end, speed=0.01, period=0.012, offset=0.0):
    """A straight path along x from ``start`` to ``end`` (m) with a dwell of one second at both ends."""
    travel = np.arange(start, end, speed * period)
    x = np.concatenate([np.full(83, start), travel, np.full(83, end)])
    return np.column_stack([x, np.full_like(x, offset), np.zeros_like(x)])


def torque(x):
    return np.column_stack([50 * np.sin(300 * x), 20 * x])


def test_logs_that_started_apart_agree_where_they_are_at_the_same_place():
    cut, idle = log(0.0, 0.05), log(-0.004, 0.055)
    reference = cut[moving(cut)]
    s_cut = np.where(moving(cut), along_path(cut, reference), np.nan)
    s_idle = np.where(moving(idle), along_path(idle, reference), np.nan)
    found = align(s_cut, torque(cut[:, 0]) + np.array([7.0, -3.0]), s_idle, torque(idle[:, 0]))
    assert len(found.s) >= 48
    np.testing.assert_allclose(found.first - found.second, np.tile([7.0, -3.0], (len(found.s), 1)), atol=1.2)
    np.testing.assert_allclose(found.second, torque(found.s), atol=1.2)


def test_time_alignment_would_have_been_wrong():
    """The same comparison sample by sample is off by as much as the torque: the test above can fail."""
    cut, idle = log(0.0, 0.05), log(-0.004, 0.055)
    n = min(len(cut), len(idle))
    assert np.abs(torque(cut[:n, 0]) - torque(idle[:n, 0]))[:, 0].max() > 40


def test_position_along_a_bent_path_is_its_arc_length():
    angle = np.linspace(0, np.pi, 500)
    reference = 0.1 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    probe = np.array([0.3, 1.2, 2.9])
    points = 0.103 * np.column_stack([np.cos(probe), np.sin(probe), 0 * probe])
    np.testing.assert_allclose(along_path(points, reference), 0.1 * probe, rtol=1e-4)


def test_points_beyond_the_ends_of_the_path_have_no_position():
    reference = np.column_stack([np.linspace(0, 1, 11), np.zeros(11), np.zeros(11)])
    s = along_path(np.array([[-0.2, 0, 0], [0.0, 0.1, 0], [0.55, 0, 0], [1.1, 0, 0]]), reference)
    np.testing.assert_allclose(s, [np.nan, 0.0, 0.55, np.nan])


def test_standstill_does_not_count():
    path = log(0.0, 0.02)
    assert moving(path).sum() == pytest.approx(0.02 / (0.01 * 0.012), abs=2)


def test_a_bin_holds_the_mean_of_its_samples_and_an_empty_one_nothing():
    s = np.array([0.1, 0.2, 1.5, np.nan, 9.0])
    found = bin_means(s, np.array([[2.0], [4.0], [7.0], [99.0], [99.0]]), np.array([0.0, 1.0, 2.0, 3.0]))
    np.testing.assert_allclose(found, [[3.0], [7.0], [np.nan]])


def test_an_idle_run_that_is_too_short_is_refused_with_its_length():
    s = np.linspace(0, 0.05, 400)
    with pytest.raises(ValueError, match=r"covers 20\.1 mm of the 50\.0 mm"):
        align(s, torque(s), s[s < 0.0201], torque(s[s < 0.0201]))


def test_a_missing_idle_run_is_refused():
    s = np.linspace(0, 0.05, 400)
    with pytest.raises(ValueError, match=r"covers 0\.0 mm"):
        align(s, torque(s), s[:0], torque(s[:0]))


def test_bins_below_half_a_millimetre_are_refused():
    s = np.linspace(0, 0.05, 400)
    with pytest.raises(ValueError, match=r"0\.5 mm"):
        align(s, torque(s), s, torque(s), width=4e-4)


def test_logs_whose_samples_lie_apart_agree_to_a_thousandth_of_a_sample_on_a_slope():
    step = 3e-4
    s_cut, s_idle = np.arange(0, 0.05, step) + 0.31 * step, np.arange(0, 0.05, step) + 0.83 * step
    steep = 2000.0
    found = align(s_cut, steep * s_cut[:, None], s_idle, steep * s_idle[:, None])
    np.testing.assert_allclose(found.first - found.second, 0.0, atol=1e-3 * steep * step)
    plain = [bin_means(s, steep * s[:, None], 1e-3 * np.arange(50)) for s in (s_cut, s_idle)]
    assert np.nanmax(np.abs(plain[0] - plain[1])) > 0.2 * steep * step


def test_the_distance_from_a_path_is_that_of_its_chords():
    reference = np.column_stack([np.linspace(0, 1, 11), np.zeros(11), np.zeros(11)])
    _, away = projected(np.array([[0.55, 0.3, 0.4], [1.2, 0.0, 0.0]]), reference)
    np.testing.assert_allclose(away, [0.5, 0.2])


def test_where_samples_were_lost_a_bin_with_less_than_half_of_its_samples_is_left_out():
    s = np.arange(0.1e-3, 40e-3, 0.2e-3)
    noisy = np.random.default_rng(3).normal(size=(len(s), 1))
    # five samples a bin of a millimetre: one is left of the bin from 10 mm, four of that from 20 mm
    kept = ~((s > 10.2e-3) & (s < 14e-3) | (s > 20.0e-3) & (s < 20.2e-3))
    whole = align(s, noisy, s, noisy, 1e-3)
    for first, second in ((s[kept], s), (s, s[kept])):
        values = noisy[kept] if first is not s else noisy, noisy[kept] if second is not s else noisy
        found = align(first, values[0], second, values[1], 1e-3, gaps=True)
        lost = np.setdiff1d(whole.s.round(6), found.s.round(6))
        np.testing.assert_allclose(lost, whole.s[10:14], atol=1e-6)
        assert len(align(first, values[0], second, values[1], 1e-3).s) == len(found.s) + 1
