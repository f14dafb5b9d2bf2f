"""ROS 2 bags with joint states and set-points, written here by the writer of rosbags."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from metro.formats import FormatError
from metro.formats.registry import read, sniff
from metro.signals.quality import sampling

AXES = np.arange(1, 7)
PERIOD, START = 4_000_000, 1_760_000_000_123_456_789
NAMES = tuple(f"joint_a{i}" for i in AXES)
EMPTY = np.array([])
STATE = "sensor_msgs/msg/JointState"
CONTROLLER = "control_msgs/msg/JointTrajectoryControllerState"
DEFINITION = """
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint {field}
"""


def types(field="reference"):
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(DEFINITION.format(field=field), CONTROLLER))
    return store


TYPES = types()


def header(ns, store=TYPES):
    stamp = store.types["builtin_interfaces/msg/Time"](ns // 10**9, ns % 10**9)
    return store.types["std_msgs/msg/Header"](stamp, "")


def angles(k):
    return 0.1 * AXES + 1e-4 * k


def state(k, position=None, effort=None, names=NAMES):
    position = angles(k) if position is None else position
    effort = -100.0 * AXES - k if effort is None else effort
    return STATE, TYPES.types[STATE](header(START + PERIOD * k), list(names), position, EMPTY, effort)


def set_state(k):
    return state(k, angles(k) + 0.01, EMPTY)


def controller(k, field="reference", store=TYPES):
    point = store.types["trajectory_msgs/msg/JointTrajectoryPoint"](
        angles(k) + 0.01, EMPTY, EMPTY, EMPTY, store.types["builtin_interfaces/msg/Duration"](0, 0)
    )
    return CONTROLLER, store.types[CONTROLLER](header(START + PERIOD * k, store), list(NAMES), point)


def bag(tmp_path, topics, plugin=StoragePlugin.MCAP, store=TYPES):
    """Write topics (name → messages in order of arrival) and return the bag's one data file."""
    folder = tmp_path / f"bag{len(list(tmp_path.iterdir()))}"
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        for topic, messages in topics.items():
            connection = writer.add_connection(topic, messages[0][0], typestore=store)
            for arrival, (kind, message) in enumerate(messages):
                writer.write(connection, START + PERIOD * arrival, store.serialize_cdr(message, kind))
    return next(file for file in folder.iterdir() if file.suffix != ".yaml")


def simple(tmp_path, order, plugin=StoragePlugin.MCAP):
    measured = [state(k) for k in order]
    setpoints = [set_state(k) for k in range(40)]
    return bag(tmp_path, {"/joint_states": measured, "/joint_setpoints": setpoints}, plugin)


def failure(path):
    with pytest.raises(FormatError) as caught:
        read(path, "robot")
    assert caught.value.path == path
    return caught.value.message


def check(table, cycle):
    seconds = table["t_s"].to_numpy() - START * 1e-9
    np.testing.assert_allclose(seconds, 0.004 * cycle, atol=1e-6)
    for i in AXES:
        expected = np.degrees(0.1 * i + 1e-4 * cycle)
        np.testing.assert_allclose(table[f"q{i}_deg"], expected, rtol=1e-12)
        np.testing.assert_allclose(table[f"q{i}_set_deg"], expected + np.degrees(0.01), rtol=1e-9)
        np.testing.assert_array_equal(table[f"tau{i}_nm"], -100.0 * i - cycle)


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_joint_states_and_set_points_become_a_robot_log_in_degrees(tmp_path, plugin):
    path = simple(tmp_path, range(40), plugin)
    assert path.suffix == {StoragePlugin.MCAP: ".mcap", StoragePlugin.SQLITE3: ".db3"}[plugin]
    sniff(path, "robot")
    table = read(path, "robot")
    check(table, np.arange(40))
    assert table.attrs["notes"] == []


@pytest.mark.parametrize("field", ["reference", "desired"])
def test_set_points_of_the_trajectory_controller_go_first(tmp_path, field):
    store = types(field)
    wrong = [state(k, angles(k) + 1, EMPTY) for k in range(20)]
    topics = {
        "/joint_states": [state(k) for k in range(20)],
        "/arm_controller/controller_state": [controller(k, field, store) for k in range(20)],
        "/joint_commands": wrong,
    }
    check(read(bag(tmp_path, topics, store=store), "robot"), np.arange(20))


def test_joints_are_told_by_name_whatever_their_order_and_whatever_else_is_published(tmp_path):
    turned = slice(None, None, -1)
    names = ["joint_e1", *NAMES[turned], "gripper"]
    measured = [
        state(k, np.r_[9.0, angles(k)[turned], 9.0], np.r_[9.0, (-100.0 * AXES - k)[turned], 9.0], names)
        for k in range(20)
    ]
    measured.insert(7, state(3, np.array([1.0]), np.array([1.0]), ["gripper"]))
    topics = {"/joint_states": measured, "/set": [set_state(k) for k in range(20)]}
    check(read(bag(tmp_path, topics), "robot"), np.arange(20))


@pytest.mark.parametrize("joints", [4, 7])
def test_an_arm_has_as_many_joints_as_the_names_count(tmp_path, joints):
    own, fingers = np.arange(1, joints + 1), ["finger_joint1", "finger_joint2"]
    names = [*fingers, *(f"arm_joint_{i}" for i in own)]
    measured = [state(k, np.r_[0.0, 0.0, 0.1 * own + k], np.r_[0.0, 0.0, -own], names) for k in range(20)]
    commanded = [state(k, 0.1 * own + k, EMPTY, names[2:]) for k in range(20)]
    table = read(bag(tmp_path, {"/joint_states": measured, "/set": commanded}), "robot")
    assert len(table.columns) == 1 + 3 * joints
    np.testing.assert_allclose(table[f"q{joints}_deg"], np.degrees(0.1 * joints + np.arange(20)), rtol=1e-12)
    np.testing.assert_array_equal(table[f"tau{joints}_nm"], -float(joints))
    apart = {"/joint_states": measured, "/set": [set_state(k) for k in range(20)]}
    assert f"found {joints} measured joints and set-points of 6" in failure(bag(tmp_path, apart))


def test_set_points_of_another_rate_are_interpolated(tmp_path):
    topics = {
        "/joint_states": [state(k) for k in range(37)],
        "/set": [set_state(k) for k in range(0, 40, 3)],
    }
    check(read(bag(tmp_path, topics), "robot"), np.arange(37))


def test_states_without_set_points_around_them_are_left_out_and_noted(tmp_path):
    commanded = [k for k in range(5, 36) if k not in (20, 21, 22)]
    topics = {"/joint_states": [state(k) for k in range(40)], "/set": [set_state(k) for k in commanded]}
    table = read(bag(tmp_path, topics), "robot")
    check(table, np.array(commanded))
    note = {note.check: note for note in table.attrs["notes"]}["set-points"]
    assert (note.value, note.ok) == (12, False)


def test_dropped_late_and_repeated_messages(tmp_path):
    order = [k for k in range(40) if k not in (10, 11)]
    order[20], order[21] = order[21], order[20]
    table = read(simple(tmp_path, [*order, 38]), "robot")
    check(table, np.array([k for k in range(40) if k not in (10, 11)]))
    found = {note.check: note.value for note in table.attrs["notes"]}
    assert found == {"late packets": 1, "repeated packets": 1}
    gaps = next(finding for finding in sampling(table["t_s"].to_numpy(), 250.0) if finding.check == "gaps")
    assert gaps.message.startswith("1 gap, the longest 12 ms, 2 samples missing")


def test_a_bag_without_set_points_says_which_topics_it_has_and_which_were_looked_for(tmp_path):
    message = failure(bag(tmp_path, {"/joint_states": [state(k) for k in range(20)]}))
    assert f"found /joint_states ({STATE}), expected one topic of type {CONTROLLER}" in message
    assert "setpoint, command, reference, desired or target, for q1_set_deg" in message


def test_two_topics_of_measured_states_are_not_guessed_between(tmp_path):
    states = [state(k) for k in range(20)]
    message = failure(bag(tmp_path, {"/left": states, "/right": states, "/set": [set_state(0)]}))
    assert "found /left" in message
    assert "expected one topic /joint_states" in message


@pytest.mark.parametrize(
    ("measured", "parts"),
    [
        (
            lambda k: state(k, effort=EMPTY),
            ["message 1 of /joint_states", "empty", "one per joint (rad, N m)"],
        ),
        (
            lambda k: state(k, names=("shoulder_pan", "shoulder_lift", "elbow", "w1", "w2", "w3")),
            ["found the joints shoulder_pan", "names end in 1, 2, 3"],
        ),
        (
            lambda k: state(k, angles(k) * (np.inf if k == 9 else 1)),
            ["message 10 of /joint_states, column q1_deg", "found inf"],
        ),
        (
            lambda k: state(0 if k == 19 else 1000 * k),
            ["message 20 of /joint_states", "found header.stamp [ns]", "two starts"],
        ),
        (lambda k: state(0, angles(k)), ["a second time with other values"]),
    ],
)
def test_what_is_wrong_with_the_states_is_said_with_its_place(tmp_path, measured, parts):
    topics = {"/joint_states": [measured(k) for k in range(20)], "/set": [set_state(k) for k in range(20)]}
    message = failure(bag(tmp_path, topics))
    assert [part for part in parts if part not in message] == []


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_bag_that_was_cut_short_is_said_to_be_unreadable(tmp_path, plugin):
    path = simple(tmp_path, range(40), plugin)
    whole = path.read_bytes()
    for share in (0.1, 0.4, 0.7, 0.95):
        path.write_bytes(whole[: int(share * len(whole))])
        assert "is not a readable ROS 2 bag" in failure(path)


def test_what_is_named_a_bag_and_is_none_is_refused(tmp_path):
    path = Path(tmp_path / "log.mcap")
    path.write_text("t_s,q1_deg\n")
    assert "does not start as a ROS 2 bag" in failure(path)
