"""The derivatives of a point are computed once, whatever the noise, and are those of that point."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from toy import BEND, GATES, Wave, problem

from metro.loop.fitting.candidate import Candidate
from metro.loop.fitting.noise import first_noise
from metro.loop.fitting.system import State, linearised

CALLS = [0]


@dataclass(frozen=True)
class Counted(Wave):
    """A wave that counts how often it is asked."""

    def design(self, block, nuisance, _beta=None):
        CALLS[0] += 1
        return super().design(block, nuisance, _beta)


@pytest.fixture
def place():
    """A candidate, its blocks and noise, and a state of it."""
    task = problem(7, truth=Wave(bend=0.1))
    blocks = task.role("identify")
    state = State(np.array([0.05]), np.array([5.0, 8.0]), {b.run: np.array([0.3]) for b in blocks})
    return (
        Candidate(Counted(), (BEND,)),
        blocks,
        first_noise(GATES.model_form_budget, task.scatter, blocks),
        state,
    )


def test_another_noise_asks_the_model_for_nothing(place):
    candidate, blocks, noise, state = place
    first = linearised(candidate, blocks, noise, state)
    CALLS[0] = 0
    again = linearised(candidate, blocks, replace(noise, budget=2.0 * noise.budget), state)
    assert CALLS == [0]
    assert again.cost != first.cost


@pytest.mark.parametrize("moved", ["theta", "beta", "nuisance"])
def test_another_place_has_its_own_derivatives(place, moved):
    candidate, blocks, noise, state = place
    first = linearised(candidate, blocks, noise, state)
    run = blocks[0].run
    changed = {
        "theta": {"theta": state.theta + 0.1},
        "beta": {"beta": state.beta + 0.1},
        "nuisance": {"nuisance": {**state.nuisance, run: np.array([0.4])}},
    }[moved]
    other = linearised(candidate, blocks, noise, replace(state, **changed))
    for column in (0, 3):  # the residual, and how it depends on the phase
        assert not np.allclose(first.rows[0][column], other.rows[0][column], rtol=1e-6, atol=0.0)
    assert list(first.rows[0][0]) == list(linearised(candidate, blocks, noise, state).rows[0][0])
