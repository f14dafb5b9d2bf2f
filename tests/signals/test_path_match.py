"""Whether an idle run is that of the cut: paths, speeds and clocks that are made to differ."""

from __future__ import annotations

import numpy as np
import pytest

from metro.signals.path_match import match

RATE = np.array([[0.01, -0.02, 0.005], [0.012, -0.03, 0.0]])


def run(start=0.0, end=0.1, *, speed=0.01, aside=0.0, phase=0.0):
    """A bent path: x along, y a parabola, lifted by ``aside``; stamps from the start of the log."""
    period = 0.012
    x = np.arange(start + phase * speed * period, end, speed * period)
    return np.column_stack([x, 5 * x**2, np.full_like(x, aside)]), period * np.arange(len(x))


def test_two_runs_of_one_programme_have_nothing_to_be_said_of():
    found = match(*run(), *run(start=-0.002, end=0.102, phase=0.4))
    assert found.refusal is None
    assert found.remarks(RATE) == []
    assert found.covered == pytest.approx(1.0, abs=0.01)
    assert found.apart < 1e-6
    assert found.pace == pytest.approx(1.0, abs=1e-5)
    # the idle run set out 2 mm earlier: its clock reads 0.2 s where the cut's starts
    assert found.offset == pytest.approx(-0.2, abs=0.006)


def test_a_lifted_idle_run_is_stated_with_its_distance_and_another_path_refused():
    near = match(*run(), *run(aside=0.004))
    assert near.refusal is None
    assert near.remarks(RATE) == ["the idle run is 4.00 mm (rms; at most 4.00 mm) from the cut's path"]
    far = match(*run(), *run(aside=0.03))
    assert "30.0 mm (rms) from the cut's path, expected at most 10 mm" in far.refusal


def test_another_speed_is_stated_with_what_it_does_to_friction():
    found = match(*run(), *run(speed=0.012))
    assert found.pace == pytest.approx(1.2, rel=1e-3)
    [unknown] = found.remarks(RATE)
    assert "+20.0 % faster" in unknown
    assert "up to 0.006 N m per N m s/rad of viscous friction (joint 2; it is not known here)" in unknown
    [known] = found.remarks(RATE, np.array([3000.0, 100.0, 50.0]))
    assert "viscous friction differs by up to 7.2 N m (joint 1)" in known


@pytest.mark.parametrize("drift", [3e-3, -4e-4])
def test_a_drift_of_the_clocks_is_found_within_its_interval(drift):
    cut, cut_time = run(phase=0.3)
    idle, idle_time = run()
    jitter = np.random.default_rng(3).normal(0, 5e-4, len(cut_time))
    found = match(cut, 1.7 + (1 + drift) * cut_time + jitter, idle, idle_time)
    assert abs(found.pace - 1 - drift) < 3 * found.pace_sd
    assert found.pace_sd < 5e-5
    [said] = found.remarks(RATE)
    assert said.startswith(f"the clocks drift: {found.pace - 1:+.2e}")


def test_a_short_idle_run_is_stated_and_one_below_half_refused():
    found = match(*run(), *run(end=0.08))
    # arc length of the parabola up to x: (u √(1 + u²) + asinh u) / 20, u = 10 x
    part, whole = ((u * np.hypot(1, u) + np.arcsinh(u)) / 20 for u in (0.8, 1.0))
    assert found.covered == pytest.approx(part / whole, abs=2e-3)
    assert found.remarks(RATE) == ["the idle run covers 76 % of the cut's path: no force elsewhere"]
    assert "covers" in match(*run(), *run(end=0.03)).refusal


def test_a_run_elsewhere_covers_nothing():
    found = match(*run(), *run(start=0.3, end=0.4))
    assert found.covered == 0.0
    assert "covers 0.0 mm" in found.refusal
