"""Profile parameters: a reference profile whose parameters are published, and closed forms."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from metro.surface.profile_parameters import profile_parameters

ROOT = Path(__file__).resolve().parents[2]
PROFILES = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real")) / "reference/profiles"
there = pytest.mark.skipif(not PROFILES.is_dir(), reason="METRO_REAL_DATA has no reference/profiles")


def reference(name: str) -> tuple[np.ndarray, float]:
    """Heights and spacing in µm."""
    text = (PROFILES / f"{name}.xml").read_text()
    heights = re.search(r"<DATA_POINT_VALUES>(.*?)</DATA_POINT_VALUES>", text, re.DOTALL)
    spacing = re.search(r"<SPACING>(.*?)</SPACING>", text)
    assert heights is not None
    assert spacing is not None
    return np.array(heights[1].split(), dtype=float), float(spacing[1])


@there
def test_the_edm_reference_profile_has_its_published_parameters_to_five_digits() -> None:
    found = profile_parameters(*reference("edm"))
    assert found.a == pytest.approx(0.46434, abs=5e-6)
    assert found.q == pytest.approx(0.55994, abs=5e-6)
    assert found.skewness == pytest.approx(-0.13265, abs=5e-6)
    assert found.kurtosis == pytest.approx(2.36461, abs=5e-6)
    assert found.t == pytest.approx(2.8623, abs=5e-5)
    assert found.slope == pytest.approx(0.10536, abs=5e-6)
    assert found.width == pytest.approx(46.09835, abs=5e-6)


@there
def test_the_numerical_sine_has_its_published_parameters() -> None:
    found = profile_parameters(*reference("sine"))
    assert found.a == pytest.approx(0.63663, abs=5e-6)
    assert found.q == pytest.approx(0.70711, abs=5e-6)


def test_a_sine_has_the_moments_slope_and_width_of_its_closed_form() -> None:
    x = np.arange(0, 4000) * 0.01  # ten whole waves of 4
    found = profile_parameters(3.0 * np.sin(2 * np.pi * x / 4.0), 0.01)
    assert (found.skewness, found.kurtosis) == pytest.approx((0.0, 1.5), abs=1e-9)
    assert found.slope == pytest.approx(3.0 * 2 * np.pi / 4.0 / np.sqrt(2), rel=1e-3)  # six ends lack a slope
    assert found.width == pytest.approx(4.0, rel=1e-6)


def test_ripples_lower_than_a_twentieth_are_no_elements() -> None:
    x = np.arange(0, 4000) * 0.01
    wave = np.sin(2 * np.pi * x / 4.0)
    assert profile_parameters(wave + 0.04 * np.sin(2 * np.pi * x / 0.1), 0.01).width == pytest.approx(
        4.0, rel=0.02
    )


def test_a_profile_of_one_height_is_refused() -> None:
    with pytest.raises(ValueError, match="no parameters"):
        profile_parameters(np.ones(50), 0.1)
