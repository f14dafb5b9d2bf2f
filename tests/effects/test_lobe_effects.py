"""Effects of the stability boundary: what each does to a model, and that they stack."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from metro.dynamics.stability_model import StabilityModel
from metro.dynamics.system import Cut, Structure
from metro.effects import missing_mode, mode_coupling, process_damping, spindle_speed_softening
from metro.effects.effect import fitted_to
from metro.effects.library import library

STRUCTURE = Structure(
    np.array([0, 1]), 2 * np.pi * np.array([310.0, 390.0]), np.array([0.03, 0.04]), np.array([9e6, 7e6])
)
MODEL = StabilityModel(STRUCTURE, (Cut(3, 1.7, np.pi, 8e8, 3e8),), 0.006)
RPM = np.array([2400.0, 4800.0])
VALUES = {
    "missing_mode": {"frequency_hz": 250.0, "damping": 0.02, "stiffness_n_um": 8.0, "axis": 1.0},
    "mode_coupling": {"angle_deg": 30.0},
    "process_damping": {"coefficient_n_mm": 120.0},
    "spindle_speed_softening": {"change_per_krpm": -0.02},
    "depth_yielding": {"growth_per_mm": 0.1},
}


def test_the_library_has_the_effects_of_the_contract():
    effects = {effect.name: effect for effect in library("lobes")}
    assert set(effects) == set(VALUES)
    assert {name for name, effect in effects.items() if effect.resembled} == {"depth_yielding"}
    assert all(set(effects[name].names) == set(values) for name, values in VALUES.items())


@pytest.mark.parametrize("effect", library("lobes"), ids=lambda effect: effect.name)
def test_an_effect_changes_the_boundary_and_leaves_the_model_as_it_was(effect):
    before = MODEL.boundary(RPM)[0]
    changed = effect.apply(MODEL, VALUES[effect.name]).boundary(RPM)[0]
    assert np.abs(np.log(changed / before)).max() > 0.02
    np.testing.assert_array_equal(MODEL.boundary(RPM)[0], before)


def test_the_effects_stack_in_any_order():
    forward = backward = MODEL
    for effect in library("lobes"):
        forward = effect.apply(forward, VALUES[effect.name])
    for effect in reversed(library("lobes")):
        if effect.name != "mode_coupling":  # turns the modes that are there
            backward = effect.apply(backward, VALUES[effect.name])
    assert forward.cuts == backward.cuts
    assert forward.softening == backward.softening
    assert forward.yielding == backward.yielding
    np.testing.assert_array_equal(forward.structure.omega, backward.structure.omega)


def test_a_missing_mode_is_one_more_mode_of_its_axis():
    structure = missing_mode.apply(MODEL, VALUES["missing_mode"]).structure
    assert structure.axis[-1] == 1
    assert structure.omega[-1] == pytest.approx(2 * np.pi * 250.0)
    assert structure.stiffness[-1] == pytest.approx(8e6)
    np.testing.assert_array_equal(structure.stiffness[:-1], STRUCTURE.stiffness)


def test_process_damping_is_the_force_of_the_contract():
    # a C v_n / v_c with v_c = spindle * radius: the cut holds C / radius
    (cut,) = process_damping.apply(MODEL, VALUES["process_damping"]).cuts
    assert cut.damping == pytest.approx(120e3 / 0.006)
    assert replace(cut, damping=0.0) == MODEL.cuts[0]


def test_coupled_x_modes_lean_towards_y():
    turned = mode_coupling.apply(MODEL, {"angle_deg": 30.0}).structure
    np.testing.assert_allclose(turned.directions[0], [np.cos(np.pi / 6), 0.5])
    np.testing.assert_allclose(turned.directions[1], [-0.5, np.cos(np.pi / 6)])


def test_softening_is_relative_per_thousand_turns():
    softer = spindle_speed_softening.apply(MODEL, {"change_per_krpm": -0.02})
    own = replace(STRUCTURE, omega=STRUCTURE.omega * np.sqrt(0.904), stiffness=STRUCTURE.stiffness * 0.904)
    expected = replace(MODEL, structure=own).boundary(RPM[1:])
    assert softer.boundary(RPM[1:])[0] == pytest.approx(expected[0], rel=1e-4)


def test_bounds_follow_the_batch():
    problem = SimpleNamespace(cases=(SimpleNamespace(model=MODEL, rpm=RPM),), depth=np.array([1e-3, 4e-3]))
    effects, unable = fitted_to(library("lobes"), problem)
    bounds = {p.name: (p.lower, p.upper) for effect in effects for p in effect.parameters}
    assert not unable
    assert bounds["frequency_hz"] == pytest.approx((0.4 * 310.0, 2.5 * 390.0))
    assert bounds["stiffness_n_um"] == pytest.approx((0.2 * 7.0, 20.0 * 7.0))
    low, _ = bounds["change_per_krpm"]
    assert bounds["growth_per_mm"] == pytest.approx((0.0, 2.0 / 2.0))  # twice as soft at the mean log depth
    assert 1.0 + low * 4.8 == pytest.approx(0.2)  # a fifth of the stiffness at the fastest speed, no less
