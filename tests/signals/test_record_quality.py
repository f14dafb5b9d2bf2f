"""A record that is checked piece by piece is judged as the whole of it is."""

import numpy as np
import pytest

from metro.signals import quality
from metro.signals.record_quality import RecordQuality

NAMES, RATE = ("Fx", "Fy", "Fz"), 1e4
COUNT = 20_000


def record():
    """Three channels that cut from 0.4 s to 1.6 s, with noise and a zero."""
    rng = np.random.default_rng(7)
    t = np.arange(COUNT) / RATE
    cutting = (t > 0.4) & (t < 1.6)
    wave = np.stack([100.0 * np.sin(300.0 * t + phase) for phase in (0.0, 1.0, 2.0)], axis=1)
    return 5.0 + t, cutting[:, None] * wave + rng.normal(3.0, 1.0, (COUNT, 3))


def gathered(time, values, cuts, full_scale=None):
    found = RecordQuality(NAMES, full_scale)
    for t, v in zip(np.split(time, cuts), np.split(values, cuts), strict=True):
        found.add(t, v)
    return found


def whole(time, values, full_scale=None):
    each = [
        check
        for name, v in zip(NAMES, values.T, strict=True)
        for check in (quality.dead(name, v), quality.flat_tops(name, v, full_scale))
    ]
    return quality.sampling(time, RATE), [*each, quality.alike(NAMES, values)]


def alike(found, expected):
    for one, other in zip(found, expected, strict=True):
        assert (one.check, one.ok, one.message) == (other.check, other.ok, other.message)
        assert one.value == pytest.approx(other.value, rel=1e-9)


CUTS = [[], [5000, 5001, 12_000], list(range(1000, COUNT, 1000))]


@pytest.mark.parametrize("cuts", CUTS)
def test_a_sound_record(cuts):
    time, values = record()
    found = gathered(time, values, cuts)
    sampling, channels = whole(time, values)
    alike(found.sampling(RATE), sampling)
    alike(found.channels(), channels)
    assert all(one.ok for one in (*sampling, *channels))
    assert found.zero == 5.0
    assert found.largest == pytest.approx(np.linalg.norm(values, axis=1).max())
    assert [one.value for one in found.air_offset()] == pytest.approx([3.0] * 3, abs=0.1)


@pytest.mark.parametrize("cuts", CUTS)
def test_a_gap_is_found_where_two_pieces_meet_too(cuts):
    time, values = record()
    time = time + 0.003 * (np.arange(COUNT) >= 5000) + 0.002 * (np.arange(COUNT) >= 5400)
    found = gathered(time, values, cuts).sampling(RATE)
    alike(found, whole(time, values)[0])
    assert "2 gaps, the longest 3.1 ms, 50 samples" in found[2].message


@pytest.mark.parametrize("cuts", CUTS)
@pytest.mark.parametrize(("level", "full_scale"), [(95.0, None), (90.0, 90.0)])
def test_a_flat_top_is_found_across_two_pieces(cuts, level, full_scale):
    """Cut off over the whole record, or at full scale: the longest flat lies across the cut at 5000."""
    time, values = record()
    values[:, 1] = np.clip(values[:, 1], -level, level)
    values[4996:5004, 1] = level
    found = gathered(time, values, cuts, full_scale).channels()
    alike([found[3]], [whole(time, values, full_scale)[1][3]])
    assert not found[3].ok


@pytest.mark.parametrize("cuts", CUTS)
def test_channels_that_are_dead_or_one_signal(cuts):
    time, values = record()
    values[:, 0], values[:, 2] = 1.5, -values[:, 1]
    found = gathered(time, values, cuts).channels()
    alike(found, whole(time, values)[1])
    assert not found[0].ok
    assert found[-1].message.startswith("Fy and Fz are one signal")


def test_channels_that_are_alike_for_a_while_only_are_two():
    time, values = record()
    values[:9000, 2] = values[:9000, 1]
    assert gathered(time, values, [3000, 6000]).channels()[-1].ok


def test_a_channel_that_stands_at_another_level_in_each_piece_moves():
    time, values = record()
    values[:, 0] = np.where(np.arange(COUNT) < 5000, 1.0, 2.0)
    assert gathered(time, values, [5000]).channels()[0].ok


@pytest.mark.parametrize("cuts", CUTS)
def test_a_flat_top_that_lies_half_in_one_piece_and_half_in_the_next(cuts):
    time, values = record()
    values[4997:5003, 1] = 130.0
    found = gathered(time, values, cuts).channels()[3]
    assert not found.ok
    assert "stays at 130 for 6 samples" in found.message
