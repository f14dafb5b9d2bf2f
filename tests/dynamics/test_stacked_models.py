"""Models that are solved as one stack: each has the boundary that it has alone."""

from dataclasses import replace

import numpy as np
import pytest
from machines import TWO
from test_stability_model import marched_radius

from metro.cutting.cutter import Cutter
from metro.dynamics.softening import Softening
from metro.dynamics.stability_model import StabilityModel, boundaries
from metro.dynamics.system import Cut, Edge

RPM = np.array([700.0, 1350.0])
SLOT, SIDE = Cut(3, 0.0, np.pi, 1e9, 4e8), Cut(4, 2.0, np.pi, 1e9, 4e8)
MODEL = StabilityModel(TWO, (SIDE, SLOT), 0.01)
BALL = Cutter(0.005, 0.0, (0.0, 120.0), corner=0.005)


def damped(value):
    return replace(MODEL, cuts=tuple(replace(cut, damping=value) for cut in MODEL.cuts))


def turned(angle):
    return replace(MODEL, structure=TWO.turned(angle))


def with_mode(axis, hz):
    return replace(MODEL, structure=TWO.with_mode(axis, 2 * np.pi * hz, 0.04, 3e6))


def softer(change, *shares):
    return replace(MODEL, softening=(Softening(change, 1000.0, 1.0, shares),))


STACKS = {
    "damping": [damped(value) for value in (1e8, 3e8, 2e8)],
    "some damped": [MODEL, damped(2e8)],
    "turned": [turned(angle) for angle in (-0.4, 0.2, 0.9)],
    "turned and damped": [replace(turned(a), cuts=damped(1e8 * (1 + a)).cuts) for a in (0.1, 0.7)],
    "one more mode": [with_mode(0, 50.0), with_mode(1, 55.0), with_mode(0, 80.0)],
    "softer": [softer(-0.3), softer(0.2), softer(-0.1)],
    "some modes softer": [softer(-0.3, 1.0, 0.2, 0.0, 0.5), MODEL],
    "yielding": [replace(MODEL, yielding=value) for value in (0.0, 40.0, 150.0)],
}


@pytest.mark.parametrize("models", STACKS.values(), ids=STACKS)
def test_each_model_has_the_boundary_that_it_has_alone(models):
    depth, hz = boundaries(models, RPM)
    alone = [model.boundary(RPM) for model in models]
    np.testing.assert_allclose(depth, [d for d, _ in alone], rtol=3e-4)
    np.testing.assert_allclose(hz, [f for _, f in alone], rtol=1e-3)
    assert np.ptp(depth, axis=0).min() > 1e-3 * depth.min()


def test_turned_and_damped_models_of_a_stack_are_at_their_limit_as_brute_force_says():
    models = STACKS["turned and damped"]
    depth, _ = boundaries(models, RPM)
    for model, depths in zip(models, depth, strict=True):
        radius = np.array([
            [marched_radius(model.structure, cut, rpm, at, 120) for cut in model.cuts]
            for rpm, at in zip(RPM, depths, strict=True)
        ])  # fmt: skip
        np.testing.assert_allclose(radius.max(axis=1), 1.0, atol=1e-3)


def test_a_ball_of_a_stack_has_the_depth_that_it_has_alone():
    """Its depths are interpolated between those that are solved, which are others in a stack."""
    cut = replace(SIDE, edge=Edge(BALL, 4e8, 1e8))
    models = [replace(MODEL, cuts=(cut,), structure=TWO.turned(angle)) for angle in (0.0, 0.5)]
    depth, _ = boundaries(models, RPM)
    np.testing.assert_allclose(depth, [model.boundary(RPM)[0] for model in models], rtol=0.02)


def test_what_each_model_is_in_a_stack_does_not_depend_on_its_place():
    models = [with_mode(0, 50.0), damped(2e8), MODEL, with_mode(0, 80.0), turned(0.3)]
    depth, _ = boundaries(models, RPM)
    backwards, _ = boundaries(models[::-1], RPM)
    np.testing.assert_allclose(depth, backwards[::-1], rtol=1e-9)


def test_models_without_a_mode_are_stable_at_any_depth():
    none = replace(
        TWO, axis=TWO.axis[:0], omega=TWO.omega[:0], zeta=TWO.zeta[:0], stiffness=TWO.stiffness[:0]
    )
    rigid = replace(MODEL, structure=none)
    depth, _ = boundaries([rigid, rigid, MODEL], RPM)
    assert np.all(np.isinf(depth[:2]))
    assert np.all(np.isfinite(depth[2]))
