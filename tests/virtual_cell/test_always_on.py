"""What is always there of the library's effects: told of a batch where it is built, and not where it is off.

What a thing does is taken from what the simulator makes with it and without it; what the truth says of it is
put into the contract's formulas. The two share nothing.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from metro.effects.library import library
from virtual_cell.blind import RECIPES
from virtual_cell.recipes import arm_world, arm_world_programme, boundary_world, faces_world
from virtual_cell.recipes.boundary_world_draws import drawn_cell, drawn_programme
from virtual_cell.recipes.faces_world_draws import drawn as drawn_faces
from virtual_cell.units import DEG, MM
from virtual_cell.world.arm import terms as of_arm
from virtual_cell.world.arm.told import Gauges, Run
from virtual_cell.world.boundary import terms as of_boundary
from virtual_cell.world.boundary.cell import Plan
from virtual_cell.world.boundary.cell import made as made_cuts
from virtual_cell.world.boundary.chatter import march
from virtual_cell.world.faces import fixture, warmth
from virtual_cell.world.faces import terms as of_faces
from virtual_cell.world.faces.finish import over_plate
from virtual_cell.world.present import LEAST, listed, term

NONE = np.zeros(6)


def test_what_changes_a_thousand_readings_by_a_hundredth_of_their_noise_is_not_listed():
    wave = np.sin(np.linspace(0.0, 20.0, 400))
    small, large = (term({"a": 1.0}, size * wave, size * wave, 1.0, 1000.0) for size in (0.01, 0.3))
    assert not small.present
    assert large.present
    assert large.gain == pytest.approx(0.5 * 1000.0 * 0.3**2 * 0.5, rel=0.05)
    assert large.gain > LEAST
    other = term({"a": 1.0}, wave + 1.5 * np.cos(np.linspace(0.0, 300.0, 400)), wave, 1.0, 1000.0)
    assert not other.present  # most of what it does is no such effect


def test_a_hidden_effect_is_not_listed_but_in_other_joints():
    one, two = (term({"joint": joint}, np.ones(9), np.ones(9), 1.0, 100.0) for joint in (1, 2))
    assert listed({"gap": [one, two]}, {"gap": {"joint": 2}}) == {"gap": [{"joint": 1}]}
    assert listed({"gap": [one, two]}, {}) == {"gap": [{"joint": 1}, {"joint": 2}]}
    assert listed({"gap": [two]}, {"gap": {"joint": 2}}) == {}


# -- faces


@pytest.fixture(scope="module")
def faces():
    cell = drawn_faces(np.random.default_rng([5, 47]), "c")
    rng = np.random.default_rng(1)
    return cell, faces_world.planned(cell, faces_world.ordered(cell, rng), rng)


def face(cell, run, cause):
    """Form of one face (n,), m, that a cause leaves, with coordinates of its points over the plate."""
    form, _ = of_faces.parted(cell, of_faces.done_by(cell, cause, [run]))
    return form[0], over_plate(fixture.grid(cell.size)[:: of_faces._EVERY], cell.size)


def test_the_bow_that_is_told_is_the_form_of_the_free_plate(faces):
    cell, session = faces
    bent = replace(cell.always.bow, moments=(9e-6, -5e-6), twist=3e-6, repeat=0.0)
    cell = replace(cell, always=replace(cell.always, bow=bent))
    (told,) = of_faces.in_contract_terms(cell, session)["fixture_bow"]
    assert told.present
    form, (u, v) = face(cell, session[0], bent)
    p = {name: value * 1e-6 for name, value in told.parameters.items()}
    made = p["xx_um"] * u**2 + p["xy_um"] * u * v + p["yy_um"] * v**2
    made, _ = of_faces.parted(cell, made[None])
    assert np.sqrt(np.mean((form - made[0]) ** 2)) < 0.15 * np.sqrt(np.mean(form**2))
    flat = replace(bent, moments=(1e-12, 0.0), twist=0.0)
    flat_cell = replace(cell, always=replace(cell.always, bow=flat))
    assert not of_faces.in_contract_terms(flat_cell, session)["fixture_bow"][0].present


def test_a_spindle_that_grows_is_told_by_its_rate_and_one_that_does_not_is_not(faces):
    cell, session = faces
    for lengths, there in (((0.0, 4e-2), True), ((0.0, 0.0), False)):
        warm = warmth.Warmth(lengths, (120.0, 1e5))  # so slow that its rate is its length over its time
        now = replace(cell, always=replace(cell.always, warm=warm))
        (told,) = of_faces.in_contract_terms(now, session)["thermal_growth"]
        assert told.present is there
        cold = [run.started - sum(stop - start for start, stop in run.earlier) for run in session]
        assert max(cold) < 0.2 * 1e5
        assert told.parameters["um_per_min"] == pytest.approx(lengths[1] / 1e5 * 6e7, rel=0.1)


def test_a_spindle_out_of_square_is_told_and_a_squared_one_is_not(faces):
    cell, session = faces
    for angle, there in ((4e-4, True), (0.0, False)):
        tilt = replace(cell.always.tilt, shims=(angle * 0.06, 0.0, angle * 0.03), circle=0.06)
        now = replace(cell, always=replace(cell.always, tilt=tilt))
        (told,) = of_faces.in_contract_terms(now, session)["spindle_tilt"]
        assert told.present is there
        # Of three pads at 120° one is higher by h, and one by half of it: |h (e₁ + ½ e₃)| over 1½ radii.
        size = np.hypot(*told.parameters.values())
        assert size == pytest.approx(1e3 * angle * np.sqrt(0.75) / 1.5, rel=0.01)
        assert not there or told.rest < 1e-6


def test_a_load_cell_that_reads_too_little_is_a_stiffer_tip_in_the_cut(faces):
    cell, session = faces
    for gain in (0.3, 0.0):
        now = replace(cell, loads=replace(cell.loads, gain=gain))
        (told,) = of_faces.in_contract_terms(now, session)["stiffness_scale"]
        assert told.present is (gain > 0.0)
        assert told.parameters["factor"] == pytest.approx(1.0 + gain)


# -- arms


def session_of(style="c", seed=3):
    return arm_world_programme.drawn(np.random.default_rng([seed, 41, ord(style)]), style)


def runs_of(robot, bench, session, count=4):
    """Cut and idle runs under the force of a side cut; what the logs and gauges do is left out."""
    day = arm_world._Day(robot, bench, session, 3)
    made = []
    for order, (plan, _) in enumerate(session.runs[:count], start=1):
        wall = arm_world.side(bench, arm_world.way(plan))
        line = arm_world.statics(robot, bench.lines[arm_world.way(plan)])
        one = arm_world._Run(plan, plan, wall, line, order)

        def force(x, one=one):
            on = np.clip(x / 4e-3, 0.0, 1.0) * np.clip((one.wall.length - x) / 4e-3, 0.0, 1.0)
            return np.outer(on, [180.0, -240.0, 60.0])

        courses = [day.course(one, 12.0 * MM, cutting=cutting, start=NONE) for cutting in (True, False)]
        cut, air = (arm_world.done(robot, c, force if c.cutting else None) for c in courses)
        made.append(Run(cut, air, 0.0, (courses[0].warmth, courses[1].warmth)))
    return made


GAUGES = Gauges(np.zeros(3), 0.0, 3e-7, 2e-6)


@pytest.fixture(scope="module")
def world():
    robot, bench, session = session_of()
    robot = replace(robot, transmission=replace(robot.transmission, size=np.zeros((6, 6))))
    robot = replace(robot, hose=replace(robot.hose, drag=NONE))
    joints = replace(robot.joints, by_load=np.full(6, 0.02), wearing_in=0.0, thinning=0.0)
    return replace(robot, joints=joints), bench, session


def of(about, robot, bench, session, gauges=GAUGES):
    told = of_arm.in_contract_terms(about, robot, runs_of(robot, bench, session), gauges)
    return listed(told, {})


def test_friction_that_goes_with_the_load_is_the_torque_that_the_cut_has_more(world):
    robot, bench, session = world
    told = of("joint_force", *world)["friction_reversal"]
    off = replace(robot, joints=replace(robot.joints, by_load=NONE))
    on, without = (runs_of(one, bench, session) for one in (robot, off))
    for one in told:
        joint = one["joint"] - 1
        more = np.concatenate(
            [
                ((a.cut.torque - a.air.torque) - (b.cut.torque - b.air.torque))[:, joint]
                for a, b in zip(on, without, strict=True)
            ]
        )
        way = np.concatenate([np.sign(run.cut.during.rate[:, joint]) for run in on])
        rest = np.mean((more - one["torque_nm"] * way) ** 2)
        assert rest < 0.55 * np.mean(more**2)
        assert abs(one["torque_nm"]) > 0.1 * robot.recorder.torque_noise
    assert told
    assert "friction_reversal" not in of("joint_force", off, bench, session)


def test_without_logs_of_the_air_no_friction_is_told(world):
    robot, bench, session = world
    runs = [replace(run, air=None) for run in runs_of(robot, bench, session)]
    told = listed(of_arm.in_contract_terms("joint_force", robot, runs, GAUGES), {})
    assert not {"friction_reversal", "friction_by_speed"} & set(told)


def test_grease_that_is_warmer_in_the_cut_is_friction_by_speed(world):
    robot, bench, session = world
    warm = replace(session, warming=replace(session.warming, before=0.0, constant=1200.0, final=1.0))
    warm = replace(warm, idle_first=True, gap=400.0)
    quick = replace(robot, joints=replace(robot.joints, thinning=0.5, by_load=NONE))
    told = of("joint_force", quick, bench, warm)["friction_by_speed"]
    on = runs_of(quick, bench, warm)
    for one in told:
        joint = one["joint"] - 1
        more = np.concatenate([(run.cut.torque - run.air.torque)[:, joint] for run in on])
        less = np.concatenate(
            [(r.cut.torque - r.air.torque)[:, joint] for r in runs_of(robot_off(quick), bench, warm)]
        )
        rate = np.concatenate([run.cut.during.rate[:, joint] for run in on])
        slope = rate @ (more - less) / (rate @ rate)
        assert one["torque_nm_s"] == pytest.approx(slope, rel=0.05)
        assert one["torque_nm_s"] < 0.0
    assert told
    assert "friction_by_speed" not in of("joint_force", robot_off(quick), bench, warm)


def robot_off(robot):
    return replace(robot, joints=replace(robot.joints, thinning=0.0))


def walls(runs):
    """Heights, m, of the walls in mid-wall, where nothing rings."""
    return np.concatenate(
        [(r.cut.tip @ r.cut.during.normal)[(r.cut.during.x > 0.3 * r.cut.during.length)] for r in runs]
    )


def test_lost_motion_is_a_gap_of_up_to_twice_it(world):
    robot, bench, session = world
    lost = np.array([0.0, 0.0, 2e-5, 0.0, 0.0, 0.0])
    loose, tight = (replace(robot, springs=replace(robot.springs, lost=by)) for by in (lost, NONE))
    told = of("deformation", loose, bench, session)["joint_backlash"]
    assert [one["joint"] for one in told] == [3]
    assert 1.3 * 2e-5 < told[0]["angle_mdeg"] * 1e-3 * DEG <= 2.0 * 2e-5  # it turns round over some N m
    runs = runs_of(loose, bench, session)
    moved = walls(runs) - walls(runs_of(tight, bench, session))
    sides = np.concatenate(
        [
            (np.einsum("nai,a->ni", d.jacobian, d.normal)[:, 2] * np.sign(d.torque[:, 2]))[
                d.x > 0.3 * d.length
            ]
            for d in (run.cut.during for run in runs)
        ]
    )
    in_contract = 0.5 * told[0]["angle_mdeg"] * 1e-3 * DEG * sides
    assert np.mean((moved - in_contract) ** 2) < 0.5 * np.mean(moved**2)
    assert "joint_backlash" not in of("deformation", tight, bench, session)


def test_gains_of_the_gauges_are_a_factor_of_the_stiffness(world):
    robot, bench, session = world
    gauges = replace(GAUGES, gains=np.full(3, 0.1), load=0.05)
    (told,) = of("deformation", robot, bench, session, gauges)["stiffness_scale"]
    # Walls are expected to be 1.1 times 1.05 as high as they are.
    assert told == {"factor": pytest.approx(1.1 * 1.05, rel=1e-3), "joint": "all"}
    assert "stiffness_scale" not in of("deformation", robot, bench, session)


def test_a_spring_that_stiffens_is_told_by_a_cubic_and_a_straight_one_is_not(world):
    robot, bench, session = world
    straight = replace(robot.springs, ratio=np.ones((6, 2)))
    bent = replace(straight, ratio=np.array([[1.0, 1.0]] * 4 + [[0.6, 1.6]] + [[1.0, 1.0]]))
    told = of("deformation", replace(robot, springs=bent), bench, session)["stiffness_hardening"]
    assert [one["joint"] for one in told] == [5]
    assert told[0]["cubic"] > 0.0
    unbent = replace(robot, springs=straight)
    assert "stiffness_hardening" not in of("deformation", unbent, bench, session)


def test_an_error_of_a_gear_is_a_wave_of_the_wall(world):
    robot, bench, session = world
    runs = runs_of(robot, bench, session)
    during = runs[0].cut.during
    per_m = float(np.median(np.abs(during.rate[:, 0]))) / during.feed
    order = np.full((6, 6), 0.5)
    order[0, 3] = 2.0 * np.pi / (4.0 * MM * per_m)
    size = np.zeros((6, 6))
    size[0, 3] = 2e-6
    wheel = replace(robot.transmission, order=order, size=size, flank=np.zeros((6, 6)))
    uneven = replace(robot, transmission=wheel)
    (told,) = of("waviness", uneven, bench, session)["gear_ripple"]
    assert told["joint"] == 1
    assert told["order"] == pytest.approx(order[0, 3], abs=1e-2)
    # A torque that twists the joint by as much as the gear is ahead; phases apart by half a turn.
    assert told["torque_nm"] == pytest.approx(2e-6 * robot.arm.stiffness[0], rel=0.02)
    off = (np.degrees(wheel.phase[0, 3]) + 180.0 - told["phase_deg"]) % 360.0
    assert min(off, 360.0 - off) < 1.0
    assert "gear_ripple" not in of("waviness", robot, bench, session)


@pytest.mark.parametrize("about", ["joint_force", "deformation", "waviness"])
def test_a_batch_of_an_arm_tells_what_its_observable_reads(about, tmp_path, monkeypatch):
    few = replace(arm_world_programme.HABITS["c"], identify=(3, 3), validate=(1, 1))
    monkeypatch.setitem(arm_world_programme.HABITS, "c", few)
    hidden = {"joint_backlash": {"joint": 2, "angle_mdeg": 8.0}}
    truth = RECIPES[about].make(tmp_path / "one", hidden, 4, "c")
    json.dumps(truth)
    for name, values in truth["always_on"].items():
        assert all(one["joint"] == "all" or 1 <= one["joint"] <= 6 for one in values)
        assert name != "joint_backlash" or all(one["joint"] != 2 for one in values)


@pytest.mark.parametrize("about", ["joint_force", "deformation", "waviness"])
def test_what_is_told_are_parameters_of_a_form_of_the_library(about, world):
    robot, bench, session = world
    known = {(effect.name, effect.where.get("joint")): effect for effect in library(about)}
    told = of_arm.in_contract_terms(about, robot, runs_of(robot, bench, session), GAUGES)
    for name, some in told.items():
        for one in some:
            effect = known[name, one.parameters.get("joint")]
            assert {*one.parameters, *effect.left_out} == {*effect.names, *effect.where}


# -- tests on either side of the boundary


@pytest.fixture(scope="module")
def machine():
    cell = boundary_world._settled(drawn_cell(np.random.default_rng([2, 59, 0])))
    programme = drawn_programme(np.random.default_rng(2), cell, "c")
    rpm = np.array(programme.speeds)
    ways = (cell.direction,) * len(rpm)
    return cell, programme, of_boundary.Climbs(rpm, ways, 1.2, 0)


@pytest.mark.parametrize("way", ["up", "down"])
def test_the_boundary_of_the_mean_cut_is_where_marched_tests_begin_to_chatter(machine, way):
    cell, programme, climbs = machine
    rpm, ladder = climbs.rpm[::2], np.geomspace(0.4, 2.5, 9)
    depth, _ = of_boundary.boundary(cell, of_boundary.Climbs(rpm, (way,) * len(rpm), 1.2, 0))
    plan = Plan(
        np.repeat(rpm, 9), np.outer(depth, ladder).ravel(), (way,) * 9 * len(rpm), np.zeros(9 * len(rpm))
    )
    rng = np.random.default_rng(1)
    course = march(made_cuts(cell, plan, 60, rng), programme.per_turn, 2, rng)
    turns = course.tip.reshape(len(plan.rpm), 2, programme.per_turn, 2)
    loud = course.stopped | (np.abs(turns[:, 1] - turns[:, 0]).max(axis=(1, 2)) > 0.25 * cell.feed)
    first = ladder[loud.reshape(len(rpm), 9).argmax(axis=1)]
    assert 0.9 < np.median(first) < 1.3
    assert first.max() < 2.5


def test_a_worn_land_is_told_and_a_sharp_edge_is_not(machine):
    cell, _, climbs = machine
    assert of_boundary.in_contract_terms(cell, climbs)["process_damping"][0].present is False
    worn = replace(cell, flank=replace(cell.flank, land=cell.flank.with_viscous(3e6), springback=1e-3))
    (told,) = of_boundary.in_contract_terms(worn, climbs)["process_damping"]
    assert told.present
    with_it, none = (
        of_boundary.boundary(one, climbs)[0]
        for one in (worn, replace(cell, flank=replace(cell.flank, land=0.0)))
    )
    assert np.mean(with_it > none) > 0.7  # it damps
    shift = np.log(with_it / none)
    slow, fast = np.argmin(climbs.rpm), np.argmax(climbs.rpm)
    assert shift[slow] > shift[fast]


def test_bearings_that_soften_lower_the_frequency_that_is_recorded(machine):
    cell, _, climbs = machine
    heard = replace(climbs, turns=45)
    soft = replace(cell, spindle=replace(cell.spindle, bearing=-0.3, bent=1.0))
    (told,) = of_boundary.in_contract_terms(soft, heard)["spindle_speed_softening"]
    assert told.present
    assert told.parameters["change_per_krpm"] < 0.0
    rigid = replace(cell, spindle=replace(cell.spindle, bearing=0.0))
    assert not of_boundary.in_contract_terms(rigid, heard)["spindle_speed_softening"][0].present


def test_a_housing_turned_as_a_whole_is_told_by_its_angle(machine):
    cell, _, climbs = machine
    straight = np.round(cell.resonances.heading / (np.pi / 2)) * (np.pi / 2)
    for degrees in (25.0, 0.0):
        lines = replace(cell.resonances, heading=straight + degrees * DEG)
        (told,) = of_boundary.in_contract_terms(replace(cell, resonances=lines), climbs)["mode_coupling"]
        assert told.present is (degrees > 0.0)
        assert told.parameters["angle_deg"] == pytest.approx(degrees, abs=0.01)
