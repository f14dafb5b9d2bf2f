"""P, W and R parameters of traces whose texture is known in closed form, and the coverage of intervals."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from metro.formats.kinds import KINDS
from metro.formats.softgauge import read_softgauge
from metro.surface.profile import transmission
from metro.surface.profile_parameters import profile_parameters, section_length, upward_crossings
from metro.surface.texture import Profile, by_repeats, levelled, parameters, stated, texture

ROOT = Path(__file__).resolve().parents[2]
FIELD = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real")).parent / "field/profile-square"
UM, MM = 1e-6, 1e-3
X = np.arange(0.0, 8 * MM, 0.5 * UM)
LC = 0.8 * MM


def of(z, letter, x=X, cutoff=LC):
    return parameters(next(each for each in texture(x, z, cutoff).profiles if each.letter == letter))


def sine(length, size=1 * UM, x=X):
    return size * np.sin(2 * np.pi * x / length + 0.3)


@pytest.mark.skipif(not FIELD.is_dir(), reason="the folder field beside METRO_REAL_DATA is absent")
def test_the_square_wave_of_the_software_gauge_has_its_known_parameters():
    trace = read_softgauge(FIELD / "square.xml", KINDS["profile"], None).frame
    found = of(trace["z_mm"].to_numpy() * MM, "P", trace["x_mm"].to_numpy() * MM)
    assert (found["a"], found["q"], found["t"]) == pytest.approx((1 * UM, 1 * UM, 2 * UM), rel=1e-12)
    assert found["Sm"] == pytest.approx(200 * UM, rel=1e-12)
    assert found["dq"] == pytest.approx(0.2494, abs=5e-5)


def test_a_triangle_has_the_moments_and_the_slope_of_its_closed_form():
    wave = 2 * UM * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * X / (80 * UM)))
    found = of(wave, "P")
    assert found["a"] == pytest.approx(1 * UM, rel=1e-3)
    assert found["q"] == pytest.approx(2 * UM / math.sqrt(3), rel=1e-3)
    assert (found["sk"], found["ku"]) == pytest.approx((0.0, 1.8), abs=1e-3)
    assert found["dq"] == pytest.approx(2 * UM / (20 * UM), rel=0.04)  # less at the tips, by seven points
    assert found["Sm"] == pytest.approx(80 * UM, rel=1e-4)


@pytest.mark.parametrize("length", [0.1 * MM, 0.8 * MM])
def test_a_sine_is_shared_among_waviness_and_roughness_as_the_filter_transmits(length):
    passes = float(transmission(np.array(length), LC))
    found = of(sine(length), "R")
    assert found["q"] == pytest.approx((1 - passes) * UM / math.sqrt(2), rel=0.01)
    assert found["Sm"] == pytest.approx(length, rel=1e-3)
    if passes > 0.1:
        assert of(sine(length), "W")["q"] == pytest.approx(passes * UM / math.sqrt(2), rel=0.02)


def test_short_waves_are_taken_out_of_the_roughness_where_the_points_show_them():
    kept = float(transmission(np.array(2.5 * UM), 2.5 * UM))
    fine = np.arange(0.0, 4 * MM, 0.25 * UM)
    assert of(sine(2.5 * UM, x=fine), "R", fine)["q"] == pytest.approx(kept * UM / math.sqrt(2), rel=0.01)
    coarse = np.arange(0.0, 4 * MM, 1 * UM)
    said = texture(coarse, sine(0.1 * MM, x=coarse), LC).notes
    assert any("λs = 2.5 µm is not applied: the points are 1 µm apart" in note for note in said)


def test_random_heights_have_the_moments_of_a_normal_and_intervals_that_hold_them():
    covered = 0
    for seed in range(40):
        z = 1 * UM * np.random.default_rng(seed).standard_normal(8000)
        found = stated(Profile("R", X[:8000], z, LC, 8 * UM), math.nan)
        covered += found["a"].low <= 1 * UM * math.sqrt(2 / np.pi) <= found["a"].high
        assert found["ku"].value == pytest.approx(3.0, abs=0.4)
    assert covered >= 34  # 95 % of 40, less two standard deviations


def test_a_trace_that_is_too_short_or_too_coarse_for_the_cut_off_says_so():
    short = X[X < 1.5 * MM]
    found = texture(short, sine(0.1 * MM, x=short), LC)
    assert [each.letter for each in found.profiles] == ["P"]
    assert "the trace is 1.5 mm long, and λc = 0.8 mm takes 1.6 mm" in found.notes[-1]
    coarse = np.arange(0.0, 50 * MM, 0.2 * MM)
    assert "the points are 200 µm apart" in texture(coarse, sine(5 * MM, x=coarse), LC).notes[-1]


def test_fewer_sections_than_the_standard_asks_for_are_said():
    short = X[X < 4 * MM]
    assert "R is of 4 sections" in texture(short, sine(0.1 * MM, x=short), LC).notes[-1]


def test_a_tilt_is_taken_out_but_not_the_line_that_a_texture_makes_by_chance():
    square = np.sign(np.sin(2 * np.pi * (X[:8000] + 1e-9) / (200 * UM))) * UM
    assert np.ptp(levelled(X[:8000], square)[0]) == pytest.approx(2 * UM)
    assert np.ptp(levelled(X[:8000], square + 0.01 * X[:8000])[0]) == pytest.approx(2 * UM, rel=0.1)


def test_hills_narrower_than_a_hundredth_of_the_section_do_not_count():
    wave = sine(0.4 * MM)
    spiked = wave.copy()
    spiked[np.abs(X - 0.1 * MM) < 1 * UM] -= 2 * UM  # a scratch of 2 µm that crosses the mean line
    assert profile_parameters(spiked, 0.5 * UM).width < 0.399 * MM
    assert profile_parameters(spiked, 0.5 * UM, 8 * UM).width == pytest.approx(0.4 * MM, rel=1e-3)


def test_narrow_hills_are_left_out_the_narrowest_first_and_their_neighbours_go_on():
    z = np.repeat([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0], [10, 10, 3, 10, 10, 10, 10])
    assert upward_crossings(z, 0.0).tolist() == pytest.approx([19.5, 32.5, 52.5])
    assert upward_crossings(z, 5.0).tolist() == pytest.approx([32.5, 52.5])


@pytest.mark.parametrize(
    ("width", "section"), [(0.03, 0.08), (0.1, 0.25), (0.2, 0.8), (1.0, 2.5), (2.0, 8.0)]
)
def test_the_section_follows_from_the_width_of_the_elements(width, section):
    x = np.arange(0.0, 20 * MM, 2 * UM)
    assert section_length(sine(width * MM, x=x), 2 * UM) == pytest.approx(section * MM)


def test_repeated_traces_give_the_interval_of_one():
    values = [{"a": 1.0, "sk": 0.1}, {"a": 1.2, "sk": -0.1}, {"a": 1.1, "sk": 0.0}]
    found = by_repeats(values)("a", 1.1)
    assert (found.low, found.high) == pytest.approx((1.1 - 4.303 * 0.1, 1.1 + 4.303 * 0.1), rel=1e-3)
    assert found.source == "scatter of 3 traces"


def test_noise_of_the_points_lowers_the_lower_end_by_what_it_adds():
    x = X[:2000]
    true, noise = sine(0.2 * MM, x=x), 0.2 * UM
    z = true + noise * np.random.default_rng(1).standard_normal(len(x))
    found = stated(Profile("P", x, z - z.mean(), float(np.ptp(x)), 8 * UM), noise)
    for name in ("a", "q", "t"):
        assert found[name].low <= parameters(Profile("P", x, true - true.mean(), 1.0, 8 * UM))[name]
        assert found[name].high >= found[name].value
