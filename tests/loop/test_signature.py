"""What is left after a fit: which places count."""

import numpy as np
import pytest
from toy import Wave, problem

from metro.loop.checks.signature import signature
from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.fit import fit
from metro.loop.fitting.noise import first_noise


@pytest.mark.parametrize(("spike", "counts"), [(0.009, False), (0.016, True)])
def test_a_rest_of_a_third_of_the_noise_does_not_count_however_sure_it_is(spike, counts):
    """Of many runs the least rest is beyond chance: the noise itself is not known to a third."""
    task = problem(
        2, truth=Wave(spike=spike), phased=False, feeds=np.linspace(1, 4, 80), repeats=1, scatter=0.0
    )
    runs = task.role("identify")
    fitted = fit(Candidate(task.base), runs, first_noise(0.0, task.scatter, runs))
    (line,) = (line for line in signature(fitted, 0.0) if line.label == "last quarter")
    assert line.p_value < 1e-6
    assert (line.ratio > 1.5) == counts
    assert line.significant == counts
