"""Calibration by measured poses, against an arm simulated without its code, closed forms and differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import permutation_test
from simulated_poses import REACH, ROWS, TOOL, drawn, measured, rows_rad

from metro.robot.calibration.determined import determined
from metro.robot.calibration.fit import Fit, fitted
from metro.robot.calibration.model import State, free_of_geometry, jacobian, moved, names
from metro.robot.calibration.next_poses import next_poses
from metro.robot.calibration.performance import repeated
from metro.robot.calibration.poses import Poses, approached, regions
from metro.robot.calibration.rows import standard_rows
from metro.robot.calibration.search import by_luck
from metro.robot.calibration.start import nominal
from metro.robot.calibration.study import calibrated, sizes
from metro.robot.chain import chain, of_rows
from metro.robot.kinematics import forward

SIGMA = 3e-5  # m: a tracker


def poses(q, at, **more):
    count = len(q)
    blank = np.zeros(count)
    own = {"sigma": blank, "time": np.arange(count, dtype=float), "temperature": np.full(count, np.nan)}
    return Poses(q, at, **{**own, "came": approached(q), **more})


def some_state(rng, tilts=True):
    rows = np.column_stack([rows_rad(), rng.normal(0, 0.02, 6) * tilts])
    state = State(rows, np.zeros(6, dtype=bool), np.eye(4), TOOL)
    return moved(state, np.r_[0.4, -0.2, 0.7, 0.3, -0.5, 0.9, np.zeros(33)])


def test_positions_are_those_of_composed_rotations():
    q = drawn(40)
    state = State(np.column_stack([rows_rad(), np.zeros(6)]), np.zeros(6, dtype=bool), np.eye(4), TOOL)
    seen = measured(q)
    apart = [np.linalg.norm(points[:, None] - points, axis=2) for points in (state.position(q), seen)]
    assert np.allclose(*apart, atol=1e-12)


def test_jacobian_against_differences():
    rng = np.random.default_rng(1)
    state, q = some_state(rng), drawn(7)
    _, derivatives = jacobian(state, q)
    for place in range(derivatives.shape[-1]):
        step = np.zeros(derivatives.shape[-1])
        step[place] = 1e-6
        numeric = (moved(state, step).position(q) - moved(state, -step).position(q)) / 2e-6
        assert np.allclose(derivatives[..., place], numeric, atol=1e-8), names(state)[place]


def test_jacobian_of_a_joint_that_shifts():
    rng = np.random.default_rng(2)
    state = replace(some_state(rng), prismatic=np.array([True, False, False, True, False, False]))
    q = drawn(5)
    _, derivatives = jacobian(state, q)
    for place in range(derivatives.shape[-1]):
        step = np.zeros(derivatives.shape[-1])
        step[place] = 1e-6
        numeric = (moved(state, step).position(q) - moved(state, -step).position(q)) / 2e-6
        assert np.allclose(derivatives[..., place], numeric, atol=1e-8), names(state)[place]


@pytest.mark.parametrize("count", [4, 5, 6, 7])
def test_a_point_on_an_arm_determines_four_parameters_for_each_joint_and_three(count):
    """Each turning axis is a line (4 numbers) in the instrument's frame, and the point has 3 in the last one.

    This is 4 n + 6 (Everett, Driels & Mooring 1987) less the turn of the tool, which a point does not show.
    """
    rng = np.random.default_rng(count)
    rows = np.column_stack(
        [rng.uniform(0.5, 1.2, (count, 2)), rng.uniform(0.1, 0.8, (count, 2)), np.zeros(count)]
    )
    state = State(rows, np.zeros(count, dtype=bool), np.eye(4), TOOL)
    _, derivatives = jacobian(state, rng.uniform(-3, 3, (400, count)))
    assert determined(derivatives, free_of_geometry(state), 0.0).kept.sum() == 4 * count + 3


def test_parallel_axes_need_a_tilt_in_place_of_a_link_offset():
    rng = np.random.default_rng(3)
    state = replace(some_state(rng, tilts=False), base=np.eye(4))
    _, derivatives = jacobian(state, drawn(400))
    allowed = free_of_geometry(state)
    kept = determined(derivatives, allowed, 0.0).kept
    assert kept.sum() == 27
    assert kept[names(state).index("joint 2 tilt")]
    rows_alone = determined(derivatives, allowed & ~np.array(["tilt" in n for n in names(state)]), 0.0).kept
    assert rows_alone.sum() == 26


def test_condition_and_o1_are_those_of_the_singular_values():
    state = some_state(np.random.default_rng(4))
    _, derivatives = jacobian(state, drawn(50))
    found = determined(derivatives, free_of_geometry(state), 0.0)
    singular = np.linalg.svd(derivatives[..., found.kept].reshape(150, -1) * 5e-3, compute_uv=False)
    assert np.isclose(found.condition, singular[0] / singular[-1], rtol=1e-6)
    assert np.isclose(found.o1, np.prod(singular) ** (1 / len(singular)) / np.sqrt(50), rtol=1e-6)


def test_what_moves_points_by_less_than_the_scatter_is_left_out():
    state = some_state(np.random.default_rng(4))
    _, derivatives = jacobian(state, drawn(50))
    allowed = free_of_geometry(state)
    many, few = (determined(derivatives, allowed, scatter).kept.sum() for scatter in (1e-5, 1e-2))
    assert few < many == 27


def test_rows_of_a_modified_chain_lead_the_tool_along_the_same_places():
    rng = np.random.default_rng(5)
    rows = np.column_stack([rng.uniform(-1, 1, (5, 2)), rng.uniform(0.1, 0.5, (5, 2))])
    rows[2, 1] = 0.0  # an axis parallel to the one before
    kinds = ["revolute", "prismatic", "revolute", "revolute", "revolute"]
    geometry = chain(of_rows(rows, kinds, modified=True))
    q = rng.uniform(-1, 1, (30, 5))
    flange = forward(geometry, q)
    own, place, prismatic = standard_rows(geometry)
    state = State(np.column_stack([own, np.zeros(5)]), prismatic, place, np.zeros(3))
    last = state.frames(q)[0][-1]
    there = np.linalg.inv(last) @ flange  # the same in all poses: a fixed tool is between them
    assert np.allclose(there, there[0], atol=1e-9)


def test_geometry_is_found_within_its_intervals_and_outliers_do_no_harm():
    q = drawn(400, seed=7)
    errors = np.zeros((6, 4))
    errors[1] = [0.0011, -0.0006, 0.0, 0.0007]
    errors[2] = [-0.0008, 0.0009, 0.0, -0.0005]
    errors[4, 3] = 0.0004
    at = measured(q, errors, sigma=SIGMA)
    at[::25] += 0.02
    start, _ = nominal(poses(q, at), rows_rad())
    state = start.state
    known = determined(jacobian(state, q)[1], free_of_geometry(state), SIGMA)
    fit = fitted(poses(q, at), state, known.kept)
    assert SIGMA * 0.85 < fit.scale < SIGMA * 1.2
    truth = np.column_stack([errors, np.zeros(6)]).ravel()
    found = (fit.state.rows - state.rows).ravel()
    free = np.flatnonzero(known.kept)
    sd = np.sqrt(np.diag(fit.covariance))
    off = [(found[place - 9] - truth[place - 9]) / sd[at_] for at_, place in enumerate(free) if place >= 9]
    assert np.max(np.abs(off)) < 3.5
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.6
    assert np.max(sd[9:]) < 1e-3


def test_gravity_and_eccentricity_are_found_and_nothing_else():
    q = drawn(900, seed=8)

    def eccentric(joint, angle):
        return 4e-4 * np.sin(angle) - 2e-4 * np.cos(2 * angle) if joint == 3 else 0.0 * angle

    at = measured(q, turned=eccentric, sags=True, sigma=SIGMA)
    found = calibrated(poses(q, at), rows_rad())
    final = found.final
    kinds = {(effect.code, effect.joint + 1) for effect in final.effects}
    assert kinds == {("eccentricity", 4), ("elasticity", 2), ("elasticity", 3)}
    assert final.scale < 1.1 * SIGMA
    (place,) = [k for k, effect in enumerate(final.effects) if effect.code == "eccentricity"]
    sd = np.sqrt(np.diag(final.covariance))[final.place(place)]
    assert np.all(np.abs(final.values[place] - [4e-4, 0.0, 0.0, -2e-4]) < 3.0 * sd)
    assert np.all(sd < 3e-5)
    fresh = drawn(200, seed=9)
    truth = measured(fresh, turned=eccentric, sags=True)
    errors = [np.linalg.norm(truth - fit.predicted(poses(fresh, truth)), axis=1) for fit in found.fits]
    assert np.median(errors[2]) < 0.5 * SIGMA < np.median(errors[1])
    size = next(each for each in sizes(final, poses(q, at)) if each.effect.code == "eccentricity")
    bare = measured(q, sags=True)
    moved_by = np.sqrt(np.mean(np.sum((measured(q, turned=eccentric, sags=True) - bare) ** 2, axis=1)))
    assert size.moves <= moved_by < 1.5 * size.moves


def test_a_curve_of_a_reading_is_found_where_no_named_effect_has_its_shape():
    q = drawn(1500, seed=10)
    at = measured(q, turned=lambda j, a: 3e-4 * np.sin(11 * a + 0.4) if j == 1 else 0.0 * a, sigma=SIGMA)
    final = calibrated(poses(q, at), rows_rad()).final
    assert [(effect.code, effect.joint + 1) for effect in final.effects] == [("curve", 2)]
    place = np.linspace(-0.9, 0.9, 200)
    where = np.zeros((200, 6))
    where[:, 1] = place
    curve = final.effects[0].basis(poses(where, np.zeros((200, 3))), final.state) @ final.values[0]
    other = np.column_stack([np.ones(200), np.sin(place), np.cos(place)])  # what the geometry may take
    left = curve - 3e-4 * np.sin(11 * place + 0.4)
    left = left - other @ np.linalg.lstsq(other, left, rcond=None)[0]
    assert np.std(left) < 0.1 * 3e-4 / np.sqrt(2)


def test_an_arm_without_effects_has_none_found():
    q = drawn(600, seed=11)
    found = calibrated(poses(q, measured(q, sigma=SIGMA)), rows_rad())
    assert found.final.effects == ()


def test_play_shows_by_the_direction_of_approach():
    q = drawn(700, seed=12)
    at = measured(q, sigma=SIGMA)
    came = approached(q)
    late = measured(q + 1.5e-4 * came * (np.arange(6) == 1), sigma=SIGMA)
    final = calibrated(poses(q, late), rows_rad()).final
    assert [(effect.code, effect.joint + 1) for effect in final.effects] == [("approach", 2)]
    sd = float(np.sqrt(final.covariance[-1, -1]))
    assert abs(float(final.values[0][0]) - 1.5e-4) < 3.0 * sd < 1e-5
    assert not np.allclose(at, late)


def test_the_test_of_all_signs_is_that_of_another_package():
    gains = np.random.default_rng(13).normal(0.2, 1.0, 9)
    other = permutation_test(
        (gains,), np.mean, permutation_type="samples", alternative="greater", n_resamples=np.inf
    )
    assert np.isclose(by_luck(gains), other.pvalue)
    assert by_luck(np.linspace(0.1, 3.0, 5)) == 1 / 32


def test_what_helps_in_one_region_alone_is_luck():
    one = np.array([5.0, *(-0.01 * np.ones(15))])
    assert np.mean(one) > 0.2
    assert by_luck(one) > 0.4


def test_a_joint_that_stands_keeps_the_direction_in_which_it_came():
    q = np.array([[0.0, 1.0], [0.1, 1.0], [0.1, 0.9], [0.1, 0.9], [0.0, 0.9]])
    assert approached(q).tolist() == [[0, 0], [1, 0], [1, -1], [1, -1], [-1, -1]]


def test_regions_hold_as_many_poses_each_and_lie_apart():
    points = np.random.default_rng(0).uniform(0, [4.0, 1.0, 1.0], (160, 3))
    region = regions(points, 2)
    assert np.bincount(region).tolist() == [40] * 4
    assert all(np.ptp(points[region == one, 0]) < 1.4 for one in range(4))


def test_the_reach_of_the_drawn_poses_is_that_of_the_table():
    assert ROWS.shape == (6, 4)
    assert np.all(np.abs(drawn(50)) <= REACH)


def test_accuracy_and_repeatability_are_those_of_their_definitions():
    """Six corners of an octahedron, 3 µm beside the expected place: all 5 µm from the middle."""
    corners = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]]) * 5e-6
    start = some_state(np.random.default_rng(6))
    q = np.repeat(drawn(1), 6, axis=0)
    fit = fitted_as(start)
    at = start.position(q) + corners + [3e-6, 0, 0]
    came = np.repeat([[1.0] * 6, [-1.0] * 6], 3, axis=0)
    (one,) = repeated(poses(q, at, came=came), np.full(6, 7.0), (fit,))
    assert (one.target, one.count) == (7, 6)
    assert np.isclose(one.accuracy[0], 3e-6, rtol=1e-6)
    assert np.isclose(one.repeatability[0], 5e-6, rtol=1e-6)
    assert one.repeatability[1] < one.repeatability[0] < one.repeatability[2]
    apart = np.mean(corners[:3], axis=0) - np.mean(corners[3:], axis=0)
    assert np.isclose(one.directional, np.linalg.norm(apart), rtol=1e-6)


def test_poses_that_do_not_place_the_arm_are_refused_with_the_reason():
    q = np.repeat(drawn(1), 60, axis=0)
    noise = 1e-5 * np.random.default_rng(0).standard_normal((60, 3))
    with pytest.raises(ValueError, match="along one line at most"):
        calibrated(poses(q, measured(q) + noise), rows_rad())
    q = drawn(60)
    with pytest.raises(ValueError, match="do not determine the place of the arm's base: they scatter by"):
        calibrated(poses(q, measured(q, sigma=0.2)), rows_rad())


def test_the_next_poses_lower_the_errors_as_the_information_says_and_more_than_others():
    q = drawn(60, seed=14)
    own = poses(q, measured(q, sigma=SIGMA))
    fit = calibrated(own, rows_rad()).final
    free = int(fit.free.sum())
    chosen, left = next_poses(fit, own, count=6)

    def errors_left(more):
        shifts = jacobian(fit.state, more)[1][..., fit.free].reshape(-1, free)
        before = np.linalg.inv(fit.covariance[:free, :free])
        ratio = np.linalg.slogdet(before)[1] - np.linalg.slogdet(before + shifts.T @ shifts / fit.scale**2)[1]
        return np.exp(0.5 * ratio / free)

    assert np.isclose(left[-1], errors_left(chosen), rtol=1e-4)
    assert np.all(np.diff(left) < 0.0)
    others = [errors_left(drawn(6, seed)) for seed in range(20)]
    assert left[-1] < min(others)
    assert np.all((chosen >= q.min(axis=0)) & (chosen <= q.max(axis=0)))


def test_repeats_of_few_are_none():
    start = some_state(np.random.default_rng(6))
    q = np.repeat(drawn(1), 6, axis=0)
    target = np.array([1.0, 1, 1, 1, np.nan, 2])
    assert repeated(poses(q, start.position(q)), target, (fitted_as(start),)) == ()


def test_the_interval_of_repeatability_holds_that_of_many():
    rng = np.random.default_rng(7)
    start = some_state(rng)
    q = np.repeat(drawn(1), 20, axis=0)
    distances = np.linalg.norm(rng.standard_normal((200_000, 3)) * 1e-5, axis=1)
    truth = distances.mean() + 3 * distances.std()
    held = 0
    for _ in range(200):
        at = start.position(q) + 1e-5 * rng.standard_normal((20, 3))
        (one,) = repeated(poses(q, at), np.ones(20), (fitted_as(start),))
        held += one.repeatability[1] < truth < one.repeatability[2]
    assert held / 200 > 0.85


def fitted_as(state):
    """Return a fit that predicts by a state alone."""
    return Fit(state, np.zeros(39, dtype=bool), (), (), 0.0, np.zeros((0, 0)))
