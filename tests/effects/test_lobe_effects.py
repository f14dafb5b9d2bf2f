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
    "spindle_speed_softening": {
        "change_per_krpm": -0.02,
        "at_krpm": 3.0,
        "exponent": 1.5,
        "share": [0.9, 0.2],
    },
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


def test_what_a_tip_loses_is_the_mean_over_its_modes_weighed_by_their_compliance():
    """At the speed that is named: shares and exponent only say where and how, not how much."""
    values = {"change_per_krpm": -0.05, "at_krpm": 3.0, "exponent": 1.8, "share": [0.7, 0.1]}
    (softening,) = spindle_speed_softening.apply(MODEL, values).softening
    changes = softening.of_modes(np.array([3000.0]), 2)[0]
    assert changes @ (1.0 / STRUCTURE.stiffness) / np.sum(1.0 / STRUCTURE.stiffness) == pytest.approx(-0.15)
    assert changes[0] / changes[1] == pytest.approx(7.0)


def test_equal_shares_are_a_change_of_every_stiffness():
    values = {"change_per_krpm": -0.02, "at_krpm": 3.0, "exponent": 1.4}
    alike = spindle_speed_softening.apply(MODEL, values).boundary(RPM)
    shared = spindle_speed_softening.apply(MODEL, values | {"share": [0.4, 0.4]}).boundary(RPM)
    np.testing.assert_allclose(shared, alike, rtol=1e-6)


def test_a_mode_that_no_bearing_holds_leaves_its_boundary_where_it_was():
    """In a slot of even teeth along y alone: what softens moves across and does not touch it."""
    work = Structure(np.array([1, 0]), STRUCTURE.omega, STRUCTURE.zeta, np.array([9e6, 7e12]))
    model = replace(MODEL, structure=work)
    values = {"change_per_krpm": -0.05, "share": [0.0, 1.0]}
    # Weighed by compliance, all of the tip's change would be in a mode that it hardly feels.
    softer = spindle_speed_softening.apply(model, values).boundary(RPM)
    np.testing.assert_allclose(softer[0], model.boundary(RPM)[0], rtol=1e-3)


@pytest.mark.parametrize("shares", [[0.5, 0.5], [0.02, 0.9]])
def test_no_parameters_of_the_search_leave_a_mode_without_stiffness(shares):
    problem = SimpleNamespace(cases=(SimpleNamespace(model=MODEL, rpm=RPM),), depth=np.array([1e-3, 4e-3]))
    (effect,), _ = fitted_to((spindle_speed_softening.EFFECT,), problem)
    change, at, exponent, *_ = effect.parameters
    values = {"change_per_krpm": change.lower, "at_krpm": at.lower, "exponent": exponent.upper}
    softer = effect.apply(MODEL, values | {"share": shares}).boundary(RPM)[0]
    assert np.all(softer > 0.0)


def test_shares_are_sought_of_the_modes_that_make_the_tip_flexible():
    stiff = STRUCTURE.with_mode(0, 2 * np.pi * 500.0, 0.03, 3e9)
    one = SimpleNamespace(model=replace(MODEL, structure=stiff), rpm=RPM)
    shares = [p for p in spindle_speed_softening.adapt(spindle_speed_softening.EFFECT, SimpleNamespace(
        cases=(one,))).parameters if p.name == "share"]  # fmt: skip
    assert [p.given for p in shares] == [False, False, True]
    # A list has one meaning at one place only.
    two = SimpleNamespace(cases=(one, SimpleNamespace(model=MODEL, rpm=RPM)))
    names = spindle_speed_softening.adapt(spindle_speed_softening.EFFECT, two).names
    assert names == ("change_per_krpm", "at_krpm", "exponent")


def test_bounds_follow_the_batch():
    problem = SimpleNamespace(cases=(SimpleNamespace(model=MODEL, rpm=RPM),), depth=np.array([1e-3, 4e-3]))
    effects, unable = fitted_to(library("lobes"), problem)
    bounds = {p.name: (p.lower, p.upper) for effect in effects for p in effect.parameters}
    assert bounds["at_krpm"] == pytest.approx((3.6, 3.6))  # the mean of the speeds that are tested
    assert not unable
    assert bounds["frequency_hz"] == pytest.approx((0.4 * 310.0, 2.5 * 390.0))
    assert bounds["stiffness_n_um"] == pytest.approx((0.2 * 7.0, 20.0 * 7.0))
    low, _ = bounds["change_per_krpm"]
    assert bounds["growth_per_mm"] == pytest.approx((0.0, 2.0 / 2.0))  # twice as soft at the mean log depth
    assert 1.0 + low * 4.8 == pytest.approx(0.2)  # a fifth of the stiffness at the fastest speed, no less
