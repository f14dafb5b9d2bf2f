"""FRFs from hammer records against the exact receptance of the structure that was hit."""

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from metro.dynamics.frf import estimate_frf
from metro.dynamics.hits import Hit, fault, gate

REAL = Path(os.environ.get("METRO_REAL_DATA", "../shared/real"))
RATE, SECONDS = 2048.0, 2.0
OMEGA = 2 * np.pi * np.array([21.4, 34.8, 65.6])
ZETA = np.array([0.06, 0.07, 0.063])
STIFFNESS = np.array([7.2e6, 4.1e6, 2.2e6])


def receptance(frequency):
    ratio = 2 * np.pi * frequency[:, None] / OMEGA
    return (1 / (STIFFNESS * (1 - ratio**2 + 2j * ZETA * ratio))).sum(axis=1)


def record(rng=None, scale=1.0, unit="m/s2"):
    """One hit by convolution with the exact receptance over a record four times as long."""
    n = int(RATE * SECONDS)
    t = np.arange(4 * n) / RATE
    force = np.where((t > 0.05) & (t < 0.056), scale * 400 * np.sin(np.pi * (t - 0.05) / 0.006) ** 2, 0.0)
    frequency = np.fft.rfftfreq(4 * n, 1 / RATE)
    to_unit = (2j * np.pi * frequency) ** {"m/s2": 2, "m/s": 1, "m": 0}[unit]
    response = np.fft.irfft(np.fft.rfft(force) * receptance(frequency) * to_unit)[:n]
    force = force[:n]
    if rng is not None:
        force = force + rng.normal(size=n) * 0.002 * np.abs(force).max()
        response = response + rng.normal(size=n) * 0.02 * response.std()
    return Hit(force, response, RATE)


def relative_error(frf, low=10.0, high=150.0):
    band = (frf.frequency > low) & (frf.frequency < high)
    exact = receptance(frf.frequency[band])
    return np.linalg.norm(frf.h1[band] - exact) / np.linalg.norm(exact)


@pytest.mark.parametrize("unit", ["m/s2", "m/s", "m"])
def test_a_clean_hit_gives_the_receptance_whatever_was_measured(unit):
    frf = estimate_frf([record(unit=unit)], unit)
    assert relative_error(frf) < 0.003
    assert frf.frequency[0] > 0
    assert np.all(np.isfinite(frf.h1))


def test_a_driving_point_has_negative_imaginary_part():
    frf = estimate_frf([record()], "m/s2")
    assert frf.h1[np.argmin(np.abs(frf.frequency - 65.6))].imag < 0


def test_gating_lowers_the_error_of_noisy_hits():
    rng = np.random.default_rng(1)
    hits = [record(rng) for _ in range(5)]
    f = np.fft.rfft([hit.force for hit in hits], axis=1)[:, 1:]
    x = np.fft.rfft([hit.response for hit in hits], axis=1)[:, 1:]
    frf = estimate_frf(hits, "m/s2")
    raw = (f.conj() * x).sum(axis=0) / (np.abs(f) ** 2).sum(axis=0) / -((2 * np.pi * frf.frequency) ** 2)
    band = (frf.frequency > 10) & (frf.frequency < 150)
    exact = receptance(frf.frequency[band])
    assert relative_error(frf) < 0.6 * np.linalg.norm(raw[band] - exact) / np.linalg.norm(exact)
    assert relative_error(frf) < 0.01


def test_stated_variance_covers_the_actual_error():
    rng = np.random.default_rng(2)
    frf = estimate_frf([record(rng) for _ in range(8)], "m/s2")
    band = (frf.frequency > 20) & (frf.frequency < 150)
    ratio = np.abs(frf.h1 - receptance(frf.frequency))[band] ** 2 / frf.variance[band]
    assert 0.5 < ratio.mean() < 2.0


def test_what_the_hits_add_to_the_error_adds_up_to_the_spread_of_tests_of_unequal_hits():
    rng = np.random.default_rng(7)
    clean = [record(scale=scale) for scale in (1.0, 1.0, 2.0)]
    noise = 0.02 * clean[0].response.std()
    stated, found = [], []
    for _ in range(30):
        hits = [Hit(h.force, h.response + noise * rng.normal(size=len(h.response)), RATE) for h in clean]
        frf = estimate_frf(hits, "m/s2")
        band = (frf.frequency > 20) & (frf.frequency < 150)
        stated.append(np.sum(np.abs(frf.deviation[:, band]) ** 2, axis=0))
        found.append(frf.h1[band])
    assert 0.8 < np.mean(np.mean(stated, axis=0) / np.var(found, axis=0, ddof=1)) < 1.25


def test_estimators_agree_where_the_noise_is_low_and_h2_is_never_smaller():
    rng = np.random.default_rng(3)
    frf = estimate_frf([record(rng) for _ in range(5)], "m/s2")
    band = (frf.frequency > 50) & (frf.frequency < 90)
    assert np.all(np.abs(frf.h2) >= np.abs(frf.h1) * (1 - 1e-12))
    assert np.all(np.abs(frf.hv[band] / frf.h1[band] - 1) < 0.002)
    np.testing.assert_allclose(np.abs(frf.hv) ** 2, np.abs(frf.h1) * np.abs(frf.h2), rtol=1e-9)
    np.testing.assert_allclose(frf.coherence, np.abs(frf.h1) / np.abs(frf.h2), rtol=1e-9)
    assert frf.coherence[band].min() > 0.99


def test_a_single_hit_has_no_coherence_and_says_so():
    frf = estimate_frf([record()], "m/s2")
    assert np.all(np.isnan(frf.coherence))
    assert np.all(np.isnan(frf.variance))
    assert "single hit" in frf.notes[0]


def double(hit):
    force = hit.force.copy()
    force[600:612] += 0.2 * hit.force.max() * np.hanning(12)
    return Hit(force, hit.response, hit.rate)


def clipped(hit):
    return Hit(np.minimum(hit.force, 0.6 * hit.force.max()), hit.response, hit.rate)


@pytest.mark.parametrize(("spoil", "reason"), [(double, "double hit"), (clipped, "force is overloaded")])
def test_spoilt_hits_are_rejected_and_named(spoil, reason):
    rng = np.random.default_rng(4)
    hits = [record(rng), spoil(record()), record(rng)]
    frf = estimate_frf(hits, "m/s2")
    assert frf.used == (0, 2)
    assert frf.notes == (f"hit 2 rejected: {reason}",)


def test_hits_that_are_all_spoilt_are_refused():
    with pytest.raises(ValueError, match="no usable hit: hit 1 rejected: double hit"):
        estimate_frf([double(record())], "m/s2")


def test_a_record_without_a_pulse_is_no_hit():
    rng = np.random.default_rng(5)
    assert fault(Hit(rng.normal(size=4096), rng.normal(size=4096), RATE)) == "no force pulse above the noise"


def test_records_of_different_length_are_used_together_and_named():
    """What a gate has left of a decayed response may be continued with zeros."""
    long, rng = record(), np.random.default_rng(6)
    cut = round(0.7 * len(long.force))
    short = Hit(record(rng).force[:cut], record(rng).response[:cut], RATE)
    frf = estimate_frf([long, short, record(rng)], "m/s2")
    assert frf.used == (0, 1, 2)
    assert frf.notes == ("hit 2 (1.4 s) shorter than the longest record (2 s): continued with zeros",)
    assert len(frf.frequency) == len(long.force) // 2
    assert relative_error(frf) < 0.015  # 0.0126 of three whole records


def test_a_record_of_another_rate_is_named():
    rng = np.random.default_rng(7)
    other = record(rng)
    frf = estimate_frf([record(rng), record(rng), Hit(other.force, other.response, RATE / 2)], "m/s2")
    assert frf.used == (0, 1)
    assert frf.notes == ("hit 3 rejected: sampled at 1024 Hz, 2 others at 2048 Hz",)


def test_lines_in_a_hole_of_the_hammers_spectrum_are_not_used_and_those_of_a_strong_side_lobe_are():
    """A nearly flat pulse of 6 ms: holes every 167 Hz and a first side lobe 13 dB lower, as a sinc."""
    hit = record()
    (struck,) = np.nonzero(hit.force > 0.0)
    flat = np.zeros_like(hit.force)
    flat[struck] = np.linspace(390.0, 410.0, len(struck))  # else it would count as overloaded
    seconds = np.count_nonzero(flat) / RATE
    frf = estimate_frf([Hit(flat, hit.response, RATE)], "m/s2")
    holes, lobes = (np.abs(frf.frequency * seconds - place) for place in (1.0, 1.5))
    assert not frf.excited[holes < 0.05].any()
    assert frf.excited[lobes < 0.2].all()
    assert frf.excited[frf.frequency * seconds < 0.8].all()


def test_an_unknown_unit_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="'g': expected m/s2, m/s, m"):
        estimate_frf([record()], "g")


def test_the_gate_keeps_the_decay_and_drops_the_noise_after_it():
    rng = np.random.default_rng(6)
    force, _, kept = gate(record(rng))
    assert np.count_nonzero(force) < 60
    assert 0.3 * RATE < kept < SECONDS * RATE


@pytest.mark.skipif(not REAL.exists(), reason="METRO_REAL_DATA is not there")
def test_a_real_hit_gives_the_published_receptance():
    folder = REAL / "batches" / "tool-impact" / "impacts"
    raw, published = pd.read_parquet(folder / "hit-p1.parquet"), pd.read_csv(folder / "frf-p1.csv")
    hit = Hit(raw["force_n"].to_numpy(), raw["response"].to_numpy(), 51200.0)
    frf = estimate_frf([hit], "m/s2")
    band = (frf.frequency >= 100) & (frf.frequency <= 3000)
    expected = np.interp(frf.frequency[band], published["frequency_hz"], published["real"]) + 1j * np.interp(
        frf.frequency[band], published["frequency_hz"], published["imag"]
    )
    assert np.linalg.norm(frf.h1[band] - expected) / np.linalg.norm(expected) < 0.025


def test_a_hit_at_another_place_is_rejected_with_the_reason():
    rng = np.random.default_rng(8)
    hits = [record(rng, scale) for scale in (1.0, 0.7, 1.2, 0.9)]
    elsewhere = Hit(hits[2].force, -0.6 * hits[2].response, RATE)
    frf = estimate_frf([*hits[:2], elsewhere, hits[3]], "m/s2")
    assert frf.used == (0, 1, 3)
    assert frf.notes[0].startswith("hit 3 rejected: its response differs by ")
    assert frf.notes[0].endswith("another place or direction, or a loose sensor")


@pytest.mark.parametrize("seed", range(10))
def test_hits_of_one_place_are_all_used_however_hard(seed):
    rng = np.random.default_rng(seed)
    assert estimate_frf([record(rng, scale) for scale in (1.0, 0.25, 1.2, 0.5, 0.8)], "m/s2").notes == ()


def test_of_three_hits_none_is_judged_by_the_two_others():
    rng = np.random.default_rng(9)
    hits = [record(rng) for _ in range(3)]
    frf = estimate_frf([*hits[:2], Hit(hits[2].force, -hits[2].response, RATE)], "m/s2")
    assert frf.used == (0, 1, 2)
