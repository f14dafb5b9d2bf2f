"""The harder world of boundary batches: with everything of it switched off it is the idealised one."""

import math
from dataclasses import replace

import numpy as np
import pytest

from virtual_cell.milling import in_millimetres
from virtual_cell.modes import Modes
from virtual_cell.recipes.boundary_world_draws import drawn_cell, drawn_programme
from virtual_cell.regeneration import Trials
from virtual_cell.regeneration import march as idealised
from virtual_cell.world.boundary.cell import Cell, Mishap, Plan, Session, Spindle, Tool, made, wandering
from virtual_cell.world.boundary.chatter import Law, march
from virtual_cell.world.boundary.flank import Flank
from virtual_cell.world.boundary.resonances import Resonances, state_matrices

HZ, ZETA, K = np.array([310.0, 392.0]), np.array([0.03, 0.035]), np.array([9e6, 7e6])
QUIET = Resonances(HZ, ZETA, K, np.array([0.0, math.pi / 2]), np.eye(2), np.ones(2), np.ones(2, dtype=bool))
STEADY = Spindle(off=0.0, wander=0.0, wander_s=1.0, droop=0.0, bearing=0.0, bent=2.0, damped=0.0)
CALM = Session(common=0.0, own=0.0, drift=0.0, depth_off=0.0, depth_sd=0.0, grain=0.0, settling=5.0)
SHARP = Flank(land=1e-9, springback=1e-9, pressure=1e14, friction=0.0, growth=0.0)
OFF = Cell(
    QUIET, STEADY, Tool(12e-3, np.zeros(3), 0.0, 0.0), Law(800e6, 320e6, 100e6, 0.0, 0.0, 5e-6),
    SHARP, CALM, 60e-6, 6e-3 * (1 - math.cos(math.radians(84))), "down", 6000.0,
)  # fmt: skip
PLAN = Plan(np.array([2800.0, 4400.0]), np.array([0.8e-3, 0.8e-3]), ("down", "down"), np.array([0.0, 1.0]))


def tip(cell, turns=12, per_turn=120):
    rng = np.random.default_rng(1)
    return march(made(cell, PLAN, turns, rng), per_turn, turns, rng).tip


def test_with_the_world_off_the_march_is_the_idealised_one():
    x, y = (
        Modes(HZ[i : i + 1] * np.sqrt(1 - ZETA[i : i + 1] ** 2), ZETA[i : i + 1], K[i : i + 1])
        for i in range(2)
    )
    law = in_millimetres((800.0, 320.0, 100.0), (0.0, 0.0, 0.0), (0.0, 0.0))
    trials = Trials((x, y), law, 3, 60e-6, PLAN.rpm, PLAN.depth, entry=5, immersion=OFF.immersion("down"))
    expected = idealised(trials, 12, 120).tip
    np.testing.assert_allclose(tip(OFF), expected, atol=2e-4 * np.abs(expected).max())


@pytest.mark.parametrize(
    "changed",
    [
        {"mishap": Mishap(play=5e-6, loose=0.5)},
        {"mishap": Mishap(friction=20.0)},
        {"mishap": Mishap(wavy=0.3, waves=0.3)},
        {"mishap": Mishap(clogging=1.0)},
        {"mishap": Mishap(clamped=0.6)},
        {"spindle": replace(STEADY, droop=0.02)},
        {"spindle": replace(STEADY, sag=0.1)},
        {"spindle": replace(STEADY, whirl=1.0)},
        {"tool": Tool(12e-3, np.array([0.0, 0.0, -40e-6]), 0.0, 0.0)},
        {"flank": replace(SHARP, land=100e-6, springback=1e-6)},
    ],
)
def test_each_thing_of_the_world_moves_the_tip(changed):
    moved = np.abs(tip(replace(OFF, **changed)) - tip(OFF)).max()
    assert moved > 0.02 * np.abs(tip(OFF)).max()


def test_a_damping_matrix_that_is_shared_takes_energy_and_a_gyroscopic_one_does_not():
    shared = replace(QUIET, shared=np.array([[1.0, 0.4], [0.4, 1.0]]))
    one = np.ones(1)

    def power(resonances, damped, whirl):  # of the velocities, per mass: what a motion loses
        a, _, _ = state_matrices(resonances, np.ones((1, 2)), damped * one, whirl * one)
        lost = -a[0, 2:, 2:]
        return np.linalg.eigvalsh(lost + lost.T)

    assert (power(shared, 1.0, 500.0) > 0.0).all()
    np.testing.assert_allclose(power(QUIET, 0.0, 500.0), 0.0, atol=1e-9)


def test_a_whirling_spindle_splits_a_pair_of_equal_resonances():
    # For M ẍ + G ẋ + K x = 0 with two equal modes, ω = ± g/2 + sqrt(g²/4 + ω0²).
    equal = replace(QUIET, hz=np.array([300.0, 300.0]), damping=np.full(2, 1e-6))
    a, _, _ = state_matrices(equal, np.ones((1, 2)), np.ones(1), np.array([600.0]))
    found = np.sort(np.abs(np.linalg.eigvals(a[0]).imag))[::2]
    omega = 2 * np.pi * 300.0
    expected = np.sqrt(300.0**2 + omega**2) + np.array([-300.0, 300.0])
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_the_receptance_of_one_line_is_that_of_one_oscillator_and_a_mass_lowers_its_peak():
    one = (np.array([value]) for value in (250.0, 0.02, 8e6, 0.3))
    lone = Resonances(*one, np.eye(1), np.ones(1), np.ones(1, dtype=bool))
    hz = np.array([0.0, 250.0])
    felt = lone.receptance(hz)
    along = np.array([math.cos(0.3), math.sin(0.3)])
    np.testing.assert_allclose(along @ felt[0] @ along, 1.0 / 8e6)
    np.testing.assert_allclose(along @ felt[1] @ along, 1.0 / (8e6 * 2j * 0.02))
    about = np.linspace(230.0, 260.0, 3001)
    mass = 8e6 / (2 * np.pi * 250.0) ** 2
    loaded = np.abs(lone.receptance(about, 0.02 * mass)[:, 0, 0])
    assert about[loaded.argmax()] == pytest.approx(250.0 / math.sqrt(1.02), rel=1e-3)


def test_a_wear_land_is_viscous_for_small_waves_and_comes_free_of_steep_ones():
    flank = Flank(land=100e-6, springback=2e-6, pressure=1.5e14, friction=0.2, growth=0.1)
    rise = flank.squeezed(np.array([1e-4])) - flank.squeezed(np.array([-1e-4]))
    assert rise[0] / 2e-4 == pytest.approx(0.5 * 1.5e14 * 100e-6**2)
    assert flank.effective(0.01) == pytest.approx(1.0, abs=1e-6)  # springback over land is 0.02
    assert flank.effective(0.2) < 0.75
    assert flank.squeezed(np.array([-1.0]))[0] < 0.02 * flank.squeezed(np.array([0.0]))[0]


def test_the_squeezed_volume_is_the_integral_under_the_land():
    flank = Flank(land=80e-6, springback=1.5e-6, pressure=2e14, friction=0.2, growth=0.1)
    s = (np.arange(20000) + 0.5) / 20000 * 80e-6
    for slope in (-0.1, -0.03, -0.01, 0.0, 0.02):
        volume = np.maximum(1.5e-6 + slope * s, 0.0).mean() * 80e-6
        assert flank.squeezed(np.array([slope]))[0] == pytest.approx(2e14 * volume, rel=1e-3)


def test_the_spindle_wanders_as_much_and_as_slowly_as_drawn():
    spindle = replace(STEADY, wander=2e-3, wander_s=0.5)
    course = wandering(spindle, np.full(400, 3000.0), 200, 5.0, np.random.default_rng(3))
    assert course.std() == pytest.approx(2e-3, rel=0.05)
    lag = 25  # turns of 20 ms: the time in which it forgets
    correlated = np.mean(course[:, :-lag] * course[:, lag:]) / np.mean(course**2)
    assert correlated == pytest.approx(math.exp(-1.0), abs=0.05)


def test_a_slower_turn_takes_longer_and_its_steps_are_exact():
    slow = replace(OFF, spindle=replace(STEADY, off=-0.01))
    rng = np.random.default_rng(1)
    cuts = made(OFF, PLAN, 12, rng)
    wandered = replace(cuts, speed=np.full((2, 12), -0.01))
    one = march(wandered, 120, 12, rng)
    other = march(made(slow, PLAN, 12, rng), 120, 12, rng)
    np.testing.assert_allclose(one.seconds, other.seconds, rtol=2e-4)
    np.testing.assert_allclose(one.tip, other.tip, atol=2e-3 * np.abs(other.tip).max())


def test_a_cut_that_goes_wild_is_stopped():
    wild = replace(PLAN, depth=np.array([0.5e-3, 60e-3]))
    rng = np.random.default_rng(1)
    course = march(made(OFF, wild, 60, rng), 120, 2, rng)
    assert course.stopped.tolist() == [False, True]
    assert 0 < course.made[1] < 60
    assert np.isfinite(course.tip).all()


def test_what_is_always_on_is_drawn_over_its_range():
    cells = [drawn_cell(np.random.default_rng(seed)) for seed in range(60)]
    off = np.array([cell.spindle.off for cell in cells])
    assert (np.abs(off) <= 5e-3).all()
    assert np.abs(off).max() > 4e-3
    for get, low, high in (
        (lambda c: c.spindle.wander, 1e-4, 3e-3),
        (lambda c: abs(c.session.depth_off), 1e-5, 6e-5),
        (lambda c: c.tool.runout, 1e-6, 5e-6),
        (lambda c: c.session.common, 3e-3, 1e-2),
    ):
        values = np.array([get(cell) for cell in cells])
        assert low <= values.min() < low * 1.5
        assert high / 1.5 < values.max() <= high
    for cell in cells:
        assert np.linalg.eigvalsh(cell.resonances.shared).min() > 0.19
    for style in "cd":
        plans = [drawn_programme(np.random.default_rng(i), cell, style) for i, cell in enumerate(cells)]
        assert 0.3 < np.mean([p.records for p in plans]) < 0.7
        assert {len(p.kinds) for p in plans} == {1, 2}
        for p, cell in zip(plans, cells, strict=True):
            assert set(p.held_out) < set(p.speeds)
            assert not p.per_turn % cell.tool.teeth
            assert p.per_turn * p.speeds[0] / 60.0 / cell.resonances.hz.max() > 14.9
