"""How tests are heard and how machines are struck in the harder world, and what its batches hide."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from metro.effects.library import library
from virtual_cell.blind import RECIPES
from virtual_cell.recipes import boundary, boundary_world
from virtual_cell.recipes.boundary_world_draws import drawn_cell
from virtual_cell.world.boundary import ears, hammer
from virtual_cell.world.boundary.effects import HARDER_EFFECTS, told
from virtual_cell.world.boundary.resonances import Resonances

LOUD = np.exp(np.linspace(math.log(0.01), math.log(3.0), 4000))
PAIR = ears.Ears((0.2, 0.25), 0.12, 0.5)
LONE = Resonances(
    np.array([240.0, 310.0]), np.array([0.02, 0.03]), np.array([8e6, 9e6]), np.array([0.0, math.pi / 2]),
    np.eye(2), np.ones(2), np.ones(2, dtype=bool),
)  # fmt: skip
CAREFUL = hammer.Hammer(
    rate=4096.0, seconds=2.0, hits=4, peak=200.0, tip_hz=2000.0, astray=(0.0, 0.0), scatter=0.0,
    sensor_astray=(0.0, 0.0), mass=0.0, reversed=(False, False), warmth=(0.0, 0.0), double=0.0,
    force_noise=1e-5, response_noise=1e-5,
)  # fmt: skip


def struck(axis=0, flats=0.0, **changes):
    records = hammer.struck(LONE, replace(CAREFUL, **changes), axis, flats, np.random.default_rng(2))
    return hammer.averaged(records, CAREFUL.rate)


def test_listeners_differ_on_the_share_that_was_drawn_and_leave_their_share_blank():
    scatter = ears.scatter_for(PAIR, LOUD)
    said = np.array(ears.labels(PAIR, LOUD, scatter, np.random.default_rng(4)))
    assert ears.disagreement(PAIR, LOUD, scatter) == pytest.approx(0.12, abs=1e-3)
    assert (said == "").mean() == pytest.approx(0.12 * 0.5, abs=0.02)
    assert (said[:500] == "yes").mean() > 0.98
    assert (said[-500:] == "no").mean() > 0.98


def test_wrong_labels_are_exchanged_ones():
    sure = replace(PAIR, undecided=0.0)
    right, wrong = (
        np.array(ears.labels(one, LOUD, 1e-3, np.random.default_rng(4)))
        for one in (sure, replace(sure, mistaken=0.2))
    )
    assert (right != wrong).mean() == pytest.approx(0.2, abs=1e-3)


def test_forced_vibration_that_grows_with_the_depth_is_not_heard_and_chatter_locked_to_the_turns_is():
    angle = 2 * np.pi * np.arange(10 * 120) / 120
    forced = np.stack([np.sin(angle), np.zeros(1200)], axis=1)  # once per turn, as of runout
    locked = np.stack([np.sin(angle), np.sin(2 * angle)], axis=1) * 8e-6  # of four teeth; repeats each turn
    tips = np.stack([1e-6 * forced, 2e-6 * forced, locked])
    depth, first = np.array([1.0, 2.0, 2.0]) * 1e-3, np.zeros(3, dtype=int)
    heard = ears.loudness(tips, depth, first, per_turn=120, teeth=4, feed=20e-6)
    np.testing.assert_allclose(heard[:2], 0.0, atol=1e-9)
    assert heard[2] > 0.1


def test_a_careful_blow_measures_the_receptance():
    hz, frf, coherence = struck()
    exact = LONE.receptance(hz)[:, 0, 0]
    inside = (hz > 50.0) & (hz < 1200.0)
    np.testing.assert_allclose(frf[inside], exact[inside], atol=0.01 * np.abs(exact).max())
    assert coherence[inside].min() > 0.99


def test_the_spectrum_of_a_pulse_is_that_of_a_half_sine_and_its_tip_ends_where_it_is_said_to():
    width = CAREFUL.pulse
    t = (np.arange(20000) + 0.5) / 20000 * width - 0.5 * width
    hz = np.array([0.0, 300.0, 0.5 / width, 1500.0, 2000.0])
    exact = (np.cos(np.pi * t / width) * np.cos(2 * np.pi * hz[:, None] * t)).mean(axis=1) * width
    found = hammer._half_sine(2 * np.pi * hz, width)
    np.testing.assert_allclose(found, exact, atol=1e-5 * width)
    assert abs(found[-1] / found[0]) == pytest.approx(0.1, abs=0.005)


def test_what_goes_wrong_with_a_blow_shows_in_what_is_measured():
    clear = slice(40, 2000)  # an accelerometer tells nothing of the first lines
    hz, frf, coherence = (part[clear] for part in struck())
    peak = hz[np.abs(frf).argmax()]
    turned = struck(reversed=(True, False))[1][clear]
    np.testing.assert_allclose(turned, -frf, atol=0.01 * np.abs(frf).max())
    warm = struck(warmth=(-0.02, 0.0))[1][clear]
    assert hz[np.abs(warm).argmax()] == pytest.approx(0.98 * peak, abs=0.5)
    heavy = struck(mass=0.05)[1][clear]
    assert hz[np.abs(heavy).argmax()] < peak
    astray = struck(astray=(0.3, 0.0), sensor_astray=(0.3, 0.0))[1][clear]
    exact = LONE.turned(-0.3).receptance(hz)[:, 0, 0]
    np.testing.assert_allclose(astray, exact, atol=0.01 * np.abs(exact).max())
    noisy = struck(response_noise=0.3)[2][clear]
    assert noisy.mean() < coherence.mean() - 0.05


def test_blows_along_turned_flats_do_not_see_that_the_housing_is_turned():
    cell = drawn_cell(np.random.default_rng(2))
    turned = HARDER_EFFECTS["mode_coupling"].apply(cell, {"angle_deg": 40.0})
    one, other = (
        hammer.averaged(hammer.struck(c.resonances, CAREFUL, 0, c.flats, np.random.default_rng(1)), 4096.0)[1]
        for c in (cell, turned)
    )
    np.testing.assert_allclose(one[40:2000], other[40:2000], atol=1e-3 * np.abs(one).max())
    felt = [c.resonances.receptance(np.array([c.resonances.hz[0]]))[0, 0, 0] for c in (cell, turned)]
    assert abs(felt[0] - felt[1]) > 0.2 * abs(felt[0])


@pytest.mark.parametrize("seed", range(4))
def test_what_is_asked_for_in_the_contracts_terms_is_what_is_told(seed):
    cell = drawn_cell(np.random.default_rng(seed))
    rpm = np.linspace(0.4, 1.0, 13) * cell.fast
    inside = {effect.name: effect for effect in library("lobes") if not effect.resembled}
    assert set(inside) <= set(HARDER_EFFECTS)
    for name, effect in inside.items():
        asked = HARDER_EFFECTS[name].draw(np.random.default_rng(seed), cell)
        built = HARDER_EFFECTS[name].apply(cell, asked)
        values, error = told(name, built, asked, rpm)
        assert set(values) == set(effect.names) - set(effect.left_out)
        assert set(error) <= set(values)
        assert all(0.0 <= share < 1.0 for share in error.values())
        if name == "spindle_speed_softening":
            assert values["change_per_krpm"] == pytest.approx(asked["change_per_krpm"], rel=1e-3)
        if name == "process_damping":  # the land grows meanwhile
            worn = (1 + 0.5 * cell.flank.growth) ** 2
            assert values["coefficient_n_mm"] == pytest.approx(worn * asked["coefficient_n_mm"], rel=1e-3)


def test_a_missing_mode_is_felt_in_the_cut_and_not_by_the_hammer():
    cell = drawn_cell(np.random.default_rng(3))
    asked = {"frequency_hz": 260.0, "damping": 0.02, "stiffness_n_um": 5.0, "axis": "y"}
    built = HARDER_EFFECTS["missing_mode"].apply(cell, asked)
    rest = [c.resonances.receptance(np.array([0.0]))[0, 1, 1].real for c in (built, cell)]
    assert rest[0] - rest[1] == pytest.approx(1.0 / 5e6, rel=1e-6)
    assert len(built.resonances.felt_by_hammer().hz) == len(cell.resonances.hz)


def test_at_least_ten_kinds_are_outside_and_resemble_no_effect_of_the_library():
    hidden = RECIPES["lobes"].hides("d")
    every = {effect.name for effect in library("lobes")}
    assert len(set(hidden) - every) >= 10
    assert "yielding_with_depth" not in hidden  # the library has its likeness


@pytest.fixture(autouse=True, scope="module")
def short_programmes():
    """Fewer speeds and turns than batches have, so that a test takes seconds."""
    whole = boundary_world.drawn_programme

    def few(rng, cell, style):
        programme = whole(rng, cell, style)
        speeds = programme.speeds[::3]
        return replace(programme, speeds=speeds, held_out=speeds[1:2], repeated=(), turns=45, per_turn=120)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(boundary_world, "drawn_programme", few)
        yield


@pytest.fixture(scope="module", params=["c", "d"])
def batch(request, short_programmes, tmp_path_factory):
    folder = tmp_path_factory.mktemp("lobes") / "one"
    return folder, boundary.make(folder, {"process_damping": None}, 5, request.param)


def test_a_batch_brackets_the_boundary_and_says_what_was_drawn_in_its_truth_alone(batch):
    folder, truth = batch
    runs = pd.read_csv(folder / "runs.csv")
    assert set(truth["effects"]) == {"process_damping"}
    assert truth["world"]["tests"] == len(runs)
    assert set(truth["translation_error"]["process_damping"]) == {"coefficient_n_mm"}
    assert runs.groupby("spindle_rpm")["role"].nunique().eq(1).all()
    both = runs.groupby(["spindle_rpm", "direction"])["stable"].nunique() == 2
    assert both.mean() >= 0.6
    written = "".join(path.read_text() for path in folder.glob("*.*"))
    assert "damping" not in written
    assert sum(yaml.safe_load((folder / "batch.yaml").read_text())["tool"]["pitch_deg"]) == pytest.approx(360)


def test_the_same_seed_makes_the_same_batch(batch, tmp_path):
    folder, truth = batch
    again = boundary.make(tmp_path / "one", {"process_damping": None}, 5, truth["style"])
    assert again == truth
    for name in ("runs.csv", "impacts.csv", "batch.yaml"):
        assert (tmp_path / "one" / name).read_bytes() == (folder / name).read_bytes()
