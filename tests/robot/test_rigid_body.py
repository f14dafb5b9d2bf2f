"""The torque regressor against closed forms and virtual work; pinocchio is asked in test_arm_oracle."""

import numpy as np

from metro.robot.rigid_body import GRAVITY, gravity_regressor, torque_regressor

RNG = np.random.default_rng(4)


def point_mass(mass, place):
    """The ten parameters of a point mass at ``place`` in the link's frame."""
    x, y, z = place
    inertia = [y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y]
    return mass * np.r_[1.0, place, inertia]


def test_a_pendulum_on_a_horizontal_axis():
    dh = np.array(
        [[0.0, -np.pi / 2, 0.4, 0.0], [0.0, 0.0, 0.0, 0.3]]
    )  # joint 2 turns about a horizontal axis
    q, rate, acceleration = (RNG.normal(size=(9, 2)) * (0, 1) for _ in range(3))
    torque = torque_regressor(dh, q, rate, acceleration) @ np.r_[np.zeros(10), point_mass(2.0, (0.1, 0, 0))]
    reach = 0.4
    expected = 2.0 * reach**2 * acceleration[:, 1] - 2.0 * GRAVITY * reach * np.cos(q[:, 1])
    np.testing.assert_allclose(torque[:, 1], expected, atol=1e-12)


def test_two_links_in_a_plane_as_in_the_textbook():
    """Double pendulum with point masses at the links' ends (Craig, Introduction to Robotics, eq. 6.58)."""
    lengths, masses = (0.5, 0.3), (3.0, 2.0)
    upright = np.array([[0.0, np.pi / 2, 0.0, 0.0], [0.0, 0.0, 0.0, 0.5], [0.0, 0.0, 0.0, 0.3]])
    q, rate, acceleration = (RNG.normal(size=(9, 3)) * (0, 1, 1) for _ in range(3))
    parameters = np.r_[np.zeros(10), point_mass(3.0, (0, 0, 0)), point_mass(2.0, (0, 0, 0))]
    torque = torque_regressor(upright, q, rate, acceleration) @ parameters
    (l1, l2), (m1, m2), (_, q1, q2) = lengths, masses, q.T
    (_, v1, v2), (_, a1, a2) = rate.T, acceleration.T
    g2 = m2 * l2 * GRAVITY * np.cos(q1 + q2)
    second = m2 * l1 * l2 * (np.cos(q2) * a1 + np.sin(q2) * v1**2) + g2 + m2 * l2**2 * (a1 + a2)
    first = (
        m2 * l2**2 * (a1 + a2)
        + m2 * l1 * l2 * np.cos(q2) * (2 * a1 + a2)
        + (m1 + m2) * l1**2 * a1
        - m2 * l1 * l2 * np.sin(q2) * (v2**2 + 2 * v1 * v2)
        + g2
        + (m1 + m2) * l1 * GRAVITY * np.cos(q1)
    )
    np.testing.assert_allclose(torque[:, 1:], np.column_stack([first, second]), atol=1e-11)


def test_at_rest_the_torques_do_the_work_of_lifting_the_arm():
    """Weight of a point mass of the last link, by differences of its height alone."""
    from metro.robot.kinematics import forward

    dh = RNG.uniform(-1, 1, (6, 4))
    q, place, step = RNG.uniform(-2, 2, (5, 6)), np.array([0.1, -0.2, 0.3]), 1e-6
    torque = gravity_regressor(dh, q) @ np.r_[np.zeros(20), 1.5, 1.5 * place]

    def height(angles):
        frame = forward(dh, angles)
        return frame[:, 2, :3] @ place + frame[:, 2, 3]

    for j in range(6):
        move = step * np.eye(6)[j]
        lifted = (height(q + move) - height(q - move)) / (2 * step)
        np.testing.assert_allclose(torque[:, j], 1.5 * GRAVITY * lifted, atol=1e-7)
