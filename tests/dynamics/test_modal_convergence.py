"""A modal fit that does not converge is refused; one that needs more steps gets them."""

import numpy as np
import pytest

from metro.dynamics import modal
from metro.dynamics.modal import identify_modes
from metro.dynamics.refine import refine

FREQUENCY = np.arange(5.0, 80.0, 0.5)
HERTZ, ZETA, STIFFNESS = np.array([21.0, 35.0, 57.0]), np.array([0.06, 0.07, 0.04]), np.array([7e6, 4e6, 4e6])


def frf():
    ratio = FREQUENCY[:, None] / HERTZ
    exact = (1 / (STIFFNESS * (1 - ratio**2 + 2j * ZETA * ratio))).sum(axis=1)
    rng = np.random.default_rng(3)
    noise = rng.normal(size=exact.shape) + 1j * rng.normal(size=exact.shape)
    return (exact + 1e-9 * noise)[:, None]


def identified():
    return identify_modes(FREQUENCY, frf(), np.full((len(FREQUENCY), 1), 2e-18), driving=0)


def halted(most):
    """Return the refinement as it is, but of no more than so many steps at a time, from far off at first."""

    def few(data, omega, zeta, *, real, iterations=None):
        start = 1.15 * zeta if iterations is None else zeta
        return refine(data, omega, start, real=real, iterations=min(iterations or most, most))

    return few


def test_a_fit_that_was_halted_early_is_followed_to_its_end(monkeypatch):
    whole = identified()
    monkeypatch.setattr(modal, "refine", halted(1))
    found = identified()
    assert len(found.modes) == len(whole.modes) == 3
    expected = [mode.damping for mode in whole.modes]
    assert [mode.damping for mode in found.modes] == pytest.approx(expected, rel=1e-3)
    assert found.fit.chi2 == pytest.approx(whole.fit.chi2, rel=1e-3)


def test_a_fit_that_goes_on_falling_is_refused(monkeypatch):
    monkeypatch.setattr(modal, "_SETTLED", -1.0)
    with pytest.raises(ValueError, match="does not converge, its last 3 steps still lower chi² by"):
        identified()
