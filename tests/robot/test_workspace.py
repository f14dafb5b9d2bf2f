"""Stiffness over the workspace: arms in closed form, virtual work, poses that are and are not reached."""

from __future__ import annotations

import numpy as np
import pytest
from kr160_arm import arm_with_tool

from metro.robot.kinematics import Arm, forward
from metro.robot.workspace import ellipsoid, principal_sd, reach, stiffness_map

ARM = arm_with_tool(work_in_base={"xyz_mm": [1200, 50, 600], "rpy_deg": [5, -10, 40]})
HOME = np.array([0.1, -0.9, 0.2, 0.3, 0.8, 0.2])
SOFT = 1e-6 * np.array([0.8, 0.5, 1.1, 4.0, 5.0, 6.0])


def test_a_planar_arm_has_the_stiffness_of_its_closed_form():
    # a third joint turns about an axis across the plane, so that all three directions give way
    dh = np.array([[0, 0, 0, 1.0], [0, np.pi / 2, 0, 0.6], [0, 0, 0, 0.3]])
    arm, c = Arm(dh, np.zeros(3), np.eye(4)), np.array([2e-6, 5e-6, 1e-6])
    q = np.array([0.4, 0.9, 0.0])
    found = ellipsoid(arm, q, c)
    # at q3 = 0 the third link lies along the second and lifts the tip out of the plane
    a, b = q[0], q[0] + q[1]
    moves = np.array([-np.sin(a) - 0.9 * np.sin(b), np.cos(a) + 0.9 * np.cos(b)])
    second = 0.9 * np.array([-np.sin(b), np.cos(b)])
    plane = c[0] * np.outer(moves, moves) + c[1] * np.outer(second, second)
    expected = np.zeros((3, 3))
    expected[:2, :2], expected[2, 2] = np.linalg.inv(plane), 1 / (c[2] * 0.3**2)
    np.testing.assert_allclose(found.matrix, expected, rtol=1e-9, atol=1e-6 * expected.max())
    np.testing.assert_allclose(found.along[2], expected[2, 2], rtol=1e-9)
    np.testing.assert_allclose(found.along[:2], 1 / np.diag(plane), rtol=1e-9)


def test_a_force_along_a_principal_axis_deflects_along_it_by_the_energy_of_the_joints():
    found = ellipsoid(ARM, HOME, SOFT)
    step = 1e-6
    moves = np.stack(
        [(ARM.tip(HOME + step * e) - ARM.tip(HOME - step * e)) / (2 * step) for e in np.eye(6)], 1
    )
    for axis, stiffness in zip(found.axes.T, found.principal, strict=True):
        torque = moves.T @ (100.0 * axis)
        assert 100.0**2 / stiffness == pytest.approx(SOFT @ torque**2, rel=1e-6)
        np.testing.assert_allclose(moves @ (SOFT * torque), 100.0 * axis / stiffness, rtol=1e-5, atol=1e-12)
    assert (np.diff(found.principal) > 0).all()


def test_the_tool_reaches_places_as_it_was_held():
    grid = np.stack(np.meshgrid([-0.2, 0.0, 0.2], [-0.2, 0.2], [-0.1, 0.1]), axis=-1).reshape(-1, 3)
    place = ARM.tip(HOME) + grid
    q = reach(ARM, HOME, place)
    np.testing.assert_allclose(ARM.tip(q), place, atol=1e-6)
    held = forward(ARM.dh, HOME)[:3, :3]
    np.testing.assert_allclose(forward(ARM.dh, q)[:, :3, :3], np.tile(held, (len(q), 1, 1)), atol=2e-6)
    np.testing.assert_allclose(reach(ARM, HOME, ARM.tip(HOME)[None])[0], HOME, atol=1e-9)


def test_what_lies_beyond_the_arm_is_not_reached():
    place = ARM.tip(HOME) + np.array([[3.0, 0.0, 0.0], [0.05, 0.0, 0.0]])
    found = stiffness_map(ARM, HOME, place, SOFT)
    assert np.isnan(found.joints[0]).all()
    assert np.isnan(found.stiffness.principal[0]).all()
    np.testing.assert_allclose(
        found.stiffness.principal[1], ellipsoid(ARM, found.joints[1], SOFT).principal, rtol=1e-12
    )
    assert found.condition[1] > 1


def test_the_error_of_principal_stiffness_is_that_of_drawn_compliances():
    rng = np.random.default_rng(2)
    sd = 0.03 * SOFT
    drawn = SOFT + rng.normal(0, sd, (1500, 6))
    spread = np.std([ellipsoid(ARM, HOME, one).principal for one in drawn], axis=0)
    np.testing.assert_allclose(principal_sd(ARM, HOME, SOFT, np.diag(sd**2)), spread, rtol=0.08)
