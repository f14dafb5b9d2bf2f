"""Boundary batches drawn by a seed: machines that differ, effects as large as told, labels that are wrong."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from metro.effects.library import library
from metro.signals.chatter import detect
from virtual_cell.hidden import BOUNDARY_EFFECTS
from virtual_cell.recipes import boundary
from virtual_cell.recipes.boundary_draws import drawn_machine, drawn_programme


def machine(seed):
    return drawn_machine(np.random.default_rng(seed))


def test_machines_and_programmes_differ_from_seed_to_seed():
    machines = [machine(seed) for seed in range(40)]
    programmes = [drawn_programme(np.random.default_rng(s), m, "b", s) for s, m in enumerate(machines)]
    assert {m.direction for m in machines} == {"up", "down", "slot"}
    assert {m.teeth for m in machines} == {2, 3, 4}
    assert {len(x.damped) for m in machines for x in m.modes} == {1, 2, 3}
    assert {len(p.rpm) for p in programmes} == {5, 7, 9, 12}
    assert {p.beside for p in programmes} == {1, 2, 3}
    assert 0 < sum(p.records for p in programmes) < 40
    for p in programmes:
        assert set(p.held_out) < set(p.rpm)
        assert not {p.rpm[0], p.rpm[-1]} & set(p.held_out)
        assert list(p.depths) == sorted(set(p.depths))


def test_the_march_has_steps_enough_for_every_wave():
    for seed in range(40):
        m = machine(seed)
        p = drawn_programme(np.random.default_rng(seed), m, "b", seed)
        waves = m.frequencies.max() / (p.rpm[0] / 60.0)
        assert p.per_turn / waves > 14.9
        entry, leave = m.immersion  # cuts begin and end between two steps
        assert np.degrees([entry, leave]) / 2.0 == pytest.approx(np.round(np.degrees([entry, leave]) / 2.0))


def test_the_level_is_that_of_one_mode_in_closed_form():
    # b = -1 / (2 K mu N* Re G), mu 1/2; the least Re G of one mode is -1 / (4 k zeta (1 + zeta))
    stiffness, zeta = 7e6, 0.035
    teeth = 3 * np.degrees(np.diff(boundary.MACHINE.immersion)[0]) / 360.0
    expected = 4 * stiffness * zeta * (1 + zeta) / (boundary.LAW.ktc * teeth)
    assert boundary.MACHINE.level == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("name", BOUNDARY_EFFECTS)
def test_an_effect_changes_the_machine_and_nothing_else_of_it(name):
    m = machine(3)
    effect = BOUNDARY_EFFECTS[name]
    changed = effect.apply(m, effect.draw(np.random.default_rng(1), m))
    differs = [f for f in m.__dataclass_fields__ if getattr(m, f) is not getattr(changed, f)]
    assert 1 <= len(differs) <= 2
    assert not {"diameter", "teeth", "feed", "radial", "direction", "law"} & set(differs)


def test_drawn_parameters_are_those_of_the_contract():
    m = machine(4)
    for effect in [one for one in library("lobes") if not one.resembled]:
        drawn = BOUNDARY_EFFECTS[effect.name].draw(np.random.default_rng(2), m)
        assert set(drawn) == set(effect.names) - set(effect.left_out)


def test_the_force_falls_and_the_damping_grows_with_speed_and_the_stiffness_falls_with_depth():
    m = replace(machine(5), speed_exponent=0.5, speed_reference=2000.0, damping_growth=1e-4, yielding=1000.0)
    rpm, depth = np.array([2000.0, 8000.0]), np.array([0.0, 1e-3])
    trials = m.trials(rpm, depth, scatter=0.0, entry=1)
    np.testing.assert_allclose(trials.strength, [1.0, 0.5])
    x = trials.modes[0]
    np.testing.assert_allclose(x.damping[1] / x.damping[0], 1.8 / 1.2)
    np.testing.assert_allclose(x.stiffness[1] / x.stiffness[0], 0.5)
    np.testing.assert_allclose(x.damped[1] / x.damped[0], np.sqrt(0.5))


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lobes") / "one"
    return folder, boundary.make(folder, {"process_damping": None}, 12, "b")


def test_a_batch_brackets_the_boundary_and_does_not_say_what_it_hides(batch):
    folder, truth = batch
    runs = pd.read_csv(folder / "runs.csv")
    assert set(truth["effects"]) == {"process_damping"}
    assert set(runs["role"]) == {"identify", "validate"}
    assert runs.groupby("spindle_rpm")["role"].nunique().eq(1).all()  # whole speeds are held out
    both = runs.groupby("spindle_rpm")["stable"].nunique() == 2
    assert both.mean() >= 0.75
    written = "".join(path.read_text() for path in folder.glob("*.*"))
    assert "damping" not in written


def test_the_same_seed_makes_the_same_batch_and_another_does_not(batch, tmp_path):
    folder, truth = batch
    again = boundary.make(tmp_path / "one", {"process_damping": None}, 12, "b")
    assert again == truth
    assert (tmp_path / "one/runs.csv").read_bytes() == (folder / "runs.csv").read_bytes()
    boundary.make(tmp_path / "other", {"process_damping": None}, 13, "b")
    assert (tmp_path / "other/batch.yaml").read_bytes() != (folder / "batch.yaml").read_bytes()


def test_the_declared_tool_is_the_drawn_one(batch):
    folder, _ = batch
    manifest = yaml.safe_load((folder / "batch.yaml").read_text())
    runs = pd.read_csv(folder / "runs.csv")
    assert sum(manifest["tool"]["pitch_deg"]) == pytest.approx(360.0, abs=1.0)
    assert (runs["radial_depth_mm"] <= manifest["tool"]["diameter_mm"] * (1 + 1e-9)).all()


def test_a_share_of_the_labels_is_wrong_and_at_least_one():
    wrong = boundary._wrong(40, 0.1, 3)
    assert wrong.sum() == 4
    assert boundary._wrong(40, 0.001, 3).sum() == 1
    assert not boundary._wrong(40, 0.0, 3).any()
    assert not np.array_equal(wrong, boundary._wrong(40, 0.1, 4))


def test_the_records_of_a_batch_say_what_its_labels_say(tmp_path):
    boundary.make(tmp_path / "heard", records=True)
    runs = pd.read_csv(tmp_path / "heard/runs.csv").iloc[::2]
    agree = []
    for _, run in runs.iterrows():
        record = pd.read_parquet(tmp_path / "heard" / run["dynamometer"])
        time = record["t_s"].to_numpy(float)
        signal = record[["fx_n", "fy_n", "fz_n"]].to_numpy(float)
        found = detect(time, 2 * np.pi * run["spindle_rpm"] / 60 * time, signal, boundary.TEETH)
        agree.append((found.probability > 0.5) == (run["stable"] == "no"))
    assert np.mean(agree) > 0.9
