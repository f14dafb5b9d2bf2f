"""What a dynamometer reads where nothing turns, against one whose frame hardly turns."""

from dataclasses import replace

import numpy as np
import pytest

from metro.observables.force.dynamometer import Dynamometer, Recording, Resonance, transfer

STILL = Recording((0.2, 0.5, 0.9), 0.1, 40.0, contact=0.1)
RINGING = Resonance((900.0, 1100.0, 2000.0), (0.05, 0.03, 0.1))


@pytest.mark.parametrize("discharge", [(0.0, 0.0, 0.0), (0.4, 0.0, 1.5)])
def test_a_frame_that_stands_still_is_the_limit_of_one_that_hardly_turns(discharge):
    sensor = Dynamometer(rotation=0.05, resonances=(RINGING,), discharge=discharge)
    turning = transfer(sensor, replace(STILL, orbit=1e-9), 12)
    assert np.allclose(transfer(sensor, STILL, 12), turning, atol=1e-7)


def test_the_mean_leaks_away_from_the_contact_on():
    seen = transfer(Dynamometer(discharge=(0.4, 0.0, 1.5)), STILL, 3)
    for block, middle in enumerate(STILL.middles):
        left = np.exp(-np.array([0.4, 0.0, 1.5]) * (middle - STILL.contact))
        assert seen[block, 0] == pytest.approx(np.diag(left))
        assert seen[block, 1] == pytest.approx(np.eye(3))
