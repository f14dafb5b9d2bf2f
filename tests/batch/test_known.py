"""What batch.yaml declares as known: the parameters of effects, by the names of the library."""

from types import SimpleNamespace

import numpy as np
import pytest
from conftest import edit

from metro.batch.known import declarable, registry
from metro.batch.manifest import read_manifest
from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.law import EdgeLaw
from metro.effects.library import library, with_declared
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceModel
from metro.observables.problem import Problem


def found(batch, known):
    edit(batch / "batch.yaml", "cell: bench", f"cell: bench\nknown: {known}")
    return [(finding.severity, str(finding)) for finding in read_manifest(batch)[1]]


def test_the_names_are_those_of_the_library():
    assert declarable() == registry(library())  # else call: python scripts/reference.py docs
    assert "tool_runout" in declarable()
    assert "chipped_tooth" not in declarable()  # what a residual is only like cannot be known


@pytest.mark.parametrize(
    "known",
    [
        "{tool_runout: {radius_um: 7.35, angle_deg: 40}}",
        "{charge_drift: {time_constant_s: 4}}",
        "{entry_transient: {amplitude_um: 12, length_mm: 15}}",
        "{entry_transient: {amplitude_um: 12, length_mm: 15, exit_um: -9}}",
        "{entry_transient: {grows_with: force, amplitude_um: 12, length_mm: 15}}",
        "{dynamometer_resonance: {frequency_hz: [900, 800, 1500], damping: 0.03}}",
        "{stiffness_scale: {joint: all, factor: 0.9}, tool_wear: {edge_growth_per_m: 0.1}}",
        "{missing_mode: {frequency_hz: 40, damping: 0.02, stiffness_n_um: 5, axis: y}}",
    ],
)
def test_an_effect_with_all_of_its_parameters_has_no_findings(batch, known):
    assert found(batch, known) == []


@pytest.mark.parametrize(
    ("known", "message"),
    [
        (
            "{tool_runout: {radius: 7}}",
            'known.tool_runout.radius: is not a parameter of tool_runout (did you mean "radius_um"?), '
            "expected radius_um, angle_deg",
        ),
        ("{charge_drift: {slope: 3}}", "expected slope_n_s or time_constant_s"),
        (
            "{tool_runout: {radius_um: 7,35, angle_deg: 40}}",
            'found "7,35", expected a number, or a list of them: write 7.35',
        ),
        ("{tool_runout: {radius_um: yes, angle_deg: 40}}", "radius_um: found true, expected a number"),
        ("{tool_runout: {radius_um: [], angle_deg: 40}}", "radius_um: found [], expected a number"),
        (
            "{friction_reversal: {joint: 10, torque_nm: 5}}",
            "joint: found 10, expected a joint, 1 to 9, or all",
        ),
        (
            "{missing_mode: {frequency_hz: 40, damping: 0.02, stiffness_n_um: 5, axis: z}}",
            'axis: found "z", expected x or y',
        ),
        (
            "{entry_transient: {grows_with: speed, amplitude_um: 12, length_mm: 15}}",
            'grows_with: found "speed", expected force',
        ),
    ],
)
def test_a_wrong_name_or_value_of_a_parameter_is_an_error(batch, known, message):
    ((severity, text),) = found(batch, known)
    assert severity == "error"
    assert message in text


@pytest.mark.parametrize(
    ("known", "message"),
    [
        (
            "{tool_runout: {radius_um: 7}}",
            "known.tool_runout: lacks angle_deg, expected radius_um, angle_deg",
        ),
        ("{gear_ripple: {joint: 2, order: 100, torque_nm: 5}}", "known.gear_ripple: lacks phase_deg"),
        ("{tool_runout: {radius_um: 7, angle_deg: 4, method: dial}}", "method: is not a parameter"),
        ("{stiffness_scale: {factor: 0.9, axis: z}}", "axis: is not a parameter of stiffness_scale"),
        ("{flange_rotation: {}}", "known.flange_rotation: lacks share"),
    ],
)
def test_what_the_contract_allows_and_the_model_cannot_use_is_a_warning(batch, known, message):
    ((severity, text),) = found(batch, known)
    assert severity == "warning"
    assert message in text


def test_names_that_the_contract_has_in_words_are_no_errors(batch):
    findings = found(batch, "{entry_transient: {decay_mm: 12, frequency_hz: 20}}")
    assert {severity for severity, _ in findings} == {"warning"}


@pytest.mark.parametrize(
    ("known", "note"),
    [
        (
            {"tool_runout": {"radius_um": 7.0}},
            "The base model does not include tool runout: batch.yaml has radius_um 7.0 under known; "
            "expected radius_um, angle_deg.",
        ),
        (
            {"dynamometer_resonance": {"frequency_hz": [900, 800], "damping": 0.03}},
            "The base model does not include dynamometer resonance: batch.yaml has frequency_hz [900, "
            "800], damping 0.03 under known; expected frequency_hz (3 values, or one), damping (3 values, "
            "or one).",
        ),
        (
            {"charge_drift": {}},
            "The base model does not include charge drift: batch.yaml has no parameter under known; expected "
            "time_constant_s (3 values, or one) or slope_n_s (3 values, or one).",
        ),
    ],
)
def test_the_report_says_which_effect_the_base_model_could_not_be_told_of(known, note):
    base = ForceModel(Cutter(6e-3, 0.6, evenly_pitched(4)), EdgeLaw())
    runs = tuple(
        SimpleNamespace(
            role="identify",
            condition=str(i),
            setting=SimpleNamespace(helix=None, start=i, recording=Recording((0.5,), 1.0, 50.0)),
        )
        for i in range(2)
    )
    told = with_declared(Problem("force", "N", 1.0, base, runs, np.full(6, 0.01)), known)
    assert told.base == base
    assert told.notes == (note,)
