"""What a cut-off channel looks like, and what only resembles it: on made waves and real records."""

import numpy as np
import pytest
import recorded

from metro.signals import quality
from metro.signals.clipping import flat_top

PLACE = np.arange(8000)
WAVE = 100.0 * np.sin(2.0 * np.pi * 37.3 * PLACE / 8000) + 3.0
real = pytest.mark.skipif(not recorded.FIELD.is_dir(), reason="set METRO_REAL_DATA")


def cut_off(values):
    return not quality.flat_tops("Fx", values).ok


@pytest.mark.parametrize("share", recorded.SHARES)
def test_a_wave_cut_off_at_any_share_of_its_height_is_found(share):
    assert cut_off(recorded.clipped(WAVE, share))
    coarse = recorded.levelled(recorded.quantised(WAVE, 10))
    assert cut_off(recorded.clipped(coarse, min(share, 0.95)))


MADE = [pair for pair in recorded.made() if not pair[0].startswith("square with flanks")]


@pytest.mark.parametrize(("name", "values"), MADE, ids=[name for name, _ in MADE])
def test_steps_and_coarsely_sampled_waves_are_not_cut_off(name, values):
    assert not cut_off(values)


COPIES = list(recorded.harmless(WAVE))


@pytest.mark.parametrize(("name", "values"), COPIES, ids=[name for name, _ in COPIES])
def test_a_copy_of_a_sound_wave_is_not_cut_off(name, values):
    assert not cut_off(values)


def test_a_profile_that_was_levelled_and_exported_to_a_tenth_of_a_nanometre_is_not_cut_off():
    """A stylus with steps of 10 nm, a tilt of 1 µm, waves of 0.4 µm; heights in mm."""
    waves = 2e-4 * np.sin(2 * np.pi * PLACE / 900)
    stepped = 1e-5 * np.round((waves + 1e-3 * PLACE / 8000) / 1e-5)
    exported = np.round(stepped - np.polyval(np.polyfit(PLACE, stepped, 1), PLACE), 7)
    assert not cut_off(exported)
    assert cut_off(np.minimum(exported, 1e-4))


def test_a_channel_that_rests_near_zero_before_after_or_most_of_the_time_is_not_cut_off():
    cut = WAVE[1000:3000] - WAVE.max() - 1.0
    still = np.full(700, -0.5)
    assert not cut_off(np.concatenate((still, cut)))
    assert not cut_off(np.concatenate((cut, still)))
    assert not cut_off(np.concatenate((cut, np.full(9000, still[0]), cut)))


@pytest.mark.parametrize("count", [700, 9000])
def test_a_channel_that_is_driven_to_the_end_of_its_range_and_stays_there_is_cut_off(count):
    drifting = np.linspace(0.0, 200.0, 2000) + WAVE[1000:3000]
    held = np.full(count, drifting.max())
    assert cut_off(np.concatenate((drifting, held)))
    assert cut_off(np.concatenate((held, drifting[::-1])))


def test_a_flat_end_of_a_piece_is_no_end_of_the_record():
    values = np.concatenate((WAVE[1:200] - WAVE.max() - 2.0, np.full(30, -1.0)))
    level = float(values.max())
    assert flat_top(values, level, (True, True)) == 0
    assert flat_top(values, level, (True, False)) == 30


@real
def test_of_measured_records_copies_that_are_sound_raise_few_alarms_and_cut_off_ones_are_found():
    """The table in docs/bad-input.md: alarms of sound copies, and cut-off copies that are found."""
    alarms = copies = found = clips = 0
    for _, values in recorded.moving():
        for _, copy in recorded.harmless(values):
            copies += 1
            alarms += cut_off(copy)
        for share in recorded.SHARES:
            cut = recorded.clipped(values, share)
            if cut is not None and np.ptp(cut) > 0:
                for copy in (cut, *(recorded.quantised(cut, bits) for bits in recorded.BITS)):
                    clips += 1
                    found += cut_off(copy)
    assert (copies, clips) == (1710, 1312)
    assert alarms <= 16
    assert found >= 1138
