"""What an effect spares base parameters that something is believed of."""

from types import SimpleNamespace

import numpy as np
import pytest

from metro.loop.checks.evidence import relieved, spared

RUN = np.array([[1.0, 2.0, 0.0], [1.0, 0.0, 3.0]])  # measured by the gain, and by two that are believed
BELIEF = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def fitted(beta, known=(0.0, 0.0)):
    """A fit of one run and of what is believed of the last two parameters, by its base parameters."""
    blocks = [
        SimpleNamespace(run="r01", role="identify", belief=False, design=RUN, measured=np.array([6.0, 8.0])),
        SimpleNamespace(run="b", role="calibrate", belief=True, design=BELIEF, measured=np.array(known)),
    ]
    model = SimpleNamespace(design=lambda block, _nuisance, _beta: (block.design, np.zeros(2)))
    candidate = SimpleNamespace(model=lambda _theta: model)
    nuisance = {block.run: np.zeros(0) for block in blocks}
    return SimpleNamespace(
        candidate=candidate, theta=np.zeros(0), beta=np.array(beta), blocks=blocks, nuisance=nuisance
    )


def test_it_is_what_they_no_longer_stand_in_for_over_what_was_measured():
    smaller, larger = fitted([1.0, 0.6, 0.2]), fitted([1.3, 0.3, 0.1])
    before, after = (np.sum((RUN[:, 1:] @ one) ** 2) for one in ([0.6, 0.2], [0.3, 0.1]))
    assert relieved(smaller, larger) == pytest.approx(np.sqrt(before - after) / 10.0)


def test_an_effect_against_which_they_have_to_work_relieves_nothing():
    assert relieved(fitted([1.0, 0.1, 0.0]), fitted([1.0, 0.6, -0.4])) == 0.0


def test_it_counts_from_what_is_believed_of_them_and_not_from_zero():
    smaller, larger = (fitted([1.0, value, 0.0], known=(0.5, 0.0)) for value in (0.9, 0.5))
    assert relieved(smaller, larger) == pytest.approx(0.4 * 2.0 / 10.0)
    assert relieved(larger, smaller) == 0.0


def test_an_effect_is_as_large_as_the_change_of_what_they_stand_in_for():
    """All of a strain where it takes that over, and no more than itself where it eases a large one."""
    strained, eased, free = (fitted([1.0, value, 0.0]) for value in (0.6, 0.59, 0.0))
    assert spared(strained, free) == pytest.approx(relieved(strained, free)) == pytest.approx(0.6 * 0.2)
    assert spared(strained, eased) == pytest.approx(0.01 * 0.2)
    assert relieved(strained, eased) > 10.0 * spared(strained, eased)
    assert spared(eased, strained) == 0.0
