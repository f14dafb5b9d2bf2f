"""The library of effects; the documented example of another package: ``tests/docs``."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import Cut
from metro.cutting.law import EdgeLaw
from metro.effects.effect import fitted_to
from metro.effects.library import described, library, not_modelled, with_declared
from metro.observables.force.dynamometer import Recording, Resonance
from metro.observables.force.model import ForceModel, ForceSetting
from metro.observables.problem import Problem, Refusal
from metro.report.results import with_facts

RECORDING = Recording((0.5,), 1.0, 50.0)


def test_the_package_finds_its_own_effects_in_the_order_of_their_names():
    names = [effect.name for effect in library()]
    assert {"tool_runout", "stiffness_scale"} <= set(names)
    assert names == sorted(names)


def test_an_observable_gets_the_effects_that_change_its_model():
    assert "tool_runout" in {effect.name for effect in library("force")}
    assert "tool_runout" not in {effect.name for effect in library("flatness")}
    assert "stiffness_scale" in {effect.name for effect in library("flatness")}


@pytest.mark.parametrize("effect", library(), ids=lambda effect: effect.title)
def test_a_cause_of_the_library_has_a_remedy_that_is_one_short_instruction(effect):
    if effect.resembled:  # it is never identified as a cause
        return
    assert effect.remedy[:1].islower()
    assert effect.remedy[-1] != "."
    assert len(effect.remedy.split()) <= 25


@pytest.mark.parametrize("effect", library(), ids=lambda effect: effect.name)
def test_every_effect_is_described_and_can_be_started(effect):
    assert effect.signature
    assert effect.meaning.endswith(".")
    assert effect.meaning[0].isupper()
    assert effect.literature
    assert effect.experiment
    for parameter in effect.parameters:
        assert parameter.lower < parameter.upper
        assert parameter.starts
        assert all(parameter.lower <= start <= parameter.upper for start in parameter.starts)
        assert parameter.scale > 0
        # an angle is turned into the one turn that its bounds span
        assert parameter.period in {None, parameter.upper - parameter.lower}


def test_the_base_model_is_told_of_what_the_manifest_declares():
    cut = Cut(1e-4, 1e-3, Engagement(0.0, np.pi))
    runs = tuple(
        SimpleNamespace(
            role="identify", condition=str(i), setting=ForceSetting(cut, 0.0, 4, RECORDING, metres)
        )
        for i, metres in enumerate((0.0, 2.0))
    )
    base = ForceModel(Cutter(6e-3, 0.6, evenly_pitched(4)), EdgeLaw())
    task = Problem("force", "N", 1.0, base, runs, np.full(6, 0.01))
    known = {
        "dynamometer_resonance": {"frequency_hz": [900, 800, 1500], "damping": 0.03},
        "tool_wear": {"edge_growth_per_m": 0.2},
        "charge_drift": {"time_constant_s": 4.0},
        "orbit_stiffness": {"amplitude": 0.1, "phase_deg": 20.0},
        "stiffness_scale": {"factor": 0.9},
    }
    told = with_declared(task, known)
    assert told.base.sensor.resonances == (Resonance((900, 800, 1500), (0.03, 0.03, 0.03)),)
    assert told.base.sensor.discharge == (0.25, 0.25, 0.25)
    assert told.base.law.edge(2.0) == pytest.approx(1.4)
    assert told.base.structure == base.structure
    assert any("orbit stiffness" in note and "helical" in note for note in told.notes)


def test_a_model_without_the_part_that_an_effect_changes_is_not_asked_for_it():
    """A printed table is predicted without an arm: its problem has the observable and none of the parts."""
    printed = SimpleNamespace(base=object())
    able, unable = fitted_to(library("joint_force"), printed)
    assert able == ()
    assert unable["payload_error"] == "what is predicted here has no payload"
    assert set(unable) == {effect.name for effect in library("joint_force")}


def test_what_changes_nothing_in_a_batch_is_not_missed_unless_it_is_asked_for():
    some = next(effect for effect in library("force") if not effect.part)
    moot = replace(some, name="moot", adapt=lambda *_: Refusal("no run is helical", moot=True))
    lacking = replace(some, name="lacking", adapt=lambda *_: Refusal("no second feed"))
    problem = SimpleNamespace(base=object())
    assert fitted_to((moot, lacking), problem) == ((), {"lacking": "no second feed"})
    assert fitted_to((moot,), problem, moot=True)[1] == {"moot": "no run is helical"}


def test_what_is_declared_of_stability_but_not_in_its_model_is_said():
    known = {"process_damping": {}, "tool_runout": {}, "stiffness_scale": {}}
    (note,) = not_modelled("lobes", known)  # runout is in the tool, and the scale is nothing of stability
    assert "process damping" in note


@pytest.mark.parametrize(
    ("parameter", "meaning"),
    [
        ("slope_n_s", "The zero of a piezoelectric sensor drifts during the measurement."),
        (
            "time_constant_s",
            "A piezoelectric sensor discharges, so that a steady force fades from its signal.",
        ),
    ],
)
def test_the_report_states_the_meaning_of_the_form_that_was_found(parameter, meaning):
    effect = {"effect": "charge_drift", "probability": 1.0, "parameters": {parameter: [1.0, 2.0, 3.0]}}
    verdict = {"observables": {"force": {"status": "explained", "effects": [effect]}}}
    told = with_facts(verdict, {"effects": described()})
    assert told["observables"]["force"]["effects"][0]["meaning"].startswith(meaning)
