"""The oracle on a problem whose answers are known in closed form."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from metro.batch.processed import read_json
from metro.effects.effect import Effect, EffectParameter
from metro.observables.problem import Block, Parameter, Problem
from proof import oracles as oracles_room
from proof.layout import Layout
from proof.oracle import oracle

POINTS, SIGMA, BUDGET = 40, 0.1, 1e-6
ANGLE = 2.0 * np.pi * np.arange(POINTS) / POINTS


@dataclass(frozen=True)
class Wave:
    """b (1 + twist) cos τ + c sin τ + bump cos 3τ + ripple sin 5τ, c free: ``twist`` is absorbed by b.

    ``late`` cos 7τ hardly shows in the runs of the fit.
    """

    twist: float = 0.0
    bump: float = 0.0
    ripple: float = 0.0
    late: float = 0.0

    @property
    def parameters(self):
        return (Parameter("b", "N"), Parameter("c", "N"))

    def nuisance_starts(self, _block):
        return np.zeros((1, 0))

    def design(self, block, _nuisance, _beta=None):
        matrix = np.stack([(1.0 + self.twist) * np.cos(ANGLE), np.sin(ANGLE)], axis=1)
        late = self.late * (1.0 if block.role == "validate" else 1e-3)
        waves = (
            self.bump * np.cos(3.0 * ANGLE) + self.ripple * np.sin(5.0 * ANGLE) + late * np.cos(7.0 * ANGLE)
        )
        return matrix, waves


def effect(name):
    def apply(model, values):
        return replace(model, **{name: values[name]})

    return Effect(name, ("toy",), (EffectParameter(name, "1", -5.0, 5.0, 0.1, (-1.0,)),), apply, "", "", "")


LIBRARY = (effect("twist"), effect("bump"), effect("ripple"), effect("late"))


def problem(truth):
    rng = np.random.default_rng(2)
    blocks = []
    for i in range(12):
        empty = Block(
            run=f"r{i}",
            condition=f"c{i // 2}",
            role="validate" if i >= 8 else "identify",
            order=i,
            measured=np.zeros(POINTS),
            sigma=np.full(POINTS, SIGMA),
            setting=None,
            axis=np.full(POINTS, "x"),
            zeros=np.zeros((POINTS, 0)),
            zero_sd=np.zeros(0),
            coordinates={"axis": np.full(POINTS, "x")},
        )
        matrix, offset = truth.design(empty, np.zeros(0))
        noise = SIGMA * rng.standard_normal(POINTS)
        blocks.append(replace(empty, measured=matrix @ [4.0, 2.0] + offset + noise))
    return Problem("toy", "N", 1.0, Wave(), tuple(blocks), np.full(2, 1e-6))


def test_the_size_is_the_rms_of_the_effect_over_the_noise_and_the_error_falls_to_the_noise():
    found = oracle(problem(Wave(bump=0.6)), {"bump": {"bump": 0.6}}, LIBRARY, BUDGET)
    assert found["floor"] == pytest.approx(SIGMA, rel=0.05)
    assert found["sizes"]["bump"] == pytest.approx(0.6 / np.sqrt(2.0) / SIGMA, rel=0.1)
    assert found["before"] == pytest.approx(np.hypot(0.6 / np.sqrt(2.0), SIGMA), rel=0.1)
    assert found["after"] == pytest.approx(SIGMA, rel=0.1)


def test_what_the_base_absorbs_has_no_size():
    found = oracle(problem(Wave(twist=0.5)), {"twist": {"twist": 0.5}}, LIBRARY, BUDGET)
    assert found["sizes"]["twist"] < 0.05


def test_of_two_effects_each_has_its_own_size():
    truth = {"bump": {"bump": 0.3}, "ripple": {"ripple": 0.9}}
    found = oracle(problem(Wave(bump=0.3, ripple=0.9)), truth, LIBRARY, BUDGET)
    assert found["sizes"]["bump"] == pytest.approx(0.3 / np.sqrt(2.0) / SIGMA, rel=0.15)
    assert found["sizes"]["ripple"] == pytest.approx(0.9 / np.sqrt(2.0) / SIGMA, rel=0.1)


def test_of_an_effect_of_one_joint_the_oracle_is_told_the_form_of_that_joint():
    bump, ripple = (
        replace(e, name="gap", form=f"joint {i}", where={"joint": i}) for i, e in enumerate(LIBRARY[1:3], 1)
    )
    task = problem(Wave(ripple=0.9))
    found = oracle(task, {"gap": {"joint": 2, "ripple": 0.9, "phase_deg": 3.0}}, (bump, ripple), BUDGET)
    assert found["sizes"]["gap"] == pytest.approx(0.9 / np.sqrt(2.0) / SIGMA, rel=0.1)
    assert found["after"] == pytest.approx(SIGMA, rel=0.1)
    assert oracle(task, {"gap": {"joint": 3, "ripple": 0.9}}, (bump, ripple), BUDGET)["after"] is None


def test_what_is_always_there_of_several_joints_is_fitted_beside_what_is_hidden():
    twist, ripple = (
        replace(e, name="gap", form=f"joint {i}", where={"joint": i}) for i, e in enumerate(LIBRARY[0:3:2], 1)
    )
    task, hidden = problem(Wave(twist=0.2, bump=0.6, ripple=0.9)), {"bump": {"bump": 0.6}}
    effects = (twist, ripple, LIBRARY[1])
    always = {"gap": [{"joint": 1, "twist": 0.2}, {"joint": 2, "ripple": 0.9}]}
    without, beside = (oracle(task, hidden, effects, BUDGET, also) for also in (None, always))
    assert beside["after"] == pytest.approx(SIGMA, rel=0.1)
    assert without["after"] == pytest.approx(np.hypot(SIGMA, 0.9 / np.sqrt(2.0)), rel=0.1)
    assert set(beside["sizes"]) == {"bump"}
    alike = tuple(replace(effect, resembled=True) for effect in (twist, ripple))
    assert oracle(task, hidden, (*alike, LIBRARY[1]), BUDGET, always) == without


def test_what_the_library_lacks_has_no_oracle_but_a_size():
    found = oracle(problem(Wave(bump=0.6)), {"chip": {"length_um": 20.0}}, LIBRARY[:1], BUDGET)
    assert found["after"] is None
    assert found["sizes"]["chip"] == pytest.approx(0.6 / np.sqrt(2.0) / SIGMA, rel=0.1)


@pytest.mark.parametrize(("name", "library"), [("bump", LIBRARY), ("chip", LIBRARY[:1])])
def test_what_no_run_tells_of_the_base_model_is_no_noise(name, library):
    task = problem(Wave(bump=0.6))
    unidentified = 3.0 * SIGMA * np.full((POINTS, 1), 1.0)
    blocks = [replace(b, unidentified=unidentified) if b.role == "validate" else b for b in task.blocks]
    values = {name: {"bump": 0.6}}
    force = replace(task, observable="force")
    able = [replace(effect, observables=("force",)) for effect in library]
    sure, unsure = (
        oracle(one, values, able, BUDGET) for one in (force, replace(force, blocks=tuple(blocks)))
    )
    assert unsure["floor"] == pytest.approx(sure["floor"], rel=1e-9)
    instrument = oracle(replace(task, blocks=tuple(blocks)), values, library, BUDGET)
    assert instrument["floor"] == pytest.approx(np.sqrt(10.0) * sure["floor"], rel=0.01)
    # of what the library lacks, the size is what is beyond the noise and the unidentified directions together
    beyond = np.sqrt(max(0.0, sure["before"] ** 2 - 10.0 * SIGMA**2)) / SIGMA
    assert unsure["sizes"][name] == pytest.approx(beyond if name == "chip" else sure["sizes"][name], rel=0.05)


def test_an_effect_that_the_runs_of_the_fit_do_not_tell_keeps_its_true_size():
    """Fitted, it would be anything between its bounds of five."""
    found = oracle(problem(Wave(late=0.3)), {"late": {"late": 0.3}}, LIBRARY, BUDGET)
    assert found["sizes"]["late"] == pytest.approx(0.3 / np.sqrt(2.0) / SIGMA, rel=0.05)
    assert found["after"] == pytest.approx(SIGMA, rel=0.1)


def test_without_held_out_runs_the_oracle_has_no_figures_that_json_cannot_hold(tmp_path, monkeypatch):
    lacking = replace(problem(Wave(bump=1.0)), blocks=problem(Wave(bump=1.0)).role("identify"))
    monkeypatch.setattr(oracles_room, "posed", lambda *_: SimpleNamespace(task=lacking))
    out = Layout(tmp_path)
    out.oracle.mkdir()
    oracles_room._ask(out, {"batch": "b1", "effects": {"bump": {"bump": 1.0}}}, "force", None)
    assert read_json(out.oracle / "b1.json") == oracles_room.UNKNOWN
