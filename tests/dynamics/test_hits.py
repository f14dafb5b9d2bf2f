"""Blows that cannot be used are named; those that can are gated."""

import numpy as np
import pytest

from metro.dynamics.frf import estimate_frf
from metro.dynamics.hits import Hit, fault, faults

RATE, N = 2048.0, 4096


def blow(seed, scale=1.0):
    """A half-sine blow on an oscillator of 40 Hz, with noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(N) / RATE
    force = scale * 300 * np.sin(np.pi * np.clip((t - 0.1) / 0.004, 0, 1))
    ring = np.exp(-10 * t) * np.sin(2 * np.pi * 40 * t)
    response = np.convolve(force, ring)[:N]
    noise = 0.5 * min(scale, 1.0)
    return Hit(force + noise * rng.normal(size=N), response + response.std() / 50 * rng.normal(size=N), RATE)


def test_good_blows_have_no_fault():
    assert faults([blow(seed) for seed in range(3)]) == ["", "", ""]


def test_a_record_that_is_there_twice_counts_once():
    first = blow(0)
    again = Hit(first.force.copy(), first.response.copy(), RATE)
    assert faults([first, blow(1), again]) == ["", "", "the same record as hit 1"]


def test_a_blow_more_than_20_db_below_the_strongest_is_weak():
    reasons = faults([blow(0), blow(1, 0.2), blow(2, 0.08)])
    assert reasons == ["", "", "its force spectrum is more than 20 dB below the strongest hit's"]


def test_a_spoilt_blow_does_not_set_the_level_for_the_others():
    strong = blow(0, 20.0)
    clipped = Hit(np.minimum(strong.force, 0.7 * strong.force.max()), strong.response, RATE)
    assert faults([clipped, blow(1)]) == ["force is overloaded", ""]


def test_the_force_channel_in_the_place_of_the_response_is_seen():
    hit = blow(0)
    assert fault(Hit(hit.force, -0.02 * hit.force, RATE)) == "response is the force channel over again"
    near = -0.02 * hit.force + 1e-3 * np.random.default_rng(1).normal(size=N)
    assert fault(Hit(hit.force, near, RATE)) == ""


@pytest.mark.parametrize("channel", ["force", "response"])
def test_values_that_are_not_finite_are_named(channel):
    hit = blow(0)
    spoilt = {"force": hit.force.copy(), "response": hit.response.copy()}
    spoilt[channel][7] = np.nan
    assert (
        fault(Hit(spoilt["force"], spoilt["response"], RATE)) == f"{channel} has values that are not finite"
    )


def test_lines_at_which_the_hammer_gives_little_are_marked():
    """A half-sine of 4 ms has its first zero at 375 Hz."""
    frf = estimate_frf([blow(0), blow(1)], "m")
    assert np.all(frf.excited[frf.frequency < 200])
    assert not np.any(frf.excited[np.abs(frf.frequency - 375) < 10])
