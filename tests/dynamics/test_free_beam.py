"""Nine real FRFs of a free beam, the hammer roving: its modes shift from file to file."""

import gzip
import os
from pathlib import Path

import numpy as np
import pytest

from metro.dynamics.driving import Standing
from metro.dynamics.modal import identify_modes

FIELD = Path(os.environ.get("METRO_REAL_DATA", "../shared/real")).parent / "field" / "modal-beam"
# Single-FRF fits of another program: means, and their standard deviations over the files.
HZ = np.array([111.99, 306.86, 596.37, 974.14])
SD = np.array([0.0024, 0.0068, 0.013, 0.032])

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not FIELD.exists(), reason="the field records are not there"),
]


@pytest.fixture(scope="module")
def model():
    columns = []
    for path in sorted(FIELD.glob("*.gz")):
        lines = gzip.decompress(path.read_bytes()).decode("latin-1").splitlines()
        start = next(i for i, line in enumerate(lines) if line.startswith("Hz")) + 1
        columns.append(np.array([line.split() for line in lines[start:] if line.strip()], dtype=float))
    frequency = columns[0][:, 0]
    keep = frequency > 45.0
    omega = 2 * np.pi * frequency[keep]
    frf = np.stack([-(c[keep, 1] + 1j * c[keep, 2]) / omega**2 for c in columns], axis=1)
    way = [np.array([i]) for i in range(len(columns))]
    return identify_modes(frequency[keep], frf, driving=0, inputs=1, files=[way])


def test_the_four_modes_have_intervals_of_the_scatter_between_files(model):
    assert [round(mode.frequency, 1) for mode in model.modes] == [112.0, 306.9, 596.4, 974.1]
    sd = np.array([mode.frequency_sd for mode in model.modes])
    # at least one standard error of the mean of nine files, at most half more than Student's interval
    assert np.all(sd > SD / 3)
    assert np.all(sd < 1.5 * SD / 3 * 2.306 / 1.96)
    error = np.abs([mode.frequency for mode in model.modes] - HZ)
    assert np.all(error < 1.96 * sd + 0.005)  # the means are printed to two digits


def test_the_first_file_is_no_driving_point(model):
    """Its third mode moves against the first two, and the fourth hardly at all."""
    assert model.declared == {0: Standing.ELSEWHERE}
    assert np.isnan([mode.stiffness for mode in model.modes]).all()
