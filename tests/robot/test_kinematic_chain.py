"""Chains of joints against published poses, closed forms and, where it is installed, pinocchio."""

import numpy as np
import pytest

from metro.formats.errors import FormatError
from metro.formats.urdf import read_urdf
from metro.robot.chain import chain, of_rows
from metro.robot.kinematics import forward, geometry_of_cell, jacobian, link_frames
from metro.robot.link_mass import Link, joint_mass
from metro.robot.rigid_body import GRAVITY, torque_regressor

RNG = np.random.default_rng(5)
UR10E = [
    *([0, 90, 180.7, 0], [0, 0, 0, -612.7], [0, 0, 0, -571.55]),
    *([0, 90, 174.15, 0], [0, -90, 119.85, 0], [0, 0, 116.55, 0]),
]
# Franka Emika Panda: rows as its maker prints them (modified), the flange as a fixed row
PANDA = [
    *([0, 0, 333, 0], [0, -90, 0, 0], [0, 90, 316, 0], [0, 90, 0, 82.5]),
    *([0, -90, 384, -82.5], [0, 90, 0, 0], [0, 90, 0, 88], [0, 0, 107, 0]),
]
KINDS = [*["revolute"] * 7, "fixed"]
ORIGINS = (  # of the same arm's URDF file
    *(("0 0 0.333", "0 0 0"), ("0 0 0", "-1.5707963267948966 0 0"), ("0 -0.316 0", "1.5707963267948966 0 0")),
    *(("0.0825 0 0", "1.5707963267948966 0 0"), ("-0.0825 0.384 0", "-1.5707963267948966 0 0")),
    *(("0 0 0", "1.5707963267948966 0 0"), ("0.088 0 0", "1.5707963267948966 0 0"), ("0 0 0.107", "0 0 0")),
)
READY = np.radians([0, -45, 0, -135, 0, 90, 45])


def panda():
    return geometry_of_cell({"arm": {"dh": PANDA, "convention": "modified", "joints": KINDS}})


def urdf(tmp_path, joints):
    """Write a URDF file of (type, xyz, rpy, axis, inertial) per joint."""
    parts = ["<robot name='r'>", "<link name='l0'/>"]
    for i, (kind, xyz, rpy, axis, inertial) in enumerate(joints):
        parts.append(f"<link name='l{i + 1}'>{inertial}</link>")
        limits = "<limit lower='-9' upper='9' effort='9' velocity='9'/>"
        ends = f"<parent link='l{i}'/><child link='l{i + 1}'/><axis xyz='{axis}'/>{limits}"
        parts.append(f"<joint name='j{i}' type='{kind}'><origin xyz='{xyz}' rpy='{rpy}'/>{ends}</joint>")
    path = tmp_path / "robot.urdf"
    path.write_text("\n".join([*parts, "</robot>"]))
    return path


def of_file(path, **ends):
    joints = read_urdf(path, **ends)
    parts = [
        {"name": j.name, "kind": j.kind, "origin": j.origin.tolist(), "axis": j.axis.tolist()} for j in joints
    ]
    return geometry_of_cell({"arm": {"chain": parts}})


def test_a_ur10e_stretched_out_is_where_its_lengths_add_up():
    flange = forward(geometry_of_cell({"arm": {"dh": UR10E}}), np.zeros(6))
    np.testing.assert_allclose(flange[:3, 3], [-1.18425, -0.2907, 0.06085], atol=1e-12)


def test_a_panda_of_modified_rows_is_at_the_poses_that_its_maker_states():
    np.testing.assert_allclose(forward(panda(), np.zeros(7))[:3, 3], [0.088, 0, 0.926], atol=1e-12)
    ready = forward(panda(), READY)
    np.testing.assert_allclose(ready[:3, 3], [0.3069, 0.0, 0.5903], atol=6e-5)
    turned = np.array([[np.sqrt(0.5), -np.sqrt(0.5), 0], [-np.sqrt(0.5), -np.sqrt(0.5), 0], [0, 0, -1]])
    np.testing.assert_allclose(np.abs(ready[:3, :3]), np.abs(turned), atol=1e-12)


def test_its_urdf_file_says_the_same_as_its_rows(tmp_path):
    kinds = [*["revolute"] * 7, "fixed"]
    path = urdf(tmp_path, [(k, *o, "0 0 1", "") for k, o in zip(kinds, ORIGINS, strict=True)])
    q = RNG.uniform(-2, 2, (20, 7))
    np.testing.assert_allclose(forward(of_file(path), q), forward(panda(), q), atol=1e-12)
    np.testing.assert_allclose(jacobian(of_file(path), q), jacobian(panda(), q), atol=1e-12)


def test_standard_rows_as_a_chain_are_the_rows():
    rows, q = RNG.uniform(-1, 1, (6, 4)), RNG.uniform(-2, 2, (9, 6))
    rate, rise = RNG.normal(size=(2, 9, 6))
    made = chain(of_rows(rows, ["revolute"] * 6))
    np.testing.assert_allclose(link_frames(made, q), link_frames(rows, q), atol=1e-12)
    np.testing.assert_allclose(
        torque_regressor(made, q, rate, rise), torque_regressor(rows, q, rate, rise), atol=1e-9
    )


@pytest.mark.parametrize("axis", ["0 0 1", "1 0 0", "0 0 -1", "0.6 0 -0.8"])
def test_the_jacobian_of_any_axis_is_the_change_of_the_pose(tmp_path, axis):
    joints = [("prismatic", "0.1 0 0.2", "0.3 0 0.4", axis, ""), ("revolute", "0 0.2 0.1", "0 1 0", axis, "")]
    arm = of_file(urdf(tmp_path, [*joints, ("continuous", "0.3 0 0", "0 0 0", "0 1 0", "")]))
    q, step = np.array([0.3, -0.4, 0.8]), 1e-6
    for joint, column in enumerate(jacobian(arm, q).T):
        ahead, behind = (forward(arm, q + s * step * np.eye(3)[joint]) for s in (1, -1))
        np.testing.assert_allclose(column[:3], (ahead - behind)[:3, 3] / (2 * step), atol=1e-8)
        spin = (ahead - behind)[:3, :3] @ forward(arm, q)[:3, :3].T / (2 * step)
        np.testing.assert_allclose(column[3:], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)


def test_a_pendulum_on_a_carriage_as_in_the_textbook():
    """Carriage of mass M along x, a point mass m at l on a joint about y: Lagrange's equations."""
    motions = [("prismatic", np.array([1.0, 0, 0])), ("revolute", np.array([0.0, 1.0, 0.0]))]
    arm = chain(motions)
    carriage, mass, length = 3.0, 0.7, 0.4
    q, rate, rise = RNG.normal(size=(3, 6, 2))
    frames = link_frames(arm, q)

    def parameters(weight, frame, place):
        """The ten parameters of a point mass at a place of the base, in a link's frame."""
        x, y, z = frame[:3, :3].T @ (place - frame[:3, 3])
        inertia = [y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y]
        return weight * np.array([1.0, x, y, z, *inertia])

    for i in range(6):
        (s, t), (_, w), (a, b) = q[i], rate[i], rise[i]
        bob = np.array([s + length * np.sin(t), 0, length * np.cos(t)])
        both = np.r_[
            parameters(carriage, frames[i, 1], np.array([s, 0, 0])), parameters(mass, frames[i, 2], bob)
        ]
        found = torque_regressor(arm, q[i : i + 1], rate[i : i + 1], rise[i : i + 1])[0] @ both
        pull = (carriage + mass) * a + mass * length * (b * np.cos(t) - w**2 * np.sin(t))
        turn = mass * length**2 * b + mass * length * a * np.cos(t) - mass * GRAVITY * length * np.sin(t)
        np.testing.assert_allclose(found, [pull, turn], atol=1e-10)
    bodies = [
        Link(1, carriage, np.zeros(3)),
        Link(2, mass, np.linalg.inv(frames[0, 2])[:3, :3] @ (bob0(q[0], length) - frames[0, 2, :3, 3])),
    ]
    inertia = joint_mass(arm, q[:1], bodies)[0]
    coupled = mass * length * np.cos(q[0, 1])
    np.testing.assert_allclose(inertia, [[carriage + mass, coupled], [coupled, mass * length**2]], atol=1e-10)


def bob0(q, length):
    return np.array([q[0] + length * np.sin(q[1]), 0, length * np.cos(q[1])])


def test_an_arm_under_a_ceiling_weighs_the_other_way_round():
    arm = {"dh": UR10E}
    hung = geometry_of_cell({"arm": {**arm, "base": {"rpy_deg": [180, 0, 0], "xyz_mm": [0, 0, 2000]}}})
    q, still = RNG.uniform(-2, 2, (4, 6)), np.zeros((4, 6))
    upright = torque_regressor(geometry_of_cell({"arm": arm}), q, still, still)
    np.testing.assert_allclose(torque_regressor(hung, q, still, still), -upright, atol=1e-9)
    assert forward(hung, np.zeros(6))[2, 3] == pytest.approx(2.0 - 0.06085)


def test_a_seven_axis_arm_on_a_rail_has_the_torques_of_pinocchio(tmp_path):
    pin = pytest.importorskip("pinocchio", reason="pinocchio (pin) is not installed (development only)")
    rng = np.random.default_rng(9)
    joints = []
    for i in range(8):
        xyz, rpy, axis, centre = (" ".join(f"{v:.6f}" for v in rng.uniform(-1, 1, 3)) for _ in range(4))
        moments = " ".join(
            f"{k}='{v}'"
            for k, v in zip(
                ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), (0.3, 0.4, 0.5, 0.02, -0.03, 0.01), strict=True
            )
        )
        place = f"<origin xyz='{centre}' rpy='0.1 0.2 0.3'/><mass value='{i + 1}'/>"
        inertial = f"<inertial>{place}<inertia {moments}/></inertial>"
        unit = np.array(axis.split(), dtype=float)
        axis = " ".join(f"{v:.17g}" for v in unit / np.linalg.norm(unit))
        joints.append(("prismatic" if i == 0 else "revolute", xyz, rpy, axis, inertial))
    path = urdf(tmp_path, joints)
    model = pin.buildModelFromUrdf(str(path))
    model.gravity.linear = np.array([0, 0, -GRAVITY])
    data, arm = model.createData(), of_file(path)
    q, rate, rise = rng.normal(size=(3, 5, 8))
    regressor, frames = torque_regressor(arm, q, rate, rise), link_frames(arm, q)
    for i in range(5):
        expected = pin.rnea(model, data, q[i], rate[i], rise[i])
        pin.forwardKinematics(model, data, q[i])
        parameters = []
        for j in range(8):
            to_link = pin.SE3(frames[i, j + 1]).actInv(data.oMi[j + 1])
            m, cx, cy, cz, xx, xy, yy, xz, yz, zz = to_link.act(model.inertias[j + 1]).toDynamicParameters()
            parameters += [m, cx, cy, cz, xx, xy, xz, yy, yz, zz]
        np.testing.assert_allclose(regressor[i] @ parameters, expected, atol=1e-8)
        np.testing.assert_allclose(forward(arm, q[i])[:3, 3], data.oMi[8].translation, atol=1e-10)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<robot>", "is no XML"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><robot/>", "expected plain XML"),
        ("<robot xmlns:xacro='x'><xacro:arm/></robot>", "is a xacro file"),
        ("<robot/>", "found no joint"),
        (
            "<robot><joint name='a' type='ball'><parent link='x'/><child link='y'/></joint></robot>",
            '"a": found the type "ball"',
        ),
        ("<robot><joint name='a' type='revolute'><child link='y'/></joint></robot>", "has no <parent link"),
        (
            "<robot><joint name='a' type='revolute'><parent link='x'/><child link='y'/>"
            "<axis xyz='0 0'/></joint></robot>",
            'joint "a", axis xyz: found "0 0", expected three numbers',
        ),
        (
            "<robot><joint name='a' type='revolute'><parent link='x'/><child link='y'/></joint>"
            "<joint name='b' type='revolute'><parent link='x'/><child link='z'/></joint></robot>",
            "has 2 ends (y, z), expected arm.tip_link",
        ),
    ],
)
def test_what_is_wrong_with_a_urdf_file_is_said(tmp_path, text, said):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(FormatError) as error:
        read_urdf(path)
    assert said in error.value.message


def test_a_branch_is_chosen_by_its_links(tmp_path):
    path = urdf(tmp_path, [("revolute", "0 0 1", "0 0 0", "0 0 1", "")] * 3)
    assert [joint.name for joint in read_urdf(path, tip="l2")] == ["j0", "j1"]
    assert [joint.name for joint in read_urdf(path, base="l1")] == ["j1", "j2"]
    with pytest.raises(FormatError, match='has no link "l9"'):
        read_urdf(path, tip="l9")
