"""Responses that are a quarter of a turn off: closed-form receptances, taken for another quantity."""

import numpy as np
import pandas as pd
import pytest

from metro.slips.phases import phase_slips, turned

FREQUENCY = np.arange(4.0, 400.0, 1.0)
NATURAL, DAMPING = np.array([60.0, 110.0, 260.0]), np.array([0.03, 0.02, 0.01])
MODES = [
    {"position": "1", "direction": "x", "frequency": {"value": f}, "damping": {"value": z}}
    for f, z in zip(NATURAL, DAMPING, strict=True)
]


def receptance(signs=(1, -1, 1), phase_deg=0.0):
    parts = 1e-7 * np.array(signs) * np.exp(1j * np.radians(phase_deg) * np.array([1, -1, 0.5]))
    ratio = FREQUENCY[:, None] / NATURAL
    return (parts / (1 - ratio**2 + 2j * DAMPING * ratio)).sum(axis=1) + 2e-9


def table(*responses, noise=0.0):
    rng = np.random.default_rng(2)
    parts = []
    for number, sound in enumerate(responses):
        level = noise * np.abs(sound).max()
        frf = sound + level * (rng.normal(size=sound.shape) + 1j * rng.normal(size=sound.shape))
        columns = {"frequency_hz": FREQUENCY, "real_m_n": frf.real, "imag_m_n": frf.imag}
        parts.append(pd.DataFrame({"position": 1, "reference": f"{number}x", "response": "1x", **columns}))
    return pd.concat(parts)


@pytest.mark.parametrize("order", [-1, 1])
def test_a_wrong_integration_is_found_whichever_way_it_is_wrong(order):
    off = (2j * np.pi * FREQUENCY) ** order
    (slip,) = phase_slips(table(off * receptance(), off * receptance((1, 1, -1)), noise=0.01), MODES)
    assert "2 of 2 responses" in slip.found
    assert "response_unit" in slip.remedy
    assert (slip.file, slip.observables) == ("impacts.csv", ("lobes",))


@pytest.mark.parametrize("phase_deg", [0.0, 25.0])
def test_a_structure_with_phases_of_its_own_is_none_nor_is_a_reversed_sensor(phase_deg):
    good = receptance(phase_deg=phase_deg)
    assert phase_slips(table(good, -good, receptance((-1, 1, 1), phase_deg), noise=0.02), MODES) == ()


def test_an_acceleration_taken_for_a_displacement_does_not_show_in_the_phase():
    assert phase_slips(table(-((2 * np.pi * FREQUENCY) ** 2) * receptance()), MODES) == ()


def test_a_background_of_other_modes_turns_nothing():
    other = 3e-7 / (1 - (FREQUENCY / 900.0) ** 2)
    assert turned(FREQUENCY, receptance() + other, NATURAL, DAMPING) > 0.95


def test_without_modes_there_or_lines_enough_nothing_is_said():
    off = 2j * np.pi * FREQUENCY * receptance()
    assert phase_slips(table(off), [{**mode, "direction": "y"} for mode in MODES]) == ()
    assert phase_slips(table(off).iloc[::50], MODES) == ()
    assert phase_slips(pd.DataFrame(), MODES) == ()
