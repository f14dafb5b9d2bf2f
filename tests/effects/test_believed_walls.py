"""What all walls share: springs that are softer in the cut, a zero, and a force that is off."""

from dataclasses import replace

import elastic_arm
import numpy as np
import pytest

from metro.effects import joint_backlash, stiffness_hardening, stiffness_scale
from metro.loop.search.search import search
from metro.loop.search.trial import Gates
from metro.loop.statement import to_json
from metro.loop.verdict.beliefs import beliefs, strained
from metro.observables.deformation.blocks import believed_block
from metro.observables.deformation.model import DeformationModel
from metro.observables.deformation.setting import CutWall
from metro.wording.statements import worded
from virtual_cell.world.arm.gears import springs

ARM = elastic_arm.ARM
BASE = DeformationModel(ARM)
COMPLIANCE = 1 / elastic_arm.STIFFNESS
SHARING = replace(BASE, touched=True, forces=("dynamometer",), springs=tuple(COMPLIANCE))
NAMES = [one.name for one in SHARING.parameters]
GATES = Gates(model_form_budget=0.007, materiality=0.004, false_additions=0.05, held_out_gain=3.0, seed=1)


def problem(truth, seed):
    task = elastic_arm.problem(truth, seed, base=SHARING)
    scatter = np.where(np.arange(len(NAMES)) < 6, 0.005, 0.0)
    return replace(task, blocks=(believed_block(SHARING), *task.blocks), scatter=scatter, systematic=0.0)


@pytest.fixture(scope="module")
def wall():
    return next(block for block in problem({}, 0).blocks if isinstance(block.setting, CutWall))


def height(block, **beliefs):
    """Predicted wall with all springs as in the load tests, but for what is given."""
    beta = np.concatenate([COMPLIANCE, np.zeros(len(SHARING.believed))])
    for name, value in beliefs.items():
        beta[NAMES.index(name)] = value
    matrix, offset = SHARING.design(block, np.zeros(0), beta)
    return matrix @ beta + offset


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_force_that_is_off_moves_the_wall_as_the_force_that_it_then_is(wall, axis):
    told = height(wall, **{f"force_off_dynamometer_{'xyz'[axis]}": 0.03})
    size = np.linalg.norm(wall.setting.force, axis=1)
    truly = replace(
        wall, setting=replace(wall.setting, force=wall.setting.force + np.outer(size, 0.03 * np.eye(3)[axis]))
    )
    matrix, offset = BASE.design(truly, np.zeros(0), COMPLIANCE)
    np.testing.assert_allclose(told, matrix @ COMPLIANCE + offset, rtol=1e-9)
    beta = np.zeros(len(NAMES))
    beta[NAMES.index(f"force_off_dynamometer_{'xyz'[axis]}")] = 0.03
    np.testing.assert_allclose(SHARING.believed_force(wall.setting, beta).force, truly.setting.force)


def test_a_joint_that_is_softer_in_the_cut_moves_the_wall_and_no_load_test(wall):
    softer = COMPLIANCE * np.array([1, 1, 1.04, 1, 1, 1])
    matrix, offset = BASE.design(wall, np.zeros(0), softer)
    np.testing.assert_allclose(height(wall, softer_joint_3=0.04), matrix @ softer + offset, rtol=1e-9)
    test = problem({}, 0).role("calibrate")[1]
    np.testing.assert_array_equal(height(test, softer_joint_3=0.04), height(test))


def test_the_zero_of_all_walls_moves_each_as_a_whole(wall):
    np.testing.assert_allclose(height(wall, wall_zero=5e-6) - height(wall), 5e-6)


SHARE, CUBIC = 0.12, 6e14


def in_series(torque):
    """Joint 1 hardens, its link does not: the two springs carry one torque."""
    twist = torque * COMPLIANCE
    soft = 2.5 * COMPLIANCE[0]  # a gear that hardens is softer at small torques
    twist[0] = SHARE * soft * torque[0] + elastic_arm.twisted(torque[0], 1 / ((1 - SHARE) * soft), CUBIC)
    return twist


def all_hardens(monkeypatch):
    """Let no joint have a link: what metro took for known before."""
    monkeypatch.setattr("metro.observables.deformation.blocks.LINKS", 0.0)
    monkeypatch.setattr("metro.observables.deformation.blocks.OF_LINKS", 1e-6)


@pytest.mark.parametrize("known", [True, False])
def test_a_link_in_series_with_a_gear_that_hardens_makes_the_hardening_no_smaller(known, monkeypatch):
    if not known:
        all_hardens(monkeypatch)
    outcome = search(problem({"springs": in_series}, 3), stiffness_hardening.EFFECT, GATES)
    assert outcome.names == ("stiffness_hardening",)
    assert outcome.final.candidate.effects[0].form == "joint 1"
    (cubic,), sd = outcome.final.theta, np.sqrt(outcome.final.covariance[-1, -1])
    if known:
        assert abs(cubic - CUBIC) < 2.0 * sd < 0.5 * CUBIC
    else:
        assert cubic < 0.6 * CUBIC


def test_the_wall_depends_on_what_stays_straight_as_its_design_says(wall):
    hard = replace(SHARING, torsion=SHARING.torsion.with_joint(0, cubic=CUBIC).with_joint(1, cubic=CUBIC))
    tests = problem({}, 0).role("calibrate")[1]
    for block in (wall, tests):
        beta = np.concatenate([COMPLIANCE, np.full(len(SHARING.believed), 0.1)])
        matrix, _ = hard.design(block, np.zeros(0), beta)
        for name in ("straight_joint_1", "straight_joint_2", "joint_compliance_1"):
            place = NAMES.index(name)
            step = 1e-4 * beta[place]
            about = [beta + sign * step * np.eye(len(beta))[place] for sign in (1.0, -1.0)]
            above, below = (m @ b + o for b in about for m, o in [hard.design(block, np.zeros(0), b)])
            expected = (above - below) / (2.0 * step)
            size = np.abs(expected).max()
            np.testing.assert_allclose(matrix[:, place], expected, atol=1e-4 * size)
            assert size > 0.0


def of_gears(seed):
    """Walls and load tests of an arm with gears of the virtual world, and what both models say of them."""
    rng = np.random.default_rng(seed)
    rated = np.array([2600.0, 3400.0, 1900.0, 700.0, 600.0, 380.0])
    task = problem({"springs": springs(rng, elastic_arm.STIFFNESS, rated).elastic}, seed)
    tests = [block.setting for block in task.role("calibrate") if not block.belief]
    torque = np.vstack([np.abs(BASE.torques(test.joints, test.force)) for test in tests])
    base = replace(SHARING, loaded=tuple(torque.max(axis=0)))
    scatter = np.where(np.arange(len(base.parameters)) < 6, 0.005, 0.0)
    blocks = (believed_block(base), *task.blocks[1:])
    return task, replace(task, base=base, blocks=blocks, scatter=scatter)


@pytest.mark.parametrize("seed", [*(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3)), 4])
def test_gears_in_three_pieces_harden_no_joint(seed, monkeypatch):
    """Springs that are a fifth softer below a tenth of the rated torque are what gears are.

    Without lost motion, and where all of a joint is taken to harden, one of them would be a hardening.
    """
    _, with_lost_motion = of_gears(seed)
    effects = (*stiffness_hardening.EFFECT, *stiffness_scale.EFFECT, *joint_backlash.EFFECT)
    assert search(with_lost_motion, effects, GATES).names == ()
    if seed == 1:
        all_hardens(monkeypatch)
        without, _ = of_gears(seed)
        assert search(without, effects, GATES).names != ()


def test_lost_motion_is_one_way_beyond_a_fraction_of_the_load(wall):
    _, task = of_gears(1)
    base, place = task.base, [one.name for one in task.base.parameters].index("lost_motion_joint_2")
    beta = np.concatenate([COMPLIANCE, np.zeros(len(base.believed))])
    largest = base.loaded[1]
    for share, passed in ((0.02, 0.1), (0.5, 1.0), (-1.0, -1.0)):
        way = base.lost(np.full((1, 6), share * largest))[0, 1]
        assert way == pytest.approx(passed * COMPLIANCE[1] * largest, rel=0.02)
    matrix, _ = base.design(wall, np.zeros(0), beta)
    moved = elastic_arm.moves(ARM, wall.setting.commanded[20])[:, 1] @ wall.setting.normal
    torque = elastic_arm.moves(ARM, wall.setting.commanded[20])[:, 1] @ wall.setting.force[20]
    middle = list(wall.setting.kept).index(20)
    expected = moved * COMPLIANCE[1] * largest * np.tanh(5.0 * torque / largest)
    assert matrix[middle, place] == pytest.approx(expected, rel=1e-3)


def test_gears_that_are_a_little_softer_in_the_cut_are_no_effect():
    task = problem({"factor": dict(zip(range(1, 7), (0.97, 0.98, 0.96, 0.98, 0.99, 0.96), strict=True))}, 2)
    outcome = search(task, (*stiffness_scale.EFFECT, *joint_backlash.EFFECT), GATES)
    assert outcome.names == ()
    assert strained(beliefs(outcome), outcome) == ""


def test_an_arm_that_is_much_softer_is_one_and_it_is_said_what_it_would_take_without():
    task = problem({"factor": dict.fromkeys(range(1, 7), 0.6)}, 3)
    outcome = search(task, (*stiffness_scale.EFFECT, *joint_backlash.EFFECT), GATES)
    assert outcome.names == ("stiffness_scale",)
    told = beliefs(outcome)
    assert {one["name"] for one in told} == {one.name for one in SHARING.believed}
    assert max(abs(one["before"]) / one["sd"] for one in told) > 3.0
    assert max(abs(one["after"]) / one["sd"] for one in told) < 3.0
    words = worded(to_json(strained(told, outcome)))
    assert words.startswith("Without stiffness scale, errors of the instruments would have to be: ")
    assert "known within ±10 %; with this effect: " in words
