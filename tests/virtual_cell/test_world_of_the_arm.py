"""Things of the arm's world against closed forms: friction, gears, hoses, links, servos, gauges."""

from dataclasses import replace

import numpy as np
import pytest

from virtual_cell.recipes.kr160 import ARM, DRIVES, NEAR_DEG
from virtual_cell.world.arm import controller, gears, hose, joints, links, stylus, tracker
from virtual_cell.world.arm.dahl import dragged

NEAR = np.array(NEAR_DEG) * np.pi / 180.0
SEEDS = range(40)


def many(draw):
    """Draw a thing with forty seeds."""
    return [draw(np.random.default_rng(seed)) for seed in SEEDS]


def to_and_fro(amplitude, steps, rounds):
    """Triangle (n,) between ± amplitude, from its middle."""
    return amplitude * 2.0 / np.pi * np.arcsin(np.sin(np.linspace(0.0, 2.0 * np.pi * rounds, steps)))


@pytest.mark.parametrize("share", [0.2, 1.0, 5.0])
def test_the_loop_of_a_hysteretic_element_has_the_area_of_the_closed_form(share):
    """Over one way from −A to A: F = 1 − (1 + F0) exp(−(x + A)/w), with F0 = tanh(A/w)."""
    width = 3e-4
    reach = share * width
    x = to_and_fro(reach, 40001, 20)
    state = dragged(np.diff(x)[:, None], width)[:, 0]
    last = slice(38000, 40000)
    middle = 0.5 * (state[last] + state[last.start - 1 : last.stop - 1])
    area = float(middle @ np.diff(x)[last])
    half = 2.0 * reach - width * (1.0 + np.tanh(share)) * -np.expm1(-2.0 * share)
    assert area == pytest.approx(2.0 * half, rel=0.01)


def test_hysteresis_depends_on_the_way_and_not_on_the_pace():
    x = to_and_fro(1e-3, 3201, 4)
    slow = dragged(np.diff(x)[:, None], 2e-4)[-1, 0]
    fast = dragged(np.diff(x[::8])[:, None], 2e-4)[-1, 0]
    assert fast == pytest.approx(slow, abs=1e-9)


@pytest.fixture(scope="module")
def friction():
    return joints.drawn(np.random.default_rng(4), DRIVES.coulomb, DRIVES.viscous)


def test_a_joint_that_slides_steadily_has_its_stribeck_curve(friction):
    for speed in (2e-3, 0.05, 0.3):
        rate = np.full((4000, 6), speed)
        torque, sliding = friction.friction(rate, np.zeros_like(rate), 1e-3, 0.0)
        peak = 1.0 + friction.breakaway * np.exp(-((speed / friction.creep) ** 2))
        np.testing.assert_allclose(torque[-1], friction.coulomb * peak + friction.viscous * speed, rtol=1e-6)
        np.testing.assert_allclose(sliding[-1], 1.0, rtol=1e-6)


def test_a_joint_that_turns_round_is_a_spring_before_it_slides(friction):
    """Friction falls by its level over the presliding: at the turn its slope is twice level over width."""
    step = 1e-6
    rate = np.vstack([np.full((3000, 6), 1e-3), np.full((8, 6), -1e-3)])
    torque, _ = friction.friction(rate, np.zeros_like(rate), step / 1e-3, 0.0)
    level = friction.level(rate[-1:], np.zeros((1, 6)), 0.0)[0]
    fell = torque[3000] - torque[3007]
    expected = 2.0 * level * -np.expm1(-7.0 * step / (friction.bristle * level / friction.coulomb))
    np.testing.assert_allclose(fell, expected, rtol=0.05)


def test_a_warm_joint_has_lost_part_of_its_viscous_friction_and_a_loaded_one_rubs_more(friction):
    rate = np.full((3000, 6), 0.2)
    nothing, load = np.zeros_like(rate), np.full_like(rate, 500.0)
    cold, warm = (friction.friction(rate, nothing, 1e-3, w)[0][-1] for w in (0.0, 1.0))
    lost = cold - warm - friction.coulomb * friction.wearing_in
    np.testing.assert_allclose(lost, friction.thinning * friction.viscous * 0.2, rtol=1e-3)
    more = friction.friction(rate, load, 1e-3, 0.0)[0][-1] - cold
    np.testing.assert_allclose(more, 500.0 * friction.by_load, rtol=1e-3)


def test_friction_lies_in_the_published_ranges():
    drawn = many(lambda rng: joints.drawn(rng, DRIVES.coulomb, DRIVES.viscous))
    for name, low, high in (
        ("bristle", 1e-4, 1e-3),
        ("creep", 1e-3, 2e-2),
        ("breakaway", 0.1, 0.6),
        ("by_load", 3e-3, 2e-2),
    ):
        values = np.array([getattr(one, name) for one in drawn])
        assert low <= values.min() < 1.4 * low
        assert high / 1.4 < values.max() <= high
        assert np.median(values) == pytest.approx(np.sqrt(low * high), rel=0.25)


def test_an_arm_that_has_run_for_long_is_warm_and_one_that_begins_is_not():
    cold, warm = joints.Warming(0.0, 1800.0, 0.8), joints.Warming(20000.0, 1800.0, 0.8)
    assert (cold.at(0.0), warm.at(0.0)) == (0.0, pytest.approx(0.8, abs=1e-3))
    assert cold.at(1800.0) == pytest.approx(0.8 * (1.0 - 1.0 / np.e))


def test_the_error_of_a_gear_has_the_slope_that_loads_its_motor():
    gear = gears.transmission(np.random.default_rng(2))
    gear = replace(gear, flank=np.zeros_like(gear.flank))
    q, h = np.random.default_rng(1).uniform(-2.0, 2.0, (50, 6)), 1e-7
    ahead, behind = (gear.error(q + side * h, np.ones((50, 6))) for side in (1.0, -1.0))
    np.testing.assert_allclose((ahead - behind) / (2.0 * h), gear.slope(q), atol=1e-7)


def test_part_of_the_error_of_a_gear_changes_its_sign_with_the_direction():
    gear = gears.transmission(np.random.default_rng(2))
    q = np.random.default_rng(1).uniform(-2.0, 2.0, (400, 6))
    there, back = (gear.error(q, np.full((400, 6), way)) for way in (1.0, -1.0))
    shifted = np.sqrt(np.mean((there - back) ** 2, axis=0))
    of_waves = np.sqrt(np.sum((gear.size * gear.flank) ** 2, axis=1) * 2.0)
    np.testing.assert_allclose(shifted, of_waves, rtol=0.2)
    arcsec = np.array([one.size.sum(axis=1) for one in many(gears.transmission)]) * 180.0 / np.pi * 3600.0
    low, high = np.quantile(arcsec, [0.05, 0.95])
    assert low > 1.0
    assert high < 45.0


@pytest.fixture(scope="module")
def springs():
    return gears.springs(np.random.default_rng(3), ARM.stiffness, np.full(6, 1000.0))


def test_a_spring_has_three_pieces_without_a_step(springs):
    torque = np.linspace(-900.0, 900.0, 4001)
    twist = springs.elastic(np.tile(torque[:, None], 6))
    np.testing.assert_allclose(twist, -twist[::-1], atol=1e-15)
    slope = np.diff(torque)[:, None] / np.diff(twist, axis=0)
    middle = 0.5 * (torque[1:] + torque[:-1])
    for joint in range(6):
        low, high = springs.knees[joint]
        ratio = slope[:, joint] / springs.stiffness[joint]
        size = np.abs(middle)
        np.testing.assert_allclose(ratio[size < low - 1.0], springs.ratio[joint, 0], rtol=1e-6)
        np.testing.assert_allclose(ratio[(size > low + 1.0) & (size < high - 1.0)], 1.0, rtol=1e-6)
        np.testing.assert_allclose(ratio[size > high + 1.0], springs.ratio[joint, 1], rtol=1e-6)


def test_a_link_rests_on_one_flank_of_its_gap_and_stays_where_its_drag_holds_it(springs):
    gap, drag = 4e-4, 10.0
    loose = replace(springs, gap=np.full(6, gap), drag=np.full(6, drag))
    parts = [(50.0, 200), (5.0, 200), (-9.0, 200), (-60.0, 200), (0.0, 200)]
    torque = np.concatenate([np.full((n, 6), value) for value, n in parts])
    place = loose.rattle(torque, 1e-3)
    np.testing.assert_allclose(place[[199, 399, 599]], 0.5 * gap)
    np.testing.assert_allclose(place[[799, 999]], -0.5 * gap)
    assert np.abs(place).max() <= 0.5 * gap
    assert not springs.rattle(torque, 1e-3).any()


def test_hoses_take_energy_as_they_bend_to_and_fro():
    one = hose.drawn(np.random.default_rng(1), NEAR)
    q = NEAR + to_and_fro(0.2, 4001, 2)[:, None]
    torque = one.torque(q, np.zeros(6))
    round_ = slice(2000, 4001)
    work = np.einsum("ni,ni->i", torque[round_][1:], np.diff(q[round_], axis=0))
    assert (work[[0, 2, 3, 4, 5]] > 0.0).all()
    assert abs(work[1]) < 1e-12
    assert (work <= 0.8 * one.drag + 1e-9).all()


def test_links_and_base_yield_as_springs_do_and_their_modes_ring():
    one = links.drawn(np.random.default_rng(1), ARM.stiffness)
    compliance = one.compliance(ARM, NEAR)
    np.testing.assert_allclose(compliance, compliance.T, rtol=1e-9)
    alone = replace(one, coupling=np.zeros((6, 6))).compliance(ARM, NEAR)
    assert np.linalg.eigvalsh(alone).min() >= -1e-15
    force = np.array([0.0, 0.0, 300.0])
    joints_alone = ARM.yields(NEAR, force)
    assert 0.02 < np.linalg.norm(alone @ force) / np.linalg.norm(joints_alone) < 0.5

    hz, damping = 8.0, 0.05
    dt = 1e-3
    step = np.ones((4000, 3))
    step[0] = 0.0
    moved = replace(one, modes=((hz, damping, 1.0),)).followed(step, dt)[:, 0]
    assert moved[-1] == pytest.approx(1.0, abs=1e-3)
    peak = int(np.argmax(moved))
    assert peak * dt == pytest.approx(0.5 / (hz * np.sqrt(1.0 - damping**2)), abs=3 * dt)
    assert moved[peak] == pytest.approx(1.0 + np.exp(-np.pi * damping / np.sqrt(1.0 - damping**2)), rel=0.01)
    for drawn in many(lambda rng: links.drawn(rng, ARM.stiffness)):
        assert sum(mode[2] for mode in drawn.modes) == pytest.approx(1.0)
        assert all(6.0 <= mode[0] <= 27.0 and 0.05 <= mode[1] <= 0.12 for mode in drawn.modes)


def test_a_servo_yields_to_a_step_of_torque_and_then_comes_back():
    servo = controller.servo(np.random.default_rng(1), ARM.stiffness, np.array(gears.RATIO))
    torque = np.zeros((9000, 6))
    torque[500:] = 40.0
    error = servo.strayed(torque, np.zeros_like(torque), 1e-3)
    assert not error[:500].any()
    assert (np.abs(error).max(axis=0) < 40.0 / servo.stiffness * 1.1).all()
    assert (np.abs(error).max(axis=0) > 0.4 * 40.0 / servo.stiffness).all()
    np.testing.assert_allclose(error[-1], 0.0, atol=1e-3 * float(np.abs(error).max()))


def test_packets_come_late_twice_or_not_at_all_but_one_after_another():
    rng = np.random.default_rng(1)
    one = replace(controller.recorder(rng, (0.004,)), late=0.02, lost=0.01, doubled=0.005, jitter=1e-4)
    due, stamp = one.arrivals(400.0, rng)
    assert (np.diff(stamp) > 0.0).all()
    assert (stamp >= due).all()
    numbers = np.round(due / one.period).astype(int)
    assert len(np.unique(numbers)) / 100_000 == pytest.approx(0.99, abs=0.002)
    assert np.mean(np.diff(np.sort(numbers)) == 0) == pytest.approx(0.005, abs=0.001)
    # a packet that is 1 to 4 periods late holds up those behind it: 1 + 2/3 + 1/3 of them by over one
    assert np.mean(stamp - due > one.period) == pytest.approx(2.0 * 0.02, rel=0.1)


def test_torques_are_read_with_the_error_of_their_constants_and_in_steps():
    rng = np.random.default_rng(1)
    one = replace(controller.recorder(rng, (0.004,)), torque_noise=1e-6)
    torque = np.full((50, 6), 300.0)
    cold, warm = (one.read(torque, warmth, rng)[0] for warmth in (0.0, 1.0))
    np.testing.assert_allclose(cold, 300.0 * (1.0 + one.gain), atol=float(one.current_step.max()))
    np.testing.assert_allclose(warm / cold, 1.0 + one.fading, atol=0.01)
    np.testing.assert_allclose(cold / one.current_step, np.round(cold / one.current_step), atol=1e-6)


def test_a_stylus_reads_the_wall_where_it_is_perfect_and_else_about_it():
    drawn = stylus.drawn(np.random.default_rng(2))
    perfect = replace(drawn, noise=0.0, form=0.0, level=0.0, zero=0.0, slide=0.0, dust=0.0)
    x = perfect.places(0.1)
    height = 5e-6 * np.sin(x / 4e-3)
    read = perfect.read(x, height, np.random.default_rng(1))
    np.testing.assert_allclose(read["z_mm"] * 1e-3, height, atol=6e-9)
    np.testing.assert_allclose(read["x_mm"] * 1e-3, x)
    off = replace(perfect, zero=6e-6, level=2e-5)
    reads = [off.read(x, height, np.random.default_rng(seed))["z_mm"] * 1e-3 - height for seed in range(300)]
    assert np.std([one.mean() for one in reads]) == pytest.approx(6e-6, rel=0.15)
    assert np.std([np.polyfit(x, one, 1)[0] for one in reads]) == pytest.approx(2e-5, rel=0.15)
    grains = replace(perfect, dust=200.0).specks(x, np.random.default_rng(3))
    assert grains.min() >= 0.0
    assert grains.max() > 0.0


def test_a_tracker_reads_worse_from_further_away_and_better_along_its_beam():
    one = tracker.Tracker(np.zeros(3), 3e-6, 2e-6, 5e-7, 0.0, 0.0)
    for away in (2.0, 6.0):
        place = np.array([away, 0.0, 0.0])
        read = np.array([one.read(place, np.zeros(3), np.random.default_rng(seed)) for seed in range(2000)])
        spread = read.std(axis=0)
        across = np.sqrt(2.0) * 2e-6 * away
        assert spread[1:] == pytest.approx([across, across], rel=0.06)
        assert spread[0] == pytest.approx(np.hypot(np.sqrt(2.0) * 3e-6, 5e-7 * away), rel=0.06)
    broken = replace(one, outliers=0.1, jump=1e-3)
    far = [np.linalg.norm(broken.read(np.ones(3), np.zeros(3), np.random.default_rng(s))) for s in range(500)]
    assert np.mean(np.array(far) > 5e-5) == pytest.approx(0.1, abs=0.04)
