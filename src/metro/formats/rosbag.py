"""Robot logs in ROS 2 bags (a file .mcap or .db3): JointState for what was measured, and the set-points.

Angles are in rad and efforts in N m, by the messages' definitions; times are those of the headers.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from metro.formats.bag_limits import check_tables, limited_chunks, plain_types
from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.packets import Note, in_order
from metro.joint_columns import MOST_AXES
from metro.units import DEG, Array

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Reader
    from rosbags.typesys.store import Typestore

STARTS = (b"\x89MCAP", b"SQLite format 3\x00")

_STATE = "sensor_msgs/msg/JointState"
_CONTROLLER = "control_msgs/msg/JointTrajectoryControllerState"
_SET = re.compile(r"set|command|cmd|reference|desired|target", re.IGNORECASE)
_NS = 1e-9
_IDL_RULE = "=" * 80 + "\nIDL: "
_LEAST_JOINTS = 4  # of an arm: fewer are the numbered ones of a wrist, or the fingers of a gripper
_GAP = 1.5  # between set-points further apart than so many of their steps the command is not known


class _Series(NamedTuple):
    """Messages of one topic, in order: stamps (n,) ns, values (n, k), and where each is in the file."""

    ns: npt.NDArray[np.int64]
    values: Array
    place: Callable[[int], str]
    notes: list[Note]


def read_rosbag(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read measured angles and torques of a JointState topic, and set angles at the same times.

    Set-points come from a topic of JointTrajectoryControllerState (``reference``, before Humble ``desired``),
    or else of JointState by a name that contains set, command, reference, desired or target. They are
    interpolated linearly to the times of the measured states; states without set-points around them are left
    out.

    Raises
    ------
    FormatError
        Where the file is no whole bag, or the topics, the joints of one arm or efforts are not there.
    """
    from rosbags.rosbag2 import Reader

    try:
        if path.suffix == ".db3":
            check_tables(path)
        with limited_chunks(path), Reader(path) as bag:
            state, target = _topics(path, kind, bag.connections)
            store = _store(path, [*state, *target])
            measured = _series(path, (bag, store), state, _measured, rows)
            commanded = _series(path, (bag, store), target, _commanded, rows)
    except FormatError:
        raise
    except Exception as error:  # whatever a damaged bag makes its reader stumble over
        raise FormatError(path, f"is not a readable ROS 2 bag: {error or type(error).__name__}") from error
    joints, targets = measured.values.shape[1] // 2, commanded.values.shape[1]
    if joints != targets:
        fault = f"found {joints} measured joints and set-points of {targets}, expected those of one arm"
        raise FormatError(path, fault)
    return _joined(measured, commanded, kind, whole=rows is None)


def _store(path: Path, connections: Sequence[Connection]) -> Typestore:
    """Return the types of ROS 2 Humble, and of the file's own those that these lack."""
    from rosbags.interfaces import MessageDefinitionFormat
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    for each in connections:
        if each.msgtype in store.fielddefs:
            continue
        text, form = each.msgdef.data, each.msgdef.format
        if form == MessageDefinitionFormat.MSG:
            types = get_types_from_msg(text, each.msgtype)
        else:
            parts = [part.partition("\n")[2] for part in text.split(_IDL_RULE)[1:]] or [text]
            types = {name: fields for part in parts for name, fields in get_types_from_idl(part).items()}
        new = {name: fields for name, fields in types.items() if name not in store.fielddefs}
        store.register(plain_types(path, new))
    return store


def _topics(
    path: Path, kind: Kind, connections: Sequence[Connection]
) -> tuple[list[Connection], list[Connection]]:
    """Pick the connections of the measured states and of the set-points."""
    by_topic: dict[str, list[Connection]] = {}
    for each in connections:
        by_topic.setdefault(each.topic, []).append(each)
    states = [topic for topic, (first, *_) in by_topic.items() if first.msgtype == _STATE]
    measured = [topic for topic in states if not _SET.search(topic)]
    measured = [topic for topic in measured if topic.endswith("/joint_states")] or measured
    targets = [topic for topic, (first, *_) in by_topic.items() if first.msgtype == _CONTROLLER]
    targets = targets or [topic for topic in states if _SET.search(topic)]
    listed = ", ".join(f"{topic} ({first.msgtype})" for topic, (first, *_) in by_topic.items()) or "no topic"
    if len(measured) != 1:
        expected = (
            f"expected one topic /joint_states of type {_STATE} for the measured angles of {kind.title}"
        )
        raise FormatError(path, f"found {listed}, {expected}")
    if len(targets) != 1:
        named = (
            f"one topic of type {_CONTROLLER}, or one of type {_STATE} named setpoint, command, reference,"
        )
        raise FormatError(path, f"found {listed}, expected {named} desired or target, for q1_set_deg …")
    return by_topic[measured[0]], by_topic[targets[0]]


def _series(
    path: Path,
    source: tuple[Reader, Typestore],
    connections: Sequence[Connection],
    values_of: Callable[[Any, list[int]], list[float]],
    rows: int | None,
) -> _Series:
    """Read a topic's messages that name the most joints of one arm; others (a gripper's) are passed over."""
    topic, (bag, store) = connections[0].topic, source
    stamps: list[int] = []
    values: list[list[float]] = []
    seen: tuple[str, ...] = ()
    most = 0
    for connection, _, data in bag.messages(connections):
        message: Any = store.deserialize_cdr(data, connection.msgtype)
        seen = tuple(message.name if connection.msgtype == _STATE else message.joint_names)
        joints = _joints(seen)
        if len(joints) > most:
            most = len(joints)
            stamps.clear()
            values.clear()
        if joints and len(joints) == most:
            stamp = message.header.stamp
            stamps.append(stamp.sec * 1_000_000_000 + stamp.nanosec)
            try:
                values.append(values_of(message, joints))
            except IndexError:
                fault = "found positions or efforts that are empty, expected one per joint (rad, N m)"
                raise FormatError(path, f"message {len(stamps)} of {topic}: {fault}") from None
        if len(stamps) == rows:
            break
    if not stamps:
        fault = f"found the joints {', '.join(seen)}" if seen else "found no message"
        expected = f"expected the joints of one arm, {_LEAST_JOINTS} or more, whose names end in 1, 2, 3, …"
        raise FormatError(path, f"{topic}: {fault}, {expected}")

    def place(row: int) -> str:
        return f"message {row + 1} of {topic}"

    ns, table = np.array(stamps, np.int64), np.array(values)
    take, notes = in_order(path, "header.stamp [ns]", (ns, _NS), table, place)
    return _Series(ns[take], table[take], lambda row: place(int(take[row])), notes)


@cache
def _joints(names: tuple[str, ...]) -> list[int]:
    """Give the places of joints 1, 2, …: those of the one stem of which most names end so; else none."""
    stems: dict[str, dict[int, int]] = {}
    for index, name in enumerate(names):
        match = re.fullmatch(rf"(.*?)0*([1-{MOST_AXES}])", name)
        if match:
            stems.setdefault(match[1], {})[int(match[2])] = index
    arms = [[places[i] for i in sorted(places)] for places in stems.values() if max(places) == len(places)]
    arms = [places for places in arms if len(places) >= _LEAST_JOINTS]
    most = max(map(len, arms), default=0)
    largest = [places for places in arms if len(places) == most]
    return largest[0] if len(largest) == 1 else []


def _measured(message: Any, joints: Iterable[int]) -> list[float]:
    order = list(joints)
    return [message.position[i] / DEG for i in order] + [message.effort[i] for i in order]


def _commanded(message: Any, joints: Iterable[int]) -> list[float]:
    if hasattr(message, "joint_names"):
        point = message.reference if hasattr(message, "reference") else message.desired
        return [point.positions[i] / DEG for i in joints]
    return [message.position[i] / DEG for i in joints]


def _joined(measured: _Series, commanded: _Series, kind: Kind, *, whole: bool) -> Raw:
    """Put set-points beside the measured states; the head of a file (not ``whole``) need not hold both."""
    keep = np.flatnonzero(_covered(measured.ns, commanded.ns)) if whole else np.arange(len(measured.ns))
    ns = measured.ns[keep]
    # nanoseconds since 1970 do not fit a float: times are interpolated from the first one on
    at, known = (ns - commanded.ns[0]) * _NS, (commanded.ns - commanded.ns[0]) * _NS
    columns: dict[str, Array] = {"t_s": np.asarray(ns * _NS, dtype=np.float64)}
    joints = range(1, 1 + commanded.values.shape[1])
    for i, angles in zip(joints, commanded.values.T, strict=True):
        columns[f"q{i}_set_deg"] = np.interp(at, known, angles)
    names = [*(f"q{i}_deg" for i in joints), *(f"tau{i}_nm" for i in joints)]
    columns |= dict(zip(names, measured.values[keep].T, strict=True))
    frame = pd.DataFrame({name: columns[name] for name in kind.columns if name in columns})
    frame.attrs["notes"] = [*measured.notes, *commanded.notes, *_left_out(len(measured.ns) - len(keep))]
    return Raw(frame, lambda row: measured.place(int(keep[row])))


def _covered(ns: npt.NDArray[np.int64], known: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """Return which times lie on a set-point, or between two that follow each other at their usual step."""
    after = np.searchsorted(known, ns)
    exact = known[np.minimum(after, len(known) - 1)] == ns
    if len(known) == 1:
        return np.asarray(exact)
    steps = np.diff(known)
    between = (after > 0) & (after < len(known))
    usual = steps[np.clip(after - 1, 0, len(steps) - 1)] <= _GAP * np.median(steps)
    return np.asarray(exact | (between & usual))


def _left_out(count: int) -> list[Note]:
    if not count:
        return []
    message = f"{count} joint states have no set-points around them and were left out"
    return [Note("set-points", float(count), 0.0, False, message)]
