"""The tip's response: against closed forms, solve_ivp, and an arm that changes smoothly."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from metro.surface.tip_response import TipModes, disc_weights, respond, tip_modes

MASS = np.array([[654.58, 0.0, 382.51], [0.0, 903.38, 0.0], [382.51, 0.0, 269.57]])
STIFFNESS = np.diag([3.32e5, 7.15e5, 8.77e5])
A0, A1 = 0.9228, 0.00209
PUSH = np.array([-10.0, 120.0, 90.0])


def rayleigh(modes: TipModes) -> np.ndarray:
    return A0 / (2 * modes.frequency) + A1 * modes.frequency / 2


def in_segments(force: np.ndarray, segments: int) -> np.ndarray:
    """Force (s · m + 1, 3) as (s, m + 1, 3), end samples shared."""
    m = (len(force) - 1) // segments
    return force[np.arange(segments)[:, None] * m + np.arange(m + 1)]


def integrated(mass: list, stiffness: list, force: np.ndarray, step: float) -> np.ndarray:
    """Height at the samples of segments (s, m + 1, 3) of force, by solve_ivp interval by interval."""
    from scipy.integrate import solve_ivp

    state, heights = np.zeros(6), []
    for m, k, part in zip(mass, stiffness, force, strict=True):
        inverse, damping = np.linalg.inv(m), A0 * m + A1 * k
        for before, after in itertools.pairwise(part):
            heights.append(state[2])

            def motion(time, now, *, a=before, b=after, k=k, c=damping, w=inverse):
                push = a + (b - a) * time / step
                return np.concatenate([now[3:], w @ (push - c @ now[3:] - k @ now[:3])])

            state = solve_ivp(motion, (0, step), state, method="DOP853", rtol=1e-10, atol=1e-16).y[:, -1]
    return np.array(heights)


@pytest.mark.parametrize("ratio", [0.0, 0.05, 1.0, 1.0 + 1e-9, 3.0])
def test_a_step_rings_as_the_closed_form_at_two_samples_a_period(ratio: float) -> None:
    omega, k = 20.0, 4.0e4
    modes = tip_modes(np.eye(3) * k / omega**2, np.eye(3)[None] * k)
    time = 0.15 * np.arange(31)
    force = np.tile([0.0, 0.0, 100.0], (31, 1))
    decay = np.exp(-ratio * omega * time)
    if ratio < 1:
        turn = omega * np.sqrt(1 - ratio**2)
        rest = decay * (np.cos(turn * time) + ratio * omega / turn * np.sin(turn * time))
    elif ratio < 2:
        rest = decay * (1 + omega * time)
    else:
        fast, slow = (omega * (ratio + s * np.sqrt(ratio**2 - 1)) for s in (1, -1))
        rest = (fast * np.exp(-slow * time) - slow * np.exp(-fast * time)) / (fast - slow)
    found = respond(modes, np.full((1, 3), ratio), force[None], 0.15)[0]
    np.testing.assert_allclose(found, 100.0 / k * (1 - rest)[:-1], atol=1e-7 * 100.0 / k)


def test_a_force_that_stays_ends_in_the_static_deflection() -> None:
    modes = tip_modes(MASS, STIFFNESS[None])
    found = respond(modes, rayleigh(modes), np.tile(PUSH, (1, 4001, 1)), 0.02)[0]
    assert found[-1] == pytest.approx((np.linalg.inv(STIFFNESS) @ PUSH)[2], rel=1e-9)


def test_mass_and_stiffness_that_change_from_segment_to_segment_ring_as_solve_ivp_has_it() -> None:
    rng = np.random.default_rng(3)
    scale = 1 + 0.3 * rng.standard_normal(5) ** 2
    turned = np.array([[0.0, 5.0e4, 3.0e4], [5.0e4, 0.0, -2.0e4], [3.0e4, -2.0e4, 0.0]])
    mass = [MASS * s for s in scale]
    stiffness = [STIFFNESS * s + turned * s**2 for s in scale[::-1]]
    force, step = in_segments(100 * rng.standard_normal((31, 3)), 5), 0.05
    modes = tip_modes(np.array(mass), np.array(stiffness))
    found = respond(modes, rayleigh(modes), force, step).ravel()
    expected = integrated(mass, stiffness, force, step)
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.ptp(expected))


@given(finer=st.integers(2, 9), seed=st.integers(0, 1000))
def test_the_step_between_samples_changes_nothing(finer: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    coarse = 100 * rng.standard_normal((13, 3))
    fine = np.stack(
        [np.interp(np.arange(12 * finer + 1) / finer, np.arange(13), column) for column in coarse.T], axis=1
    )
    modes = tip_modes(MASS, STIFFNESS * np.linspace(1.0, 1.5, 3)[:, None, None])
    found = respond(modes, rayleigh(modes), in_segments(coarse, 3), 0.1).ravel()
    again = respond(modes, rayleigh(modes), in_segments(fine, 3), 0.1 / finer).ravel()[::finer]
    np.testing.assert_allclose(again, found, atol=1e-11 * np.ptp(found))


def test_segments_of_a_few_millimetres_follow_an_arm_that_changes_smoothly() -> None:
    from scipy.integrate import solve_ivp

    period, segments = 5.0, 62  # 200 mm at 40 mm/s: 3.2 mm a segment

    def softness(time: np.ndarray) -> np.ndarray:
        return 1 - 0.3 * np.asarray(time) / period  # of the stiffness, from the start of the pass to its end

    def push(time: np.ndarray) -> np.ndarray:
        return np.clip(np.asarray(time) / 0.2, 0.0, 1.0)

    def motion(time: float, now: np.ndarray) -> np.ndarray:
        k = STIFFNESS * softness(time)
        return np.concatenate(
            [now[3:], np.linalg.solve(MASS, push(time) * PUSH - (A0 * MASS + A1 * k) @ now[3:] - k @ now[:3])]
        )

    time = np.arange(8 * segments) * period / (8 * segments)
    truth = solve_ivp(motion, (0, period), np.zeros(6), t_eval=time, rtol=1e-8, atol=1e-13).y[2]
    middle = (np.arange(segments) + 0.5) * period / segments
    modes = tip_modes(MASS, STIFFNESS * softness(middle)[:, None, None])
    force = in_segments(push(np.append(time, period))[:, None] * PUSH, segments)
    found = respond(modes, rayleigh(modes), force, time[1]).ravel()
    # static heights change by a step of ΔK from segment to segment: half of 0.5 % at most, and mean nothing
    assert np.abs(found - truth).max() < 0.005 * np.ptp(truth)
    assert abs((found - truth).mean()) < 2e-4 * np.ptp(truth)


def test_what_rings_on_reaches_the_next_pass_and_the_first_one_begins_at_rest() -> None:
    passes, count = 6, 96
    shape = np.repeat([0.0, 1.0, 0.0], [10, 70, 16])
    force = in_segments(np.append(np.tile(shape, passes), 0.0)[:, None] * PUSH, passes * 12)
    modes = tip_modes(MASS, np.tile(STIFFNESS, (passes * 12, 1, 1)))
    heights = respond(modes, 0.02, force, 0.03).reshape(passes, count)
    assert np.abs(heights[0, :10]).max() == 0.0
    change = np.abs(np.diff(heights, axis=0)).max(axis=1)
    assert change[0] > 0.02 * np.ptp(heights)
    assert (change[1:] < 0.8 * change[:-1]).all()  # 2.9 s at ζ ω = 0.43 1/s: less by exp(1.25) a pass


def test_the_mean_over_a_disc_takes_7_5_percent_of_a_wave_of_eight_radii_and_nothing_of_a_slope() -> None:
    weights = disc_weights(1.5, 0.1)
    at = 0.1 * (np.arange(len(weights)) - len(weights) // 2)
    assert weights.sum() == pytest.approx(1.0)
    assert weights @ (2 + 3 * at) == pytest.approx(2.0)
    # 2 J1(k R) / (k R) at k R = 2π/8; the hats between samples take another 0.05 %
    assert weights @ np.cos(2 * np.pi * at / 12) == pytest.approx(0.9248, abs=5e-4)


def test_a_disc_smaller_than_the_step_is_all_but_the_sample_itself() -> None:
    weights = disc_weights(0.01, 1.0)
    assert weights[1] > 0.99
    assert len(weights) == 3


def test_a_stiffness_that_no_structure_has_is_refused() -> None:
    with pytest.raises(ValueError, match="positive definite"):
        tip_modes(MASS, np.diag([1e5, -1e3, 1e5])[None])
    with pytest.raises(np.linalg.LinAlgError):
        tip_modes(MASS - 600 * np.eye(3), STIFFNESS[None])
