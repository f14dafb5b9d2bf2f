"""The mass of the tip from link masses, against closed forms and kinetic energies by differences."""

import numpy as np
import pytest

from metro.robot.kinematics import Arm, link_frames
from metro.robot.link_mass import Link, centres, joint_mass, links_of_cell, mass_about_base, tip_mass
from metro.robot.rigid_body import torque_regressor
from metro.robot.statics import tip_jacobian

DH = np.radians(
    [[0, -90, 0, 0], [-90, 0, 0, 0], [0, -90, 0, 0], [0, 90, 0, 0], [0, -90, 0, 0], [180, 0, 0, 0]]
)
DH = np.column_stack([DH[:, :2], [[0.78, 0.32], [0, 1.075], [0, 0.2], [1.1425, 0], [0, 0], [0.2, 0]]])
WORK = np.eye(4)
WORK[:3, :3] = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
WORK[:3, 3] = (1.6, -0.3, 0.7)
ARM = Arm(DH, np.array([0.19, 0.0, 0.26]), WORK)
Q = np.radians([[-8.0, 10.0, 10.0, 5.0, -20.0, 5.0], [20.0, 30.0, -15.0, 40.0, 50.0, -70.0]])
COMPLIANCE = 1 / np.array([2.6e6, 3.4e6, 2.5e6, 6.0e5, 6.6e5, 4.4e5])
LINKS = tuple(
    Link(joint, mass, np.array(centre), np.diag(inertia))
    for joint, (mass, centre, inertia) in enumerate(
        [
            (400.0, (-0.2, 0.1, 0.02), (20.0, 25.0, 12.0)),
            (200.0, (-0.5, 0.0, 0.1), (3.0, 20.0, 20.0)),
            (250.0, (-0.1, 0.05, 0.1), (9.0, 7.0, 8.0)),
            (80.0, (0.0, 0.3, 0.0), (4.0, 1.0, 4.0)),
            (40.0, (0.0, 0.0, 0.05), (0.4, 0.5, 0.3)),
            (76.53, (-0.005, 0.0, 0.226), (0.934, 1.433, 1.2)),
        ],
        start=1,
    )
)


def energies(q, rate, links):
    """Kinetic energy by central differences of the links' frames, which shares no Jacobian with the code."""
    step = 1e-6
    before, after = (link_frames(DH, q + sign * step * rate) for sign in (-1, 1))
    total = 0.0
    for body in links:
        one, two = before[body.joint], after[body.joint]
        speed = (two - one)[:3] @ np.append(body.centre, 1.0) / (2 * step)
        turn = (two - one)[:3, :3] / (2 * step) @ link_frames(DH, q)[body.joint][:3, :3].T
        omega = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
        own = link_frames(DH, q)[body.joint][:3, :3]
        total += 0.5 * body.mass * speed @ speed + 0.5 * omega @ own @ body.inertia @ own.T @ omega
    return total


def test_joint_mass_has_the_kinetic_energy_of_the_moving_links():
    rate = np.array([0.3, -0.5, 0.7, 1.1, -0.9, 0.4])
    for q, mass in zip(Q, joint_mass(DH, Q, LINKS), strict=True):
        assert 0.5 * rate @ mass @ rate == pytest.approx(energies(q, rate, LINKS), rel=1e-8)


def test_joint_mass_is_that_of_the_torque_regressor():
    """Torques at rest with unit accelerations, less those of gravity, are the columns of M."""
    parameters = []
    for body in LINKS:
        c, m = body.centre, body.mass
        about = body.inertia + m * (c @ c * np.eye(3) - np.outer(c, c))
        parameters += [
            m,
            *(m * c),
            *(about[i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))),
        ]
    q, still = np.repeat(Q[:1], 6, axis=0), np.zeros((6, 6))
    moving = torque_regressor(DH, q, still, np.eye(6)) @ parameters
    gravity = torque_regressor(DH, q, still, still) @ parameters
    assert np.allclose((moving - gravity).T, joint_mass(DH, Q[:1], LINKS)[0], rtol=1e-10, atol=1e-8)


@pytest.mark.parametrize("compliance", [COMPLIANCE, None])
def test_a_point_mass_at_the_tip_is_its_mass_in_every_direction(compliance):
    tip = Link(6, 76.53, ARM.tool)
    least = tuple(Link(joint, 1e-9, np.zeros(3), 1e-9 * np.eye(3)) for joint in range(1, 7))
    links = (tip, *least) if compliance is not None else (*LINKS, tip)
    mass = tip_mass(ARM, Q, links, compliance)
    without = 0.0 if compliance is not None else tip_mass(ARM, Q, LINKS)
    assert np.allclose(mass - without, 76.53 * np.eye(3), atol=1e-6)


def test_the_least_mass_is_never_more_than_that_of_any_other_motion_of_the_joints():
    static, least = tip_mass(ARM, Q, LINKS, COMPLIANCE), tip_mass(ARM, Q, LINKS)
    assert (np.linalg.eigvalsh(static - least) >= -1e-9).all()
    assert (np.linalg.eigvalsh(least) > 0).all()


def test_the_static_mass_gives_the_frequency_of_a_heavy_tip():
    """With a mass at the tip far above the links', the arm's lowest modes are those of M_r and K_r."""
    links = (*LINKS, Link(6, 1e6, ARM.tool))
    jacobian = tip_jacobian(ARM, Q[0])
    stiffness = np.linalg.inv(jacobian @ (COMPLIANCE[:, None] * jacobian.T))
    mass = tip_mass(ARM, Q[:1], links, COMPLIANCE)[0]
    reduced = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
    whole = np.linalg.solve(joint_mass(DH, Q[:1], links)[0], np.diag(1 / COMPLIANCE))
    assert reduced == pytest.approx(np.sort(np.linalg.eigvals(whole).real)[:3], rel=2e-3)


def test_a_joint_without_inertia_has_a_static_mass_and_no_least_one():
    links = tuple(Link(body.joint, body.mass, np.zeros(3)) for body in LINKS)
    assert np.isfinite(tip_mass(ARM, Q, links, COMPLIANCE)).all()
    with pytest.raises(ValueError, match="moves no mass"):
        tip_mass(ARM, Q, links)


def test_the_printed_equation_gives_a_point_mass_at_the_tip_no_mass_along_the_line_from_the_base():
    upright = Arm(DH, ARM.tool, np.eye(4))
    mass = mass_about_base(upright, Q, (Link(6, 76.53, ARM.tool),))
    for q, found in zip(Q, mass, strict=True):
        r = upright.tip(q)
        assert np.allclose(found, 76.53 * (np.eye(3) - np.outer(r, r) / (r @ r)))
        assert np.allclose(found @ r, 0.0, atol=1e-12)
        x, y, z = r
        printed = np.array(
            [
                [y * y + z * z, -x * y, -x * z],
                [-x * y, x * x + z * z, -y * z],
                [-x * z, -y * z, x * x + y * y],
            ]
        )
        assert np.allclose(found, 76.53 * printed / (r @ r))


def test_the_printed_equation_turns_with_the_work_frame():
    upright = mass_about_base(Arm(DH, ARM.tool, np.eye(4)), Q, LINKS)
    turn = WORK[:3, :3]
    assert np.allclose(mass_about_base(ARM, Q, LINKS), turn.T @ upright @ turn)


def test_links_of_a_cell_are_read_in_millimetres_with_the_head_on_the_last_joint():
    cell = {
        "arm": {
            "links": [{"mass_kg": 10.0 * j, "centre_mm": [100.0, 0.0, 0.0]} for j in range(1, 7)],
            "head": {
                "mass_kg": 76.53,
                "centre_mm": [-5.04, 0.3, 225.67],
                "inertia_kg_m2": [1, 2, 3, 4, 5, 6],
            },
        }
    }
    links = links_of_cell(cell)
    assert [body.joint for body in links] == [1, 2, 3, 4, 5, 6, 6]
    assert links[0].centre == pytest.approx([0.1, 0.0, 0.0])
    assert links[-1].inertia.tolist() == [[1, 4, 5], [4, 2, 6], [5, 6, 3]]
    assert links_of_cell({"arm": {}}) == ()
    assert centres(DH, Q, links).shape == (2, 7, 3)
