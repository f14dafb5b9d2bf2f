"""The arm of the harder world: its limits, what is hidden in it, how that is translated, its batches."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_arm_batches import Batch, digests, flange
from typer.testing import CliRunner

from metro.cli import app
from metro.effects.library import library
from virtual_cell.arm_effects import SHOWN as IDEALISED
from virtual_cell.blind import RECIPES
from virtual_cell.recipes import arm, arm_world, arm_world_programme
from virtual_cell.recipes.arm_draws import side, way
from virtual_cell.units import MM
from virtual_cell.world.arm.causes import ARM_CAUSES, SHOWN
from virtual_cell.world.arm.effects import LIBRARY
from virtual_cell.world.arm.robot import done
from virtual_cell.world.arm.robot import way as statics

NONE = np.zeros(6)
FORCE = np.array([180.0, -120.0, 60.0])
DRAWN = {}


def world(style="c", seed=3):
    """Draw a world once; return robot, bench and session."""
    if (style, seed) not in DRAWN:
        DRAWN[style, seed] = arm_world_programme.drawn(np.random.default_rng([seed, 41, ord(style)]), style)
    return DRAWN[style, seed]


def ideal(robot):
    """The arm with linear springs, perfect gears, dry friction alone and stiff links."""
    springs = replace(robot.springs, ratio=np.ones((6, 2)), lost=NONE)
    gears = replace(robot.transmission, size=np.zeros_like(robot.transmission.size))
    loose = replace(robot.links, bend=np.zeros(3), tilt=np.zeros(2), coupling=np.zeros((6, 6)))
    joints = replace(robot.joints, by_load=NONE, behind=NONE)
    hose = replace(robot.hose, pull=NONE, drag=NONE)
    servo = replace(robot.servo, stiffness=1e12 * np.ones(6), interpolation=NONE, lag=0.0)
    return replace(
        robot, springs=springs, transmission=gears, links=loose, joints=joints, hose=hose, servo=servo
    )


def run(robot, *, cutting=True, style="c", seed=3, at=0, push=1.0):
    """One run under a steady force over the block, ``push`` times the usual one."""
    _, bench, session = world(style, seed)
    plan = session.runs[at][0]
    one = arm_world._Run(plan, plan, side(bench, way(plan)), statics(robot, bench.lines[way(plan)]), at + 1)
    day = arm_world._Day(robot, bench, session, seed)
    course = day.course(one, 12.0 * MM, cutting=cutting, start=NONE)
    length = one.wall.length

    def force(x):
        on = np.clip(x / 0.004, 0.0, 1.0) * np.clip((length - x) / 0.004, 0.0, 1.0)
        return np.outer(on, push * FORCE)

    return done(robot, course, force if cutting else None), length


def steady(made):
    """Rows at which the tool is in the block, and what the entry set ringing has died out."""
    moved, length = made
    return (moved.during.x > 0.5 * length) & (moved.during.x < 0.9 * length)


def test_with_the_world_off_motors_carry_weight_friction_and_the_force():
    robot = ideal(world()[0])
    cut, air = run(robot), run(robot, cutting=False)
    rows = steady(cut)
    dh = arm_world.DH
    offset = air[0].torque[rows] - cut[0].torque[rows]
    for i in np.flatnonzero(rows)[:: rows.sum() // 4]:
        q, h = cut[0].during.q[i], 1e-6
        tip = [
            (t @ robot.arm.tip + o)
            for t, o in (flange(q + s * h * e, dh) for e in np.eye(6) for s in (1, -1))
        ]
        lever = np.array([(tip[2 * k] - tip[2 * k + 1]) / (2.0 * h) for k in range(6)])
        carried = offset[i - np.flatnonzero(rows)[0]]
        np.testing.assert_allclose(carried, lever @ FORCE, atol=0.02 * np.abs(lever @ FORCE).max())


def test_with_the_world_off_the_tip_gives_way_as_its_springs_do():
    robot = ideal(world()[0])
    made = run(robot)
    rows = steady(made)
    i = int(np.flatnonzero(rows)[-1])
    expected = robot.arm.yields(made[0].during.q[i], FORCE)
    weight = run(robot, cutting=False)[0].tip[i]
    assert np.linalg.norm(made[0].tip[i] - weight - expected) < 0.03 * np.linalg.norm(expected)
    q = made[0].during.q[i]
    np.testing.assert_allclose(robot.gives(q, FORCE, in_cut=False), expected, rtol=1e-9)


def test_in_the_world_springs_links_and_base_give_more():
    robot = world()[0]
    made = run(robot)
    q = made[0].during.q[steady(made)][-1]
    bare, whole = ideal(robot).gives(q, FORCE, in_cut=True), robot.gives(q, FORCE, in_cut=True)
    assert 1.02 < np.linalg.norm(whole) / np.linalg.norm(bare) < 1.7


@pytest.mark.parametrize("name", ARM_CAUSES)
def test_every_cause_changes_what_is_measured_and_only_in_the_cut(name):
    robot, _, session = world()
    rng = np.random.default_rng(8)
    values = ARM_CAUSES[name].draw(rng, robot)
    declared = {
        word.partition("=")[0].partition("[")[0].rstrip("?") for word in ARM_CAUSES[name].parameters.split()
    }
    assert set(values) <= declared
    json.dumps(values)
    hidden = ARM_CAUSES[name].apply(robot, values)
    changed = 0
    for at, push in ((0, 3.0), (len(session.runs) - 1, -3.0)):
        bare, with_it = (run(one, at=at, push=push)[0] for one in (robot, hidden))
        x = session.stylus.places(0.1)
        z = 3e-6 * np.sin(x / 2e-3)
        for cause in hidden.causes:
            changed += cause.traced is not None and bool((cause.traced(bare.during, x, z) != z).any())
            changed += cause.logged is not None and bool(
                (cause.logged(bare.during, bare.torque) != bare.torque).any()
            )
            if cause.sensed is not None:
                read = np.ones((5, 3))
                changed += bool((cause.sensed(bare.during, np.arange(5.0), read) != read).any())
        changed += bool((bare.torque != with_it.torque).any() or (bare.tip != with_it.tip).any())
        changed += hidden.clock_offset != robot.clock_offset
        if not hidden.tip_offset[0]:
            air = [run(one, cutting=False, at=at)[0] for one in (robot, hidden)]
            np.testing.assert_array_equal(air[0].torque, air[1].torque)
    assert changed


def test_a_load_on_the_flange_is_held_by_virtual_work():
    robot = ideal(world()[0])
    values = {"mass_kg": 6.0, "com_mm": [80.0, -40.0, 120.0]}
    laden = LIBRARY["payload_error"].apply(robot, values)
    during = run(robot)[0].during
    torque = laden.total("drive", during)
    for i in (0, len(during.t) // 2, len(during.t) - 1):
        heights = []
        for step in 1e-6 * np.eye(6):
            up, down = (flange(during.q[i] + sign * step, arm_world.DH) for sign in (1.0, -1.0))
            rise = [(turn @ (np.array(values["com_mm"]) * MM) + origin)[2] for turn, origin in (up, down)]
            heights.append((rise[0] - rise[1]) / 2e-6)
        np.testing.assert_allclose(torque[i], 6.0 * 9.81 * np.array(heights), atol=0.02)


def test_an_eccentric_wheel_shows_at_its_order_and_a_little_at_twice_that():
    robot = world()[0]
    values = {"joint": 1, "order": 900.0, "torque_nm": 20.0, "phase_deg": 30.0, "squeezed": 0.4}
    during = run(robot)[0].during
    torque = LIBRARY["gear_ripple"].apply(robot, values).total("load", during)
    assert not torque[:, 1:].any()
    angle = 900.0 * during.q[:, 0] + np.pi / 6.0
    shapes = np.stack([np.sin(angle), np.cos(angle), np.sin(2.0 * angle), np.cos(2.0 * angle)], axis=1)
    found = np.linalg.lstsq(shapes, torque[:, 0], rcond=None)[0]
    np.testing.assert_allclose(found, [20.0, 0.0, 4.0, 0.0], atol=1e-6)


def test_a_softer_arm_gives_way_by_the_factor_that_is_stated():
    robot = world()[0]
    values = {"factor": 0.7, "joint": "all", "uneven": 0.0}
    soft = LIBRARY["stiffness_scale"].apply(robot, values)
    during = run(robot)[0].during
    stated, error = LIBRARY["stiffness_scale"].translate(soft, [during], values)
    # the weight of the arm moves the point of work on springs that are not linear: a few per cent
    assert stated["factor"] == pytest.approx(0.7, abs=0.03)
    linear = ideal(robot)
    soft = LIBRARY["stiffness_scale"].apply(linear, values)
    assert LIBRARY["stiffness_scale"].translate(soft, [during], values)[0]["factor"] == pytest.approx(0.7)
    q = during.q[-1]
    ratio = np.linalg.norm(linear.gives(q, FORCE, in_cut=True)) / np.linalg.norm(
        soft.gives(q, FORCE, in_cut=True)
    )
    assert ratio == pytest.approx(0.7, rel=1e-9)
    assert error["factor"] < 0.05


def test_a_spring_that_hardens_is_translated_to_the_cubic_that_it_was_drawn_by():
    robot = ideal(world()[0])
    k, most = robot.springs.stiffness[0], 600.0 * robot.moves.lever[0]
    for share in (0.5, 3.0):
        values = {"joint": 1, "cubic": share * k**3 / most**2}
        hard = LIBRARY["stiffness_hardening"].apply(robot, values)
        stated, error = LIBRARY["stiffness_hardening"].translate(hard, [], values)
        assert stated["cubic"] == pytest.approx(values["cubic"], rel=0.35)
        assert 0.0 < error["cubic"] < 0.8 * stated["cubic"]


def test_a_grease_that_warms_has_the_slope_that_is_stated_over_the_run():
    robot = world()[0]
    values = {"joint": 2, "slope_nm_s": 2.0, "settles_s": 1e6}
    during = run(robot)[0].during
    stated, error = LIBRARY["friction_warmup"].translate(robot, [during], values)
    assert stated["slope_nm_s"] == pytest.approx(2.0, rel=1e-3)
    assert error["slope_nm_s"] < 0.01
    quick, _ = LIBRARY["friction_warmup"].translate(robot, [during], values | {"settles_s": 2.0})
    assert quick["slope_nm_s"] < 1.2


def test_a_gap_moves_the_tip_by_half_of_it_to_either_side():
    robot = ideal(world()[0])
    weightless = replace(robot, arm=replace(robot.arm, masses=NONE))
    gap = {"joint": 1, "angle_mdeg": 20.0}
    worn = LIBRARY["joint_backlash"].apply(weightless, gap)
    made, loose = run(weightless), run(worn)
    i = int(np.flatnonzero(steady(made))[-1])
    moved = loose[0].tip[i] - made[0].tip[i]
    lever = made[0].during.jacobian[i, :, 0]
    expected = np.sign(lever @ FORCE) * 0.5 * 20e-3 * np.pi / 180.0 * lever
    np.testing.assert_allclose(moved, expected, atol=0.02 * np.linalg.norm(expected))


def test_at_least_ten_causes_of_each_observable_are_outside_the_library():
    for observable, names in SHOWN.items():
        known = {effect.name for effect in library(observable)}
        outside = [name for name in names if name not in known]
        assert len(outside) >= 10
        assert set(names) - set(outside) == set(names) & set(LIBRARY)
        assert set(RECIPES[observable].hides("d")) == set(names)
        assert set(RECIPES[observable].hides("b")) == set(IDEALISED[observable])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """One batch of either style; the fewest runs that the styles have."""
    folder, truths = tmp_path_factory.mktemp("world"), {}
    with pytest.MonkeyPatch.context() as patch:
        for style, habits in arm_world_programme.HABITS.items():
            few = replace(habits, identify=(3, 3), validate=(1, 1), entries=1.0, lacking=0.0)
            patch.setitem(arm_world_programme.HABITS, style, few)
            truths[style] = arm.make(folder / style, {"stiffness_scale": None}, 11, style)
        again = arm.make(folder / "again" / "c", {"stiffness_scale": None}, 11, "c")
    assert again == truths["c"]
    assert digests(folder / "again" / "c") == digests(folder / "c")
    return folder, truths


@pytest.mark.parametrize("style", ["c", "d"])
def test_a_batch_passes_the_check_and_says_what_was_drawn(made, style):
    folder, truths = made
    said = CliRunner().invoke(app, ["check", str(folder / style)])
    assert said.exit_code == 0, said.output
    truth = json.loads(json.dumps(truths[style]))
    assert set(truth["effects"]["stiffness_scale"]) >= {"factor", "joint"}
    assert truth["translation_error"]["stiffness_scale"]["factor"] >= 0.0
    assert truth["world"]["helical_entries_not_recorded"] > 0
    size = sum(path.stat().st_size for path in (folder / style).rglob("*") if path.is_file())
    assert size < 15e6


def test_torques_carry_the_force_that_the_dynamometer_reads_give_or_take_their_constants(made):
    batch = Batch(made[0] / "c")
    angles = np.radians(batch.manifest["work_in_base"]["rpy_deg"])
    turns = []
    for axis, angle in zip((0, 1, 2), angles, strict=True):
        turn, (i, j) = np.eye(3), ((axis + 1) % 3, (axis + 2) % 3)
        turn[[i, j], [i, j]] = np.cos(angle)
        turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
        turns.append(turn)
    batch.work = turns[2] @ turns[1] @ turns[0]
    for name in batch.runs.index[batch.runs["robot_log"].notna()]:
        force = batch.force(name, 0.45, 0.6)
        carried = -(batch.work.T @ batch.jacobian(batch.middle(name))).T @ force
        assert np.linalg.norm(force) > 20.0
        off = batch.torque(name, 0.4, 0.6) - carried
        assert np.abs(off).max() < 12.0 + 0.09 * np.abs(carried).max()


def test_a_pump_is_translated_to_the_sine_that_it_is_closest_to():
    """One that hardly wanders is what was drawn; the more it wanders, the less of it is one sine."""

    def told(unsteady):
        t = np.arange(0.0, 12.0, 0.01)
        runs = [
            SimpleNamespace(t=t, engaged=np.ones_like(t), own=lambda i=i: np.random.default_rng(i))
            for i in range(8)
        ]
        drawn = {"frequency_hz": 4.31, "amplitude_um": 2.5, "phase_deg": 20.0, "unsteady": unsteady}
        return LIBRARY["path_vibration"].translate(None, runs, drawn)

    values, errors = told(0.002)
    assert values["frequency_hz"] == pytest.approx(4.31, abs=5e-4)
    assert values["amplitude_um"] == pytest.approx(2.5, rel=2e-3)
    assert errors["amplitude_um"] < 5e-3
    values, errors = told(0.2)
    assert 2.0 < values["amplitude_um"] < 2.5
    assert errors["amplitude_um"] > 0.02
