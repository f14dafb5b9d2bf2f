"""Chatter in simulated test cuts with loss of contact: found where it is, and in nothing else."""

from dataclasses import replace

import cuts
import numpy as np
import pytest

from metro.dynamics.lobes import spectral_radius
from metro.signals import chatter
from metro.signals.chatter import detect, evidence, held, probability_of
from virtual_cell.regeneration import march

RPM = np.array([1000.0, 1500.0, 2000.0, 2500.0])
RINGING = replace(cuts.SENSOR, resonance=((500.0, 0.02), (900.0, 0.02), (1200.0, 0.02)))
STABLE = 0.4  # of the depth at the boundary


def found(history, rpm, **settings):
    """Detection in each test."""
    records = cuts.recorded(history, rpm, **settings)
    return [detect(time, angle, read, cuts.TEETH) for time, angle, read in records]


def grid(rpm, factors):
    """Speeds and depths of tests at some factors of the depth at the boundary."""
    return np.repeat(rpm, len(factors)), np.outer(cuts.boundary(rpm), factors).ravel()


@pytest.fixture(scope="module")
def tested():
    rpm, depth = grid(RPM, (0.5, 0.85, 1.25, 1.8))
    history, unstable = cuts.bracketed(rpm, depth, 130, runout=3e-6, scatter=0.02, entry=15)
    sensor = replace(RINGING, slope=(3.0, -5.0, 2.0))
    return rpm, depth, unstable, found(history, rpm, skip=15, sensor=sensor), history


def test_every_test_off_the_boundary_is_told_right(tested):
    _, _, unstable, detections, _ = tested
    said = np.array([d.probability > 0.5 for d in detections])
    off = unstable >= 0
    assert np.count_nonzero(off) >= 14
    np.testing.assert_array_equal(said[off], unstable[off] > 0)


def test_the_simulated_tests_agree_with_the_lobes_off_the_boundary(tested):
    rpm, depth, unstable, *_ = tested
    radius = (
        np.array([spectral_radius(cuts.STRUCTURE, cuts.SLOT, rpm, f * depth) for f in (0.9, 1.0, 1.1)]) > 1
    )
    off = (unstable >= 0) & (radius.all(axis=0) | ~radius.any(axis=0))
    np.testing.assert_array_equal(unstable[off] > 0, radius[1][off])


def test_chatter_is_a_hopf_bifurcation_with_the_tips_own_frequency(tested):
    rpm, _, unstable, detections, history = tested
    for i in np.flatnonzero(unstable > 0):
        tip = history.tip[i, 30 * cuts.PER_TURN :]
        revolutions = len(tip) / cuts.PER_TURN
        spectrum = np.abs(np.fft.rfft(tip * np.hanning(len(tip))[:, None], 8 * len(tip), axis=0)).sum(axis=1)
        order = np.arange(len(spectrum)) / (8 * revolutions)
        spectrum[np.abs(order - np.round(order)) < 4 / revolutions] = 0.0
        own = order[np.argmax(spectrum)] * rpm[i] / 60
        assert detections[i].kind == "hopf"
        assert abs(detections[i].chatter_hz - own) < 4 * detections[i].chatter_sd_hz + 0.1


def test_acceleration_tells_the_same(tested):
    rpm, _, unstable, *_, history = tested
    rng = np.random.default_rng(3)
    for i in np.flatnonzero(unstable >= 0)[::3]:
        time = np.arange(15 * 60 / rpm[i], 125 * 60 / rpm[i], 1 / cuts.RATE)
        signal = history.at(i, time, "acceleration")
        signal = signal + 0.05 * rng.standard_normal(signal.shape)
        one = detect(time, time * rpm[i] * 2 * np.pi / 60, signal, cuts.TEETH, differentiated=2)
        assert (one.probability > 0.5) == (unstable[i] > 0)


def never_alarms(rpm=RPM[::2], sensor=cuts.SENSOR, **settings):
    """Cut stably with some effect, and look that nobody calls it chatter."""
    history = march(
        cuts.trials(rpm, STABLE * cuts.boundary(rpm), edges=0.25, **settings), 70, cuts.PER_TURN, 1
    )
    for one in found(history, rpm, sensor=sensor, skip=10):
        assert one.probability < 0.05
        assert one.kind == "forced"
        assert not one.chattering.any()


@pytest.mark.parametrize("runout", [5e-6, 30e-6])
def test_runout_alone_is_no_chatter_even_where_teeth_do_not_cut(runout):
    never_alarms(runout=runout, scatter=0.02)


def test_wear_alone_is_no_chatter():
    never_alarms(wear=20.0, scatter=0.02)


@pytest.mark.parametrize("drift", [{"slope": (20.0, -40.0, 30.0)}, {"time_constant": (1.0, 2.0, 1.5)}])
def test_drift_alone_is_no_chatter(drift):
    never_alarms(sensor=replace(cuts.SENSOR, **drift), scatter=0.02)


@pytest.mark.parametrize("scatter", [0.0, 0.1])
def test_a_ringing_dynamometer_alone_is_no_chatter_whatever_excites_it(scatter):
    never_alarms(sensor=RINGING, scatter=scatter)


def test_noise_of_the_force_below_the_boundary_is_no_chatter():
    history = march(cuts.trials(RPM, 0.8 * cuts.boundary(RPM), scatter=0.05), 90, cuts.PER_TURN, 2)
    assert max(one.probability for one in found(history, RPM, skip=10)) < 0.2


def test_entering_vibration_that_dies_out_is_no_chatter():
    history = march(cuts.trials(RPM, 0.7 * cuts.boundary(RPM), edges=0.0), 60, cuts.PER_TURN)
    assert cuts.spread(history, 60).max() > cuts.VISIBLE
    assert max(one.probability for one in found(history, RPM)) < 0.1


def test_chatter_locked_to_an_order_of_the_spindle_is_said_not_to_be_separable():
    rpm = np.array([1370.0])
    depth = 1.5 * cuts.boundary(rpm)
    assert spectral_radius(cuts.STRUCTURE, cuts.SLOT, rpm, depth)[0] > 1.0
    history = march(cuts.trials(rpm, depth, runout=3e-6, scatter=0.02, entry=20), 140, cuts.PER_TURN)
    (one,) = found(history, rpm, skip=20)
    assert not one.separable
    assert one.kind == "unknown"
    assert one.probability >= 0.5


def test_chatter_is_held_from_three_windows_on_and_released_below_a_tenth():
    looks = np.ones(10, dtype=bool)
    ratio = np.array([0.3, 0.3, 0.05, 0.3, 0.4, 0.5, 0.15, 0.12, 0.05, 0.3])
    np.testing.assert_array_equal(held(ratio, looks).astype(int), [0, 0, 0, 1, 1, 1, 1, 1, 0, 0])
    assert not held(ratio, ~looks).any()


def test_evidence_is_what_two_windows_in_a_row_reach():
    assert evidence(np.array([0.9, 0.1, 0.9, 0.2, 0.15, 0.0])) == pytest.approx(np.log(0.2 / 0.8))
    assert evidence(np.array([0.9, 0.0, 0.9, 0.0, 0.9])) < -6.0


def test_energy_without_a_sign_must_be_much_and_a_sign_without_energy_is_nothing():
    at = np.log(chatter.BEGINS / (1 - chatter.BEGINS))
    assert probability_of(at, 0.2, 0.0) < 0.1
    assert probability_of(2.0, 0.2, 0.0) > 0.9
    assert probability_of(at, 1.0, 1.0) > 0.95
    assert probability_of(-7.0, 1.0, 1.0) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(
    ("edges", "scatter", "noise"), [(0.1, 0.02, 2.0), (0.25, 0.05, 2.0), (1.0, 0.02, 5.0), (0.05, 0.1, 10.0)]
)
def test_the_published_grid_is_told_right_in_97_of_100(edges, scatter, noise):
    """Speeds 1000 to 2500, the published depths and finer ones; the truth is the tip's own motion."""
    speeds, depths = (
        np.arange(1000.0, 2501.0, 125.0),
        np.array([0.01, 0.02, 0.03, 0.05, 0.1, 0.15, 0.2]) * 1e-3,
    )
    rpm, depth = (a.ravel() for a in np.meshgrid(speeds, depths, indexing="ij"))
    settings = {"edges": edges, "scatter": scatter, "runout": 5e-6, "wear": 0.1, "entry": 20}
    history, unstable = cuts.bracketed(rpm, depth, 150, **settings)
    sensor = replace(RINGING, noise=noise, slope=(3.0, -5.0, 2.0))
    detections = found(history, rpm, skip=20, sensor=sensor)
    told = (unstable >= 0) & [d.probability != chatter.UNDECIDED for d in detections]
    right = np.array([d.probability > 0.5 for d in detections])[told] == (unstable[told] > 0)
    assert np.count_nonzero(told) > 0.85 * len(rpm)
    assert 15 < np.count_nonzero(unstable > 0) < len(rpm) - 15
    assert right.mean() >= 0.97


@pytest.mark.slow
def test_the_probability_is_calibrated_near_the_boundary():
    rpm, depth = grid(np.arange(1070.0, 2501.0, 110.0), (0.75, 0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.3))
    history = march(cuts.trials(rpm, depth, scatter=0.05, runout=5e-6, entry=20), 150, cuts.PER_TURN, 11)
    unstable = cuts.spread(history) > cuts.VISIBLE
    detections = found(history, rpm, skip=20, sensor=RINGING, seed=4)
    told = np.array([d.probability != chatter.UNDECIDED for d in detections])
    said = np.array([d.probability for d in detections])[told]
    truth = unstable[told].astype(float)
    sd = np.sqrt(np.sum(said * (1 - said)))
    assert abs(np.sum(said - truth)) < 3 * sd
    assert np.mean((said - truth) ** 2) < 0.05
