"""What the hidden effects of a cutting arm do to torques and wall, in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from virtual_cell.arm_cell import hardened
from virtual_cell.arm_effects import ARM_EFFECTS
from virtual_cell.arm_line import given_way, statics, strayed, under_load
from virtual_cell.arm_log import Pass, cut_log, idle_log
from virtual_cell.arm_wall import height
from virtual_cell.recipes.arm_draws import drawn, entry
from virtual_cell.side_force import SideCut, side_force

DEG, MDEG = np.pi / 180.0, np.pi / 180e3
LOAD = np.array([60.0, -150.0, 40.0])  # N, base frame
CELL, BENCH = drawn(np.random.default_rng([3, 23]), "a")
TURNING = CELL.moves.turning[0]  # index of a joint that turns round within a cut
ALONG = next(one for one in BENCH.lines.values() if len(one.turns[TURNING]))
NORMAL = CELL.turn @ np.array([0.0, 1.0, 0.0])


def constant(s):
    return np.tile(LOAD, (len(s), 1))


def a_pass(cell):
    return Pass(ALONG, statics(cell, ALONG), 0.012, 0.006)


def hiding(name, **parameters):
    return ARM_EFFECTS[name].apply(CELL, parameters)


def difference(cell, logged=cut_log):
    """Torques (n, 6) that an effect adds to a log, times (n,), angles and speeds (n, 6) there; no noise."""
    logs = []
    for one in (CELL, cell):
        quiet = replace(one, drives=replace(one.drives, torque_noise=0.0))
        extra = (constant,) if logged is cut_log else ()
        logs.append(logged(quiet, a_pass(quiet), *extra, 0.012, np.random.default_rng(1)))
    count = min(len(log["t_s"]) for log in logs)
    tau = [np.stack([log[f"tau{i}_nm"][:count] for i in range(1, 7)], axis=1) for log in logs]
    t = logs[0]["t_s"][:count]
    s = 0.006 + 0.012 * t
    return tau[1] - tau[0], t, ALONG.spline(s), ALONG.rate(s, 0.012)


def wall(cell, x=None, force=constant):
    x = np.linspace(0.0005, 0.07, 400) if x is None else x
    return height(cell, a_pass(cell), force, NORMAL, x, entry=entry(BENCH), seconds=600.0), x


def lever(cell, x):
    """How far (n, 6) the wall stands proud per torsion of each joint."""
    return np.einsum("a,nai->ni", NORMAL, statics(cell, ALONG).jacobian(x + entry(BENCH)))


def only(joint, values):
    whole = np.zeros((len(values), 6))
    whole[:, joint - 1] = values
    return whole


def test_friction_of_the_cut_goes_with_the_sign_of_the_speed():
    added, _, _, rate = difference(hiding("friction_reversal", joint=TURNING + 1, torque_nm=20.0))
    assert {-1.0, 1.0} <= set(np.sign(rate[:, TURNING]))
    expected = only(TURNING + 1, 20.0 * np.tanh(rate[:, TURNING] / 2e-4))
    np.testing.assert_allclose(added, expected, atol=0.11)


def test_friction_that_warms_up_grows_from_nothing_with_the_log_of_the_cut():
    cell = hiding("friction_warmup", joint=1, slope_nm_s=3.0)
    added, t, _, rate = difference(cell)
    np.testing.assert_allclose(added, only(1, 3.0 * t * np.tanh(rate[:, 0] / 2e-4)), atol=0.11)
    assert not difference(cell, idle_log)[0].any()


def test_a_gears_ripple_goes_with_the_angle_of_its_joint():
    cell = hiding("gear_ripple", joint=5, order=400.0, torque_nm=8.0, phase_deg=30.0)
    added, _, q, _ = difference(cell)
    np.testing.assert_allclose(added, only(5, 8.0 * np.sin(400.0 * q[:, 4] + 30.0 * DEG)), atol=0.11)


def test_a_payload_adds_the_slope_of_its_potential():
    added, _, q, _ = difference(hiding("payload_error", mass_kg=4.0, com_mm=[50.0, -20.0, 100.0]))

    def potential(angles):
        flange = CELL.arm.frames(angles)[6]
        return 4.0 * 9.81 * (flange[:3, :3] @ [0.05, -0.02, 0.1] + flange[:3, 3])[2]

    slope = [(potential(q[7] + h) - potential(q[7] - h)) / 2e-6 for h in 1e-6 * np.eye(6)]
    np.testing.assert_allclose(added[7], slope, atol=0.11)


def test_a_late_clock_stamps_the_same_torques_and_angles_later():
    late = hiding("clock_offset", offset_ms=180.0)  # fifteen periods
    logs = []
    for cell in (CELL, late):
        quiet = replace(cell, drives=replace(cell.drives, torque_noise=0.0))
        logs.append(cut_log(quiet, a_pass(quiet), constant, 0.012, np.random.default_rng(1)))
    for column, within in (("q{}_set_deg", 1e-9), ("tau{}_nm", 0.11)):
        on_time, later = (np.stack([log[column.format(i)] for i in range(1, 7)], axis=1) for log in logs)
        assert np.abs(later - on_time[: len(later)]).max() > 10.0 * within
        np.testing.assert_allclose(later[15:], on_time[: len(later) - 15], atol=within)


def test_vibration_goes_by_the_clock_of_the_log():
    straight, x = wall(CELL)
    t = (x + entry(BENCH) - 0.006) / 0.012 + 0.18
    shaken = replace(hiding("clock_offset", offset_ms=180.0), vibration=(5.0, 2e-6, 0.0))
    np.testing.assert_allclose(wall(shaken)[0] - straight, 2e-6 * np.sin(2 * np.pi * 5.0 * t), atol=1e-12)


def test_a_joint_that_has_turned_round_lags_behind_first():
    turn = ALONG.turns[TURNING][0]
    rough = replace(CELL.drives, ripple=np.zeros(6), lag=0.0, reversal=np.full(6, 1e-4))
    s = turn + np.array([-0.002, 0.004])
    before, after = strayed(replace(CELL, drives=rough), ALONG, s, 0.012)[:, TURNING]
    assert before == 0.0
    assert after == pytest.approx(-1e-4 * np.sign(ALONG.rate(s[1:], 0.012)[0, TURNING]))


def test_torque_constant_viscosity_and_delay_change_what_is_logged():
    idle = idle_log(CELL, a_pass(CELL), 0.012, np.random.default_rng(1))
    added, _, _, _ = difference(hiding("torque_constant", joint=2, error=0.1), idle_log)
    np.testing.assert_allclose(added[:, 1], 0.1 * idle["tau2_nm"][: len(added)], atol=1.5)
    assert not np.delete(added, 1, axis=1).any()
    added, _, _, rate = difference(hiding("viscous_change", joint=2, change=3.0))
    np.testing.assert_allclose(added, only(2, 3.0 * CELL.drives.viscous[1] * rate[:, 1]), atol=0.11)
    added, _, _, rate = difference(hiding("joint_delay", joint=2, delay_ms=120.0), idle_log)
    earlier = np.gradient(idle["tau2_nm"]).mean() / 0.012 * -0.12
    assert added[:, 1].mean() == pytest.approx(earlier, abs=0.3)


def test_backlash_moves_the_wall_by_half_the_gap_to_the_side_of_the_torque():
    cell = hiding("joint_backlash", joint=1, angle_mdeg=10.0)
    (proud, x), (straight, _) = wall(cell), wall(CELL)
    side = np.sign(a_pass(CELL).loads.torque(x + entry(BENCH), constant(x))[:, 0])
    np.testing.assert_allclose(proud - straight, lever(CELL, x)[:, 0] * side * 5.0 * MDEG, rtol=1e-9)
    q = ALONG.q[3]
    np.testing.assert_allclose(under_load(cell, q, LOAD), under_load(CELL, q, LOAD))


def test_joints_are_softer_in_the_cut_by_the_factor_and_not_in_the_load_tests():
    s = np.array([0.04])
    moved = [
        given_way(c, statics(c, ALONG), s, LOAD[None])[0]
        for c in (CELL, hiding("stiffness_scale", factor=0.8, joint="all"))
    ]
    np.testing.assert_allclose(moved[1], moved[0] / 0.8, rtol=1e-9)
    one = hiding("stiffness_scale", factor=0.8, joint=2)
    assert one.factor == (1.0, 0.8, 1.0, 1.0, 1.0, 1.0)
    np.testing.assert_allclose(under_load(one, ALONG.q[3], LOAD), under_load(CELL, ALONG.q[3], LOAD))


@pytest.mark.parametrize("torque", [-900.0, -3.0, 0.0, 50.0, 2000.0])
def test_a_hardening_spring_solves_its_law(torque):
    k, cubic = 2e6, 3e12
    x = hardened(np.array([torque]), np.array([k]), np.array([cubic]))[0]
    assert k * x + cubic * x**3 == pytest.approx(torque, abs=1e-8)
    root = next(r.real for r in np.roots([cubic, 0.0, k, -torque]) if abs(r.imag) < 1e-9)
    assert x == pytest.approx(root, rel=1e-6, abs=1e-12)


def test_hardening_shows_between_two_levels_of_load_and_not_at_small_ones():
    cell, q = hiding("stiffness_hardening", joint=2, cubic=2e12), ALONG.q[3]
    small, large = (under_load(cell, q, n * LOAD) / n for n in (1e-3, 6.0))
    np.testing.assert_allclose(small, under_load(CELL, q, LOAD), rtol=1e-5)
    assert np.linalg.norm(large - small) > 1e-6


def test_what_no_encoder_sees_is_on_the_wall():
    cell = hiding("gear_ripple", joint=3, order=400.0, torque_nm=8.0, phase_deg=30.0)
    (proud, x), (straight, _) = wall(cell), wall(CELL)
    q = ALONG.spline(x + entry(BENCH))
    torsion = -8.0 * np.sin(400.0 * q[:, 2] + 30.0 * DEG) / CELL.arm.stiffness[2]
    np.testing.assert_allclose(proud - straight, lever(CELL, x)[:, 2] * torsion, atol=1e-12)
    rubbing = hiding("friction_reversal", joint=3, torque_nm=20.0)
    rate = ALONG.rate(x + entry(BENCH), 0.012)[:, 2]
    torsion = -20.0 * np.tanh(rate / 2e-4) / CELL.arm.stiffness[2]
    np.testing.assert_allclose(wall(rubbing)[0] - straight, lever(CELL, x)[:, 2] * torsion, atol=1e-12)


def test_vibration_and_waves_are_on_the_wall_as_they_are_told():
    straight, x = wall(CELL)
    t = (x + entry(BENCH) - 0.006) / 0.012  # since the start of the log
    shaken = hiding("path_vibration", frequency_hz=5.0, amplitude_um=2.0, phase_deg=40.0)
    np.testing.assert_allclose(
        wall(shaken)[0] - straight, 2e-6 * np.sin(2 * np.pi * 5.0 * t + 40.0 * DEG), atol=1e-12
    )
    waves = hiding("fixed_length_waves", length_mm=3.0, amplitude_um=2.0, phase_deg=0.0)
    np.testing.assert_allclose(wall(waves)[0] - straight, 2e-6 * np.sin(2 * np.pi * x / 3e-3), atol=1e-12)
    tilted = hiding("wall_tilt", tilt_mrad=0.5)
    np.testing.assert_allclose(wall(tilted)[0] - straight, 5e-4 * x, atol=1e-12)
    drifted = hiding("thermal_drift", um_per_min=[1.0, 2.0, 3.0])
    np.testing.assert_allclose(wall(drifted)[0] - straight, NORMAL @ [1e-5, 2e-5, 3e-5], rtol=1e-9)


def test_a_link_that_twists_moves_the_tip_in_cut_and_load_test_by_its_energy():
    cell = hiding("link_flexibility", link=2, compliance_rad_nm=1e-6)
    q = ALONG.q[3]
    more = LOAD @ (under_load(cell, q, LOAD) - under_load(CELL, q, LOAD))
    frame = CELL.arm.frames(q)[2]
    moment = frame[:3, 0] @ np.cross(CELL.arm.pose(q)[0] - frame[:3, 3], LOAD)
    assert more == pytest.approx(1e-6 * moment**2)
    s = ALONG.s[3:4]
    cut = [given_way(c, statics(c, ALONG), s, LOAD[None])[0] for c in (CELL, cell)]
    assert LOAD @ (cut[1] - cut[0]) == pytest.approx(more, rel=1e-6)


def test_the_force_is_in_balance_with_the_depth_that_the_tool_is_left():
    cut = SideCut(BENCH.tool, BENCH.metal, 4000.0, 0.016, 5e-3, 4e-3, "down", 0.08)
    stiff, soft = (side_force(cut, lambda f, c=c: -c * f[1], speed_error=0.0, phase=0.0) for c in (0.0, 1e-6))
    proud = -1e-6 * soft.turn.mean(axis=0)[1]
    assert abs(proud) > 5e-5
    less = side_force(replace(cut, radial=4e-3 - proud), lambda _: 0.0, speed_error=0.0, phase=0.0)
    np.testing.assert_allclose(soft.turn, less.turn, atol=0.1)
    assert np.linalg.norm(soft.turn.mean(axis=0)) != pytest.approx(
        np.linalg.norm(stiff.turn.mean(axis=0)), rel=0.01
    )


def test_orders_that_are_not_seen_do_not_fold_to_those_that_are(monkeypatch):
    cut = SideCut(BENCH.tool, BENCH.metal, 4000.0, 0.016, 5e-3, 4e-3, "down", 0.08)
    found = side_force(cut, lambda _: 0.0, speed_error=0.0, phase=0.0)
    monkeypatch.setattr("virtual_cell.side_force._FINE", 4 * len(found.turn))
    finer = side_force(cut, lambda _: 0.0, speed_error=0.0, phase=0.0)
    orders, finer_orders = (np.fft.rfft(one.turn, axis=0)[:13] / len(one.turn) for one in (found, finer))
    largest = np.abs(finer_orders).max(axis=0)
    assert (np.abs(orders - finer_orders) < 3e-4 * largest).all()
    np.testing.assert_allclose(found.mean_at(np.array([0.04]))[0], orders[0].real, rtol=1e-12)


def test_the_mean_force_is_that_of_the_whole_record():
    cut = SideCut(BENCH.tool, BENCH.metal, 4000.0, 0.016, 5e-3, 4e-3, "up", 0.08)
    force = side_force(cut, lambda _: 0.0, speed_error=0.0, phase=0.3)
    t = np.arange(0.0, 0.3, 1.0 / 16000.0)  # 20 turns
    there = np.full(len(t), 0.04)
    np.testing.assert_allclose(force.at(t, there, 4000.0).mean(axis=0), force.mean_at(there)[0], atol=0.05)
    assert not force.mean_at(np.array([-0.02, 0.1])).any()
