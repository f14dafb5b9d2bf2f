"""The arm at the tip in the harder world, against closed forms: statics, free swing, friction, what bends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from virtual_cell.recipes.irb6640 import ARM, NEAR
from virtual_cell.world.faces import load_test, structure
from virtual_cell.world.faces.structure import BendingArm, Friction, Mode, Structure

COMPLIANCE = np.array([[5.0, 0.4, 1.0], [0.4, 4.0, -0.5], [1.0, -0.5, 6.0]]) * 1e-7
FREE = Friction(np.array([0.0, 0.0, 1.0]), 1e-9, 50e-6)
MODE = Mode(12.0, 0.04, np.array([0.6, 0.0, 0.8]), 2e7, 0.0)


def everywhere(matrix):
    return lambda at: np.tile(matrix, (len(at), 1, 1))


def plain(**changes):
    at = everywhere(COMPLIANCE)
    one = Structure(at, at, np.eye(3) * 50.0, 0.0, 0.02, np.zeros((3, 3)), (MODE,), FREE)
    return replace(one, **changes)


def pushed(one, force, seconds=4.0):
    count = round(seconds / structure._STEP)
    return structure.heights(one, [np.zeros((count, 2))], [np.tile(force, (count, 1))], count)[0]


def bare(arm=ARM):
    return BendingArm(
        arm.dh, arm.tip, arm.tool_axes, arm.stiffness, arm.masses, np.eye(6), 0.0, np.zeros((3, 3))
    )


def test_a_slow_force_bends_arm_and_modes_as_their_compliances_add_up():
    force = np.array([40.0, -20.0, 70.0])
    whole = COMPLIANCE + np.outer(MODE.towards, MODE.towards) / MODE.stiffness
    assert pushed(plain(), force)[-1] == pytest.approx(whole[2] @ force, rel=1e-3)
    np.testing.assert_allclose(plain().tested(np.zeros((1, 2)))[0], whole, rtol=1e-12)


def test_a_tip_without_damping_swings_at_the_frequency_of_stiffness_and_mass():
    k, m = 2e5, 200.0
    one = plain(in_cut=everywhere(np.eye(3) / k), mass=np.eye(3) * m, a1=0.0, modes=())
    z = pushed(one, np.array([0.0, 0.0, 100.0]), 0.8)
    t = structure._STEP * np.arange(1, len(z) + 1)
    np.testing.assert_allclose(z, 100.0 / k * (1.0 - np.cos(np.sqrt(k / m) * t)), atol=0.08 * 100.0 / k)
    assert z.max() == pytest.approx(2.0 * 100.0 / k, rel=1e-3)


def test_a_mode_swings_up_to_its_amplification_at_resonance():
    t = structure._STEP * np.arange(20_000)
    swing = MODE.rung(np.sin(2.0 * np.pi * MODE.hz * t))
    assert np.ptp(swing[-1000:]) / 2.0 == pytest.approx(1.0 / (2.0 * MODE.damping * MODE.stiffness), rel=0.02)


def test_friction_turns_as_much_work_into_heat_per_cycle_as_its_level_times_the_way():
    """Of Dahl's loop, much wider than the presliding length: 4 level amplitude, less the corners."""
    rub, amplitude = Friction(np.array([0.0, 0.0, 1.0]), 5.0, 10e-6), 1e-3
    way = amplitude * np.sin(np.linspace(0.0, 4.0 * np.pi, 40_001))
    force, held = [], 0.0
    for step in np.diff(way):
        held = rub.after(held, float(step))
        force.append(held)
    second = np.array(force[20_000:])
    assert np.abs(second).max() <= rub.level
    loop = float(second @ np.diff(way)[20_000:])
    corners = 2.0 * rub.level * rub.length * 2.0 * np.log(2.0)
    assert loop == pytest.approx(4.0 * rub.level * amplitude - 2.0 * corners, rel=0.01)


def test_friction_is_a_spring_of_level_over_length_before_it_slips():
    rub = Friction(np.array([0.0, 0.0, 1.0]), 5.0, 50e-6)
    assert rub.after(0.0, 1e-8) == pytest.approx(5.0 / 50e-6 * 1e-8, rel=1e-3)


def test_friction_keeps_a_part_of_the_force_from_the_springs():
    rubbing = plain(friction=Friction(np.array([0.0, 0.0, 1.0]), 6.0, 20e-6), modes=())
    force = np.array([[0.0, 0.0, 400.0]])
    moved = structure.pulled(rubbing, np.zeros((1, 2)), force)[0]
    np.testing.assert_allclose(moved, COMPLIANCE[:, 2] * 394.0, rtol=1e-3)


def test_the_receptance_begins_at_the_static_compliance_and_ends_at_the_mass():
    one = plain(modes=())
    low, high = one.receptance(np.zeros(2), np.array([1e-3, 1e5]))
    np.testing.assert_allclose(low.real, COMPLIANCE, rtol=1e-5)
    dynamic = -np.linalg.inv(high) / (2e5 * np.pi) ** 2
    np.testing.assert_allclose(dynamic.real, one.mass, atol=1e-2)


def test_an_arm_whose_joints_are_not_coupled_and_whose_base_is_rigid_is_the_idealised_one():
    force = np.array([30.0, -70.0, 110.0])
    np.testing.assert_allclose(bare().yields(NEAR, force), ARM.yields(NEAR, force), rtol=1e-12)


def test_a_base_that_tilts_moves_the_tip_by_angle_times_lever():
    tilting, force = replace(bare(), base=1e-8), np.array([100.0, 0.0, 0.0])
    x, y, z = tilting.pose(NEAR)[0]
    turn = 1e-8 * z * 100.0  # about the base's y axis: the moment of the force about z does not tilt it
    moved = tilting.yields(NEAR, force) - bare().yields(NEAR, force)
    np.testing.assert_allclose(moved, [turn * z, 0.0, -turn * x], rtol=1e-9, atol=1e-18)
    assert abs(y) > 0.0


def test_drawn_arms_are_symmetric_passive_and_have_a_part_of_their_compliance_beside_the_joints():
    rng, shares = np.random.default_rng(3), []
    for _ in range(30):
        arm = structure.drawn_arm(rng, ARM)
        matrix, joints = (
            np.column_stack([one.yields(NEAR, unit) for unit in np.eye(3)]) for one in (arm, arm.joints_alone)
        )
        np.testing.assert_allclose(matrix, matrix.T, rtol=1e-9)
        assert np.linalg.eigvalsh(matrix).min() > 0.0
        assert np.linalg.eigvalsh(arm.coupled).min() > 0.0
        shares.append(1.0 - np.trace(joints) / np.trace(matrix))
    assert 0.03 < np.median(shares) < 0.4
    assert all(6.0 <= mode.hz <= 25.0 for _ in range(30) for mode in structure.drawn_modes(rng, 1e6))


def test_a_tracker_reads_the_compliance_and_nobody_writes_down_a_tip_that_moves_against_the_pull():
    places = ((10.0, 20.0), (90.0, 20.0))
    test = load_test.LoadTest(places, (200.0, 400.0), 400, 30e-6, 0.0, 0.0, 0.01, 0.0)
    rows = load_test.rows(test, "A1", plain(), np.random.default_rng(1))
    assert len(rows) == 2 * 3 * 2 * 400
    force = np.array([[row[f"f{axis}_n"] for axis in "xyz"] for row in rows])
    read = np.array([[row[f"d{axis}_mm"] for axis in "xyz"] for row in rows]) / 1e3
    whole = plain().tested(np.zeros((1, 2)))[0]
    rest = read - 1.01 * force @ whole.T
    assert rest[:, 0].std() == pytest.approx(30e-6, rel=0.1)
    own = np.sum(read * force, axis=1) / np.sum((force @ whole.T) * force, axis=1)
    assert own.mean() == pytest.approx(1.01, abs=0.006)
    broken = replace(test, outliers=0.2, lost=1e-3)
    for row in load_test.rows(broken, "A1", plain(), np.random.default_rng(2)):
        axis = next(axis for axis in "xyz" if row[f"f{axis}_n"])
        assert row[f"d{axis}_mm"] >= 0.0
